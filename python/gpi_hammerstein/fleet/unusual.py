"""The devices that stand out in a fleet, and why, in words."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from gpi_hammerstein.fleet.devices import Fleet, fleet_of
from gpi_hammerstein.fleet.distances import FALSE_SHARE, NOTABLE, Distances, distances
from gpi_hammerstein.fleet.rare import reasons

MOST_REASONS = 6
"""Figures that are named for one device, those that are farthest from the fleet."""
TOGETHER = 3
"""Figures that are named for an unusual combination."""
COLUMNS: dict[str, Any] = {
    "device": pl.String,
    "name": pl.String,
    "file": pl.String,
    "date": pl.String,
    "why": pl.List(pl.String),
    "p": pl.Float64,
    "q": pl.Float64,
    "distance": pl.Float64,
}


@dataclass(frozen=True)
class Unusual:
    """A device that stands out.

    Attributes
    ----------
    place
        Its place among the devices that have a result.
    why
        Sentences.
    """

    place: int
    why: list[str]


def unusual_devices(table: pl.DataFrame) -> pl.DataFrame:
    """Return the devices of a fleet that stand out, and why.

    A device stands out if its figures are far from those of the fleet, or if it has an effect or a verdict
    that few devices have. A device is judged by its latest record that has a result.

    Parameters
    ----------
    table : polars.DataFrame
        The table of `batch`, or of ``fleet.parquet``.

    Returns
    -------
    polars.DataFrame
        One row for each device that stands out, the least probable first: ``device``, ``name``, ``file`` and
        ``date`` of its record; ``why``, a list of sentences; ``p``, the probability that a usual device has
        figures as far from the fleet's, and ``q``, the same corrected for the number of devices, both pure
        numbers; ``distance``, the joint distance of its figures in robust standard deviations, without unit.
        Null is unknown.

    Raises
    ------
    ParameterError
        A column of `gpi-fleet/1` is missing.

    Notes
    -----
    Figures, distances and constants are described on the page "Judge a fleet" of the documentation.

    Examples
    --------
    >>> import polars as pl
    >>> from gpi_hammerstein.fleet import row
    >>> random = np.random.default_rng(1)
    >>> rows = [
    ...     dict.fromkeys(row.COLUMNS)
    ...     | {"file": f"{i}.csv", "name": f"{i}", "device": f"D{i}", "verdict": "explained", "effects": []}
    ...     | {"resonance_hz": random.normal(800, 8), "sensitivity": random.normal(1.2, 0.02)}
    ...     for i in range(100)
    ... ]
    >>> rows[7]["effects"] = ["backlash"]
    >>> rows[3]["sensitivity"] = 1.0
    >>> for device, why in gpi.unusual_devices(row.table(rows)).select("device", "why").iter_rows():
    ...     print(device, why)
    D3 ["sensitivity 17 % below the fleet's median (13 robust standard deviations)"]
    D7 ['has backlash, which no other of 100 devices has']
    """
    fleet = fleet_of(table)
    known = distances(fleet)
    found = unusual(fleet, known)
    places = [one.place for one in found]
    devices = [int(fleet.judged[place]) for place in places]
    records = [int(fleet.latest[device]) for device in devices]
    return pl.DataFrame(
        {
            "device": [fleet.names[device] for device in devices],
            **{name: [fleet.table[name][record] for record in records] for name in ("name", "file", "date")},
            "why": [one.why for one in found],
            **{name: _numbers(getattr(known, name), places) for name in ("p", "q", "distance")},
        },
        schema=COLUMNS,
    )


def unusual(fleet: Fleet, known: Distances) -> list[Unusual]:
    """Return the devices that stand out, the least probable first.

    Parameters
    ----------
    fleet
        The devices.
    known
        The distances of their figures.

    Returns
    -------
    list of Unusual
        Those by figures in the order of p, then those by effects and verdicts, the rarest first.
    """
    found = []
    for place, own in enumerate(reasons(fleet)):
        far = bool(known.q[place] <= FALSE_SHARE)
        why = [*(_figures(known, place) if far else []), *own.strong]
        if why:
            order = (known.p[place], 0.0) if far else (2.0, own.share)
            found.append((order, Unusual(place, [*why, *own.weak])))
    return [one for _, one in sorted(found, key=lambda pair: (pair[0], pair[1].place))]


def two_digits(value: float) -> str:
    """Return a positive number with two significant digits, and without an exponent if it is not huge.

    Parameters
    ----------
    value
        The number.

    Examples
    --------
    >>> two_digits(6.34), two_digits(123.4), two_digits(1.2e9)
    ('6.3', '123', '1.2e+09')
    """
    return f"{value:.0f}" if 99.5 <= value < 1e5 else f"{value:.2g}"


def _numbers(values: np.ndarray, places: list[int]) -> list[float | None]:
    return [float(values[place]) if np.isfinite(values[place]) else None for place in places]


def _figures(known: Distances, place: int) -> list[str]:
    """Return why the figures of a device are far from the fleet's."""
    z = np.nan_to_num(known.z[place])
    far = np.array(
        [value if figure.upward else abs(value) for value, figure in zip(z, known.figures, strict=True)]
    )
    order = np.argsort(-far, kind="stable")
    notable = [int(one) for one in order if far[one] >= NOTABLE][:MOST_REASONS]
    if notable:
        return [_sentence(known, place, one) for one in notable]
    own = known.contributions[place]
    together = [int(one) for one in np.argsort(-own, kind="stable") if own[one] > 0][:TOGETHER]
    names = [known.figures[one].label for one in together]
    if len(names) < 2:
        return [_sentence(known, place, int(order[0]))]
    return [
        f"the combination of {', '.join(names[:-1])} and {names[-1]} is unusual (robust distance "
        f"{known.distance[place]:.3g}), although none of them alone is"
    ]


def _sentence(known: Distances, place: int, at: int) -> str:
    """Return how a figure of a device differs from the fleet's."""
    figure, own = known.figures[at], known.scaled[at]
    size = f"({two_digits(abs(known.z[place, at]))} robust standard deviations)"
    unit = f" {figure.unit}".rstrip()
    value, median = own.values[place], own.median
    if not own.logarithmic:
        side = "above" if value > median else "below"
        return f"{figure.label} {value:.4g}{unit}, {side} the fleet's median of {median:.4g}{unit} {size}"
    if own.sign * own.original[place] <= 0:
        return (
            f"{figure.label} {own.original[place]:.4g}{unit}, not of the sign of the fleet's median of "
            f"{median:.4g}{unit}"
        )
    ratio = float(np.exp(np.clip(value - np.log(abs(median)), -700, 700)))
    if 0.5 <= ratio <= 2:
        side = "above" if ratio > 1 else "below"
        return f"{figure.label} {two_digits(abs(100 * (ratio - 1)))} % {side} the fleet's median {size}"
    return f"{figure.label} {ratio:.3g} times the fleet's median {size}"
