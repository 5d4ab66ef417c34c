"""`gpi report`: one HTML page with the results of `gpi explain`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.explain import explained, split_effects
from gpi_hammerstein.cli.output import common_unit, console, escape, working
from gpi_hammerstein.explanation import in_words, to_dict

Out = Annotated[
    Path,
    typer.Option("--out", "-o", metavar="FILE", help="File for the page.", callback=options.writable_file),
]


def report(
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
    effects: Annotated[
        str | None,
        typer.Option(help="Effects that may be added, separated by commas. Default: all.", metavar="A,B"),
    ] = None,
    out: Out = Path("report.html"),
) -> int:
    """Explain a record and write one HTML page: verdict, errors, effects, pictures, quality of the data.

    The page needs no network and no other files. `gpi explain --report` writes it together with the other
    results.
    """
    from gpi_hammerstein.report import write_report

    read: dict[str, Any] = {
        "input": input,
        "output": output,
        "time": time,
        "rate": rate,
        "covariate": covariate,
        "resample": resample,
        "warmup": warmup,
    }
    chosen = split_effects(effects)
    recording, found, _ = explained(records, read, experiments, holdout_record, effects=chosen)
    with working("drawing"):
        write_report(found, out, command=context.obj, notes=recording.notes)
    screen = console()
    for sentence in in_words(to_dict(found), common_unit(found.record), numbers=False):
        screen.print(escape(sentence))
    screen.print(f"Written: {escape(str(out))}")
    return 130 if found.interrupted else 0
