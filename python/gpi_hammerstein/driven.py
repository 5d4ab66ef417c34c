"""A model that is driven by a record: whether they match, and the simulated outputs as a table."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError, Model, Record
from gpi_hammerstein.io import Recording
from gpi_hammerstein.io.recording import Run

__all__ = ["require_match", "simulated_runs", "simulated_table", "table_of"]


def require_match(model: Model, recording: Recording) -> None:
    """Reject a record that does not match the model."""
    for what, ours, theirs in (
        ("inputs", len(model.input_names), len(recording.inputs)),
        ("outputs", len(model.output_names), len(recording.outputs) or len(model.output_names)),
    ):
        if ours != theirs:
            raise DataError(
                f"the model has {ours} {what}, but the record has {theirs}; "
                "name the columns (--input, --output)"
            )
    if abs(model.rate - recording.rate) > 1e-3 * model.rate:
        raise DataError(
            f"the model is sampled at {model.rate:g} Hz, but the record at {recording.rate:g} Hz; "
            f"resample it (--resample {model.rate:g})"
        )
    units = [*zip(model.input_units, recording.inputs, strict=True)]
    if recording.outputs:
        units += zip(model.output_units, recording.outputs, strict=True)
    for unit, column in units:
        if unit and column.unit and unit != column.unit:
            raise DataError(
                f"column `{column.header}` is in {column.unit}, but the model was fitted in {unit}; "
                "convert it"
            )


def simulated_table(model: Model, recording: Recording, start: Record | None = None) -> pl.DataFrame:
    """Return the time and the simulated outputs of all experiments, with the recording's covariates.

    `start` is the record of the same experiments, if their initial states are to be fitted to its outputs.
    """
    if start is None:
        simulated = simulated_runs(model, recording)
    else:
        residuals = model.residual(start, fit_start=True)
        simulated = [measured - residual for measured, residual in zip(start.y, residuals, strict=True)]
    return table_of(model, recording, simulated)


def table_of(model: Model, recording: Recording, simulated: list[NDArray[np.float64]]) -> pl.DataFrame:
    """Return the time of all experiments and their outputs, which are already simulated."""
    several = len(model.output_names) > 1
    names = [f"y{index + 1}" for index in range(len(model.output_names))] if several else ["y"]
    frames = []
    for number, (run, own) in enumerate(zip(recording.runs, simulated, strict=True)):
        y = own.reshape(len(run.u), -1)
        t = run.start + np.arange(len(run.u)) / recording.rate
        columns = {"t": t, **{name: y[:, index] for index, name in enumerate(names)}}
        if len(recording.runs) > 1:
            columns = {"experiment": np.full(len(run.u), number), **columns}
        frames.append(pl.DataFrame(columns))
    return pl.concat(frames)


def simulated_runs(model: Model, recording: Recording) -> list[NDArray[np.float64]]:
    """Return the simulated outputs of all experiments, each from a steady state."""
    return [simulated_run(model, run) for run in recording.runs]


def simulated_run(model: Model, run: Run) -> NDArray[np.float64]:
    """Return the simulated outputs of one experiment, from a steady state."""
    covariates = run.covariates if run.covariates.shape[1] else None
    return model.simulate(run.u, covariates=covariates)
