"""`gpi compensate`: the drive that makes an actuator follow a reference."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import polars as pl
import typer
from rich.markup import escape

from gpi_hammerstein import files
from gpi_hammerstein._native import Compensation, DataError, Model, ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    console,
    error_table,
    picture,
    print_json,
    say_written,
    working,
    write_json,
)
from gpi_hammerstein.cli.simulate import ModelFile
from gpi_hammerstein.io import Recording, read_recording

ReferenceFile = Annotated[
    Path,
    typer.Argument(metavar="REFERENCE", help="A table of what the outputs shall do.", show_default=False),
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--reference",
        "-r",
        help="Columns of the reference; the model's output names, `reference`, `r` and `y` are found.",
        rich_help_panel=options.COLUMNS,
    ),
]
Limits = Annotated[
    list[str] | None,
    typer.Option(
        "--limits",
        metavar="LOW,HIGH",
        help="Lowest and highest drive, in the input's unit; once for all inputs, or once each.",
    ),
]
Slew = Annotated[float | None, typer.Option(help="The fastest drive, in units of the input per second.")]
QuasiStatic = Annotated[
    bool, typer.Option("--quasi-static", help="Leave the dynamics alone: only their DC gain is inverted.")
]
Preview = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="How much earlier the drive may begin; as long as the dynamics need by itself.",
    ),
]
Passes = Annotated[int, typer.Option(min=0, help="Most passes after the first one.")]

WRITTEN = ["drive.csv", "compensation.json", "compensation.png"]


def compensate(
    model_file: ModelFile,
    reference_file: ReferenceFile,
    reference: Columns = None,
    time: options.Time = None,
    rate: options.Rate = None,
    resample: options.Resample = None,
    limits: Limits = None,
    slew: Slew = None,
    quasi_static: QuasiStatic = False,
    preview: Preview = None,
    passes: Passes = 20,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Find the drive that makes the outputs follow a reference, and predict the error.

    The model is run backwards: sensor, dynamics, hysteresis, delay. Writes drive.csv (t, the inputs, the
    reference and what the model predicts), compensation.json and a picture to DIR.
    """
    model = files.load_model(model_file)
    recording = read_reference(reference_file, model, options.split_names(reference), time, rate, resample)
    if len(recording.runs) > 1:
        count = len(recording.runs)
        raise DataError(f"{reference_file}: the reference falls into {count} parts; give one without gaps")
    with working("compensating"):
        found = model.compensate(
            recording.runs[0].u,
            limits=[read_pair(pair) for pair in limits] if limits else None,
            slew=slew,
            quasi_static=quasi_static,
            preview=None if preview is None else round(preview * model.rate),
            passes=passes,
        )
    result: dict[str, Any] = {
        "schema": "gpi-compensation/1",
        "model": str(model_file),
        "reference": str(reference_file),
        "samples": len(recording.runs[0].u),
        "rate_hz": model.rate,
        "lead_s": found.lead / model.rate,
        "drive": {
            name: {
                "unit": unit,
                "lowest": float(u.min()),
                "highest": float(u.max()),
                "fastest": fastest(u, model.rate),
            }
            for name, unit, u in zip(model.input_names, model.input_units, columns(found.drive), strict=True)
        },
        "error": {"predicted": found.error, "in_proportion": found.error_in_proportion},
        "passes": found.passes,
        "out_of_reach": found.out_of_reach,
        "too_fast": found.too_fast,
        "compensated": found.compensated,
        "left": [{"effect": effect, "why": why} for effect, why in found.left],
        "files": WRITTEN if out is not None else [],
    }
    if out is not None:
        from gpi_hammerstein.plot import compensation

        with files.staged(out) as folder:
            drive_table(model, found).write_csv(folder / WRITTEN[0], float_precision=None)
            write_json(result, folder / WRITTEN[1])
            picture(folder / WRITTEN[2], lambda ax: compensation(found, ax), 6.0, 6.0)
    if as_json:
        print_json(result)
        return
    screen = console()
    unit = model.output_units[0] if len(set(model.output_units)) == 1 else ""
    rows = {"drive in proportion": found.error_in_proportion, "compensated": found.error}
    screen.print(error_table(rows, unit, "Predicted error; that of the model itself comes on top"))
    for name, row in result["drive"].items():
        screen.print(
            f"{name} goes from {row['lowest']:.4g} to {row['highest']:.4g} {row['unit']}, at most "
            f"{row['fastest']:.4g} {row['unit']}/s"
            + ("." if limits else "; no limits were given (--limits).")
        )
    for effect, why in found.left:
        screen.print(f"[yellow]left[/] {effect}: {escape(why)}; its error comes on top.")
    if found.lead:
        screen.print(f"The drive begins {found.lead / model.rate:.4g} s before the reference.")
    if found.out_of_reach:
        screen.print(f"[yellow]out of reach[/] {found.out_of_reach} samples stand at a limit of the drive.")
    if found.too_fast:
        screen.print(f"[yellow]too fast[/] {found.too_fast} samples are held back to the fastest drive.")
    say_written(screen, out, WRITTEN)


def read_reference(
    path: Path,
    model: Model,
    names: list[str] | None,
    time: str | None,
    rate: float | None,
    resample: str | None,
) -> Recording:
    """Read the columns of a reference, found by their usual names unless given."""
    usual = [list(model.output_names), ["reference"], ["ref"], ["r"], ["y"]]
    missing: DataError | None = None
    for wanted in usual if names is None else [names]:
        try:
            recording = read_recording(
                path,
                input=wanted,
                output=[],
                covariate=[],
                time=time,
                rate=rate,
                resample=options.parse_resample(resample),
            )
        except DataError as error:
            if "no column" not in str(error):
                raise
            missing = missing or error
            continue
        return matching(recording, model)
    raise DataError(f"{missing}; name the reference's columns (--reference)")


def matching(recording: Recording, model: Model) -> Recording:
    """Refuse a reference that the model was not made for."""
    wanted, found = len(model.output_names), len(recording.inputs)
    if wanted != found:
        raise DataError(f"the model has {wanted} outputs, but the reference has {found} columns")
    if abs(model.rate - recording.rate) > 1e-3 * model.rate:
        raise DataError(
            f"the model is sampled at {model.rate:g} Hz, but the reference at {recording.rate:g} Hz; "
            f"resample it (--resample {model.rate:g})"
        )
    for unit, column in zip(model.output_units, recording.inputs, strict=True):
        if unit and column.unit and unit != column.unit:
            raise DataError(
                f"the model's output is in {unit}, but column `{column.header}` is in {column.unit}"
            )
    return recording


def read_pair(text: str) -> tuple[float, float]:
    """Read two numbers joined by a comma."""
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise ParameterError(
            f"`limits` = {text}: write the lowest and the highest drive, such as -10,150"
        ) from None
    return low, high


def columns(signal: np.ndarray) -> np.ndarray:
    """Return the channels of a signal, one a row."""
    return np.atleast_2d(signal.T)


def fastest(u: np.ndarray, rate: float) -> float:
    """Return the largest speed, in units per second."""
    return float(np.max(np.abs(np.diff(u)), initial=0.0) * rate)


def drive_table(model: Model, found: Compensation) -> pl.DataFrame:
    """Return time, drives, references and predictions, one a column."""
    table = {"t": found.time}
    for name, values in zip(model.input_names, columns(found.drive), strict=True):
        table[name] = values
    signals = {
        "reference": found.reference,
        "predicted": found.predicted,
        "in_proportion": found.in_proportion,
    }
    for what, signal in signals.items():
        for name, values in zip(model.output_names, columns(signal), strict=True):
            table[f"{what}_{name}"] = values
    return pl.DataFrame(table)
