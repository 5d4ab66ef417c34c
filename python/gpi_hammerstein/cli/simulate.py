"""`gpi simulate`: simulate a model with the input of a record."""

from pathlib import Path
from typing import Annotated

import numpy as np
import polars as pl
import typer
from numpy.typing import NDArray

from gpi_hammerstein import files
from gpi_hammerstein._native import DataError, Model, ParameterError, Record
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    common_unit,
    console,
    describe_record,
    error_table,
    escape,
    print_json,
    say_written,
    working,
)
from gpi_hammerstein.held_out import rule_in_words
from gpi_hammerstein.io import Recording
from gpi_hammerstein.io.recording import Run

ModelFile = Annotated[
    Path, typer.Argument(metavar="MODEL", help="A model file (model.json).", show_default=False)
]
Skip = Annotated[
    float,
    typer.Option(help="Time at the start of every experiment that is not scored, in s.", metavar="SECONDS"),
]


def simulate(
    model_file: ModelFile,
    records: options.Records,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    warmup: options.Warmup = None,
    experiments: options.Experiments = None,
    skip: Skip = 0.0,
    fit_start: options.FitStart = False,
    remove_mean: options.RemoveMean = False,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Simulate a model from the input of a record, and compare the result with the output if there is one.

    All effects of the model are simulated. Without --fit-start, each experiment begins in the steady state at
    its first input, and the output has no influence on the simulation.

    Writes simulated.csv to DIR. Its columns are t and y, or t, y1, y2, ..; for several experiments, the first
    column is `experiment`.
    """
    model = options.load_model(model_file)
    recording = options.read(
        records,
        input=input,
        output=output,
        time=time,
        rate=rate,
        covariate=covariate,
        resample=resample,
        warmup=warmup,
        experiments=experiments,
        model=model,
    ).skip(skip)
    require_match(model, recording)
    record = recording.record() if recording.outputs else None
    if fit_start and record is None:
        raise ParameterError(
            "`fit-start`: the record has no output column for the fit; name one (--output) or omit it"
        )
    with working("simulating"):
        error = None if record is None else model.error(record, remove_mean=remove_mean, fit_start=fit_start)
        start = record if fit_start else None
        simulated = simulated_table(model, recording, start) if out is not None else None
    result = {
        "schema": "gpi-simulation/1",
        "model": str(model_file),
        "record": describe_record(recording, records),
        "mean_removed": remove_mean,
        "start_fitted": fit_start,
        "rule": rule_in_words(fit_start=fit_start, remove_mean=remove_mean),
        "skipped_s": skip,
        "error": error,
        "files": [],
    }
    if out is not None and simulated is not None:
        with files.staged(out) as folder:
            simulated.write_csv(folder / "simulated.csv", float_precision=None)
        result["files"] = ["simulated.csv"]
    if as_json:
        print_json(result)
        return
    screen = console()
    for note in recording.notes:
        screen.print(f"[yellow]note[/] {escape(note)}")
    if record is None:
        screen.print("The record has no output column, so that no error can be computed.")
    else:
        title = f"Simulation error ({rule_in_words(fit_start=fit_start, remove_mean=remove_mean)})"
        screen.print(error_table({"record": error}, common_unit(record), title))
    say_written(screen, out, ["simulated.csv"])


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
        simulated = [simulated_run(model, run) for run in recording.runs]
    else:
        residuals = model.residual(start, fit_start=True)
        simulated = [measured - residual for measured, residual in zip(start.y, residuals, strict=True)]
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


def simulated_run(model: Model, run: Run) -> NDArray[np.float64]:
    """Return the simulated outputs of one experiment, from a steady state."""
    covariates = run.covariates if run.covariates.shape[1] else None
    return model.simulate(run.u, covariates=covariates)
