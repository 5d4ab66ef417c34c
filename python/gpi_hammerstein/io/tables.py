"""Tables of numbers: what every format is converted to."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.io.calendar_time import clocks_as_seconds
from gpi_hammerstein.io.columns import Column, parse_header
from gpi_hammerstein.io.header import DECIMAL_COMMA

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """Columns of equal length: the samples of one experiment."""

    source: str
    columns: dict[Column, Array]
    text: dict[Column, str]
    """Columns that do not contain numbers: what they contain, and where."""
    rate: float | None = None
    """The sampling rate in Hz, if the file contains it."""
    warmup: int = 0
    """Number of samples at the start that are warm-up."""
    notes: list[str] = field(default_factory=list)
    """Notes on lines of the file that were skipped."""
    left_out: dict[str, str] = field(default_factory=dict)
    """Names of the arrays of the file that are no columns, and what they contain."""

    def headers(self) -> list[Column]:
        """Return all columns."""
        return [*self.columns, *self.text]

    def unusable(self) -> dict[Column, str]:
        """Return the columns that contain something else than numbers, and what."""
        found = dict(self.text)
        for column, samples in self.columns.items():
            bad = int(np.count_nonzero(~np.isfinite(samples)))
            if bad:
                empty = "no numbers" if bad == len(samples) else f"{bad} NaN, infinite or empty samples"
                found[column] = empty
        return found

    def complete_rows(self, columns: Sequence[Column]) -> NDArray[np.bool_]:
        """Return which rows have a number in each of `columns`."""
        rows = len(next(iter(self.columns.values())))
        whole = np.ones(rows, dtype=bool)
        for column in columns:
            if column in self.columns:
                whole &= np.isfinite(self.columns[column])
        return whole

    def require_numbers(self, columns: Sequence[Column], *, has_clock: bool = False) -> None:
        """Reject text, NaN and infinite samples in `columns`.

        Raises
        ------
        DataError
            The message states the column, the rows, which are counted from 0, and what to do. `has_clock`
            says whether time stamps allow to leave rows out.
        """
        for column in columns:
            if column in self.text:
                raise DataError(
                    f"{self.source}: column `{column.header}` holds {self.text[column]} "
                    "(the rows below the names are counted from 0); correct or remove such rows"
                )
            rows = np.flatnonzero(~np.isfinite(self.columns[column]))
            if rows.size == len(self.columns[column]):
                raise DataError(
                    f"{self.source}: column `{column.header}` contains no numbers; name another column "
                    "(--input, --output, --time)"
                )
            if rows.size:
                shown = ", ".join(map(str, rows[:5])) + (", .." if rows.size > 5 else "")
                advice = "correct these rows"
                if has_clock:
                    advice += (
                        ", or leave them out with --resample auto (resample=True): it interpolates over a "
                        "few rows, and cuts the record where more are missing"
                    )
                raise DataError(
                    f"{self.source}: column `{column.header}` has {rows.size} NaN, infinite or empty "
                    f"samples, in rows {shown} (counted from 0 below the names); {advice}"
                )

    def stack(self, columns: Sequence[Column]) -> Array:
        """Return the columns as one array, (samples, columns)."""
        rows = len(next(iter(self.columns.values())))
        return np.column_stack([np.empty((rows, 0)), *(self.columns[column] for column in columns)])


def from_frame(frame: pl.DataFrame, source: str) -> Table:
    """Convert a data frame to a table. A column with cells that are not numbers is a text column.

    Parameters
    ----------
    frame
        Columns of numbers, or of text that can be converted to numbers.
    source
        Name of the file, for messages.

    Returns
    -------
    Table
        The columns, with numbers as float64.

    Raises
    ------
    DataError
        The frame has no rows.

    Examples
    --------
    >>> from_frame(pl.DataFrame({"u_V": ["1", "x"]}), "demo").text
    {Column(header='u_V', name='u', unit='V', array='u_V'): 'text, first `x` in row 1'}
    """
    if frame.height == 0:
        raise DataError(
            f"{source}: the file is empty: a header without rows; a record has one row for each sample"
        )
    columns: dict[Column, Array] = {}
    text: dict[Column, str] = {}
    frame, clocks = clocks_as_seconds(frame)
    frame, wrong = _numbers_of_texts(frame)
    numeric = [name for name, kind in frame.schema.items() if kind.is_numeric() or kind == pl.Boolean]
    # All columns at once, because a call for each of many columns is slow.
    numbers = frame.select(pl.col(numeric).cast(pl.Float64).fill_null(float("nan")))
    there = dict(zip(numbers.columns, numbers.get_columns(), strict=True))
    for name, kind in frame.schema.items():
        column = parse_header(name)
        if name in clocks:
            column = replace(column, unit="s")
        if name in there:
            columns[column] = there[name].to_numpy().astype(np.float64)
        else:
            text[column] = wrong.get(name, f"values of the type {kind}")
    return Table(source, columns, text)


def _numbers_of_texts(frame: pl.DataFrame) -> tuple[pl.DataFrame, dict[str, str]]:
    """Convert the columns of text that contain only numbers.

    Returns the frame, and the first text of each column that could not be converted.
    """
    cells = frame.select(pl.col(pl.String).str.strip_chars())
    cells = cells.select(pl.when(pl.all() != "").then(pl.all()))
    if not cells.width:
        return frame, {}
    # A comma within a cell is a decimal comma, because the separator is then another character.
    commas = cells.select(pl.all().str.contains(DECIMAL_COMMA).fill_null(True).all()).row(0)
    replaced = [name for name, found in zip(cells.columns, commas, strict=True) if found]
    numbers = cells.with_columns(pl.col(replaced).str.replace(",", ".", literal=True))
    numbers = numbers.select(pl.all().cast(pl.Float64, strict=False))
    before, after = cells.null_count().row(0), numbers.null_count().row(0)
    wrong = {}
    for name, empty, lost in zip(cells.columns, before, after, strict=True):
        if lost > empty:
            row = int((numbers[name].is_null() & cells[name].is_not_null()).arg_true()[0])
            wrong[name] = f"text, first `{shortened(cells[name][row])}` in row {row}"
    return frame.with_columns(numbers.drop(list(wrong))), wrong


def shortened(text: str) -> str:
    """Return the start of a text in one line, for messages.

    Parameters
    ----------
    text
        The text, which can contain a whole file.

    Examples
    --------
    >>> shortened("no number")
    'no number'
    """
    shown = visible(text[:61])
    return shown if len(shown) <= 60 else f"{shown[:60]}.."
