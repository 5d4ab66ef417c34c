"""`gpi compensate`: compute the drive that makes an actuator follow a reference."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import polars as pl
import typer
from rich.table import Table

from gpi_hammerstein import files
from gpi_hammerstein._native import Compensation, DataError, Model
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    console,
    escape,
    picture,
    print_json,
    say_written,
    working,
)
from gpi_hammerstein.cli.simulate import ModelFile
from gpi_hammerstein.escaping import in_cell
from gpi_hammerstein.io import Recording, read_recording
from gpi_hammerstein.json_values import write_json

ReferenceFile = Annotated[
    Path,
    typer.Argument(metavar="REFERENCE", help="A table with the desired outputs.", show_default=False),
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--reference",
        "-r",
        help="Columns of the reference. The model's output names, `reference`, `r` and `y` are recognised.",
        rich_help_panel=options.COLUMNS,
    ),
]
Limits = Annotated[
    list[options.Pair] | None,
    typer.Option(
        "--limits",
        parser=options.read_pair,
        metavar="LOW,HIGH",
        help="Lowest and highest drive, in the unit of the input; once for all inputs, or once for each.",
    ),
]
Slew = Annotated[
    float | None, typer.Option(help="Largest slope of the drive, in units of the input per second.")
]
QuasiStatic = Annotated[bool, typer.Option("--quasi-static", help="Invert only the DC gain of the dynamics.")]
Preview = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="How long before the reference the drive may begin. Default: as long as the dynamics need.",
    ),
]
Start = Annotated[
    list[float] | None,
    typer.Option(
        metavar="INPUT",
        help="Constant input before the drive begins, once for each input. At 0, the plays are at rest. "
        "Default: the first value of the drive, and an unknown state of the plays.",
    ),
]
StartOutput = Annotated[
    float | None,
    typer.Option(
        metavar="OUTPUT",
        help="Output that is measured at the constant input --start. It determines a part of the state of "
        "the plays.",
    ),
]
Passes = Annotated[int, typer.Option(min=0, help="Largest number of iterations after the first pass.")]

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
    start: Start = None,
    start_output: StartOutput = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Compute the drive that makes the outputs follow a reference, and predict the error.

    The model is inverted from the output to the input: sensor curve, dynamics, hysteresis, delay. Writes
    drive.csv (t, the inputs, the reference and the predicted outputs), compensation.json and a picture to
    DIR.
    """
    model = options.load_model(model_file, "REFERENCE")
    recording = read_reference(reference_file, model, options.split_names(reference), time, rate, resample)
    if len(recording.runs) > 1:
        count = len(recording.runs)
        raise DataError(
            f"{reference_file}: the reference has gaps and consists of {count} parts; give a reference "
            "without gaps"
        )
    with working("compensating"):
        found = model.compensate(
            recording.runs[0].u,
            limits=limits or None,
            slew=slew,
            quasi_static=quasi_static,
            preview=None if preview is None else round(preview * model.rate),
            passes=passes,
            start=start or None,
            start_output=start_output,
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
        "start": None if not start else {"input": start, "output": start_output},
        "expected_error": found.expected_error,
        "error": {"inversion": found.error, "static_curve": found.error_static_curve},
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
    screen.print(expected_table(found, unit))
    screen.print(escape(expected_sentence(found, unit)))
    for name, row in result["drive"].items():
        unit_in = row["unit"]
        screen.print(
            escape(
                f"The range of {name} is {row['lowest']:.4g} to {row['highest']:.4g} {unit_in}, and its "
                f"largest slope is {row['fastest']:.4g} {unit_in}/s."
            )
            + ("" if limits else " No limits were given (--limits).")
        )
    for effect, why in found.left:
        screen.print(
            f"[yellow]not compensated[/] {effect}: {escape(why)}. The expected error does not contain it."
        )
    if found.lead:
        screen.print(f"The drive begins {found.lead / model.rate:.4g} s before the reference.")
    if found.out_of_reach:
        screen.print(f"[yellow]out of reach[/] {found.out_of_reach} samples are at a limit of the drive.")
    if found.too_fast:
        screen.print(f"[yellow]too fast[/] the slope of the drive is limited at {found.too_fast} samples.")
    say_written(screen, out, WRITTEN)


PARTS = {
    "inversion": "inversion: limits of the drive, and iterations that are not complete",
    "parameters": "parameters: uncertainty of the parameters of the model",
    "model": "model: error of the structure of the model",
    "past": "past: unknown state of the plays before the drive begins",
}


def expected_table(found: Compensation, unit: str) -> Table:
    """Return the table of the expected error and its parts."""
    expected = found.expected_error
    table = Table(title="Expected error of the stage, without the noise of the sensor")
    table.add_column("part")
    table.add_column("rms" + (f" / {escape(unit)}" if unit else ""), justify="right")
    for name, what in PARTS.items():
        part = expected["parts"][name]
        table.add_row(what, "not known" if part is None else f"{part:.4g}")
    table.add_section()
    table.add_row("compensated drive", ("> " if expected["missing"] else "") + f"{expected['rms']:.4g}")
    table.add_row("best static curve (error of the inversion only)", f"{found.error_static_curve['rms']:.4g}")
    return table


def expected_sentence(found: Compensation, unit: str) -> str:
    """Return the expected error in one sentence."""
    expected = found.expected_error
    rms, bound = (f"{expected[name]:.3g} {unit}".rstrip() for name in ("rms", "bound"))
    text = (
        f"The stage is expected to miss the reference by {rms} rms. At the worst sample, the error is below "
    )
    text += f"{bound} with a probability of 95 %"
    if expected["missing"]:
        missing = " and ".join(expected["missing"])
        text += f"; the parts {missing} are missing, because the model file has no `prediction`: "
        text += "identify the model again"
    return text + "."


def read_reference(
    path: Path,
    model: Model,
    names: list[str] | None,
    time: str | None,
    rate: float | None,
    resample: str | None,
) -> Recording:
    """Read the columns of a reference. They are recognised by their usual names unless they are given."""
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
    """Reject a reference that does not match the model."""
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


def columns(signal: np.ndarray) -> np.ndarray:
    """Return the channels of a signal, one in each row."""
    return np.atleast_2d(signal.T)


def fastest(u: np.ndarray, rate: float) -> float:
    """Return the largest slope, in units per second."""
    return float(np.max(np.abs(np.diff(u)), initial=0.0) * rate)


def drive_table(model: Model, found: Compensation) -> pl.DataFrame:
    """Return a table with columns for the time, the drives, the references and the predictions."""
    table = {"t": found.time}
    for name, values in zip(model.input_names, columns(found.drive), strict=True):
        table[in_cell(name)] = values
    signals = {
        "reference": found.reference,
        "predicted": found.predicted,
        "static_curve": found.static_curve,
    }
    for what, signal in signals.items():
        for name, values in zip(model.output_names, columns(signal), strict=True):
            table[f"{what}_{name}"] = values
    return pl.DataFrame(table)
