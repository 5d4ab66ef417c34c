"""`gpi simulate`: simulate a model with the input of a record."""

from pathlib import Path
from typing import Annotated

import typer

from gpi_hammerstein import files
from gpi_hammerstein._native import ParameterError
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
from gpi_hammerstein.driven import require_match, simulated_table
from gpi_hammerstein.held_out import rule_in_words

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
