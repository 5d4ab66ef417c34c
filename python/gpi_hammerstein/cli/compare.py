"""`gpi compare`: which values of two models, or of two fleets, differ beyond their uncertainty."""

from pathlib import Path
from typing import Annotated

import typer

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, describe_record, escape, print_json, working
from gpi_hammerstein.driven import require_match

First = Annotated[
    Path,
    typer.Argument(metavar="A", help="A model.json, or the fleet.parquet of a batch.", show_default=False),
]
Second = Annotated[Path, typer.Argument(metavar="B", help="Another one.", show_default=False)]
Records = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="RECORD",
        help="For models: record files on which the simulated outputs are compared.",
        show_default=False,
    ),
]


def compare(
    a: First,
    b: Second,
    records: Records = None,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    warmup: options.Warmup = None,
    experiments: options.Experiments = None,
    fit_start: options.FitStart = True,
    remove_mean: options.RemoveMean = False,
    as_json: options.Json = False,
) -> None:
    """Compare two models, or two fleets, and name what differs beyond its uncertainty.

    Models: sensitivity, hysteresis, bandwidth, resonances, offset, the quantities of the effects, the
    parameters if both have the same structure, and the simulated outputs. Fleets (tables of gpi batch): the
    medians of all figures, and how often each effect occurs. If two stages are equal, anything is named with
    a probability of at most 5 %.
    """
    from gpi_hammerstein import difference

    of_fleets = [file.suffix.lower() == ".parquet" for file in (a, b)]
    if all(of_fleets):
        if records:
            raise ParameterError(
                f"`RECORD` = {records[0]}: a record is compared with models, not with fleets"
            )
        with working("comparing"):
            fleets = difference.compare_fleets(a, b)
        if as_json:
            print_json(fleets.to_dict())
        else:
            console().print(escape(repr(fleets)))
        return
    if any(of_fleets):
        raise ParameterError(f"{a} and {b}: compare two models, or two tables of gpi batch")
    recording, record = None, None
    if records:
        model = options.load_model(a, "MODEL RECORD")
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
        )
        require_match(model, recording)
        record = recording.record()
    with working("comparing"):
        found = difference.compare(a, b, record, fit_start=fit_start, remove_mean=remove_mean)
    if as_json:
        described = None if recording is None else describe_record(recording, records or [])
        print_json(found.to_dict() | {"record": described})
        return
    screen = console()
    for note in recording.notes if recording is not None else []:
        screen.print(f"[yellow]note[/] {escape(note)}")
    screen.print(escape(repr(found)))
