"""`gpi excite`: signals that show what an actuator does."""

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
from gpi_hammerstein.cli.output import console, print_json
from gpi_hammerstein.files import write_atomically

excite: typer.Typer = typer.Typer(
    no_args_is_help=True, help="Write an excitation signal: multisine, prbs, triangle or steps."
)

Rate = Annotated[float, typer.Option(help="Sampling rate in Hz.", show_default=False)]
Duration = Annotated[float, typer.Option(help="Length in s.", show_default=False)]
Range = Annotated[
    tuple[float, float], typer.Option("--range", help="Smallest and largest value.", metavar="LOW HIGH")
]
Slew = Annotated[float | None, typer.Option(help="Largest slope in units per second.")]
Seed = Annotated[int, typer.Option(min=0, help="Another seed gives another signal of the same kind.")]
Unit = Annotated[str, typer.Option(help="Unit of the signal, for the column's name.")]
Out = Annotated[Path, typer.Option("--out", "-o", metavar="FILE.csv", help="File to write.")]


@excite.command()
def multisine(
    rate: Rate,
    duration: Duration,
    band: Annotated[
        tuple[float, float], typer.Option(help="Lowest and highest frequency in Hz.", metavar="LOW HIGH")
    ],
    range_: Range,
    out: Out,
    slew: Slew = None,
    odd: Annotated[bool, typer.Option("--odd", help="Excite odd lines only.")] = False,
    detection: Annotated[
        bool, typer.Option("--detection", help="Odd lines, one in four left out to show nonlinearities.")
    ] = False,
    seed: Seed = 0,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write one period of a random-phase multisine, flat in the band; repeat it to see the steady state."""
    samples = count(rate, duration)
    u = native.multisine(samples, rate, band, range_, seed=seed, odd=odd, detection=detection, slew=slew)
    kind = {"kind": "multisine", "band_hz": band, "odd": odd, "detection": detection, "seed": seed}
    finish(u, kind, rate, unit, out, as_json)


@excite.command()
def prbs(
    rate: Rate,
    duration: Duration,
    clock: Annotated[float, typer.Option(help="How often the signal may switch, in Hz.", show_default=False)],
    range_: Range,
    out: Out,
    slew: Slew = None,
    seed: Seed = 0,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write a pseudo-random binary signal: the most power for a given range."""
    u = native.prbs(count(rate, duration), rate, clock, range_, seed=seed, slew=slew)
    finish(u, {"kind": "prbs", "clock_hz": clock, "seed": seed}, rate, unit, out, as_json)


@excite.command()
def triangle(
    rate: Rate,
    duration: Duration,
    frequency: Annotated[float, typer.Option(help="Triangles per second, in Hz.", show_default=False)],
    range_: Range,
    out: Out,
    slew: Slew = None,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write triangles whose amplitude falls to zero: nested hysteresis loops, largest first."""
    u = native.decaying_triangle(count(rate, duration), rate, frequency, range_, slew=slew)
    finish(u, {"kind": "triangle", "frequency_hz": frequency}, rate, unit, out, as_json)


@excite.command()
def steps(
    rate: Rate,
    duration: Duration,
    range_: Range,
    out: Out,
    slew: Slew = None,
    unit: Unit = "V",
    as_json: options.Json = False,
) -> None:
    """Write a step to each end and to the middle, held for a quarter of the time: creep and drift."""
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
    """Write the signal and print its figures."""
    swing = u - u.mean()
    rms = float(np.sqrt(np.mean(swing**2)))
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
        "crest_factor": float(np.abs(swing).max()) / rms if rms > 0 else None,
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
        f"crest factor {crest}, steepest {result['max_slew']:.4g} {unit}/s\n"
        f"Written to {out}",
        markup=False,
    )
