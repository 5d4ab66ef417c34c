"""The tables of two fleets: one value for each device of everything that is compared."""

import os
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from gpi_hammerstein._native import DataError
from gpi_hammerstein.fleet.reading import read_fleet as read_table

USED = (
    *("device", "effects", "sizes", "rms_after", "noise_floor", "unit", "error"),
    *("resonance_hz", "damping", "sensitivity", "hysteresis_width"),
)
"""The columns of `gpi-fleet/1` that are used here."""

RATIO = "rms_after / noise_floor"
PLAIN = {RATIO: "", "sensitivity": "", "hysteresis_width": "", "resonance_hz": "Hz", "damping": ""}
"""The figures that every table has, with their units."""

Device = tuple[str, Any]


@dataclass(frozen=True)
class Fleet:
    """One value for each device: the median of its records that have a result.

    Attributes
    ----------
    values
        For each figure the value of each device; a record without a device is one of its own.
    units
        The unit of each figure.
    effects
        The effects of each device: those of at least half of its records.
    records, failed
        The number of rows, and of those without a result.
    unit
        The unit of the outputs.
    """

    values: Mapping[str, Mapping[Device, float]]
    units: Mapping[str, str]
    effects: Mapping[Device, frozenset[str]]
    records: int
    failed: int
    unit: str

    @property
    def named(self) -> set[Device]:
        """The devices that have a name."""
        return {device for device in self.effects if device[0] == "device"}


def fleet_of(table: str | os.PathLike[str] | pl.DataFrame) -> Fleet:
    """Return the values of a table of `gpi batch`.

    Parameters
    ----------
    table
        The table, or its Parquet file.

    Returns
    -------
    Fleet
        One value for each device.

    Raises
    ------
    DataError
        The file is no table of `gpi batch`, its outputs have several units, or no record has a result.
    """
    name = "the table" if isinstance(table, pl.DataFrame) else os.fspath(table)
    frame = table if isinstance(table, pl.DataFrame) else read_table(table)
    missing = [column for column in USED if column not in frame.columns]
    if missing:
        raise DataError(f"{name}: is no table of `gpi batch`; it has no column {', '.join(missing)}")
    good = frame.filter(pl.col("error").is_null())
    if not len(good):
        raise DataError(f"{name}: no record has a result")
    units = sorted(set(good["unit"].drop_nulls().to_list()))
    if len(units) > 1:
        raise DataError(
            f"{name}: the outputs are in {' and '.join(unit or 'no unit' for unit in units)}; compare the "
            "rows of one unit"
        )
    rows = list(good.select(USED).iter_rows(named=True))
    found: dict[str, dict[Device, list[float]]] = {figure: defaultdict(list) for figure in PLAIN}
    known = dict(PLAIN)
    effects: dict[Device, list[set[str]]] = defaultdict(list)
    for number, row in enumerate(rows):
        device = ("record", number) if row["device"] is None else ("device", row["device"])
        effects[device].append(set(row["effects"] or ()))
        for figure, unit, value in _figures(row):
            if known.setdefault(figure, unit) != unit:
                raise DataError(
                    f"{name}: {figure} is in {known[figure]} and in {unit}; compare rows of one unit"
                )
            if value is not None and np.isfinite(value):
                found.setdefault(figure, defaultdict(list))[device].append(value)
    return Fleet(
        values={
            figure: {device: float(np.median(own)) for device, own in devices.items()}
            for figure, devices in found.items()
        },
        units=known,
        effects={device: _usual(own) for device, own in effects.items()},
        records=len(frame),
        failed=len(frame) - len(good),
        unit=units[0] if units else "",
    )


def _figures(row: Mapping[str, Any]) -> Iterator[tuple[str, str, float | None]]:
    """Yield the name, the unit and the value of everything that is compared of one record."""
    floor = row["noise_floor"]
    yield RATIO, "", row["rms_after"] / floor if floor and row["rms_after"] is not None else None
    for name, unit in PLAIN.items():
        if name != RATIO:
            yield name, unit, row[name]
    times: Counter[tuple[str, str]] = Counter()
    for own in row["sizes"] or ():
        key = (own["effect"], own["name"])
        # the second line of the mains, the second measured column
        label = f"{own['effect']}[{times[key]}]" if times[key] else own["effect"]
        times[key] += 1
        # without a standard deviation, the data do not determine it
        yield f"{label}.{own['name']}", own["unit"] or "", None if own["std"] is None else own["value"]


def _usual(effects: list[set[str]]) -> frozenset[str]:
    counts = Counter(name for own in effects for name in own)
    return frozenset(name for name, count in counts.items() if 2 * count >= len(effects))
