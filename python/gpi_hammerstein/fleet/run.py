"""A batch: many records, one table."""

import os
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import polars as pl

from gpi_hammerstein import files
from gpi_hammerstein._native import DataError, ParameterError
from gpi_hammerstein.fleet import engine, jobs, row
from gpi_hammerstein.fleet.work import Task, done

TABLE = "fleet.parquet"
RECORDS = "records"
# Seconds between two writes of the table while records are in work.
PERIOD = 30.0


def batch(
    records: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] = (),
    *,
    out: str | os.PathLike[str],
    manifest: str | os.PathLike[str] | None = None,
    executor: Executor | Any | None = None,
    workers: int | None = None,
    threads: int = 1,
    memory: float | None = None,
    report: bool = False,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> pl.DataFrame:
    """Explain many records, and return one row for each of them.

    The results are in `out`: ``fleet.parquet`` with the returned table, and ``records/NAME/`` with
    model.json and explanation.json of each record. A batch that was stopped continues where it was: a result
    whose data, options and version are the same is not computed again. A record that cannot be read or
    explained gets a row with the error, and does not end the batch.

    Every option of `read_record` and `explain` can be given by its name, for all records: ``input``,
    ``rate``, ``effects``, ``order``, and so on.

    Parameters
    ----------
    records
        Files; folders, whose record files are found at any depth; patterns such as ``"runs/*.csv"``.
    out
        The folder of the results.
    manifest
        Instead of `records`, a CSV or Parquet table with the columns ``file``, ``device``, ``date`` and
        options of `read_record` and `explain`.
    executor
        An executor with the interface of `concurrent.futures`, or a ``dask.distributed.Client``. All its
        workers must see the same files. If None, processes on this machine.
    workers
        Number of processes; None for one for each processor. An `executor` has its own workers.
    threads
        Threads of each process, without an `executor`.
    memory
        Memory that each process may take, in GiB, without an `executor`.
    report
        Whether each record gets a report.html.
    progress
        Called with the number of records that are done and the number of all.

    Returns
    -------
    polars.DataFrame
        One row for each record, in their order: the columns of `gpi-fleet/1`.

    Raises
    ------
    ParameterError
        There is no record, an option is unknown, or `out` cannot be written.
    DataError
        The manifest cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from pathlib import Path
    >>> import polars as pl
    >>> folder = Path(tempfile.mkdtemp())
    >>> k = np.arange(1500)
    >>> u = np.sin(0.02 * k) + np.sin(0.031 * k)
    >>> y = 2.0 * u + 0.01 * np.random.default_rng(1).normal(size=1500)
    >>> columns = pl.DataFrame({"t": k / 1000, "u": u, "y": y})
    >>> columns.write_csv(folder / "A-0017.csv")
    >>> with ThreadPoolExecutor(1) as executor:
    ...     table = gpi.batch(folder, out=folder / "fleet", executor=executor, half_widths=1, effects=[])
    >>> table.select("name", "verdict", "effects").rows()
    [('A-0017', 'explained', [])]
    """
    found = _jobs(records, manifest, Path(out), options)
    if workers is not None and workers < 1:
        raise ParameterError(f"`workers` = {workers}: must be at least one process")
    target = files.require_folder(out)
    folder = Path(target) / RECORDS
    folder.mkdir(parents=True, exist_ok=True)
    rows, tasks = _planned(found, folder, report)
    if executor is not None:
        worked = engine.with_executor(tasks, _executor(executor))
    else:
        worked = engine.in_processes(tasks, engine.Processes(workers or os.cpu_count() or 1, threads, memory))
    known_before, tell = len(found) - len(tasks), _told(progress, len(found))
    written = time.monotonic()
    with closing(worked):
        try:
            tell(known_before)
            for ready, (_, known) in enumerate(worked, known_before + 1):
                rows.results[known["key"]] = known
                tell(ready)
                if time.monotonic() - written > PERIOD:
                    _write(target, rows.table())
                    written = time.monotonic()
        finally:
            _write(target, rows.table())
    return rows.table()


class _Rows:
    """The rows of all jobs, in their order; those of unfinished jobs are missing."""

    def __init__(self, found: list[jobs.Job]) -> None:
        self.jobs = found
        self.keys: list[str | None] = []
        self.failed: dict[int, dict[str, Any]] = {}
        self.results: dict[str | None, dict[str, Any]] = {}

    def table(self) -> pl.DataFrame:
        """Return the table. A result that two files share belongs to both."""
        rows = []
        for place, (job, key) in enumerate(zip(self.jobs, self.keys, strict=True)):
            known = self.failed.get(place) or self.results.get(key)
            if known is not None:
                rows.append(known | {"file": str(job.file), "device": job.device, "date": job.date})
        return row.table(rows)


def _jobs(
    records: Any, manifest: str | os.PathLike[str] | None, out: Path, options: Mapping[str, Any]
) -> list[jobs.Job]:
    for name in options:
        if name not in (*jobs.READ, *jobs.EXPLAIN):
            known = ", ".join((*jobs.READ, *jobs.EXPLAIN))
            raise ParameterError(
                f"`{name}`: no option of read_record or explain in a batch; possible: {known}"
            )
    read, choices = (
        {name: value for name, value in options.items() if name in known}
        for known in (jobs.READ, jobs.EXPLAIN)
    )
    one = [records] if isinstance(records, str | os.PathLike) else list(records)
    if (manifest is None) == (not one):
        raise ParameterError("`records`: give record files or a manifest, and not both")
    if manifest is not None:
        found = jobs.from_manifest(Path(manifest), read, choices)
    else:
        found = jobs.find([Path(record) for record in one], read, choices, out)
    if not found:
        raise ParameterError(f"`manifest` = {manifest}: contains no record")
    return found


def _planned(found: list[jobs.Job], folder: Path, report: bool) -> tuple[_Rows, list[Task]]:
    """Return the rows that are known, and what is left to do: every result once."""
    known = done(folder)
    taken = {one["name"] for one in known.values()}
    rows = _Rows(found)
    tasks: dict[str, Task] = {}
    for place, (job, name) in enumerate(zip(found, jobs.names(found), strict=True)):
        try:
            key = job.key()
        except DataError as error:
            rows.keys.append(None)
            rows.failed[place] = row.of_failure(job, name, None, str(error), 0.0)
            continue
        rows.keys.append(key)
        if key in known:
            rows.results[key] = known[key]
        elif key not in tasks:
            # another record, or other options, have used the name before
            free = name if name not in taken else f"{name}-{key[:8]}"
            # a worker may have another current folder
            absolute = replace(job, file=job.file.absolute())
            tasks[key] = Task(absolute, key, folder.absolute() / free, report)
    return rows, list(tasks.values())


def _executor(given: Any) -> Executor:
    """Return the executor of a Dask client; other executors are what they are."""
    if isinstance(given, Executor):
        return given
    if hasattr(given, "get_executor"):
        made: Executor = given.get_executor(pure=False, retries=engine.ATTEMPTS)
        return made
    raise ParameterError(
        f"`executor` = {given!r}: must be an executor of concurrent.futures or a dask.distributed.Client"
    )


def _told(progress: Callable[[int, int], None] | None, every: int) -> Callable[[int], None]:
    """Return a function that tells how many records are done."""
    return lambda ready: None if progress is None else progress(ready, every)


def _write(target: str | os.PathLike[str], table: pl.DataFrame) -> None:
    content = BytesIO()
    table.write_parquet(content, metadata={"schema": row.VERSION})
    files.write_atomically(Path(target) / TABLE, content.getvalue())
