"""Tables of numbers: what every format is converted to."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError
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

    def require_numbers(self, columns: Sequence[Column]) -> None:
        """Reject text, NaN and infinite samples in `columns`.

        Raises
        ------
        DataError
            The message states the column and the rows, which are counted from 0.
        """
        for column in columns:
            if column in self.text:
                raise DataError(
                    f"{self.source}: column `{column.header}` holds {self.text[column]} "
                    "(the rows below the names are counted from 0); correct or remove such rows; if the "
                    "column is no input, output or time, ignore it (covariate=[], --covariate none)"
                )
            rows = np.flatnonzero(~np.isfinite(self.columns[column]))
            if rows.size:
                shown = ", ".join(map(str, rows[:5])) + (", .." if rows.size > 5 else "")
                raise DataError(
                    f"{self.source}: column `{column.header}` has {rows.size} NaN, infinite or empty "
                    f"samples, in rows {shown} (counted from 0 below the names); correct these rows, or "
                    "remove them and read the rest with --resample auto (resample=True)"
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
    for series in frame:
        column = parse_header(series.name)
        if series.dtype == pl.String:
            cells = series.str.strip_chars()
            cells = cells.set(cells == "", None)
            # a comma within a cell is a decimal comma, because the separator is then another character
            if cells.str.contains(DECIMAL_COMMA).fill_null(True).all():
                cells = cells.str.replace(",", ".", literal=True)
            numbers = cells.cast(pl.Float64, strict=False)
            wrong = (numbers.is_null() & cells.is_not_null()).arg_true()
            if len(wrong):
                row = int(wrong[0])
                text[column] = f"text, first `{shortened(cells[row])}` in row {row}"
                continue
        elif series.dtype.is_numeric() or series.dtype == pl.Boolean:
            numbers = series.cast(pl.Float64)
        else:
            text[column] = f"values of the type {series.dtype}"
            continue
        columns[column] = numbers.fill_null(float("nan")).to_numpy().astype(np.float64)
    return Table(source, columns, text)


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
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text[:61])
    return shown if len(shown) <= 60 else f"{shown[:60]}.."
