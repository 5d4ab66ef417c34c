"""One record of a batch, in a worker process: read, explain, write."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from gpi_hammerstein import files
from gpi_hammerstein._native import GpiError, explain
from gpi_hammerstein.explanation import to_dict
from gpi_hammerstein.fleet import row
from gpi_hammerstein.fleet.jobs import Job
from gpi_hammerstein.io.read import read_recording
from gpi_hammerstein.json_values import write_json

ROW = "row.parquet"


@dataclass(frozen=True)
class Task:
    """A job, its address, and the folder that receives its results."""

    job: Job
    key: str
    folder: Path
    report: bool = False


def work(task: Task) -> dict[str, Any]:
    """Explain one record and write its results.

    The folder gets model.json, explanation.json, on request report.html, and row.parquet, all in one step: a
    result exists whole or not at all, and is never computed twice.

    Parameters
    ----------
    task
        The record and where its results belong.

    Returns
    -------
    dict
        The row. A record that cannot be read or explained has a row with its error. A cluster may repeat a
        task whose worker was lost after its end: the row is then that of the first time.
    """
    started = time.monotonic()
    try:
        return _complete(task.folder / ROW, task.key) or _work(task, started)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001  panics of libraries are no Exception, and cannot be pickled
        text = f"{type(error).__name__}: {error}"
        return row.of_failure(task.job, task.folder.name, task.key, text, time.monotonic() - started)


def _work(task: Task, started: float) -> dict[str, Any]:
    job, name = task.job, task.folder.name
    try:
        recording = read_recording(job.file, **job.read)
        found = explain(recording.record(), **job.choices)
    except GpiError as error:
        seconds = time.monotonic() - started
        failed = row.of_failure(job, name, task.key, str(error), seconds)
        if isinstance(error.__cause__, MemoryError):
            return failed  # the next run may have more
        with files.staged(task.folder) as folder:
            row.table([failed]).write_parquet(folder / ROW)
        return failed
    known = row.of_explanation(job, name, task.key, found, time.monotonic() - started)
    with files.staged(task.folder) as folder:
        files.save_model(found.model, folder / "model.json")
        result = to_dict(found)
        result["record"] |= {
            "files": [str(job.file)],
            "experiments": len(recording.runs),
            "notes": recording.notes,
        }
        write_json(result, folder / "explanation.json")
        if task.report:
            from gpi_hammerstein.report import report_html

            command = f"gpi explain {job.file}"
            page = report_html(found, command=command, notes=recording.notes, model_file="model.json")
            (folder / "report.html").write_text(page, encoding="utf-8")
        row.table([known]).write_parquet(folder / ROW)
    return known


def done(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the rows that an earlier run wrote, by their keys.

    Parameters
    ----------
    folder
        The folder with one folder for each record.

    Returns
    -------
    dict
        The row of each key. Folders without a complete row are left out.
    """
    rows = {}
    for path in sorted(folder.glob(f"*/{ROW}")):
        known = _complete(path)
        if known is not None:
            rows[str(known["key"])] = known
    return rows


def _complete(path: Path, key: str | None = None) -> dict[str, Any] | None:
    """Return the row in a file; None if there is none, or one of another version or another key."""
    try:
        table = pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError):
        return None
    if dict(table.schema) != row.COLUMNS or len(table) != 1:
        return None
    known = table.row(0, named=True)
    return known if key in (None, known["key"]) else None
