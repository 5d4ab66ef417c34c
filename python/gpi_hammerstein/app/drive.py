"""Another record, driven through the model: its error, its residual, and its pictures."""

from pathlib import Path
from typing import Any

import numpy as np

from gpi_hammerstein import files
from gpi_hammerstein._native import Model, residual_tests
from gpi_hammerstein.app.choices import Choices
from gpi_hammerstein.app.signals import Array, Channel, Signals
from gpi_hammerstein.app.uploads import Uploads
from gpi_hammerstein.compared import compare
from gpi_hammerstein.driven import require_match, simulated_runs, table_of
from gpi_hammerstein.explanation import failed_in_words
from gpi_hammerstein.io import Recording
from gpi_hammerstein.io.for_model import read_for_model
from gpi_hammerstein.json_values import plain

SIMULATED = "simulated.csv"


def drive(model: Model, uploads: Uploads, choices: Choices, out: Path) -> tuple[dict[str, Any], Signals]:
    """Simulate a model with the input of another record, and compare it with the output if there is one.

    Parameters
    ----------
    model
        The model.
    uploads
        The files that are kept.
    choices
        Which of them, and how they are read. Columns with the names of the model's channels are found.
    out
        The folder that receives simulated.csv.

    Returns
    -------
    dict
        ``error`` (as `Model.error`), ``fit_percent`` of each output, ``rule``, ``sentences`` on the residual
        and ``notes``; without an output, ``error`` is None.
    Signals
        The input, the measured and the simulated output, and the residual.

    Raises
    ------
    ParameterError, DataError
        The record cannot be read, or does not match the model.

    Examples
    --------
    >>> drive(model, uploads, Choices(files=["0f3a"]), folder)[0]["error"]["rms"]  # doctest: +SKIP
    0.0123
    """
    paths = [upload.path for upload in uploads.find(choices.files)]
    recording = read_for_model(model, paths, **choices.reading())
    require_match(model, recording)
    units = set(model.output_units)
    found: dict[str, Any] = {
        "samples": sum(len(run.u) for run in recording.runs),
        "experiments": len(recording.runs),
        "notes": [uploads.shown(note) for note in recording.notes],
        "unit": units.pop() if len(units) == 1 else "",
        "error": None,
        "fit_percent": {},
        "rule": "from the steady state at the first input",
        "sentences": [],
    }
    if recording.outputs:
        record = recording.record()
        comparison = compare(model, record)
        model, simulated = comparison.model, comparison.simulated
        residual = residual_tests(model, record, fit_start=True)
        found |= {
            "error": plain(comparison.error),
            "fit_percent": plain(comparison.fit_percent),
            "rule": comparison.rule,
            "sentences": [*failed_in_words(residual["tests"]), verdict(residual["structured"])],
        }
    else:
        simulated = simulated_runs(model, recording)
    with files.staged(out) as folder:
        table_of(model, recording, simulated).write_csv(folder / SIMULATED, float_precision=None)
    return found, signals(model, recording, simulated)


def verdict(structured: bool) -> str:
    """Return whether the residual has structure, in words."""
    has = "has structure" if structured else "has no structure beyond noise"
    return f"The residual {has}."


def signals(model: Model, recording: Recording, simulated: list[Array]) -> Signals:
    """Return what is drawn: inputs, measured and simulated outputs, and their difference."""
    inputs = [Channel(column.name, column.unit, "input") for column in recording.inputs]
    own = list(zip(model.output_names, model.output_units, strict=True))
    channels = [*inputs, *(Channel(name, unit, "simulated") for name, unit in own)]
    if recording.outputs:
        channels += [Channel(name, unit, kind) for kind in ("output", "residual") for name, unit in own]
    values = []
    for run, own_simulated in zip(recording.runs, simulated, strict=True):
        y = own_simulated.reshape(len(run.u), -1)
        columns = [run.u, y]
        if recording.outputs:
            columns += [run.y, run.y - y]
        values.append(np.hstack(columns))
    return Signals(channels, values, recording.rate)
