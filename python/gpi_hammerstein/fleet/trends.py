r"""Trends of the figures over the dates of the records.

The test is that of Mann (1945, Econometrica 13) and Kendall: S is the number of pairs of records of which the
later one has the larger value, minus the number of the other pairs. The slope is the median of the slopes of
all pairs (Theil, 1950; Sen, 1968, J. Am. Stat. Assoc. 63). Outliers change neither much.

Records of the same device are not independent. Two trends of the fleet are therefore computed:

- between devices: each device counts once, with its median date and the median of its values. This trend
  is that of production, or of the equipment that measures.
- within devices: S and its variance are summed over the devices, so that only records of the same device
  are compared (the regional Kendall test of Helsel and Frans, 2006, Environ. Sci. Technol. 40). This trend is
  that of ageing.

A device with at least `FEWEST` dates has a trend of its own. For three dates, no order is improbable enough
to be significant; the trend within devices needs only two dates of each of many devices.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy import special

from gpi_hammerstein.fleet.devices import Fleet, fleet_of
from gpi_hammerstein.fleet.distances import FALSE_SHARE, false_discovery
from gpi_hammerstein.fleet.figures import Figure, Scaled, scaled
from gpi_hammerstein.fleet.robust import Array

FEWEST = 3
"""Smallest number of dates for the trend of a device."""
FEWEST_OF_FLEET = 10
"""Smallest number of devices, or of pairs of records of the same device, for a trend of the fleet."""
MOST_POINTS = 1500
"""Points of which all pairs give a slope; of more, as many are taken in even steps over their order."""
YEAR = 365.25
KINDS = ("between devices", "within devices", "device")
COLUMNS = {
    "kind": pl.String,
    "device": pl.String,
    "figure": pl.String,
    "slope": pl.Float64,
    "unit": pl.String,
    "dates": pl.Int64,
    "p": pl.Float64,
    "q": pl.Float64,
}


@dataclass(frozen=True)
class Trend:
    """The trend of one figure.

    Attributes
    ----------
    kind
        One of `KINDS`.
    device
        The device; -1 for the fleet.
    figure
        The figure.
    slope
        Per year: in the figure's unit, or a part of its value for `relative`.
    relative
        Whether the figure is compared on a logarithmic scale.
    dates
        Number of points.
    p, q
        Of the test, and corrected for all trends of the fleet or all trends of devices.
    """

    kind: str
    device: int
    figure: Figure
    slope: float
    relative: bool
    dates: int
    p: float
    q: float = np.nan

    @property
    def significant(self) -> bool:
        """Whether q is at most `FALSE_SHARE`."""
        return self.q <= FALSE_SHARE

    @property
    def unit(self) -> str:
        """The unit of the slope."""
        return "1/year" if self.relative or not self.figure.unit else f"{self.figure.unit}/year"


def fleet_trends(table: pl.DataFrame) -> pl.DataFrame:
    """Return how the figures of a fleet, and of its devices, change with the dates of the records.

    Parameters
    ----------
    table : polars.DataFrame
        The table of `batch`, or of ``fleet.parquet``. Its column ``date`` has ISO 8601 dates or date-times;
        other texts count as unknown.

    Returns
    -------
    polars.DataFrame
        One row for each trend: ``kind`` is "between devices", "within devices" or "device"; ``device``, null
        for the fleet; ``figure``; ``slope`` in ``unit``, where 1/year is a part of the value of a positive
        figure; ``dates``, a count; ``p`` of the test of Mann and Kendall, and ``q``, corrected for the number
        of trends, both pure numbers.

    Raises
    ------
    ParameterError
        A column of `gpi-fleet/1` is missing.

    Examples
    --------
    >>> from gpi_hammerstein.fleet import row
    >>> rows = [
    ...     dict.fromkeys(row.COLUMNS)
    ...     | {"file": f"{i}.csv", "device": f"D{i % 5}", "verdict": "explained", "effects": []}
    ...     | {"date": f"2026-{1 + i // 5:02}-01", "sensitivity": 1.2 * 0.99 ** (i // 5) + 0.001 * (i % 5)}
    ...     for i in range(40)
    ... ]
    >>> trends = gpi.fleet_trends(row.table(rows))
    >>> [(kind, round(slope, 2)) for kind, slope in trends.select("kind", "slope").head(1).iter_rows()]
    [('within devices', -0.12)]
    """
    fleet = fleet_of(table)
    rows = [
        {
            "kind": one.kind,
            "device": fleet.names[one.device] if one.device >= 0 else None,
            "figure": one.figure.key,
            "slope": one.slope,
            "unit": one.unit,
            "dates": one.dates,
            "p": one.p,
            "q": one.q,
        }
        for one in trends(fleet)
    ]
    return pl.DataFrame(rows, schema=COLUMNS, orient="row")


def trends(fleet: Fleet) -> list[Trend]:
    """Return all trends, those of the fleet first, the least probable first.

    Parameters
    ----------
    fleet
        The devices.

    Returns
    -------
    list of Trend
        Only trends of figures that do not stay the same.
    """
    of_fleet, of_devices = [], []
    for figure in fleet.figures:
        usable = np.isfinite(figure.values) & np.isfinite(fleet.days)
        if not figure.judged or not usable.any():
            continue
        own = scaled(np.where(usable, figure.values, np.nan), figure.std)
        order = np.flatnonzero(usable)[np.argsort(fleet.of_record[usable], kind="stable")]
        ends = np.flatnonzero(np.diff(fleet.of_record[order])) + 1
        places = np.split(order, ends)
        groups = [(int(fleet.of_record[at[0]]), fleet.days[at], own.values[at]) for at in places]
        of_fleet += [_between(figure, own, groups), _within(figure, own, groups)]
        of_devices += [_of_device(figure, own, *one) for one in groups]
    return [*_corrected(of_fleet), *_corrected(of_devices)]


Group = tuple[int, Array, Array]


def _between(figure: Figure, own: Scaled, groups: list[Group]) -> Trend | None:
    days = np.array([np.median(one[1]) for one in groups])
    values = np.array([np.median(one[2]) for one in groups])
    if len(days) < FEWEST_OF_FLEET or np.ptp(days) == 0 or np.ptp(values) == 0:
        return None
    p = _p_value(days, values)
    return Trend("between devices", -1, figure, slope_of(days, values), own.logarithmic, len(days), p)


def _within(figure: Figure, own: Scaled, groups: list[Group]) -> Trend | None:
    total, variance, slopes, dates = 0.0, 0.0, [], 0
    for _, days, values in groups:
        if np.ptp(days) == 0:
            continue
        days, values = _thinned(days, values)
        first, second = np.triu_indices(len(days), 1)
        step, rise = days[second] - days[first], values[second] - values[first]
        total += float((np.sign(step) * np.sign(rise)).sum())
        variance += _variance(days, values)
        slopes.append(rise[step != 0] / step[step != 0])
        dates += len(days)
    if variance <= 0 or sum(map(len, slopes)) < FEWEST_OF_FLEET:
        return None
    # the correction for continuity, as in the test of Mann and Kendall
    z = max(abs(total) - 1, 0.0) / np.sqrt(variance)
    slope = float(np.median(np.concatenate(slopes))) * YEAR
    return Trend("within devices", -1, figure, slope, own.logarithmic, dates, float(2 * special.ndtr(-z)))


def _of_device(figure: Figure, own: Scaled, device: int, days: Array, values: Array) -> Trend | None:
    if len(np.unique(days)) < FEWEST or np.ptp(values) == 0:
        return None
    p = _p_value(days, values)
    return Trend("device", device, figure, slope_of(days, values), own.logarithmic, len(days), p)


def _p_value(days: Array, values: Array) -> float:
    """Return the p-value of Kendall's test: exact for few points without equal dates or values."""
    from scipy import stats  # takes long to import

    return float(stats.kendalltau(days, values).pvalue)


def _variance(days: Array, values: Array) -> float:
    """Return the variance of S of one device; equal dates and values make it smaller (Kendall, 1975)."""

    def ties(x: Array, weight: Callable[[Array], Array]) -> float:
        return float(weight(np.unique(x, return_counts=True)[1].astype(np.float64)).sum())

    n = float(len(days))
    full = n * (n - 1) * (2 * n + 5)
    both = [ties(x, lambda t: t * (t - 1) * (2 * t + 5)) for x in (days, values)]
    pairs = [ties(x, lambda t: t * (t - 1)) for x in (days, values)]
    triples = [ties(x, lambda t: t * (t - 1) * (t - 2)) for x in (days, values)]
    rest = pairs[0] * pairs[1] / (2 * n * (n - 1))
    if n > 2:
        rest += triples[0] * triples[1] / (9 * n * (n - 1) * (n - 2))
    return (full - sum(both)) / 18 + rest


def slope_of(days: Array, values: Array) -> float:
    """Return the median slope of all pairs, per year.

    Parameters
    ----------
    days, values
        Dates in days and values on the scale of comparison, shape (points,).

    Returns
    -------
    float
        In the figure's unit; on a logarithmic scale, a part of the value.
    """
    days, values = _thinned(days, values)
    first, second = np.triu_indices(len(days), 1)
    step = days[second] - days[first]
    slopes = (values[second] - values[first])[step != 0] / step[step != 0]
    return float(np.median(slopes)) * YEAR


def _thinned(days: Array, values: Array) -> tuple[Array, Array]:
    if len(days) <= MOST_POINTS:
        return days, values
    chosen = np.argsort(days, kind="stable")[np.linspace(0, len(days) - 1, MOST_POINTS).astype(np.int64)]
    return days[chosen], values[chosen]


def _corrected(found: list[Trend | None]) -> list[Trend]:
    known = [one for one in found if one is not None]
    q = false_discovery(np.array([one.p for one in known]))
    corrected = [
        Trend(one.kind, one.device, one.figure, one.slope, one.relative, one.dates, one.p, float(own))
        for one, own in zip(known, q, strict=True)
    ]
    return sorted(corrected, key=lambda one: (one.p, one.figure.key))
