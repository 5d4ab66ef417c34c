"""Reading of CSV and Parquet files."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.io.columns import Column, parse_header
from gpi_hammerstein.io.forked import require_threads
from gpi_hammerstein.io.header import DECIMAL_COMMA, find_header, is_number

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """Columns of equal length: the samples of one experiment."""

    source: str
    columns: dict[Column, Array]
    text: dict[Column, tuple[int, str]]
    """Columns that contain text: the first row with text, and this text."""
    rate: float | None = None
    """The sampling rate in Hz, if the file contains it."""
    warmup: int = 0
    """Number of samples at the start that are warm-up."""
    notes: list[str] = field(default_factory=list)
    """Notes on lines of the file that were skipped."""

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
                row, cell = self.text[column]
                raise DataError(
                    f"{self.source}: column `{column.header}` holds text, first `{visible(cell)}` in row "
                    f"{row} (the rows below the names are counted from 0); correct or remove such rows; if "
                    "the column is no input, output or time, ignore it (covariate=[], --covariate none)"
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


def read_csv(path: Path) -> Table:
    """Read a CSV file, which may be compressed with gzip.

    Parameters
    ----------
    path
        The file, separated by commas, semicolons or tabs, in UTF-8 or Latin-1. The names are the last line
        above the numbers, or the line above a line of units. Lines above the names and lines that start with
        ``#`` are skipped. If the separator is not a comma, numbers may have a decimal comma.

    Returns
    -------
    Table
        The columns. Empty cells are NaN.

    Raises
    ------
    DataError
        The file is empty, has no header, or has rows with more cells than the header.

    Examples
    --------
    >>> read_csv(Path("record.csv")).headers()  # doctest: +SKIP
    """
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            import gzip

            data = gzip.decompress(data)
        text = decoded(data)
    except (OSError, EOFError) as error:
        raise DataError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from error
    except UnicodeDecodeError:
        raise DataError(f"{path}: not a text file; a CSV record is text, in UTF-8 or Latin-1") from None
    header = find_header(text)
    if header is None:
        raise DataError(f"{path}: the file is empty; a record has a header line and one row for each sample")
    names = header.names
    if all(map(is_number, names)):
        first = header.separator.join(names)[:60]
        raise DataError(f"{path}: no header line (row 0 reads `{first}`); add one such as `t_s,u_V,y_um`")
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise DataError(f"{path}: {names.count(repeated[0])} columns are named `{repeated[0]}`; rename them")
    if not header.rows:
        raise DataError(
            f"{path}: no rows below the header line `{header.separator.join(names)[:60]}`; a record has one "
            "row for each sample"
        )
    require_threads()
    try:
        frame = pl.read_csv(
            io.BytesIO(header.rows.encode()),
            separator=header.separator,
            has_header=False,
            new_columns=names,
            comment_prefix="#",
            infer_schema=False,
        )
    except pl.exceptions.PolarsError as error:
        raise DataError(f"{path}: cannot be read as CSV: {str(error).splitlines()[0]}") from error
    return replace(from_frame(frame, str(path)), notes=header.notes)


def read_parquet(path: Path) -> Table:
    """Read a Parquet file.

    Parameters
    ----------
    path
        The file, with columns of numbers and names such as ``t_s``, ``u_V``, ``y_um``.

    Returns
    -------
    Table
        The columns. Null values are NaN.

    Raises
    ------
    DataError
        The file is empty or is not a Parquet file.

    Examples
    --------
    >>> read_parquet(Path("record.parquet")).headers()  # doctest: +SKIP
    """
    require_threads()
    try:
        frame = pl.read_parquet(io.BytesIO(path.read_bytes()))
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error
    except pl.exceptions.PolarsError as error:
        raise DataError(f"{path}: cannot be read as Parquet: {str(error).splitlines()[0]}") from error
    return from_frame(frame, str(path))


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
    {Column(header='u_V', name='u', unit='V', array='u_V'): (1, 'x')}
    """
    if frame.height == 0:
        raise DataError(
            f"{source}: the file is empty: a header without rows; a record has one row for each sample"
        )
    columns: dict[Column, Array] = {}
    text: dict[Column, tuple[int, str]] = {}
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
                text[column] = (int(wrong[0]), str(cells[int(wrong[0])]))
                continue
        elif series.dtype.is_numeric() or series.dtype == pl.Boolean:
            numbers = series.cast(pl.Float64)
        else:
            text[column] = (0, str(series[0]))
            continue
        columns[column] = numbers.fill_null(float("nan")).to_numpy().astype(np.float64)
    return Table(source, columns, text)


def decoded(data: bytes) -> str:
    """Return the text of a file, in UTF-8 or else in Latin-1, which some data loggers write."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        if b"\0" in data:
            raise
        return data.decode("latin-1")
