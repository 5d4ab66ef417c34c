"""`gpi validate`: what a model leaves unexplained on a record."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.markup import escape
from rich.table import Table

from gpi_hammerstein import files
from gpi_hammerstein._native import Model, Record
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    common_unit,
    console,
    describe_record,
    error_table,
    mean_and_start,
    picture,
    print_json,
    say_written,
    working,
    write_json,
)
from gpi_hammerstein.cli.simulate import ModelFile, Skip, require_match

# Sensor noise dominates the top of the band, dynamics and hysteresis the bottom.
LOW_BAND, HIGH_BAND = 0.25, 0.75


def validate(
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
    """Measure a model's error on a record and look for structure in the residual.

    Writes validation.json and residual.png to DIR.
    """
    model = files.load_model(model_file)
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
    ).skip(skip)
    require_match(model, recording)
    record = recording.record()
    with working("simulating"):
        error = model.error(record, remove_mean=remove_mean, fit_start=fit_start)
        residual = residual_figures(model, record, fit_start=fit_start)
    result: dict[str, Any] = {
        "schema": "gpi-validation/1",
        "model": str(model_file),
        "record": describe_record(recording, records),
        "mean_removed": remove_mean,
        "start_fitted": fit_start,
        "skipped_s": skip,
        "error": error,
        "residual": residual,
        "files": [],
    }
    if out is not None:
        from gpi_hammerstein import plot

        with files.staged(out) as folder:
            draw = partial(plot.residual, model, record, fit_start=fit_start)
            picture(folder / "residual.png", draw, 10.0, 3.5)
            result["files"] = ["residual.png", "validation.json"]
            write_json(result, folder / "validation.json")
    if as_json:
        print_json(result)
        return
    screen = console()
    for note in recording.notes:
        screen.print(f"[yellow]note[/] {escape(note)}")
    title = "Simulation error" + mean_and_start(remove_mean, fit_start)
    screen.print(error_table({"record": error}, common_unit(record), title))
    screen.print(residual_table(residual))
    screen.print(
        "White noise alone has a lag-1 correlation of 0 and 25 % of its power in the lowest quarter of the "
        "band. The noise estimate supposes white noise, which the highest quarter shows alone."
    )
    say_written(screen, out, result["files"])


def residual_figures(model: Model, record: Record, *, fit_start: bool = False) -> list[dict[str, Any]]:
    """Return figures of the residual of every output, the mean of each experiment removed.

    ``rms`` is without the mean; ``lag1`` is the correlation of neighbouring samples; ``low_band`` the
    share of the power below a quarter of half the rate; ``noise_rms`` the rms of white noise that has
    the residual's power density above three quarters of half the rate.
    """
    residuals = model.residual(record, fit_start=fit_start)
    scored = [values[warmup:] for values, warmup in zip(residuals, record.warmup, strict=True)]
    return [
        {"output": name, **channel_figures([values[:, index] for values in scored])}
        for index, name in enumerate(record.output_names)
    ]


def channel_figures(pieces: list[NDArray[np.float64]]) -> dict[str, float]:
    """Return figures of one output's residual over its experiments."""
    centred = [piece - piece.mean() for piece in pieces]
    samples = sum(len(piece) for piece in centred)
    power = sum(float(piece @ piece) for piece in centred)
    lagged = sum(float(piece[1:] @ piece[:-1]) for piece in centred)
    low = high = high_share = 0.0
    for piece in centred:
        spectrum = np.abs(np.fft.rfft(piece * np.hanning(len(piece)))) ** 2
        place = np.linspace(0.0, 1.0, len(spectrum))
        weight = len(piece) / max(float(spectrum.sum()), np.finfo(np.float64).tiny) * float(np.mean(piece**2))
        low += weight * float(spectrum[place < LOW_BAND].sum())
        high += weight * float(spectrum[place > HIGH_BAND].sum())
        high_share += float(np.mean(place > HIGH_BAND)) * len(piece)
    return {
        "rms": float(np.sqrt(power / samples)),
        "lag1": lagged / power if power > 0 else 0.0,
        "low_band": low / power if power > 0 else 0.0,
        "noise_rms": float(np.sqrt(high / high_share)) if high_share > 0 else 0.0,
    }


def residual_table(residual: list[dict[str, Any]]) -> Table:
    """Return the figures for people to read."""
    table = Table(title="Residual, mean removed", title_justify="left")
    for name in ("output", "rms", "lag-1 correlation", "power in lowest quarter", "white noise estimate"):
        table.add_column(name, justify="left" if name == "output" else "right")
    for figures in residual:
        table.add_row(
            escape(figures["output"]),
            f"{figures['rms']:.4g}",
            f"{figures['lag1']:.3f}",
            f"{100 * figures['low_band']:.1f} %",
            f"{figures['noise_rms']:.4g}",
        )
    return table
