"""`gpi demo`: the whole of it on a record that comes along."""

import json
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape

import gpi_hammerstein._native as native
from gpi_hammerstein._native import Explanation
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.explain import before_and_after, write_results
from gpi_hammerstein.cli.identification import describe_model
from gpi_hammerstein.cli.output import console, print_json, progress_bar, say_written
from gpi_hammerstein.cli.validate import residual_figures
from gpi_hammerstein.explanation import in_words, join, to_dict
from gpi_hammerstein.io import read_record

DATA = files("gpi_hammerstein") / "data"
RECORD, TRUTH = "demo.csv.gz", "demo.truth.json"


def demo(out: options.Out = None, as_json: options.Json = False) -> None:
    """Identify the record that comes along, find what the model lacks, and compare before and after.

    The record is a simulated piezo stage with effects that the model is not told of. Writes model.json,
    demo.json and pictures to DIR.
    """
    with as_file(DATA / RECORD) as path:
        record = read_record(path)
    truth = json.loads((DATA / TRUTH).read_text(encoding="utf-8"))
    with progress_bar() as progress:
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


def tell(screen: Console, found: Explanation, result: dict[str, Any], out: Path | None) -> None:
    """Print the story: what is identified, what is left, what is missing, before and after."""
    record, explanation, truth = found.record, result["explanation"], result["truth"]
    unit = record.output_units[0]
    before, after = (explanation["error"][when]["holdout"] for when in ("before", "after"))
    screen.print(
        escape(f"A simulated piezo stage, {record.input_units[0]} to {unit}: {record.samples} samples ")
        + f"at {record.rate:g} Hz. What else its simulator put in, no model was told.\n"
    )
    plays, zones = (len(result["identified"][name][0]) for name in ("half_widths", "thresholds"))
    screen.print(
        f"[bold]1 Identify[/]  {zones} deadzones and {plays} plays before linear dynamics of order "
        f"{result['identified']['order']}: on held-out data {before['rms']:.3g} {escape(unit)} rms, "
        f"{100 * before['nrmse']:.2g} % of the span."
    )
    chance = 1.96 / np.sqrt(record.samples)
    screen.print(
        f"[bold]2 What is left[/]  is no noise: neighbouring samples of the residual correlate by "
        f"{result['left']['lag1']:.2f}, where white noise stays within ±{chance:.2f}."
    )
    screen.print("[bold]3 What is missing[/]")
    for sentence in in_words(explanation, unit):
        screen.print(f"  {escape(sentence)}")
    screen.print("[bold]4 Before and after[/]")
    screen.print(before_and_after(explanation, unit))
    put_in = [
        f"{name} ({truth['rms_over_noise'][name]:.3g} times the noise)" for name in sorted(truth["effects"])
    ]
    screen.print(
        f"What the simulator had put in: {join(put_in)}, the hum at {truth['hum_hz']:g} Hz; noise of "
        f"{truth['noise_rms_um']:.3g} {escape(unit)}. What is left held out is "
        f"{after['rms'] / truth['noise_rms_um']:.2f} times that noise."
    )
    say_written(screen, out, result["files"])
