"""`gpi excite`: excitation signals for experiments."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import polars as pl
import typer
from numpy.typing import NDArray

import gpi_hammerstein._native as native
from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.help import Command, Group
from gpi_hammerstein.cli.output import console, print_json
from gpi_hammerstein.files import write_atomically

excite: typer.Typer = typer.Typer(
    cls=Group, no_args_is_help=True, help="Write an excitation signal: multisine, prbs, triangle or steps."
)

Rate = Annotated[float, typer.Option(help="Sampling rate in Hz.", show_default=False)]
Duration = Annotated[float, typer.Option(help="Duration in s.", show_default=False)]
Range = Annotated[
    options.Pair,
    typer.Option(
        "--range",
        parser=options.read_pair,
        help="Smallest and largest value.",
        metavar="LOW,HIGH",
        show_default=False,
    ),
]
Slew = Annotated[float | None, typer.Option(help="Largest slope, in units per second.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")]
Unit = Annotated[str, typer.Option(help="Unit of the signal, for the name of the column.")]
Out = Annotated[
    Path,
    typer.Option("--out", "-o", metavar="FILE.csv", help="File to write.", callback=options.writable_file),
]


@excite.command(cls=Command)
def multisine(
    rate: Rate,
    duration: Duration,
    band: Annotated[
        options.Pair,
        typer.Option(
            parser=options.read_pair,
            help="Lowest and highest frequency in Hz.",
            metavar="LOW,HIGH",
            show_default=False,
        ),
    ],
    range_: Range,
    out: Out,
    slew: Slew = None,
    odd: Annotated[bool, typer.Option("--odd", help="Excite only odd spectral lines.")] = False,
    detection: Annotated[
        bool,
        typer.Option(
            "--detection",
            help="Excite only odd spectral lines, and leave out one in four of them to detect nonlinearity.",
        ),
    ] = False,
    seed: Seed = 0,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write one period of a random-phase multisine, flat in the band. Repeat it to reach the steady state."""
    samples = count(rate, duration)
    u = native.multisine(samples, rate, band, range_, seed=seed, odd=odd, detection=detection, slew=slew)
    kind = {"kind": "multisine", "band_hz": band, "odd": odd, "detection": detection, "seed": seed}
    finish(u, kind, rate, unit, out, as_json)


@excite.command(cls=Command)
def prbs(
    rate: Rate,
    duration: Duration,
    clock: Annotated[
        float, typer.Option(help="Frequency at which the signal may switch, in Hz.", show_default=False)
    ],
    range_: Range,
    out: Out,
    slew: Slew = None,
    seed: Seed = 0,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write a pseudo-random binary signal, which has the largest power for a given range."""
    u = native.prbs(count(rate, duration), rate, clock, range_, seed=seed, slew=slew)
    finish(u, {"kind": "prbs", "clock_hz": clock, "seed": seed}, rate, unit, out, as_json)


@excite.command(cls=Command)
def triangle(
    rate: Rate,
    duration: Duration,
    frequency: Annotated[float, typer.Option(help="Frequency of the triangle, in Hz.", show_default=False)],
    range_: Range,
    out: Out,
    slew: Slew = None,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write a triangle whose amplitude decreases to zero, for nested hysteresis loops, the largest first."""
    u = native.decaying_triangle(count(rate, duration), rate, frequency, range_, slew=slew)
    finish(u, {"kind": "triangle", "frequency_hz": frequency}, rate, unit, out, as_json)


@excite.command(cls=Command)
def steps(
    rate: Rate,
    duration: Duration,
    range_: Range,
    out: Out,
    slew: Slew = None,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write steps to each end and the middle, each held for a quarter of the time: for creep and drift."""
    u = native.held_steps(count(rate, duration), rate, range_, slew=slew)
    finish(u, {"kind": "steps"}, rate, unit, out, as_json)


def count(rate: float, duration: float) -> int:
    """Return the number of samples."""
    for name, value in (("rate", rate), ("duration", duration)):
        if not (np.isfinite(value) and value > 0):
            raise ParameterError(f"`{name}` = {value}: must be positive")
    samples = round(rate * duration)
    if samples < 2:
        raise ParameterError(
            f"`duration` = {duration} s at {rate:g} Hz is {samples} samples; at least 2 are needed"
        )
    return samples


def finish(
    u: NDArray[np.float64], kind: Mapping[str, Any], rate: float, unit: str, out: Path, as_json: bool
) -> None:
    """Write the signal to a file and print its properties."""
    centred = u - u.mean()
    rms = float(np.sqrt(np.mean(centred**2)))
    result = {
        "schema": "gpi-excitation/1",
        **kind,
        "rate_hz": rate,
        "samples": len(u),
        "unit": unit,
        "min": float(u.min()),
        "max": float(u.max()),
        "mean": float(u.mean()),
        "rms": rms,
        "crest_factor": float(np.abs(centred).max()) / rms if rms > 0 else None,
        "max_slew": float(np.abs(np.diff(u)).max()) * rate,
        "file": str(out),
    }
    table = pl.DataFrame({"t_s": np.arange(len(u)) / rate, f"u_{unit}" if unit else "u": u})
    write_atomically(out, table.write_csv())
    if as_json:
        print_json(result)
        return
    crest = "-" if result["crest_factor"] is None else f"{result['crest_factor']:.3g}"
    console().print(
        f"{kind['kind']}: {len(u)} samples at {rate:g} Hz, "
        f"{result['min']:.4g} to {result['max']:.4g} {unit}, rms about its mean {rms:.4g} {unit}, "
        f"crest factor {crest}, largest slope {result['max_slew']:.4g} {unit}/s\n"
        f"Written to {out}",
        markup=False,
    )
