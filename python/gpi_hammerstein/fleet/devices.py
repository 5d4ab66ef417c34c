"""The devices of a table: which records belong to which device, and which record is judged.

A device is judged by its latest record that has a result, so that a device with many records does not weigh
more than one with a single record. A record without a device is a device of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.columns import USED, wrong_columns
from gpi_hammerstein.fleet.dates import days_of
from gpi_hammerstein.fleet.figures import Figure, figures
from gpi_hammerstein.fleet.robust import Array

Places = NDArray[np.int64]

SHOWN = 3
"""Refused dates that a note quotes."""


@dataclass(frozen=True)
class Fleet:
    """A table of records, and what is known of its devices.

    Attributes
    ----------
    table
        The columns of `gpi-fleet/1`.
    names
        The name of each device.
    of_record
        The device of each record, shape (records,).
    latest
        The record by which each device is judged, shape (devices,); -1 for a device without a result.
    days
        The date of each record in days since 1970, shape (records,); NaN if it is unknown.
    figures
        The figures of the records.
    notes
        What was left out, as sentences.
    """

    table: pl.DataFrame
    names: list[str]
    of_record: Places
    latest: Places
    days: Array
    figures: list[Figure]
    notes: list[str]

    @property
    def judged(self) -> Places:
        """The devices that have a result."""
        return np.flatnonzero(self.latest >= 0)

    def of_devices(self, figure: Figure) -> tuple[Array, Array]:
        """Return a figure and its standard deviations for the devices that have a result.

        Parameters
        ----------
        figure
            One of `figures`.

        Returns
        -------
        tuple of ndarray
            Both of shape (judged devices,), in the figure's unit.
        """
        records = self.latest[self.judged]
        return figure.values[records], figure.std[records]

    def column(self, name: str) -> list[Any]:
        """Return a column for the devices that have a result."""
        return self.table[name].gather(self.latest[self.judged]).to_list()


def fleet_of(table: pl.DataFrame) -> Fleet:
    """Return the devices and figures of a table.

    Parameters
    ----------
    table
        The table of `batch`.

    Returns
    -------
    Fleet
        The devices, in the order of their first records.

    Raises
    ------
    ParameterError
        A column is missing or has another type.

    Examples
    --------
    >>> from gpi_hammerstein.fleet import row
    >>> known = {"device": "A", "verdict": "explained"}
    >>> rows = [known | {"file": f"{name}.csv", "name": name} for name in ("a", "b")]
    >>> fleet = fleet_of(row.table([dict.fromkeys(row.COLUMNS) | one for one in rows]))
    >>> fleet.names, fleet.latest.tolist()
    (['A'], [1])
    """
    wrong = wrong_columns(table)
    if wrong:
        raise ParameterError(f"`table`: {wrong}; give the table of `batch`")
    table = table.select(USED)
    days, refused = days_of(table["date"])
    places: dict[tuple[str, int], int] = {}
    names: list[str] = []
    of_record = []
    for record, (device, name, file) in enumerate(table.select("device", "name", "file").iter_rows()):
        key = (device, -1) if device else ("", record)
        if key not in places:
            places[key] = len(names)
            names.append(visible(device or name or file or f"record {record}"))
        of_record.append(places[key])
    owners = np.array(of_record, dtype=np.int64)
    latest = np.full(len(names), -1, dtype=np.int64)
    known = (table["error"].is_null() & table["verdict"].is_not_null()).to_numpy()
    # unknown dates are the earliest; of equal dates, the last row counts
    for record in np.argsort(np.where(np.isfinite(days), days, -np.inf), kind="stable"):
        if known[record]:
            latest[owners[record]] = record
    own, notes = figures(table)
    return Fleet(table, names, owners, latest, days, own, [*_refused(refused), *notes])


def _refused(dates: Sequence[str]) -> list[str]:
    if not dates:
        return []
    quoted = ", ".join(f"`{visible(text[:40])}`" for text in dates[:SHOWN])
    return [
        f"{len(dates)} {'date is' if len(dates) == 1 else 'dates are'} left out, because only ISO 8601 is "
        f"read, such as 2026-03-02: {quoted}" + (", .." if len(dates) > SHOWN else "")
    ]
