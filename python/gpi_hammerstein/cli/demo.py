"""`gpi demo`: the complete workflow on the demo record."""

import json
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

import gpi_hammerstein._native as native
from gpi_hammerstein._native import Explanation
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.explain import before_and_after, write_results
from gpi_hammerstein.cli.identification import describe_model
from gpi_hammerstein.cli.output import (
    console,
    escape,
    print_json,
    say_written,
    stoppable,
)
from gpi_hammerstein.cli.progress import progress_bar
from gpi_hammerstein.cli.validate import residual_figures
from gpi_hammerstein.explanation import in_words, join, to_dict
from gpi_hammerstein.held_out import rule_of
from gpi_hammerstein.io import read_record

DATA = files("gpi_hammerstein") / "data"
RECORD, TRUTH = "demo.csv.gz", "demo.truth.json"


def demo(out: options.Out = None, log: options.Log = False, as_json: options.Json = False) -> int:
    """Run the complete workflow on a bundled record: identify, find missing effects, compare the errors.

    The record is from a simulated piezo stage with effects that the declared model does not contain. Writes
    model.json, demo.json and pictures to DIR. Ctrl-C ends the search; what was found until then is
    written.
    """
    with as_file(DATA / RECORD) as path:
        record = read_record(path)
    truth = json.loads((DATA / TRUTH).read_text(encoding="utf-8"))
    with progress_bar(log=log) as progress, stoppable():
        found = native.explain(record, progress=progress)
    result: dict[str, Any] = {
        "schema": "gpi-demo/1",
        "identified": describe_model(found.base),
        "left": residual_figures(found.base, record)[0],
        "explanation": to_dict(found),
        "truth": truth,
        "files": [],
    }
    if out is not None:
        write_results(out, found, result, "demo.json")
    if as_json:
        print_json(result)
    else:
        tell(console(), found, result, out)
    return 130 if found.interrupted else 0


def tell(screen: Console, found: Explanation, result: dict[str, Any], out: Path | None) -> None:
    """Print the identified model, the residual, the missing effects, and the errors before and after."""
    record, explanation, truth = found.record, result["explanation"], result["truth"]
    unit = record.output_units[0]
    before, after = (explanation["error"][when]["holdout"] for when in ("before", "after"))
    screen.print(
        escape(f"A simulated piezo stage, {record.input_units[0]} to {unit}: {record.samples} samples ")
        + f"at {record.rate:g} Hz. It has effects that the declared model does not contain.\n"
    )
    plays, zones = (len(result["identified"][name][0]) for name in ("half_widths", "thresholds"))
    screen.print(
        f"[bold]1 Identification[/]  The model has {zones} deadzones and {plays} plays before linear "
        f"dynamics of order {result['identified']['order']}. Its error on held-out data is "
        f"{before['rms']:.3g} {escape(unit)} rms, {100 * before['nrmse']:.2g} % of the span."
    )
    bound = 1.96 / np.sqrt(record.samples)
    screen.print(
        f"[bold]2 Residual[/]  The residual is not white noise: the correlation of neighbouring samples is "
        f"{result['left']['lag1']:.2f}; that of white noise is within ±{bound:.2f}."
    )
    screen.print("[bold]3 Missing effects[/]")
    for sentence in in_words(explanation, unit):
        screen.print(f"  {escape(sentence)}")
    screen.print("[bold]4 Before and after[/]")
    screen.print(before_and_after({**explanation, "rule": rule_of(found)}, unit))
    present = [
        f"{name} ({truth['rms_over_noise'][name]:.3g} times the noise)" for name in sorted(truth["effects"])
    ]
    screen.print(
        f"The simulator contains {join(present)}. The hum is at {truth['hum_hz']:g} Hz. The noise is "
        f"{truth['noise_rms_um']:.3g} {escape(unit)} rms. The error on held-out data is now "
        f"{after['rms'] / truth['noise_rms_um']:.2f} times this noise."
    )
    say_written(screen, out, result["files"])
