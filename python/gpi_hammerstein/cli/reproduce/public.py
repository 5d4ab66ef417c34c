"""`gpi reproduce silverbox` and the other public benchmarks: errors and names next to what is published."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from gpi_hammerstein import files
from gpi_hammerstein.cli import options
from gpi_hammerstein.cli.output import console, escape, picture, print_json, say_written
from gpi_hammerstein.cli.progress import progress_bar
from gpi_hammerstein.explanation import in_words, to_dict
from gpi_hammerstein.json_values import write_json
from gpi_hammerstein.reproduce.catalogue import BENCHMARKS
from gpi_hammerstein.reproduce.public import TRAINING, Benchmark, Reproduction, reproduce

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Data = Annotated[
    Path | None,
    typer.Option(help="Folder of the files. Default: the data folder, or a download.", metavar="DIR"),
]


def command(name: str) -> Callable[[Path | None, Path | None, bool, bool], None]:
    """Return the command of a benchmark."""
    benchmark = BENCHMARKS[name]

    def own(
        data: Data = None,
        out: options.Out = None,
        log: options.Log = False,
        as_json: options.Json = False,
    ) -> None:
        run(benchmark, data, out, log=log, as_json=as_json)

    own.__doc__ = (
        f"{benchmark.title}.\n\n{benchmark.truth} Explains the training data, tests the model on the other "
        f"data of the benchmark, and compares with published errors. Writes {name}.json, model.json and a "
        "picture of the errors to DIR."
    )
    return own


def run(benchmark: Benchmark, data: Path | None, out: Path | None, *, log: bool, as_json: bool) -> None:
    """Explain a benchmark, and print and write the result."""
    with progress_bar(log=log) as progress:
        answer = reproduce(benchmark, data, progress=progress)
    result = describe(answer)
    if out is not None:
        with files.staged(out) as folder:
            files.save_model(answer.found.model, folder / "model.json")
            draw(answer, folder)
            result["files"] = sorted([*(file.name for file in folder.iterdir()), f"{benchmark.name}.json"])
            write_json(result, folder / f"{benchmark.name}.json")
    if as_json:
        print_json(result)
        return
    screen = console()
    screen.print(comparison(answer))
    screen.print(escape(f"Known: {benchmark.truth}"))
    screen.print(escape(f"Named: {', '.join(answer.found.effects) or 'none'}."))
    screen.print()
    for sentence in in_words(result["explanation"], answer.found.record.output_units[0]):
        screen.print(escape(sentence))
    say_written(screen, out, result["files"])


def describe(answer: Reproduction) -> dict[str, Any]:
    """Return the errors and the explanation, for JSON."""
    benchmark = answer.benchmark
    return {
        "schema": "gpi-reproduction/1",
        "example": benchmark.name,
        "title": benchmark.title,
        "truth": benchmark.truth,
        "true_effects": list(benchmark.effects),
        "false_names": answer.false_names,
        "unit": benchmark.unit,
        "errors": {part: {"before": own[0], "after": own[1]} for part, own in answer.errors.items()},
        "published": {source: dict(errors) for source, errors in benchmark.published.items()},
        "seconds": answer.seconds,
        "explanation": to_dict(answer.found),
        "files": [],
    }


def comparison(answer: Reproduction) -> Table:
    """Return the table that the command prints."""
    benchmark = answer.benchmark
    title = f"{benchmark.title}. Error of simulation, rms in {benchmark.unit}"
    table = Table(title=escape(title), title_justify="left")
    table.add_column("model", min_width=30)
    for part in answer.errors:
        table.add_column(f"{part}, held out" if part == TRAINING else part, justify="right")
    for source, errors in benchmark.published.items():
        table.add_row(source, *(f"{errors[part]:.4g}" if part in errors else "" for part in answer.errors))
    table.add_section()
    for place, name in enumerate(("declared model", "final model")):
        table.add_row(name, *(f"{own[place]:.4g}" for own in answer.errors.values()))
    return table


def draw(answer: Reproduction, folder: Path) -> None:
    """Draw the output and the error of both models on the last part."""
    part = list(answer.parts)[-1]
    picture(folder / "errors.png", partial(draw_errors, answer=answer, part=part))


def draw_errors(ax: "Axes", answer: Reproduction, part: str) -> None:
    """Draw the measured output, and the error before and after, over time."""
    record, found = answer.parts[part], answer.found
    unit = record.output_units[0]
    time, warmup = np.asarray(record.time[0]), record.warmup[0]
    shown = slice(warmup, None)
    ax.plot(time[shown], np.ravel(record.y[0])[shown], lw=0.6, color="0.75", label="output")
    for model, label in ((found.models[0], "error, declared model"), (found.model, "error, final model")):
        error = np.ravel(model.residual(record, fit_start=True)[0])
        ax.plot(time[shown], error[-len(time[shown]) :], lw=0.6, label=label)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"{record.output_names[0]} [{unit}]")
    ax.set_title(f"{answer.benchmark.name}: {part}")
    ax.legend(fontsize="small")
