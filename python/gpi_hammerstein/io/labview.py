"""Reading of LabVIEW measurement files: .lvm (text) and .tdms.

An .lvm file is a text with a header, and one segment for each measurement::

    LabVIEW Measurement
    Separator<TAB>Tab
    Decimal_Separator<TAB>.
    X_Columns<TAB>One
    ***End_of_Header***

    Channels<TAB>2
    Samples<TAB>100<TAB>100
    Y_Unit_Label<TAB>Volts<TAB>Micrometers
    Delta_X<TAB>1.0E-3<TAB>1.0E-3
    ***End_of_Header***
    X_Value<TAB>Drive<TAB>Sensor<TAB>Comment
    0.000000<TAB>1.000000<TAB>2.000000
"""

import io
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.arrays import from_arrays
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.columns import parse_header
from gpi_hammerstein.io.extras import load
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.text import decoded, table_of_text

END = "***End_of_Header***"
HEADER = "Channels"
FIRST_LINE = "LabVIEW Measurement"
UNITS = {"volts": "V", "volt": "V", "amps": "A", "amperes": "A", "meters": "m", "millimeters": "mm"}
UNITS |= {"micrometers": "um", "nanometers": "nm", "seconds": "s", "degrees": "deg", "newtons": "N"}
COMMENT = "comment"


def read_lvm(file: File) -> list[Table]:
    """Read a LabVIEW measurement file (.lvm).

    Parameters
    ----------
    file
        The file.

    Returns
    -------
    list of Table
        One table for each segment. If the file has no column of x values, the rate follows from ``Delta_X``.

    Raises
    ------
    DataError
        The file is no text, or has no numbers.

    Examples
    --------
    >>> with opened(Path("record.lvm"), "LVM") as file:  # doctest: +SKIP
    ...     read_lvm(file)[0].headers()
    """
    text = decoded(file.data)
    if text is None:
        raise DataError(f"{file.path}: not a text file; an .lvm file is text")
    if not text.lstrip().startswith(FIRST_LINE):
        return [table_of_text(text, file)]  # LabVIEW also writes .lvm files without a header
    general, *segments = text.split(END)
    settings = _settings(general.split("\n"), "\t")
    separator = "," if settings.get("Separator", [""])[0].lower() == "comma" else "\t"
    settings = _settings(general.split("\n"), separator)
    if settings.get("Decimal_Separator", ["."])[0] == "," and separator == ",":
        raise ValueError("its separator is also its decimal separator")
    tables = []
    about: dict[str, list[str]] = {}
    for segment in segments:
        lines = segment.strip("\n").split("\n")
        # A header begins with `Channels`; it ends the rows of the segment before it.
        edge = next((k for k, line in enumerate(lines) if line.split(separator)[0] == HEADER), len(lines))
        rows = [line for line in lines[:edge] if line.strip()]
        if rows and about:
            tables.append(_segment(rows, about, separator, file))
        about = _settings(lines[edge:], separator)
    if not tables:
        raise DataError(f"{file.path}: no rows below `{END}`; a record has one row for each sample")
    return [
        replace(table, source=f"{table.source} (segment {place})") if len(tables) > 1 else table
        for place, table in enumerate(tables)
    ]


def _settings(lines: Sequence[str], separator: str) -> dict[str, list[str]]:
    """Return the entries of a header: names and values."""
    cells = [[cell.strip() for cell in line.split(separator)] for line in lines if line.strip()]
    return {name: values for name, *values in cells if name}


def _segment(rows: Sequence[str], about: dict[str, list[str]], separator: str, file: File) -> Table:
    """Return the table of one segment."""
    names, *samples = [row.split(separator) for row in rows]
    units = iter(_symbols(about.get("Y_Unit_Label", [])))
    headers, kept = [], []
    for place, name in enumerate(names):
        if name.strip().lower() == COMMENT:
            continue
        is_clock = name.strip().lower().startswith("x_value")
        unit = (
            ("s" if about.get("X_Dimension", ["Time"])[0] == "Time" else "") if is_clock else next(units, "")
        )
        shown = parse_header(name)
        headers.append(f"{shown.header} [{unit}]" if unit and not shown.unit else shown.header)
        kept.append(place)
    clocks = [place for place, name in enumerate(headers) if name.lower().startswith("x_value")]
    used = [place for place in range(len(headers)) if place not in clocks[1:]]
    cells = [[row[kept[place]] if kept[place] < len(row) else "" for place in used] for row in samples]
    if not any(any(cell.strip() for cell in row) for row in cells):
        raise DataError(f"{file.path}: no rows below `{END}`; a record has one row for each sample")
    # Without x values, the column is empty or missing.
    if clocks and all(not row[used.index(clocks[0])].strip() for row in cells):
        gone = used.index(clocks[0])
        cells, used = [row[:gone] + row[gone + 1 :] for row in cells], used[:gone] + used[gone + 1 :]
    shown_names = "\t".join(headers[place].replace("\t", " ") for place in used)
    if len(used) == 1:  # one column has no separator by which it is recognised as a table
        shown_names, cells = f"{shown_names}\tunused", [[*row, "0"] for row in cells]
    table = table_of_text("\n".join([shown_names, *("\t".join(row) for row in cells)]), file)
    step = _number(about.get("Delta_X", [""])[0])
    has_clock = any(column.name.lower().startswith("x_value") for column in table.columns)
    return table if has_clock or not step else replace(table, rate=1.0 / step)


def _symbols(labels: Sequence[str]) -> list[str]:
    """Return the symbols of units that LabVIEW writes as words."""
    return [UNITS.get(label.lower(), label) for label in labels]


def _number(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return 0.0


def read_tdms(file: File) -> list[Table]:
    """Read a TDMS file.

    Parameters
    ----------
    file
        The file. Channels of one group are the columns of a table; if groups have the same channels, each
        group is an experiment, else only the group with the most values is read. The property
        ``wf_increment`` gives the rate, ``unit_string`` the units.

    Returns
    -------
    list of Table
        One table for each experiment.

    Raises
    ------
    DataError
        The file has no channels of numbers, is larger than allowed, or the package npTDMS is missing.

    Examples
    --------
    >>> with opened(Path("record.tdms"), "TDMS") as file:  # doctest: +SKIP
    ...     read_tdms(file)[0].headers()
    """
    nptdms = load("nptdms", "tdms", file)
    groups: list[tuple[str, dict[str, Any]]] = []
    with nptdms.TdmsFile.open(io.BytesIO(file.data)) as content:
        found = [(group.name, group.channels()) for group in content.groups()]
        file.allowance.check_columns(sum(len(channels) for _, channels in found))
        for name, channels in found:
            arrays: dict[str, Any] = {}
            for channel in channels:
                if not len(channel):
                    continue
                file.allowance.spend(8 * len(channel))
                arrays[_tdms_header(channel)] = channel[:]
                step = channel.properties.get("wf_increment")
                if isinstance(step, int | float) and step > 0:
                    arrays["dt"] = step
            if arrays:
                groups.append((name, arrays))
    if not groups:
        raise DataError(f"{file.path}: no channel contains samples")
    size = max(sum(getattr(values, "size", 1) for values in arrays.values()) for _, arrays in groups)
    chosen = next(a for _, a in groups if sum(getattr(v, "size", 1) for v in a.values()) == size)
    tables = []
    for name, arrays in groups:
        if arrays.keys() != chosen.keys():
            continue
        for table in from_arrays(arrays, file):
            tables.append(
                replace(table, source=f"{table.source} (group {name})") if len(groups) > 1 else table
            )
    ignored = [name for name, arrays in groups if arrays.keys() != chosen.keys()]
    if ignored:
        note = f"other groups are left out, because they have other channels: {', '.join(ignored)}"
        tables[0] = replace(tables[0], notes=[*tables[0].notes, note])
    return tables


def _tdms_header(channel: Any) -> str:
    unit = str(channel.properties.get("unit_string", "") or "").strip()
    name = str(channel.name)
    [unit] = _symbols([unit])
    return f"{name} [{unit}]" if unit and not parse_header(name).unit else name
