"""`gpi demo`: the whole of it on a record that comes along."""

from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.markup import escape

import gpi_hammerstein._native as native
from gpi_hammerstein._native import Fir, Model, Record
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.identification import describe_model
from gpi_hammerstein.cli.output import (
    console,
    error_table,
    picture,
    print_json,
    progress_bar,
    say_written,
    working,
    write_json,
)
from gpi_hammerstein.files import save_model, staged
from gpi_hammerstein.io import read_record

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Long enough for the resonance to ring down.
LINEAR_TAPS = 128


def demo(out: options.Out = None, as_json: options.Json = False) -> None:
    """Identify the record that comes along and test it on another experiment of the same actuator.

    Compares a linear model with the identified one. Writes model.json, demo.json and pictures to DIR.
    """
    train, test = bundled("demo.csv.gz"), bundled("demo_again.csv.gz")
    linear = native.fir(train.u, train.y, LINEAR_TAPS)
    with progress_bar() as progress:
        model = native.identify(train, progress=progress)
    result: dict[str, Any] = {
        "schema": "gpi-demo/1",
        "record": {"samples": train.samples, "rate_hz": train.rate, "holdout_samples": test.samples},
        **describe_model(model),
        "error": {
            "linear": {"train": linear_error(linear, train), "holdout": linear_error(linear, test)},
            "identified": {"train": model.error(train, fit_start=True), "holdout": model.error(test)},
        },
        "files": [],
    }
    if out is not None:
        from gpi_hammerstein.cli.pictures import write_pictures

        with working("drawing"), staged(out) as folder:
            write_pictures(folder, model, train, test)
            picture(folder / "before_after.png", lambda ax: draw_comparison(ax, linear, model, test), 10.0)
            save_model(model, folder / "model.json")
            result["files"] = sorted([*(file.name for file in folder.iterdir()), "demo.json"])
            write_json(result, folder / "demo.json")
    if as_json:
        print_json(result)
        return
    screen = console()
    screen.print(
        f"A simulated piezo stage, V to {escape(train.output_units[0])}, at {train.rate:g} Hz: "
        f"{train.samples} samples to fit on, {test.samples} samples of another experiment to test on."
    )
    for note in result["notes"]:
        screen.print(f"[yellow]note[/] {escape(note)}")
    before, after = result["error"]["linear"], result["error"]["identified"]
    unit = train.output_units[0]
    screen.print(
        error_table(
            {
                "linear, fitted": before["train"],
                "linear, held out": before["holdout"],
                "with hysteresis, fitted": after["train"],
                "with hysteresis, held out": after["holdout"],
            },
            unit,
        )
    )
    ratio = before["holdout"]["rms"] / after["holdout"]["rms"]
    screen.print(f"Held out, the error is {ratio:.1f} times smaller with hysteresis than without.")
    say_written(screen, out, result["files"])


def bundled(name: str) -> Record:
    """Read a record that is part of the package."""
    with as_file(files("gpi_hammerstein") / "data" / name) as path:
        return read_record(path)


def linear_output(linear: Fir, record: Record) -> NDArray[np.float64]:
    """Return what a finite impulse response predicts for the first experiment, (samples,)."""
    offset = float(np.ravel(linear.offsets)[0])
    return np.ravel(linear.simulate(record.u[0])) + offset


def linear_error(linear: Fir, record: Record) -> dict[str, float]:
    """Return the error figures of a finite impulse response on a record of one output."""
    y = record.y[0][:, 0]
    error = y - linear_output(linear, record)
    rms = float(np.sqrt(np.mean(error**2)))
    return {
        "rms": rms,
        "nrmse": rms / float(np.ptp(y)),
        "fit_percent": 100 * (1 - rms / float(np.std(y))),
        "max": float(np.abs(error).max()),
    }


def draw_comparison(ax: "Axes", linear: Fir, model: Model, record: Record) -> None:
    """Draw both residuals on one pair of axes."""
    from gpi_hammerstein.plot.style import BLUE, ORANGE

    t = np.arange(len(record.y[0])) / record.rate
    before = record.y[0][:, 0] - linear_output(linear, record)
    ax.plot(t, before, color=ORANGE, lw=0.8, label="linear alone")
    ax.plot(t, model.residual(record)[0][:, 0], color=BLUE, lw=0.8, label="with hysteresis")
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"residual of {record.output_names[0]} [{record.output_units[0]}]")
    ax.set_title("Another experiment of the same actuator")
    ax.legend(loc="upper right")
