"""Output of commands: messages, tables, JSON and pictures."""

import json
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape as escape_markup
from rich.table import Table

from gpi_hammerstein._native import GpiError, Record
from gpi_hammerstein.comparison import rival_rows
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.io import Recording
from gpi_hammerstein.json_values import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Figures = Mapping[str, float] | None


def escape(text: str) -> str:
    """Return a text that the console prints as it is: without markup, with visible control characters."""
    return "\n".join(escape_markup(visible(line)) for line in text.split("\n"))


def complain(problem: Exception | str, code: int) -> int:
    """Print an error message of one line on stderr, and return the exit code."""
    if isinstance(problem, Exception) and not isinstance(problem, GpiError):
        text = f"{type(problem).__name__}: {problem} (GPI_DEBUG=1 shows the traceback)"
    else:
        text = str(problem)
    print("gpi: " + "\n".join(map(visible, text.split("\n"))), file=sys.stderr)
    return code


def print_json(result: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout."""
    print(json.dumps(plain(result), allow_nan=False))


def console() -> Console:
    """Return the console for summaries."""
    screen = Console(highlight=False, soft_wrap=True)
    if not screen.file.isatty():
        # A file or a pipe has no width: numbers must not be cut.
        screen.width = 120
    return screen


@contextmanager
def working(what: str) -> Iterator[None]:
    """Show an activity message on stderr, if stderr is a terminal."""
    errors = Console(stderr=True)
    # `is_terminal` is also True if FORCE_COLOR is set, as in notebooks.
    with errors.status(what) if errors.file.isatty() else nullcontext():
        yield


@contextmanager
def stoppable() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt in the block, for work that then returns what it has found."""
    is_main = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT) if is_main else None
    # Who ignores Ctrl-C, or handles it in a way of their own that is not Python's, keeps this.
    if not callable(before):
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def describe_record(recording: Recording, files: Sequence[Path | str]) -> dict[str, Any]:
    """Return the part of a result that describes the record."""
    return {
        "files": [str(file) for file in files],
        "samples": sum(len(run.u) for run in recording.runs),
        "experiments": len(recording.runs),
        "rate_hz": recording.rate,
        "inputs": [column.header for column in recording.inputs],
        "outputs": [column.header for column in recording.outputs],
        "covariates": [column.header for column in recording.covariates],
        "notes": recording.notes,
    }


def error_table(rows: Mapping[str, Figures], unit: str = "", title: str = "Simulation error") -> Table:
    """Return a table of error figures, with one row for each data set."""
    table = Table(title=escape(title), title_justify="left")
    table.add_column("")
    label = f" [{unit}]" if unit else ""
    for name in (f"rms{label}", "rms / span", "fit", f"largest{label}"):
        table.add_column(escape(name), justify="right")
    for name, figures in rows.items():
        if figures is None:
            table.add_row(escape(name), *["-"] * 4)
            continue
        table.add_row(
            escape(name),
            f"{figures['rms']:.4g}",
            f"{100 * figures['nrmse']:.3g} %",
            f"{figures['fit_percent']:.2f} %",
            f"{figures['max']:.4g}",
        )
    return table


def rival_table(rivals: Sequence[Mapping[str, Any]], unit: str = "") -> Table:
    """Return a table of simple models and their errors on the same data."""
    table = Table(title="Simple models", title_justify="left")
    label = f" [{unit}]" if unit else ""
    table.add_column("")
    table.add_column("what was chosen")
    for name in (f"rms, fitted{label}", f"rms, held out{label}"):
        table.add_column(escape(name), justify="right")
    for row in rival_rows(rivals):
        table.add_row(*map(escape, row))
    return table


def common_unit(record: Record) -> str:
    """Return the unit of the outputs if they have the same unit, else an empty text."""
    units = set(record.output_units)
    return units.pop() if len(units) == 1 else ""


def picture(path: Path, draw: Callable[["Axes"], object], width: float = 8.0, height: float = 4.5) -> None:
    """Draw one PNG file, without use of the state of pyplot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=120, layout="constrained")
    draw(figure.add_subplot())
    figure.savefig(path)


def say_written(screen: Console, out: Path | None, files: Sequence[str]) -> None:
    """Print the names of the files that were written."""
    if out is not None:
        screen.print(f"Written to {escape(str(out))}: {escape(', '.join(files))}")
