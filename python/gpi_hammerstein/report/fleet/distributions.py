"""The distributions of the figures: histograms with quantiles and the devices that stand out."""

from collections.abc import Iterable
from html import escape

import numpy as np

from gpi_hammerstein.fleet.figures import Figure
from gpi_hammerstein.fleet.robust import Array
from gpi_hammerstein.report.fleet.axis import HEIGHT, LEFT, RIGHT, WIDTH, Axis, tick_labels

TOP, BASE = 8.0, 88.0
"""Vertical places of the highest bar and of the axis."""
BOX, DOTS, LABELS = 100.0, 119.0, 144.0
MOST_BINS = 40
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
MOST_DOTS = 150
"""Devices that are drawn as dots; more would hide each other."""


def histogram(figure: Figure, axis: Axis, marked: Iterable[tuple[int, int, str, bool]], key: int) -> str:
    """Return the distribution of a figure as a figure element.

    Parameters
    ----------
    figure
        The figure.
    axis
        Its axis, with the values of the devices.
    marked
        Devices that stand out: their place among the judged devices, their number in the page, their name,
        and whether this figure is far from the fleet's.
    key
        Number of the figure in the page.

    Returns
    -------
    str
        A ``figure`` element.
    """
    values = axis.scaled.values
    known = values[np.isfinite(values)]
    counts = np.histogram(axis.part(known), bins=bins(len(known)), range=(0.0, 1.0))[0]
    quantiles = np.quantile(known, QUANTILES)
    least, _, middle, _, most = (axis.text(float(one)) for one in quantiles)
    words = f"median {middle}, 90 % between {least} and {most}, {len(known):,} devices"
    name, (low, high) = escape(title(figure)), axis.ends()
    return (
        f'<figure data-figure="{key}"><figcaption><b>{name}</b> {words}</figcaption>'
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{name}: {words}">'
        f"{bars(counts)}{box(axis.x(quantiles))}{dots(axis, marked)}"
        f"{tick_labels(low, axis.text(0.5 * (axis.low + axis.high)), high, LABELS)}</svg></figure>"
    )


def title(figure: Figure) -> str:
    """Return the name of a figure with its unit."""
    label = figure.label[:1].upper() + figure.label[1:] if not figure.effect else figure.label
    return f"{label} [{figure.unit}]" if figure.unit else label


def bins(values: int) -> int:
    """Return the number of bars: twice the cube root of the number of values (Rice's rule)."""
    return int(np.clip(np.ceil(2 * np.cbrt(values)), 5, MOST_BINS))


def bars(counts: Array) -> str:
    """Return the bars of a histogram, and its axis."""
    width = (RIGHT - LEFT) / len(counts)
    heights = (BASE - TOP) * counts / max(int(counts.max()), 1)
    drawn = "".join(
        f'<rect class="bar" x="{LEFT + at * width:.1f}" y="{BASE - height:.1f}" width="{width:.1f}" '
        f'height="{height:.1f}"/>'
        for at, height in enumerate(heights)
        if height > 0
    )
    return f'{drawn}<path class="axis" d="M{LEFT:g} {BASE:g}H{RIGHT:g}"/>'


def box(x: Array) -> str:
    """Return quantiles as a line over 90 % of the devices, a box over one half, and a mark at the median."""
    return (
        f'<path class="axis" d="M{x[0]:.1f} {BOX:g}H{x[4]:.1f}"/>'
        f'<rect class="half" x="{x[1]:.1f}" y="{BOX - 4:g}" width="{max(x[3] - x[1], 0.5):.1f}" height="8"/>'
        f'<path class="median" d="M{x[2]:.1f} {BOX - 6:g}V{BOX + 6:g}"/>'
    )


def dots(axis: Axis, marked: Iterable[tuple[int, int, str, bool]]) -> str:
    """Return devices as dots, those that are far in this figure last, so that they are visible."""
    drawn = []
    for place, device, name, far in sorted(marked, key=lambda one: one[3])[-MOST_DOTS:]:
        value = axis.scaled.values[place]
        if np.isfinite(value):
            kind = "dot far" if far else "dot"
            drawn.append(
                f'<circle class="{kind}" data-device="{device}" cx="{axis.x(value):.1f}" cy="{DOTS:g}" r="4">'
                f"<title>{escape(name)}: {axis.text(value)}</title></circle>"
            )
    return "".join(drawn)
