"""Reading of Excel workbooks."""

import datetime
import io
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.extras import load
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.text import table_of_text

# The memory of one cell as text.
CELL_BYTES = 24


def read_xlsx(file: File) -> list[Table]:
    """Read the sheet of an Excel workbook that has the most rows with numbers.

    The cells are converted to text, so that names, units and lines above them are found as in a CSV file.
    Formulas have the value that Excel has stored.

    Parameters
    ----------
    file
        The workbook (.xlsx or .xlsm).

    Returns
    -------
    list of Table
        One table. A note names the sheet if there are several.

    Raises
    ------
    DataError
        The workbook has no numbers, has more cells than the limits, or the package openpyxl is missing.

    Examples
    --------
    >>> with opened(Path("record.xlsx"), "XLSX") as file:  # doctest: +SKIP
    ...     read_xlsx(file)[0].headers()
    """
    openpyxl = load("openpyxl", "xlsx", file)
    with zipfile.ZipFile(io.BytesIO(file.data)) as archive:
        file.allowance.check_columns(len(archive.infolist()))
        for member in archive.infolist():
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise ValueError(f"`{member.filename}` is compressed by a method that Excel does not use")
            # The size that a member states also limits what is decompressed.
            file.allowance.spend(member.file_size)
    book = openpyxl.load_workbook(io.BytesIO(file.data), read_only=True, data_only=True, keep_links=False)
    sheets: dict[str, list[str]] = {}
    counts: dict[str, int] = {}
    for sheet in book.worksheets:
        sheet.reset_dimensions()  # the size that a sheet claims can be anything
        sheets[sheet.title], counts[sheet.title] = _lines(sheet.iter_rows(values_only=True), file)
    if not any(counts.values()):
        raise DataError(
            f"{file.path}: no sheet contains rows of numbers; a record has one row for each sample"
        )
    chosen = max(counts, key=lambda title: counts[title])
    table = table_of_text("\n".join(sheets[chosen]), file)
    if len(sheets) > 1:
        note = f"the sheet `{chosen}` is read, which has the most rows with numbers of {len(sheets)} sheets"
        table = replace(table, notes=[note, *table.notes])
    return [table]


def _lines(rows: Iterable[Iterable[Any]], file: File) -> tuple[list[str], int]:
    """Return the rows as text, and how many of them have two or more numbers."""
    table: list[list[str]] = []
    numbers = width = 0
    for row in rows:
        cells = list(row)
        while cells and cells[-1] is None:
            cells.pop()
        file.allowance.check_columns(len(cells))
        file.allowance.spend(CELL_BYTES * (len(cells) + 1))
        if cells:
            numbers += sum(isinstance(cell, int | float) for cell in cells) > 1
            texts = list(_texts(cells))
            # A workbook stores a text once, and any number of cells can refer to it.
            file.allowance.spend(sum(map(len, texts)))
            table.append(texts)
            width = max(width, len(cells))
    file.allowance.spend(width * len(table))
    return ["\t".join(row + [""] * (width - len(row))) for row in table], numbers


def _texts(cells: Iterable[Any]) -> Iterator[str]:
    """Return cells as text without characters that separate cells or lines."""
    for cell in cells:
        if isinstance(cell, datetime.datetime):
            yield cell.strftime("%Y-%m-%d %H:%M:%S.%f")
        elif isinstance(cell, datetime.time):
            yield cell.strftime("%H:%M:%S.%f")
        elif isinstance(cell, datetime.timedelta):
            yield repr(cell.total_seconds())
        elif isinstance(cell, bool):
            yield str(int(cell))
        else:
            yield "" if cell is None else " ".join(str(cell).replace('"', "'").split())
