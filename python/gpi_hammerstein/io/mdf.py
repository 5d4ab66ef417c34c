"""Reading of measurement files of the ASAM standard MDF, version 3 and 4 (.mf4, .mdf, .dat of MDF)."""

import io
from typing import Any

import numpy as np

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.arrays import from_arrays
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.columns import parse_header
from gpi_hammerstein.io.extras import load
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.vocabulary import score


def read_mdf(file: File) -> list[Table]:
    """Read one channel group of an MDF file.

    A channel group has one clock. The group is read whose names speak most for an input and an output; see
    :mod:`~gpi_hammerstein.io.vocabulary`. Of equal groups, the one with the most samples is read.

    Parameters
    ----------
    file
        The file.

    Returns
    -------
    list of Table
        One table, with the stamps of the group's clock as ``t_s``. A note names the groups that are left out.

    Raises
    ------
    DataError
        The file has no samples, is larger than allowed, or the package asammdf is missing.

    Examples
    --------
    >>> with opened(Path("record.mf4"), "MDF") as file:  # doctest: +SKIP
    ...     read_mdf(file)[0].headers()
    """
    asammdf = load("asammdf", "mdf", file)
    with asammdf.MDF(io.BytesIO(file.data)) as content:
        groups = [
            (_merit(group), int(group.channel_group.cycles_nr), place)
            for place, group in enumerate(content.groups)
        ]
        merit, samples, chosen = max(groups, default=(0, 0, 0))
        if not samples:
            raise DataError(f"{file.path}: no channel contains samples")
        channels = content.groups[chosen].channels
        file.allowance.check_columns(len(channels))
        file.allowance.spend(8 * samples * (len(channels) + 1))
        arrays: dict[str, Any] = {}
        master = content.masters_db.get(chosen)
        for place, channel in enumerate(channels):
            if place == master:
                continue
            signal = content.get(group=chosen, index=place)
            values = np.asarray(signal.samples)
            if values.dtype.kind in "fiub" and values.ndim == 1:
                arrays[_header(channel.name, signal.unit)] = values
            arrays.setdefault("t_s", np.asarray(signal.timestamps, dtype=np.float64))
    tables = from_arrays(arrays, file)
    others = [str(place) for _, count, place in groups if place != chosen and count]
    if others:
        tables[0].notes.append(
            f"channel group {chosen} is read; other groups with other clocks are left out: "
            f"{', '.join(others)}"
        )
    return tables


def _merit(group: Any) -> int:
    """Return how strongly the names of a group speak for an input and an output."""
    columns = [parse_header(channel.name) for channel in group.channels]
    return sum(max((score(column, role)[0] for column in columns), default=0) for role in ("input", "output"))


def _header(name: str, unit: str | None) -> str:
    return f"{name} [{unit}]" if unit and not parse_header(name).unit else name
