"""What the script of the page shows, as one JSON object: devices, records and figures."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.devices import Fleet
from gpi_hammerstein.fleet.figures import Figure
from gpi_hammerstein.fleet.unusual import Unusual
from gpi_hammerstein.report.fleet.axis import Axis
from gpi_hammerstein.report.fleet.tables import shortened
from gpi_hammerstein.report.packing import MOST, Array, packed

# Bytes of a packed number: these are 32 bit floating point numbers.
SIZE = 4


def page_data(
    fleet: Fleet,
    axes: Sequence[tuple[Figure, Axis, Array]],
    found: Sequence[Unusual],
    links: Mapping[int, str],
) -> str:
    """Return the data of the page as the text of a script element.

    Parameters
    ----------
    fleet
        The devices.
    axes
        The figures with their axes, and their values on the scale of the axis for all records.
    found
        The devices that stand out.
    links
        Addresses by device.

    Returns
    -------
    str
        JSON in ASCII. It contains no ``<``, so that no text in it can end the element or begin another one.
    """
    why = {int(fleet.judged[one.place]): one.why for one in found}
    columns = ("verdict", "effects", "file", "date")
    rows = [dict(zip(columns, row, strict=True)) for row in fleet.table.select(columns).iter_rows()]
    records = np.bincount(fleet.of_record, minlength=len(fleet.names))
    last = np.full(len(fleet.names), -1)
    last[fleet.of_record] = np.arange(len(fleet.of_record))  # of a device without a result
    data: dict[str, Any] = {
        "devices": [
            described(name, rows[record if record >= 0 else last[device]], record >= 0)
            | {
                "record": int(record),
                "records": int(records[device]),
                "why": [shortened(text) for text in why.get(device, [])],
                "link": links.get(device),
            }
            for device, (name, record) in enumerate(zip(fleet.names, fleet.latest, strict=True))
        ],
        "owners": packed(fleet.of_record.astype(np.float64), SIZE),
        "days": known_only(fleet.days),
        "figures": [
            {
                "key": figure.key,
                "label": figure.label,
                "unit": figure.unit,
                "effect": figure.effect,
                "logarithmic": axis.scaled.logarithmic,
                "sign": axis.scaled.sign,
                "low": axis.low,
                "high": axis.high,
            }
            | known_only(values)
            for figure, axis, values in axes
        ],
    }
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def described(name: str, row: Mapping[str, Any], known: bool) -> dict[str, Any]:
    """Return what is known of a device from the record that represents it."""
    return {
        "name": shortened(name),
        "verdict": visible(row["verdict"] or "") if known else "no result",
        "effects": ", ".join(visible(one or "") for one in row["effects"] or []) if known else "",
        "file": shortened(row["file"] or ""),
        "date": shortened(row["date"] or ""),
    }


def known_only(values: Array) -> dict[str, Any]:
    """Return the known values of an array, and the places where they are, as packed numbers."""
    places = np.flatnonzero(np.isfinite(values))
    return {
        "places": packed(places.astype(np.float64), SIZE),
        "values": packed(np.clip(values[places], -MOST, MOST), SIZE),
    }
