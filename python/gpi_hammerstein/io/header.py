"""The header of a text file: column names, units, and the text above them."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from gpi_hammerstein.io.columns import is_unit

# A number with a decimal comma, or an integer.
DECIMAL_COMMA = r"(?i)^[+-]?(\d*(,\d*)?(e[+-]?\d+)?|nan|inf)$"

# Largest number of lines in which the header is searched.
DEEPEST = 200
SEPARATORS = ",;\t"
COMMENTS = ("#", "%")


@dataclass(frozen=True)
class Header:
    """The names of the columns, and the rows below them."""

    names: list[str]
    separator: str
    rows: str
    notes: list[str]
    """Descriptions of the lines that were skipped."""
    is_named: bool = True
    """Whether the names stand in the file; otherwise they are numbers of columns."""


@dataclass(frozen=True)
class _Start:
    """Where a table starts, as indices of lines."""

    names: int | None
    """The line of names; None for a table without names."""
    first: int
    """The first row of numbers."""
    headers: list[str]
    separator: str
    has_units: bool = False
    """Whether the line below the names contains the units."""

    def top(self) -> int:
        """Return the first line that belongs to the table."""
        return self.first if self.names is None else self.names


def find_header(text: str) -> Header | None:
    r"""Find the line of the column names.

    This is the last line above the first row of numbers that has the same number of cells. If there is a line
    of units between the names and the numbers, each unit is appended to its name, as in ``u [V]``. Lines
    above the names are skipped. Empty lines and lines that start with ``#`` or ``%`` are ignored, except that
    such a line directly above the numbers can contain the names. If the file contains several tables, each
    below its own names, the one with the most rows is taken. Without names, columns are ``column1``, ...

    Parameters
    ----------
    text
        The text of the file, separated by commas, semicolons, tabs, or else spaces.

    Returns
    -------
    Header
        The names. None for a file without text.

    Examples
    --------
    >>> found = find_header("Scope 3\ntime,drive\ns,V\n0,1.5\n")
    >>> found.names, found.rows, found.notes
    (['time [s]', 'drive [V]'], '0,1.5', ['skipped 1 line above the names, first `Scope 3`'])
    """
    *head, rest = f"{text}\n".split("\n", DEEPEST)
    lines: list[str] = []
    remarks: dict[int, str] = {}
    for line in head:
        if line.startswith(COMMENTS):
            remarks[len(lines)] = line
        elif line.strip():
            lines.append(line.rstrip("\r"))
    if not lines:
        return None
    numbers = _first_numbers(lines, SEPARATORS)
    if numbers is None:  # perhaps each row contains a text
        numbers = _first_numbers(lines, SEPARATORS, alone=False)
    if numbers is None and any(_are_numbers(line.split()) for line in lines):
        return find_header("\n".join("\t".join(line.split()) for line in text.split("\n")))
    if numbers is None:
        # without a row of numbers, take the first line as names: the error is then found in the rows below
        separator = max(SEPARATORS, key=lines[0].count)
        rows = "\n".join([*lines[1:], rest]).strip("\r\n")
        return Header(_cells(lines[0], separator), separator, rows, [])
    starts = _starts(lines, *numbers, remarks)
    ends = [*(start.top() for start in starts[1:]), len(lines)]
    sizes = [end - start.first for start, end in zip(starts, ends, strict=True)]
    if rest.strip():
        sizes[-1] = DEEPEST
    chosen = max(range(len(starts)), key=lambda place: (sizes[place], place))
    start, end = starts[chosen], ends[chosen]
    below = lines[start.first if start.names is None else start.names + 1 : end]
    if start.has_units:
        below = below[1:]
    if chosen == len(starts) - 1:
        below.append(rest)
    return Header(
        start.headers,
        start.separator,
        "\n".join(below).strip("\r\n"),
        _notes(lines, start, len(starts)),
        is_named=start.names is not None or not _is_numbered(start.headers),
    )


def _notes(lines: Sequence[str], start: _Start, tables: int) -> list[str]:
    """Return descriptions of the lines that are skipped."""
    notes, above = [], start.top()
    if above > 0:
        what = "1 line" if above == 1 else f"{above} lines"
        notes.append(f"skipped {what} above the names, first `{lines[0].strip()[:60]}`")
    if tables > 1:
        notes.append(
            f"the file contains {tables} tables; only the longest one is read, with the columns "
            f"{', '.join(start.headers)}"
        )
    return notes


def _starts(lines: Sequence[str], first: int, separator: str, remarks: dict[int, str]) -> list[_Start]:
    """Return where tables start: at the first row of numbers, and wherever names stand above numbers."""
    starts = [_start(lines, first, separator, remarks)]
    for place in range(first + 1, len(lines)):
        found = _first_numbers(lines[place : place + 1], SEPARATORS)
        if found is None or _first_numbers(lines[place - 1 : place], SEPARATORS) is not None:
            continue
        start = _start(lines, place, found[1], {})
        if start.names is not None and start.names > starts[-1].first and sum(map(bool, start.headers)) > 1:
            starts.append(start)
    return starts


def _start(lines: Sequence[str], first: int, separator: str, remarks: dict[int, str]) -> _Start:
    """Return the names of the table whose first row of numbers is `first`."""
    row = _cells(lines[first], separator)

    def named(line: str) -> list[str] | None:
        """Return the names in a line that has as many cells as the row."""
        cells = _cells(line, separator)
        same = len(cells) == len(row) or _width(cells) == _width(row)
        if not same or not any(cells) or any(map(is_number, filter(None, cells))):
            return None
        return [*cells, *[""] * (len(row) - len(cells))]

    if first in remarks and (found := named(remarks[first].lstrip("#% \t"))):
        return _Start(None, first, found, separator)
    # Rows with some text can stand between the names and the first row of numbers alone; names contain no
    # number.
    names = first - 1
    while (
        names > 0 and len(cells := _cells(lines[names], separator)) == len(row) and any(map(is_number, cells))
    ):
        names -= 1
    if names > 0 and _are_units(_cells(lines[names], separator)) and (found := named(lines[names - 1])):
        units = [cell.strip("[]() ") for cell in _cells(lines[names], separator)]
        units += [""] * (len(found) - len(units))
        headers = [f"{name} [{unit}]" if unit else name for name, unit in zip(found, units, strict=False)]
        return _Start(names - 1, first, headers, separator, has_units=True)
    if names >= 0 and (found := named(lines[names])):
        return _Start(names, first, found, separator)
    return _Start(None, first, [f"column{place}" for place in range(1, len(row) + 1)], separator)


def _is_numbered(headers: Sequence[str]) -> bool:
    return list(headers) == [f"column{place}" for place in range(1, len(headers) + 1)]


def _first_numbers(lines: Sequence[str], separators: str, alone: bool = True) -> tuple[int, str] | None:
    """Find the first line with two or more numbers, and their separator; `alone`: and without text."""
    for place, line in enumerate(lines):
        for separator in separators:
            if _are_numbers(_cells(line, separator), alone):
                return place, separator
    return None


def _are_numbers(cells: Sequence[str], alone: bool = True) -> bool:
    if not alone:
        return sum(map(is_number, cells)) > 1
    return len(cells) > 1 and any(cells) and all(not cell or is_number(cell) for cell in cells)


def _width(cells: Sequence[str]) -> int:
    """Return the number of cells without empty ones at the end."""
    return max((place for place, cell in enumerate(cells, 1) if cell), default=0)


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def is_number(cell: str) -> bool:
    """Return whether a cell contains a number, with a decimal point or a decimal comma."""
    try:
        float(cell)
    except ValueError:
        return bool(cell) and re.fullmatch(DECIMAL_COMMA, cell) is not None
    return True


def _are_units(cells: Sequence[str]) -> bool:
    known = [is_unit(cell.strip("[]() ")) for cell in cells if cell.strip("[]() ")]
    return bool(known) and all(known)
