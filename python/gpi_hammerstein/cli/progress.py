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
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from gpi_hammerstein._native import Progress

Tell = Callable[[Progress], None]

# Seconds between two lines of the log: a search of some minutes gives a page of them.
LOG_SECONDS = 5.0
# Characters of a line of the bar in front of the words: bar, percent, two times, and the spaces between them.
BESIDE = 12 + 4 + 8 + 12 + 4


@contextmanager
def progress_bar(*, log: bool = False) -> Iterator[Tell | None]:
    """Yield a function that shows progress on stderr; None if stderr is no terminal and no log is wanted."""
    errors = Console(stderr=True)
    if log:
        yield lines()
    elif errors.file.isatty():  # `is_terminal` is also True if FORCE_COLOR is set, as in notebooks
        with bar(errors) as tell:
            yield tell
    else:
        yield None


@contextmanager
def bar(errors: Console) -> Iterator[Tell]:
    """Yield a function that draws one bar for all work."""
    columns = (
        BarColumn(bar_width=12),
        TaskProgressColumn(),
        # the clock goes on between two reports, and stops when the fraction first is 1, which is at the end
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]:<9}"),
        TextColumn("{task.description}"),
    )
    with Bar(*columns, console=errors, transient=True) as shown:
        task = shown.add_task("", total=1.0, left="")

        def tell(now: Progress) -> None:
            left = "" if now.remaining is None else f"{clock(now.remaining)} left"
            words = ", ".join(filter(None, (best(now), stage(now))))
            # a line that is too long would take the place of the bar
            room = max(errors.width - BESIDE, 1)
            words = words if len(words) <= room else words[: room - 1] + "…"
            shown.update(task, completed=now.done, left=left, description=escape_markup(words))

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
        words = ", ".join(filter(None, (stage(now), best(now), f"{clock(now.elapsed)} elapsed{left}")))
        print(f"{time.strftime('%H:%M:%S')} {100 * now.done:3.0f} % {words}", file=sys.stderr, flush=True)

    return tell


def stage(now: Progress) -> str:
    """Return the stage and what it tries."""
    return f"{now.stage} ({now.trial})" if now.trial else now.stage


def best(now: Progress) -> str:
    """Return the smallest error so far."""
    return "" if now.error is None else f"best error {now.error:.4g}"


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
