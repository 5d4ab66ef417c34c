"""`gpi identify`: identify a model from a record."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

import gpi_hammerstein._native as native
from gpi_hammerstein import files
from gpi_hammerstein._native import ParameterError, Record
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.identification import describe_model, summarise
from gpi_hammerstein.cli.output import (
    common_unit,
    console,
    describe_record,
    print_json,
    working,
)
from gpi_hammerstein.cli.progress import progress_bar
from gpi_hammerstein.held_out import rule_in_words
from gpi_hammerstein.io import Recording, raise_warmup
from gpi_hammerstein.json_values import write_json

HOLDOUT = "Held-out data"


def identify(
    records: options.Records,
    input: options.Input = None,
    output: options.Output = None,
    time: options.Time = None,
    rate: options.Rate = None,
    covariate: options.Covariate = None,
    resample: options.Resample = None,
    warmup: options.Warmup = None,
    experiments: options.Experiments = None,
    holdout_record: Annotated[
        Path | None,
        typer.Option(help="Another experiment for the test.", rich_help_panel=HOLDOUT, metavar="FILE"),
    ] = None,
    holdout_experiments: Annotated[
        str | None,
        typer.Option(help="Experiments for the test, numbered from 0.", rich_help_panel=HOLDOUT, metavar="5"),
    ] = None,
    holdout: Annotated[
        float | None,
        typer.Option(
            help="Share at the end of every experiment for the test. Default: 0.2, unless other data are "
            "held out.",
            rich_help_panel=HOLDOUT,
            show_default=False,
        ),
    ] = None,
    taps: Annotated[
        int | None, typer.Option(min=1, help="Number of FIR taps.", rich_help_panel=options.MODEL)
    ] = None,
    order: Annotated[
        int | None,
        typer.Option(
            min=0, help="Order (number of states) of the linear part.", rich_help_panel=options.MODEL
        ),
    ] = None,
    half_widths: options.HalfWidths = None,
    thresholds: options.Thresholds = None,
    delay: options.Delay = None,
    reading: options.Reading = "one-sided",
    hysteresis: options.Hysteresis = None,
    offset_knots: Annotated[
        int,
        typer.Option(
            min=1,
            help="Knots of the offset of each experiment. With 2 or more, the offset may drift.",
            rich_help_panel=options.MODEL,
        ),
    ] = 1,
    robust: Annotated[
        bool | None,
        typer.Option(
            "--robust/--no-robust",
            help="Give outliers less weight. Default: chosen from the data.",
            rich_help_panel=options.MODEL,
            show_default=False,
        ),
    ] = None,
    fit_start: options.FitStart = True,
    remove_mean: options.RemoveMean = False,
    out: options.Out = None,
    log: options.Log = False,
    as_json: options.Json = False,
) -> None:
    """Identify hysteresis and linear dynamics from a record, and test the model on held-out data.

    Writes model.json, identification.json and pictures to DIR.
    """
    read: dict[str, Any] = {
        "input": input,
        "output": output,
        "time": time,
        "rate": rate,
        "covariate": covariate,
        "resample": resample,
        "warmup": warmup,
    }
    chosen = experiments if holdout_experiments is None else None
    recording = options.read(records, **read, experiments=chosen)
    train, test, how = hold_out(recording, read, experiments, holdout_record, holdout_experiments, holdout)
    with progress_bar(log=log) as progress:
        model = native.identify(
            train,
            taps=taps,
            order=order,
            half_widths=options.parse_numbers("half_widths", half_widths),
            thresholds=options.parse_numbers("thresholds", thresholds),
            reading=reading,
            hysteresis=hysteresis,
            delay=delay,
            robust=robust,
            offset_knots=offset_knots,
            progress=progress,
        )
    if model.identification is not None:
        # Samples that depend on the unknown initial state were not used for the fit, and are not scored.
        train = raise_warmup(train, model.identification.warmups)
    counted: dict[str, Any] = {"fit_start": fit_start, "remove_mean": remove_mean}
    held_out = None if test is None else model.on_another_record(test, **counted)["error"]
    # The initial state of the training data was part of the fit.
    error = {"train": model.error(train, remove_mean=remove_mean, fit_start=True), "holdout": held_out}
    result = {
        "schema": "gpi-identification/1",
        "record": describe_record(recording, records),
        "holdout": how,
        **describe_model(model),
        "mean_removed": remove_mean,
        "start_fitted": fit_start,
        "rule": rule_in_words(**counted),
        "error": error,
        "rivals": native.rivals(train, test),
        "files": [],
    }
    if out is not None:
        from gpi_hammerstein.cli.pictures import write_pictures

        with files.staged(out) as folder, working("drawing"):
            write_pictures(folder, model, train, test, fit_start=fit_start)
            files.save_model(model, folder / "model.json")
            result["files"] = sorted([*(file.name for file in folder.iterdir()), "identification.json"])
            write_json(result, folder / "identification.json")
    if as_json:
        print_json(result)
    else:
        summarise(console(), result, model, common_unit(train), out)


def hold_out(
    recording: Recording,
    read: Mapping[str, Any],
    experiments: str | None,
    holdout_record: Path | None,
    holdout_experiments: str | None,
    holdout: float | None,
) -> tuple[Record, Record | None, str]:
    """Return the training data, the test data, and a description of the test data."""
    given = [
        name
        for name, value in (
            ("--holdout-record", holdout_record),
            ("--holdout-experiments", holdout_experiments),
            ("--holdout", holdout),
        )
        if value is not None
    ]
    if len(given) > 1:
        raise ParameterError(f"{given[0]} and {given[1]} exclude each other; give only one of them")
    if holdout_record is not None:
        if holdout_record.suffix == ".npy":
            raise ParameterError(
                f"`holdout-record` = {holdout_record}: a .npy file contains no output; hold out "
                "experiments of the record (--holdout-experiments) or use .npz"
            )
        other = options.read([holdout_record], **read)
        return recording.record(), other.record(), f"another record: {holdout_record}"
    if holdout_experiments is not None:
        if experiments is None:
            rest = recording.without(holdout_experiments)
        else:
            rest = recording.select(experiments)
        return (
            rest.record(),
            recording.select(holdout_experiments).record(),
            f"experiments {holdout_experiments} of the record",
        )
    if holdout == 0:
        return recording.record(), None, "none"
    share = 0.2 if holdout is None else holdout
    if not 0 < share < 1:
        raise ParameterError(f"`holdout` = {holdout}: the share must be between 0 and 1")
    train, test = recording.record().split(1 - share)
    return train, test, f"the last {100 * share:g} % of every experiment in time"
