"""The records of a batch: files, folders, patterns, or the rows of a manifest."""

import glob
import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import polars

from gpi_hammerstein._native import DataError, ParameterError, __version__
from gpi_hammerstein.io.formats import FORMATS

READ = ("input", "output", "time", "rate", "covariate", "resample", "warmup", "experiment")
EXPLAIN = ("effects", "require", "order", "half_widths", "thresholds", "delay", "reading", "hysteresis")
BLOCK = 1 << 20
# A .npy file needs the option `output`; without it, its row says so.
ENDINGS = (*FORMATS, ".npy")


@dataclass(frozen=True)
class Job:
    """One record and how it is read and explained.

    Attributes
    ----------
    file
        The record file.
    device, date
        What the manifest says of it; None if it says nothing.
    read, choices
        Options of `read_record` and of `explain`.
    """

    file: Path
    device: str | None = None
    date: str | None = None
    read: Mapping[str, Any] = field(default_factory=dict)
    choices: Mapping[str, Any] = field(default_factory=dict)

    def key(self) -> str:
        """Return the address of the result: a hash of the data, of the options and of the version.

        Returns
        -------
        str
            64 hexadecimal digits.

        Raises
        ------
        DataError
            The file cannot be read.
        """
        content = hashlib.sha256()
        if self.file.exists() and not self.file.is_file():
            raise DataError(f"{self.file}: is not a regular file")  # a pipe or a device may never end
        try:
            with self.file.open("rb") as source:
                while block := source.read(BLOCK):
                    content.update(block)
        except OSError as error:
            raise DataError(f"{self.file}: {error.strerror}") from error
        options = {"read": dict(self.read), "explain": dict(self.choices), "version": __version__}
        content.update(json.dumps(options, sort_keys=True, default=str).encode())
        return content.hexdigest()


def find(
    records: Iterable[str | Path], read: Mapping[str, Any], choices: Mapping[str, Any], out: Path
) -> list[Job]:
    """Return one job for each record file.

    Parameters
    ----------
    records
        Files; folders, whose record files are found at any depth; patterns such as ``runs/*.csv``.
    read, choices
        Options of `read_record` and of `explain` for all of them.
    out
        The folder of the results: what is in it is no record.

    Returns
    -------
    list of Job
        Each file once, in the order of the arguments; those of a folder or a pattern are sorted.

    Raises
    ------
    ParameterError
        A folder or a pattern contains no record.
    """
    files = dict.fromkeys(file for record in records for file in _files(Path(record), out))
    return [Job(file, read=read, choices=choices) for file in files]


def _files(record: Path, out: Path) -> Iterator[Path]:
    results = out.resolve()
    if record.is_dir():
        found = sorted(file for file in record.rglob("*") if _is_record(file, results))
    elif record.exists() or not glob.has_magic(str(record)):
        # a file that does not exist becomes a row with its error
        found = [record]
    else:
        paths = map(Path, glob.glob(str(record), recursive=True))
        found = sorted(path for path in paths if _is_record(path, results))
    if not found:
        raise ParameterError(
            f"`records` = {record}: no record file is there; known endings: {', '.join(ENDINGS)}"
        )
    yield from found


def _is_record(file: Path, results: Path) -> bool:
    if not file.name.lower().endswith(ENDINGS) or not file.is_file():
        return False
    return results not in file.resolve().parents


def from_manifest(manifest: str | Path, read: Mapping[str, Any], choices: Mapping[str, Any]) -> list[Job]:
    """Return one job for each row of a table.

    Parameters
    ----------
    manifest
        A CSV or Parquet file. The column ``file`` is required; a relative path starts at the manifest's
        folder. The columns ``device`` and ``date`` are kept, and every other column is an option of
        `read_record` or of `explain`. An empty cell takes the option of the whole batch.
    read, choices
        Options for all rows.

    Returns
    -------
    list of Job
        In the order of the rows.

    Raises
    ------
    DataError
        The manifest cannot be read, or lacks the column ``file``.
    ParameterError
        A column is no option.
    """
    path = Path(manifest)
    try:
        if path.suffix.lower() == ".parquet":
            table = polars.read_parquet(path)
        else:
            table = polars.read_csv(path, infer_schema=False)
    except (OSError, polars.exceptions.PolarsError) as error:
        raise DataError(f"{path}: cannot be read as a manifest: {error}") from error
    if "file" not in table.columns:
        raise DataError(f"{path}: the manifest has no column `file`; its columns: {', '.join(table.columns)}")
    known = {"file", "device", "date", *READ, *EXPLAIN}
    for name in table.columns:
        if name not in known:
            raise ParameterError(
                f"`manifest` = {path}: column `{name}` is no option; possible columns: "
                + ", ".join(sorted(known))
            )
    return [_job(path, number, row, read, choices) for number, row in enumerate(table.iter_rows(named=True))]


def _job(
    path: Path, number: int, row: Mapping[str, Any], read: Mapping[str, Any], choices: Mapping[str, Any]
) -> Job:
    given = {name: _value(path, number, name, cell) for name, cell in row.items() if cell not in (None, "")}
    if "file" not in given:
        raise DataError(f"{path}: row {number}, column `file` is empty")
    return Job(
        path.parent / given["file"],
        given.get("device"),
        given.get("date"),
        {**read, **{name: given[name] for name in READ if name in given}},
        {**choices, **{name: given[name] for name in EXPLAIN if name in given}},
    )


def _value(path: Path, number: int, name: str, cell: Any) -> Any:
    """Return a cell as the option's type: the texts of the command line."""
    if name in ("order", "delay", "warmup"):
        return _number(path, number, name, cell, int)
    if name == "rate":
        return _number(path, number, name, cell, float)
    text = str(cell)
    if name in ("input", "output", "covariate", "effects", "require"):
        return [part.strip() for part in text.split(",") if part.strip() not in ("", "none")]
    if name in ("half_widths", "thresholds"):
        parts = [_number(path, number, name, part, float) for part in text.split(",")]
        return int(text) if text.strip().isdigit() else parts
    return text


def _number(path: Path, number: int, name: str, cell: Any, kind: type) -> Any:
    try:
        return kind(cell)
    except ValueError:
        raise DataError(f"{path}: row {number}, column `{name}`: `{cell}` is no number") from None


def names(jobs: Sequence[Job]) -> list[str]:
    """Return one folder name for each job: its file's name, if necessary with the names of its folders.

    Parameters
    ----------
    jobs
        The jobs of a batch.

    Returns
    -------
    list of str
        Different names without separators.

    Examples
    --------
    >>> names([Job(Path("a/run.csv")), Job(Path("b/run.csv")), Job(Path("b/other.csv"))])
    ['a-run', 'b-run', 'other']
    """
    paths = [job.file.with_name(stem(job.file)).parts for job in jobs]
    found = [path[-1] for path in paths]
    for depth in range(2, max(map(len, paths), default=1) + 1):
        shared = {name for name, count in Counter(found).items() if count > 1}
        if not shared:
            break
        found = [
            "-".join(part.strip("/\\:") for part in path[-depth:]) if name in shared else name
            for name, path in zip(found, paths, strict=True)
        ]
    seen: dict[str, int] = {}
    for place, name in enumerate(found):
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            found[place] = f"{name}-{seen[name]}"
    return found


def stem(file: Path) -> str:
    """Return the name of a record file without its ending.

    Parameters
    ----------
    file
        A path.

    Returns
    -------
    str
        The name.

    Examples
    --------
    >>> stem(Path("runs/device.7.csv.gz"))
    'device.7'
    """
    packed = file.with_suffix("") if file.suffix.lower() == ".gz" else file
    return packed.stem
