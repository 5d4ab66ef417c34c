"""The progress of long work on stderr: one bar on a terminal, or lines.

Both show the same: the stage and what it tries, the fraction of all work that is done, the smallest error so
far, the elapsed time and the remaining time. The fraction never falls (see `gpi_hammerstein.Progress`).
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape as escape_markup
from rich.progress import BarColumn, SpinnerColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from gpi_hammerstein._native import Progress

Tell = Callable[[Progress], None]

# Seconds between two lines of the log: a search of some minutes gives a page of them.
LOG_SECONDS = 5.0


@contextmanager
def progress_bar(*, log: bool = False) -> Iterator[Tell | None]:
    """Yield a function that shows progress on stderr; None if stderr is no terminal and no log is wanted."""
    errors = Console(stderr=True)
    if log:
        yield lines()
    elif errors.is_terminal:
        with bar(errors) as tell:
            yield tell
    else:
        yield None


@contextmanager
def bar(errors: Console) -> Iterator[Tell]:
    """Yield a function that draws one bar for all work."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TaskProgressColumn(),
        # the clock goes on between two reports, and stops when the fraction first is 1, which is at the end
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Bar(*columns, console=errors, transient=True) as shown:
        task = shown.add_task("", total=1.0, left="")

        def tell(now: Progress) -> None:
            left = "" if now.remaining is None else f"about {clock(now.remaining)} left"
            shown.update(task, description=escape_markup(what(now)), completed=now.done, left=left)

        yield tell


def lines() -> Tell:
    """Return a function that prints a line every few seconds, and the last one."""
    last = -LOG_SECONDS

    def tell(now: Progress) -> None:
        nonlocal last
        if now.elapsed - last < LOG_SECONDS and now.done < 1.0:
            return
        last = now.elapsed
        left = "" if now.remaining is None or now.done == 1.0 else f", about {clock(now.remaining)} left"
        stamp = time.strftime("%H:%M:%S")
        print(
            f"{stamp} {100 * now.done:3.0f} % {what(now)}, {clock(now.elapsed)} elapsed{left}",
            file=sys.stderr,
            flush=True,
        )

    return tell


def what(now: Progress) -> str:
    """Return the stage, what it tries, and the smallest error so far."""
    trial = f" ({now.trial})" if now.trial else ""
    error = "" if now.error is None else f", best error {now.error:.4g}"
    return f"{now.stage}{trial}{error}"


def clock(seconds: float) -> str:
    """Return a time as minutes and seconds, or hours, minutes and seconds.

    Examples
    --------
    >>> clock(75.4), clock(3700.0)
    ('1:15', '1:01:40')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
