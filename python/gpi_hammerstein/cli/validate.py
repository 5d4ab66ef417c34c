"""`gpi validate`: the error of a model on a record, and tests of its residual."""

from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from gpi_hammerstein import files
from gpi_hammerstein._native import Model, Record, residual_tests
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
from gpi_hammerstein.cli.residual import name_pictures, tests_table, write_residual_pictures
from gpi_hammerstein.cli.simulate import ModelFile, Skip
from gpi_hammerstein.driven import require_match
from gpi_hammerstein.explanation import failed_in_words
from gpi_hammerstein.held_out import rule_in_words
from gpi_hammerstein.json_values import write_json

OwnRecord = Annotated[
    bool,
    typer.Option(
        "--own-record",
        help="The record is the one that the model was fitted to: keep the effects that depend only on time.",
    ),
]

Horizon = Annotated[
    float | None,
    typer.Option(
        "--horizon",
        help="Also compute the error of predictions over this time, each from an initial state that is "
        "fitted to the samples before. Use it for a plant whose output integrates the input.",
        metavar="SECONDS",
    ),
]

# Above this share of half the sampling rate, sensor noise dominates the residual.
HIGH_BAND = 0.75


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
    fit_start: options.FitStart = True,
    remove_mean: options.RemoveMean = False,
    own_record: OwnRecord = False,
    horizon: Horizon = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Compute the error of a model on a record, and test its residual for structure.

    The error is computed in the same way as for a held-out record of identify and explain. The unknown
    initial state is fitted, and the offset of the model is kept. Effects that depend only on
    time (drift, disturbances) are left out, because they are different in every record. Accepts any
    gpi-model/1 file. Writes validation.json and pictures of the residual to DIR.
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
    record = recording.record()
    with working("simulating"):
        left_out = [] if own_record else model.functions_of_time
        if own_record:
            error = model.error(record, remove_mean=remove_mean, fit_start=fit_start)
        else:
            found = model.on_another_record(record, remove_mean=remove_mean, fit_start=fit_start)
            error, model = found["error"], found["model"]
        over = None if horizon is None else model.over_horizons(record, horizon)
        residual = residual_tests(model, record, remove_mean=remove_mean, fit_start=fit_start)
        figures = residual_figures(model, record, fit_start=fit_start)
    # tests name the channels of the model, which the record may call otherwise
    name_pictures(residual["tests"], model.output_names, drawn=out is not None)
    rule = rule_in_words(fit_start=fit_start, remove_mean=remove_mean, left_out=left_out)
    result: dict[str, Any] = {
        "schema": "gpi-validation/1",
        "model": str(model_file),
        "record": describe_record(recording, records),
        "mean_removed": remove_mean,
        "start_fitted": fit_start,
        "left_out": left_out,
        "rule": rule,
        "skipped_s": skip,
        "error": error,
        "horizons": None if over is None else {"seconds": horizon, "error": over},
        "residual": residual,
        "figures": figures,
        "files": [],
    }
    if out is not None:
        from gpi_hammerstein import plot

        with files.staged(out) as folder, working("drawing"):
            left = plot.Residuals.of_model(model, record, fit_start=fit_start, remove_mean=remove_mean)
            write_residual_pictures(folder, left)
            result["files"] = sorted([*(file.name for file in folder.iterdir()), "validation.json"])
            write_json(result, folder / "validation.json")
    if as_json:
        print_json(result)
        return
    screen = console()
    for note in recording.notes:
        screen.print(f"[yellow]note[/] {escape(note)}")
    title = f"Simulation error ({rule})"
    screen.print(error_table({"record": error}, common_unit(record), title))
    if over is not None:
        title = f"Error of predictions over {horizon:g} s (initial state fitted to the samples before)"
        screen.print(error_table({"record": over}, common_unit(record), title))
    screen.print(tests_table(residual["tests"]))
    for sentence in failed_in_words(residual["tests"]):
        screen.print(escape(sentence))
    for row in figures:
        screen.print(
            escape(
                f"{row['output']}: residual {row['rms']:.4g} rms without its mean; noise "
                f"{row['noise_rms']:.4g} rms, if it is white"
            )
        )
    has = "has structure" if residual["structured"] else "has no structure beyond noise"
    screen.print(f"The residual {has}.")
    say_written(screen, out, result["files"])


def residual_figures(model: Model, record: Record, *, fit_start: bool = False) -> list[dict[str, Any]]:
    """Return figures of the residual of every output, without the mean of each experiment.

    ``lag1`` is the correlation of neighbouring samples. ``noise_rms`` is the rms of white noise whose power
    density is that of the residual above three quarters of half the sampling rate, where noise dominates.
    """
    residuals = model.residual(record, fit_start=fit_start)
    scored = [values[warmup:] for values, warmup in zip(residuals, record.warmup, strict=True)]
    return [
        {"output": name, **channel_figures([values[:, index] for values in scored])}
        for index, name in enumerate(record.output_names)
    ]


def channel_figures(pieces: list[NDArray[np.float64]]) -> dict[str, float]:
    """Return figures of the residual of one output over its experiments."""
    centred = [piece - piece.mean() for piece in pieces]
    samples = sum(len(piece) for piece in centred)
    power = sum(float(piece @ piece) for piece in centred)
    lagged = sum(float(piece[1:] @ piece[:-1]) for piece in centred)
    high = high_share = 0.0
    for piece in centred:
        spectrum = np.abs(np.fft.rfft(piece * np.hanning(len(piece)))) ** 2
        place = np.linspace(0.0, 1.0, len(spectrum))
        weight = float(piece @ piece) / max(float(spectrum.sum()), np.finfo(np.float64).tiny)
        high += weight * float(spectrum[place > HIGH_BAND].sum())
        high_share += float(np.mean(place > HIGH_BAND)) * len(piece)
    return {
        "rms": float(np.sqrt(power / samples)),
        "lag1": lagged / power if power > 0 else 0.0,
        "noise_rms": float(np.sqrt(high / high_share)) if high_share > 0 else 0.0,
    }
