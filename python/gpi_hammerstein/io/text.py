"""Reading of CSV and Parquet files."""

import codecs
import io
from collections import Counter
from dataclasses import replace

import numpy as np
import polars as pl

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.columns import parse_header
from gpi_hammerstein.io.compressed import GZIP, inflate
from gpi_hammerstein.io.forked import require_threads
from gpi_hammerstein.io.header import find_header
from gpi_hammerstein.io.nameless import name_by_content
from gpi_hammerstein.io.tables import Table, from_frame
from gpi_hammerstein.io.vocabulary import score

GZIP_MAGIC = b"\x1f\x8b"
FLOAT64_BYTES = 8


def read_csv(file: File) -> list[Table]:
    """Read a CSV file, which may be compressed with gzip.

    Parameters
    ----------
    file
        The file, separated by commas, semicolons, tabs or spaces, in UTF-8, Latin-1, or UTF-16 with a byte
        order mark. The names are the last line above the numbers, or the line above a line of units. Lines
        above the names and lines that start with ``#`` are skipped. If the separator is not a comma, numbers
        may have a decimal comma.

    Returns
    -------
    list of Table
        One table with the columns. Empty cells are NaN.

    Raises
    ------
    DataError
        The file is empty, has more columns than the limit, or has rows with more cells than
        the header.

    Examples
    --------
    >>> with opened(Path("record.csv"), "CSV") as file:  # doctest: +SKIP
    ...     read_csv(file)[0].headers()
    """
    path, data = file.path, file.data
    if data.startswith(GZIP_MAGIC):
        data = inflate(data, file.allowance, GZIP)
    text = decoded(data)
    if text is None:
        raise DataError(
            f"{path}: not a text file; a CSV record is text, in UTF-8, Latin-1, or UTF-16 with a byte order "
            "mark"
        )
    return [table_of_text(text, file)]


def table_of_text(text: str, file: File) -> Table:
    r"""Convert the text of a table.

    Parameters
    ----------
    text
        Names and rows; see :func:`~gpi_hammerstein.io.header.find_header`.
    file
        The file that contains the text.

    Returns
    -------
    Table
        The columns. Columns without a name and without numbers are dropped.

    Raises
    ------
    DataError
        As for :func:`read_csv`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from gpi_hammerstein.io.limits import Allowance
    >>> file = File(Path("demo"), b"", Allowance(Path("demo"), 0))
    >>> [column.name for column in table_of_text("t,u\n0,1\n", file).headers()]
    ['t', 'u']
    """
    path = file.path
    header = find_header(text)
    if header is None:
        raise DataError(f"{path}: the file is empty; a record has a header line and one row for each sample")
    file.allowance.check_columns(len(header.names))
    names, renamed = _unique(header.names, str(path))
    if not header.rows:
        raise DataError(
            f"{path}: no rows below the header line `{header.separator.join(names)[:60]}`; a record has one "
            "row for each sample"
        )
    require_threads()
    frame = pl.read_csv(
        io.BytesIO(header.rows.encode()),
        separator=header.separator,
        has_header=False,
        new_columns=names,
        comment_prefix="#",
        infer_schema=False,
    )
    table = from_frame(frame, str(path))
    nameless = {name for name, given in zip(names, header.names, strict=True) if not given}
    empty = [c for c in table.columns if c.header in nameless and not np.isfinite(table.columns[c]).any()]
    columns = {column: samples for column, samples in table.columns.items() if column not in empty}
    table = replace(table, columns=columns or table.columns, notes=[*header.notes, *renamed])
    return table if header.is_named else name_by_content(table)


def _unique(names: list[str], source: str) -> tuple[list[str], list[str]]:
    """Give columns without a name their number, and columns with the same name an addition.

    Two columns whose name is that of an input, an output or the time are refused, because nobody can tell
    which one is meant.
    """
    counts = Counter(name for name in names if name)
    for name, times in counts.items():
        if times > 1 and any(score(parse_header(name), role)[0] for role in ("time", "input", "output")):
            raise DataError(f"{source}: {times} columns are named `{name}`; rename them")
    found: dict[str, None] = {}
    for place, name in enumerate(names, 1):
        unique = name or f"column{place}"
        while unique in found or (unique != name and unique in counts):
            unique += f".{place}"
        found[unique] = None
    repeated = [name for name, times in counts.items() if times > 1]
    notes = [
        f"{counts[name]} columns are named `{name}`; a number was added to the others" for name in repeated
    ]
    return list(found), notes


def read_parquet(file: File) -> list[Table]:
    """Read a Parquet file.

    Parameters
    ----------
    file
        The file, with columns of numbers and names such as ``t_s``, ``u_V``, ``y_um``.

    Returns
    -------
    list of Table
        One table with the columns. Null values are NaN.

    Raises
    ------
    DataError
        The file is empty, or has more columns or numbers than the limits.

    Examples
    --------
    >>> with opened(Path("record.parquet"), "Parquet") as file:  # doctest: +SKIP
    ...     read_parquet(file)[0].headers()
    """
    require_threads()
    columns = len(pl.read_parquet_schema(io.BytesIO(file.data)))
    file.allowance.check_columns(columns)
    row = FLOAT64_BYTES * max(columns, 1)
    # One row more than allowed is enough to notice that there are too many.
    frame = pl.read_parquet(io.BytesIO(file.data), n_rows=file.allowance.left() // row + 1)
    file.allowance.spend(frame.height * row)
    for series in frame:
        if series.dtype == pl.String:  # a dictionary makes long texts out of a small file
            file.allowance.spend(int(series.str.len_bytes().sum()))
    return [from_frame(frame, str(file.path))]


def decoded(data: bytes) -> str | None:
    r"""Return the text of a file.

    Parameters
    ----------
    data
        The content, in UTF-8, in UTF-16 with a byte order mark, or else in Latin-1, which some data loggers
        write.

    Returns
    -------
    str
        The text, with lines that end with a newline character; None for data that is no text.

    Examples
    --------
    >>> decoded(b"u\r\n0")
    'u\n0'
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if "\0" in text:
        return None
    return text.replace("\r\n", "\n").replace("\r", "\n")
