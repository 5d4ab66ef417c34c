"""The figures over the dates of the records."""

from collections.abc import Sequence
from html import escape

import numpy as np

from gpi_hammerstein.fleet.dates import as_date
from gpi_hammerstein.fleet.figures import Figure
from gpi_hammerstein.fleet.robust import Array
from gpi_hammerstein.fleet.trends import YEAR, Trend
from gpi_hammerstein.report.fleet.axis import HEIGHT, LEFT, RIGHT, WIDTH, Axis, tick_labels
from gpi_hammerstein.report.fleet.distributions import title

TOP, BASE, LABELS = 8.0, 124.0, 143.0
MOST_POINTS = 2000
"""Points of a picture. Of more records, as many are drawn in even steps over their order."""


def over_dates(figure: Figure, axis: Axis, days: Array, trends: Sequence[Trend], key: int) -> str:
    """Return a figure over the dates as a figure element; nothing if there are too few dates.

    Parameters
    ----------
    figure
        The figure.
    axis
        Its axis, with the values of the records.
    days
        Dates in days, shape (records,); NaN is unknown.
    trends
        The trends of the fleet in this figure.
    key
        Number of the figure in the page.

    Returns
    -------
    str
        A ``figure`` element. The line is the trend of the fleet with the smallest q.
    """
    values = axis.scaled.values
    usable = np.flatnonzero(np.isfinite(values) & np.isfinite(days))
    if len(usable) < 3 or np.ptp(days[usable]) == 0:
        return ""
    first, last = float(days[usable].min()), float(days[usable].max())
    shown = usable
    if len(usable) > MOST_POINTS:
        order = usable[np.argsort(days[usable], kind="stable")]
        shown = order[np.linspace(0, len(order) - 1, MOST_POINTS).astype(np.int64)]
    points = "".join(
        f"M{x:.1f} {y:.1f}h0"
        for x, y in zip(across(days[shown], first, last), upward(axis, values[shown]), strict=True)
    )
    trend = min(trends, key=lambda one: one.q, default=None)
    line = "" if trend is None else line_of(axis, trend, days[usable], values[usable])
    name, (low, high) = escape(title(figure)), axis.ends()
    return (
        f'<figure data-dates="{key}" data-first="{first:.6f}" data-last="{last:.6f}" '
        f'data-low="{axis.low!r}" data-high="{axis.high!r}"><figcaption>'
        f"<b>{name}</b> from {low} (bottom) to {high} (top), {len(usable):,} records</figcaption>"
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{name} over dates">'
        f'<path class="axis" d="M{LEFT:g} {TOP:g}V{BASE:g}H{RIGHT:g}"/>'
        f'<path class="points" d="{points}"/>{line}'
        f"{tick_labels(as_date(first), '', as_date(last), LABELS)}</svg></figure>"
    )


def across(days: Array, first: float, last: float) -> Array:
    """Return horizontal places of dates."""
    return LEFT + (RIGHT - LEFT) * (days - first) / (last - first)


def upward(axis: Axis, values: Array) -> Array:
    """Return vertical places of values."""
    return BASE - (BASE - TOP) * axis.part(values)


def line_of(axis: Axis, trend: Trend, days: Array, values: Array) -> str:
    """Return the line of a trend, which goes through the median of what the slope leaves."""
    slope = trend.slope / YEAR
    ends = np.array([days.min(), days.max()])
    heights = np.median(values - slope * days) + slope * ends
    (x0, x1), (y0, y1) = across(ends, *ends), upward(axis, heights)
    kind = "trend significant" if trend.significant else "trend"
    return f'<path class="{kind}" d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}"/>'
