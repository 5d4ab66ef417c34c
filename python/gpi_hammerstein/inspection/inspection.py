"""The inspection of a record: all that can be said before a model is fitted."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from gpi_hammerstein._native import DataError, Record
from gpi_hammerstein.inspection.clock import facts_of_clock
from gpi_hammerstein.inspection.columns import facts_of_columns, resolution
from gpi_hammerstein.inspection.command import command, experiment
from gpi_hammerstein.inspection.excitation import excitation
from gpi_hammerstein.inspection.findings import findings, set_points, shown
from gpi_hammerstein.inspection.identifiable import Facts, answers
from gpi_hammerstein.inspection.remedy import Remedy, remedy
from gpi_hammerstein.inspection.result import Inspection
from gpi_hammerstein.io.columns import TIME_UNITS
from gpi_hammerstein.io.experiments import recording_of
from gpi_hammerstein.io.frames import Frame
from gpi_hammerstein.io.recording import Recording
from gpi_hammerstein.io.sources import Names, PathLike, Source, read_sources


def inspect(
    source: PathLike | Frame | Record | Sequence[PathLike | Frame],
    *,
    input: Names | None = None,
    output: Names | None = None,
    time: str | None = None,
    rate: float | None = None,
    covariate: Names | None = None,
    resample: bool | float | str | None = None,
) -> Inspection:
    """Inspect a record before a model is fitted.

    Parameters
    ----------
    source
        A record, or what :func:`read_record` reads: a file, several files, a data frame.
    input, output, time, rate, covariate, resample
        As in :func:`read_record` (rates in Hz); without effect for a record.

    Returns
    -------
    Inspection
        Columns with their units and roles, clock, excitation, saturation, quantisation, what can be
        identified, and the command to run next. If columns or the clock cannot be used as they are,
        ``problem`` says why, and ``next`` how to go on.

    Raises
    ------
    DataError
        The file cannot be read at all: it is missing, corrupt or of an unknown format.
    ParameterError
        An option is out of range.

    Examples
    --------
    >>> import gpi_hammerstein as gpi
    >>> u = gpi.multisine(4000, 1000.0, (1.0, 100.0), (0.0, 10.0))
    >>> found = gpi.inspect(gpi.Record(u, gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u), rate=1000.0))
    >>> found.identifiable[0]["what"], found.identifiable[0]["possible"]
    ('hysteresis', 'yes')
    """
    if isinstance(source, Record):
        return Inspection({"files": ["the record"], **_of_record(source, []), **_next([], {}, [])})
    sources = read_sources(source, output)
    files = [one.name for one in sources]
    options: dict[str, Any] = {
        "input": input,
        "time": time,
        "rate": rate,
        "covariate": covariate,
        "resample": resample,
    }
    found: Remedy | None = None
    recording: Recording | None = None
    try:
        recording = recording_of(sources, **options)
    except DataError as error:
        found = remedy(sources, options, str(error))
        recording = found.recording
    repeated = {"input": input, "output": output, **{k: v for k, v in options.items() if k != "input"}}
    if found is not None:
        repeated |= found.options
    table = sources[0].tables[0]
    parts: dict[str, Any] = {
        "problem": None if found is None else found.problem,
        "assumed": None if found is None or recording is None else found.assumed,
        "columns": facts_of_columns(table, recording),
        "clock": _clock(sources[0], recording),
    }
    if recording is None or not recording.outputs:
        if found is None:
            problem = "no column was recognised as the output; name it with --output"
            parts["problem"] = problem
            repeated["output"] = repeated["output"] or "COLUMN"
        notes = [] if recording is None else recording.notes
        return Inspection(
            {"files": files, "notes": notes, **parts, "next": _command("inspect", files, repeated, "mend")}
        )
    parts |= _of_record(recording.record(), recording.notes)
    return Inspection({"files": files, **parts, **_next(files, repeated, recording.notes)})


def _clock(source: Source, recording: Recording | None) -> dict[str, Any] | None:
    table = source.tables[0]
    column = None if recording is None else recording.time
    if column is None:  # the column that would be the time if the record could be read
        column = next((one for one in table.columns if one.unit in TIME_UNITS), None)
    if column is None or column not in table.columns:
        return None
    return facts_of_clock(table.columns[column] * TIME_UNITS.get(column.unit, 1.0))


def _command(name: str, files: list[str], options: dict[str, Any], why: str) -> dict[str, str]:
    return {"why": why, "command": command(name, files, options)}


def _next(files: list[str], options: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """Return what to do with a record that can be used."""
    if any("look swapped" in note for note in notes):
        return {"next": _command("inspect", files, options, "check which column is the input")}
    stem = Path(files[0]).name.split(".")[0] if files else "record"
    page = command("report", files or ["RECORD"], options, "-o", f"{stem}.html")
    return {"next": {"why": "identify the model, find what it lacks, and write a page", "command": page}}


def _of_record(record: Record, notes: list[str]) -> dict[str, Any]:
    """Return the properties of the signals of a record. Extreme numbers give infinite properties."""
    with np.errstate(all="ignore"):
        return _properties(record, notes)


def _properties(record: Record, notes: list[str]) -> dict[str, Any]:
    found = shown(record)
    lengths = [len(u) for u in record.u]
    excitations = [
        excitation([u[:, index] for u in record.u], record.rate) for index in range(len(record.input_names))
    ]
    facts = Facts(
        record.rate,
        max(lengths) / record.rate,
        len(lengths),
        excitations,
        found["excitation_order"],
        list(record.covariate_names),
        record.input_units[0],
    )
    answered = answers(facts)
    first = excitations[0]
    return {
        "record": {
            "samples": sum(lengths),
            "experiments": len(lengths),
            "rate_hz": record.rate,
            "duration_s": sum(lengths) / record.rate,
            "excitation_order": found["excitation_order"],
        },
        "inputs": [
            {"name": name, "unit": unit, **asdict(one), "fed_back": fed_back}
            for name, unit, one, fed_back in zip(
                record.input_names, record.input_units, excitations, found["fed_back"], strict=True
            )
        ],
        "outputs": [
            _output(record, index, found["clipped"][index]) for index in range(len(record.output_names))
        ],
        "notes": notes,
        "findings": [*findings(record, found), *set_points(record)],
        "identifiable": [{"what": a.what, "possible": a.possible, "why": a.why} for a in answered],
        "next_experiment": experiment(answered, first, record.rate, record.input_units[0]),
    }


def _output(record: Record, index: int, clipped: float) -> dict[str, Any]:
    """Return the properties of one output."""
    y = np.concatenate([run[:, index] for run in record.y])
    # white noise is multiplied by the root of 1 + 9 + 9 + 1 in third differences, and a smooth signal
    # vanishes
    third = np.concatenate([np.diff(run[:, index], 3) for run in record.y])
    noise = float(np.sqrt(np.mean(third**2) / 20.0)) if third.size else math.nan
    return {
        "name": record.output_names[index],
        "unit": record.output_units[index],
        "low": float(y.min()),
        "high": float(y.max()),
        "step": resolution(y),
        "clipped": clipped,
        "noise_at_most": noise if math.isfinite(noise) else None,
    }
