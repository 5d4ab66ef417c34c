"""Reading of the table of a fleet from a Parquet file."""

import io
import os
from pathlib import Path

import polars as pl

from gpi_hammerstein._native import DataError
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.columns import USED, wrong_columns
from gpi_hammerstein.fleet.row import VERSION
from gpi_hammerstein.io.apart import is_possible, read_apart
from gpi_hammerstein.io.boundary import File, opened
from gpi_hammerstein.io.forked import require_threads

MARK = VERSION.partition("/")[0].encode() + b"/"
"""What the metadata of every version contain."""
MAGIC = b"PAR1"
# Bytes that a cell takes at least.
CELL = 8


def is_fleet(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is the table of a batch, of any version.

    The metadata at the end of the file are searched as bytes. No library reads them, because the file can be
    any file.

    Parameters
    ----------
    path
        A file.

    Returns
    -------
    bool
        False for a file that does not exist or that is not Parquet.

    Examples
    --------
    >>> is_fleet("no-such-file.parquet")
    False
    """
    file = Path(path)
    if file.suffix.lower() != ".parquet" or not file.is_file():
        return False
    with opened(file, "Parquet") as content:
        return MARK in _metadata(content)


def read_fleet(path: str | os.PathLike[str]) -> pl.DataFrame:
    """Read the table of a batch.

    Parameters
    ----------
    path
        The file ``fleet.parquet``.

    Returns
    -------
    polars.DataFrame
        The columns of `gpi-fleet/1`.

    Raises
    ------
    DataError
        The file cannot be read, is no table of a batch, or has another version.

    Examples
    --------
    >>> table = read_fleet("fleet/fleet.parquet")  # doctest: +SKIP
    """
    file = Path(path)
    with opened(file, "Parquet") as content:
        if MARK not in _metadata(content):
            raise DataError(f"{file}: is no table of `gpi batch`; give its fleet.parquet")
        if is_possible():
            # a corrupt file can end the process that reads it: another one tries first
            read_apart(file.absolute())
        require_threads()
        schema = str(pl.read_parquet_metadata(io.BytesIO(content.data)).get("schema", ""))
        if schema != VERSION:
            raise DataError(f"{file}: has the schema {visible(schema[:40])}; this version reads {VERSION}")
        return _table(content)


def _metadata(content: File) -> bytes:
    """Return the metadata at the end of a Parquet file; nothing if it is another file."""
    data = content.data
    if len(data) < 12 or not data.endswith(MAGIC):
        return b""
    size = int.from_bytes(data[-8:-4], "little")
    return data[max(len(data) - 8 - size, 0) : -8]


def _table(content: File) -> pl.DataFrame:
    """Return the columns that are used, within the limits of the file."""
    there = pl.read_parquet_schema(io.BytesIO(content.data))
    content.allowance.check_columns(len(there))
    wrong = wrong_columns(pl.DataFrame(schema=dict(there)))
    if wrong:
        raise DataError(f"{content.path}: {wrong}")
    row = CELL * len(USED)
    rows = content.allowance.left() // row + 1
    table = pl.read_parquet(io.BytesIO(content.data), columns=list(USED), n_rows=rows)
    content.allowance.spend(table.height * row + int(table.estimated_size()))
    return table
