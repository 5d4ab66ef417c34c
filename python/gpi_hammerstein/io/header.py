"""The header of a text file: column names, units, and the text above them."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from gpi_hammerstein.io.columns import UNITS

# A number with a decimal comma, or an integer.
DECIMAL_COMMA = r"(?i)^[+-]?(\d*(,\d*)?(e[+-]?\d+)?|nan|inf)$"

# Largest number of lines in which the header is searched.
DEEPEST = 200


@dataclass(frozen=True)
class Header:
    """The names of the columns, and the rows below them."""

    names: list[str]
    separator: str
    rows: str
    notes: list[str]
    """Descriptions of the lines that were skipped."""


def find_header(text: str) -> Header | None:
    r"""Find the line of the column names.

    This is the last line above the first row of numbers that has the same number of cells. If there is a line
    of units between the names and the numbers, each unit is appended to its name, as in ``u [V]``. Lines
    above the names are skipped. Empty lines and lines that start with ``#`` are ignored.

    Parameters
    ----------
    text
        The text of the file, separated by commas, semicolons or tabs.

    Returns
    -------
    Header
        The names; they are numbers if the file has no names. None for a file without text.

    Examples
    --------
    >>> found = find_header("Scope 3\ntime,drive\ns,V\n0,1.5\n")
    >>> found.names, found.rows, found.notes
    (['time [s]', 'drive [V]'], '0,1.5', ['skipped 1 line above the names, first `Scope 3`'])
    """
    *head, rest = f"{text}\n".split("\n", DEEPEST)
    lines = [line.rstrip("\r") for line in head if line.strip() and not line.startswith("#")]
    if not lines:
        return None
    found = _first_numbers(lines)
    # without a row of numbers, take the first line as names: the error is then found in the rows below
    place, separator = found or (1, max(",;\t", key=lines[0].count))
    width = len(_cells(lines[place], separator)) if place < len(lines) else 0
    above = [_cells(line, separator) for line in lines[:place]]
    units: list[str] = []
    names = place - 1
    if found and names > 0 and len(above[names - 1]) == width and _are_units(above[names]):
        units = [cell.strip("[]() ") for cell in above[names]]
        names -= 1
    is_header = found and place > 0 and len(above[names]) == width and not any(map(is_number, above[names]))
    if not is_header:
        names, units = 0, []
    headers = _cells(lines[names], separator)
    if units:
        headers = [f"{name} [{unit}]" if unit else name for name, unit in zip(headers, units, strict=True)]
    below = lines[names + (2 if units else 1) :]
    notes = []
    if names > 0:
        what = "1 line" if names == 1 else f"{names} lines"
        notes.append(f"skipped {what} above the names, first `{lines[0].strip()[:60]}`")
    return Header(headers, separator, "\n".join([*below, rest]).strip("\r\n"), notes)


def _first_numbers(lines: Sequence[str]) -> tuple[int, str] | None:
    """Find the first line with two or more numbers, and their separator."""
    for place, line in enumerate(lines):
        for separator in ",;\t":
            cells = _cells(line, separator)
            if len(cells) > 1 and any(cells) and all(not cell or is_number(cell) for cell in cells):
                return place, separator
    return None


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
    known = [cell.strip("[]() ") in UNITS for cell in cells if cell.strip("[]() ")]
    return bool(known) and all(known)
