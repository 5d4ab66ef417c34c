"""`gpi identify`: from a record to a model."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

import gpi_hammerstein._native as native
from gpi_hammerstein import files
from gpi_hammerstein._native import Model, ParameterError, Record
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    common_unit,
    console,
    describe_record,
    error_table,
    print_json,
    progress_bar,
    say_written,
    working,
    write_json,
)
from gpi_hammerstein.io import Recording, raise_warmup

HOLDOUT = "Held-out data"
MODEL = "Model"


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
        typer.Option(help="Another experiment to test on.", rich_help_panel=HOLDOUT, metavar="FILE"),
    ] = None,
    holdout_experiments: Annotated[
        str | None,
        typer.Option(help="Experiments to test on, counted from 0.", rich_help_panel=HOLDOUT, metavar="5"),
    ] = None,
    holdout: Annotated[
        float | None,
        typer.Option(
            help="Share of every experiment, at its end, to test on; 0.2 unless other data are held out.",
            rich_help_panel=HOLDOUT,
            show_default=False,
        ),
    ] = None,
    taps: Annotated[int | None, typer.Option(min=1, help="Taps of the FIR.", rich_help_panel=MODEL)] = None,
    order: Annotated[
        int | None, typer.Option(min=0, help="States of the linear part.", rich_help_panel=MODEL)
    ] = None,
    half_widths: Annotated[
        str | None,
        typer.Option(help="Number of plays, or half-widths.", rich_help_panel=MODEL, metavar="N|R1,R2,.."),
    ] = None,
    thresholds: Annotated[
        str | None,
        typer.Option(help="Number of deadzones, or thresholds.", rich_help_panel=MODEL, metavar="N|H1,H2,.."),
    ] = None,
    delay: Annotated[
        int | None,
        typer.Option(min=0, help="Makes G a gain with this delay, in samples.", rich_help_panel=MODEL),
    ] = None,
    remove_mean: options.RemoveMean = False,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Fit hysteresis and linear dynamics to a record, and test them on data that took no part.

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
    with progress_bar() as progress:
        model = native.identify(
            train,
            taps=taps,
            order=order,
            half_widths=options.parse_numbers("half_widths", half_widths),
            thresholds=options.parse_numbers("thresholds", thresholds),
            delay=delay,
            progress=progress,
        )
    if model.identification is not None:
        # What the fit could not use for want of a known past is no error of the model.
        train = raise_warmup(train, model.identification.warmups)
    error = {
        "train": model.error(train, remove_mean=remove_mean),
        "holdout": None if test is None else model.error(test, remove_mean=remove_mean),
    }
    result = {
        "schema": "gpi-identification/1",
        "record": describe_record(recording, records),
        "holdout": how,
        **describe_model(model),
        "mean_removed": remove_mean,
        "error": error,
        "files": [],
    }
    if out is not None:
        from gpi_hammerstein.cli.pictures import write_pictures

        with files.staged(out) as folder, working("drawing"):
            write_pictures(folder, model, train, test)
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
    """Return what to fit on, what to test on, and one sentence about the latter."""
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
        raise ParameterError(f"{given[0]} and {given[1]} exclude each other; give one of them")
    if holdout_record is not None:
        if holdout_record.suffix == ".npy":
            raise ParameterError(
                f"`holdout-record` = {holdout_record}: a .npy file has no output of its own; hold out "
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
        raise ParameterError(f"`holdout` = {holdout}: the share must lie between 0 and 1")
    train, test = recording.record().split(1 - share)
    return train, test, f"the last {100 * share:g} % of every experiment in time"


def describe_model(model: Model) -> dict[str, Any]:
    """Return the part of a result that says what was fitted."""
    found = model.identification
    return {
        "order": model.linear.order,
        "poles": model.linear.poles,
        "dc_gain": model.linear.dc_gain,
        "half_widths": [gpi.plays.half_widths for gpi in model.hysteresis],
        "weights": [gpi.plays.weights for gpi in model.hysteresis],
        "thresholds": [gpi.envelope.thresholds for gpi in model.hysteresis],
        "deadzone_weights": [gpi.envelope.weights for gpi in model.hysteresis],
        "offsets": model.offsets,
        "delay": found.delay if found else None,
        "taps": min(found.rounds, key=lambda one: one["rms"])["taps"] if found and found.rounds else None,
        "excited": found.supported_taps if found else None,
        "rounds": found.rounds if found else [],
        "notes": found.notes if found else [],
    }


def summarise(screen: Console, result: Mapping[str, Any], model: Model, unit: str, out: Path | None) -> None:
    """Print what was found for people to read."""
    record = result["record"]
    screen.print(
        f"{record['samples']} samples at {record['rate_hz']:g} Hz in {record['experiments']} experiment(s): "
        + escape(f"{', '.join(record['inputs'])} -> {', '.join(record['outputs'])}")
    )
    for note in (*record["notes"], *result["notes"]):
        screen.print(f"[yellow]note[/] {escape(note)}")
    screen.print(
        f"Linear part: order {result['order']}, largest pole {model.linear.spectral_radius:.4f}"
        + ("" if result["taps"] is None else f", {result['taps']:g} taps")
        + ("" if result["excited"] is None else f" (the input excites {result['excited']})")
        + ("" if result["delay"] is None else f", a gain with a delay of {result['delay']} samples")
    )
    hysteresis = zip(model.input_names, result["half_widths"], result["thresholds"], strict=True)
    for name, plays, zones in hysteresis:
        screen.print(f"Hysteresis of {escape(name)}: {len(plays)} plays, {len(zones)} deadzones")
    screen.print(f"Held out: {escape(result['holdout'])}")
    mean = ", mean removed" if result["mean_removed"] else ""
    screen.print(
        error_table(
            {"fitted": result["error"]["train"], "held out": result["error"]["holdout"]},
            unit,
            f"Simulation error{mean}",
        )
    )
    say_written(screen, out, result["files"])
