"""`gpi explain`: find the effects that a model lacks, and compare the error before and after."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

import gpi_hammerstein._native as native
from gpi_hammerstein import files
from gpi_hammerstein._native import Explanation, ParameterError
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import (
    common_unit,
    console,
    describe_record,
    error_table,
    escape,
    picture,
    print_json,
    rival_table,
    say_written,
    stoppable,
    working,
)
from gpi_hammerstein.cli.progress import progress_bar
from gpi_hammerstein.cli.residual import name_pictures, write_residual_pictures
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.held_out import rule_of
from gpi_hammerstein.io import Recording
from gpi_hammerstein.json_values import write_json


def explain(
    context: typer.Context,
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
        typer.Option(help="Another experiment of the same actuator for the test.", metavar="FILE"),
    ] = None,
    effects: options.Effects = None,
    require: options.Require = None,
    order: options.Order = None,
    half_widths: options.HalfWidths = None,
    thresholds: options.Thresholds = None,
    delay: options.Delay = None,
    reading: options.Reading = "one-sided",
    hysteresis: options.Hysteresis = None,
    out: options.Out = None,
    report: Annotated[
        bool, typer.Option("--report", help="Also write report.html, one page with all results, to DIR.")
    ] = False,
    log: options.Log = False,
    as_json: options.Json = False,
) -> int:
    """Find the effects that a model lacks, add them, and compare the error before and after.

    Held-out blocks of the record, which are not used for any fit, confirm the effects. After the declared
    model is identified, Ctrl-C stops the search and keeps the effects found so far. Writes model.json,
    explanation.json and pictures to DIR.
    """
    if report and out is None:
        raise ParameterError("`report`: name the folder for report.html (-o DIR), or use gpi report")
    read: dict[str, Any] = {
        "input": input,
        "output": output,
        "time": time,
        "rate": rate,
        "covariate": covariate,
        "resample": resample,
        "warmup": warmup,
    }
    recording, found, where = explained(
        records,
        read,
        experiments,
        holdout_record,
        log=log,
        effects=split_effects(effects),
        require=split_effects(require),
        order=order,
        half_widths=options.parse_numbers("half_widths", half_widths),
        thresholds=options.parse_numbers("thresholds", thresholds),
        delay=delay,
        reading=reading,
        hysteresis=hysteresis,
    )
    result = to_dict(found)
    result["record"] = describe_record(recording, records)
    result |= {"holdout": where, "rule": rule_of(found), "files": []}
    if out is not None:
        name_pictures(result["residual"]["tests"], found.record.output_names)
        page = page_of(found, context.obj, recording.notes) if report else None
        write_results(out, found, result, "explanation.json", page)
    if as_json:
        print_json(result)
    else:
        summarise(console(), result, common_unit(found.record), out)
    return 130 if found.interrupted else 0


def explained(
    records: list[Path],
    read: dict[str, Any],
    experiments: str | None,
    holdout_record: Path | None,
    *,
    log: bool = False,
    **choices: Any,
) -> tuple[Recording, Explanation, str]:
    """Read records and explain them. Return also a description of the test data."""
    recording = options.read(records, **read, experiments=experiments)
    if holdout_record is not None and holdout_record.suffix == ".npy":
        raise ParameterError(f"`holdout-record` = {holdout_record}: a .npy file contains no output; use .npz")
    other = None if holdout_record is None else options.read([holdout_record], **read).record()
    with progress_bar(log=log) as progress, stoppable():
        found = native.explain(recording.record(), other, progress=progress, **choices)
    where = (
        "blocks of time that are distributed over the record"
        if other is None
        else f"another record: {holdout_record}"
    )
    return recording, found, where


def split_effects(text: str | None) -> list[str] | None:
    """Parse names that are separated by commas; ``none`` is an empty list."""
    if text is None:
        return None
    return [name.strip() for name in text.split(",") if name.strip() not in ("", "none")]


def summarise(screen: Console, result: dict[str, Any], unit: str, out: Path | None) -> None:
    """Print the result as text."""
    record = result["record"]
    screen.print(
        f"{record['samples']} samples at {record['rate_hz']:g} Hz in {record['experiments']} experiment(s): "
        + escape(f"{', '.join(record['inputs'])} -> {', '.join(record['outputs'])}")
    )
    for note in record["notes"]:
        screen.print(f"[yellow]note[/] {escape(note)}")
    screen.print(f"Held-out data: {escape(result['holdout'])}")
    screen.print(before_and_after(result, unit))
    screen.print(rival_table(result["rivals"], unit))
    for sentence in in_words(result, unit):
        screen.print(escape(sentence))
    if result["next_experiment"] and result["next_experiment"]["command"]:
        screen.print(f"  {escape(result['next_experiment']['command'])}")
    say_written(screen, out, result["files"])


def before_and_after(result: Mapping[str, Any], unit: str) -> Table:
    """Return the table of errors before and after, fitted and held out."""
    names = {"train": "fitted", "holdout": "held out"}
    rows = {
        f"{when}, {names[part]}": result["error"][when][part]
        for when in ("before", "after")
        for part in ("train", "holdout")
    }
    return error_table(rows, unit, f"Simulation error (held out: {result['rule']})")


def page_of(found: Explanation, command: str, notes: list[str]) -> str:
    """Return the HTML report."""
    from gpi_hammerstein.report import report_html

    with working("drawing"):
        return report_html(found, command=command, notes=notes, model_file="model.json")


def write_results(
    out: Path, found: Explanation, result: dict[str, Any], name: str, page: str | None = None
) -> None:
    """Write model.json, pictures and the file `name` with `result` to a folder; add the files to `result`."""
    with files.staged(out) as folder, working("drawing"):
        write_pictures(folder, found)
        if page is not None:
            (folder / "report.html").write_text(page, encoding="utf-8")
        files.save_model(found.model, folder / "model.json")
        result["files"] = sorted([*(file.name for file in folder.iterdir()), name])
        write_json(result, folder / name)


def write_pictures(folder: Path, found: Explanation) -> None:
    """Draw the residual before and after, and the hysteresis loop."""
    from gpi_hammerstein import plot

    write_residual_pictures(folder, plot.Residuals.of_explanation(found))
    picture(folder / "loop.png", lambda ax: plot.loops(found, ax), 6.0, 6.0)
