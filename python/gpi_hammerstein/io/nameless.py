"""The roles of columns in a file without names, from what they contain."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein.io.columns import Column
from gpi_hammerstein.io.tables import Table

# Parts of the median step by which the steps of a clock may differ: rounded stamps differ by one digit.
JITTER = 0.2
ROLES = {"t": "the time in s", "u": "the input", "y": "the output"}


def name_by_content(table: Table) -> Table:
    """Name the columns of a file without names where their number leaves no choice.

    A first column that increases in equal steps is the time. If two other columns move, the first one is the
    input and the second one is the output, which is the usual order. In any other case, the columns keep
    their numbers and a user has to name them.

    Parameters
    ----------
    table
        Columns that are called ``column1``, ``column2``, ...

    Returns
    -------
    Table
        The columns with the names ``t``, ``u``, ``y``; their headers are still the numbers. A note says
        which.

    Examples
    --------
    >>> from gpi_hammerstein.io.columns import parse_header
    >>> names = [parse_header(f"column{place}") for place in (1, 2, 3)]
    >>> columns = dict(zip(names, np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]), strict=True))
    >>> [column.name for column in name_by_content(Table("demo", columns, {})).headers()]
    ['t', 'u', 'y']
    """
    columns = list(table.columns)
    clock = columns[:1] if columns and is_clock(table.columns[columns[0]]) else []
    moving = [c for c in columns if c not in clock and np.ptp(table.columns[c]) > 0]
    note = "the file has no line of names: the columns are numbered"
    if len(moving) != 2:
        return replace(table, notes=[*table.notes, f"{note} column1, column2, .."])
    named = dict(zip(["t"] * len(clock) + ["u", "y"], [*clock, *moving], strict=True))
    renamed = {
        old: Column(old.header, name, "s" if name == "t" else "", old.array) for name, old in named.items()
    }
    what = ", ".join(f"{old.header} is taken as {ROLES[name]}" for name, old in named.items())
    return replace(
        table,
        columns={renamed.get(column, column): samples for column, samples in table.columns.items()},
        notes=[*table.notes, f"{note}, {what}; --time, --input and --output name others"],
    )


def is_clock(samples: NDArray[np.float64]) -> bool:
    """Return whether samples increase in equal steps.

    Parameters
    ----------
    samples
        The samples, (samples,).

    Examples
    --------
    >>> is_clock(np.array([0.0, 0.1, 0.2])), is_clock(np.array([0.0, 1.0, 0.0]))
    (True, False)
    """
    steps = np.diff(samples)
    usual = float(np.median(steps)) if steps.size else 0.0
    return bool(usual > 0 and np.abs(steps - usual).max() <= JITTER * usual)
