"""Colours, labels and bands for all pictures."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from numpy.typing import NDArray

from gpi_hammerstein._native import Refinement
from gpi_hammerstein.escaping import in_plot
from gpi_hammerstein.uncertain import BAND

# The palette of Okabe and Ito, which can be distinguished with every kind of colour vision.
BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
PURPLE, SKY, BLACK = "#CC79A7", "#56B4E9", "#000000"
CYCLE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
STYLES = ("-", "--", ":", "-.")

# Distance in points between the axes and a title above a legend.
ABOVE_LEGEND = 26.0

BAND_LABEL = "95 % band"
SHADE = 0.25


def axes(ax: Axes | None, width: float = 7.0, height: float = 4.0) -> Axes:
    """Return the given axes, or those of a new figure."""
    if ax is not None:
        return ax
    return plt.subplots(figsize=(width, height), layout="constrained")[1]


def label(name: str, unit: str) -> str:
    """Return the name of an axis with its unit in brackets."""
    return in_plot(f"{name} [{unit}]" if unit else name)


def line_style(index: int) -> tuple[str, str]:
    """Return the colour and the line style of one line among many."""
    return CYCLE[index % len(CYCLE)], STYLES[index // len(CYCLE) % len(STYLES)]


def legend_above(ax: Axes, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    """Put the legend between the title and the axes. The title needs the distance `ABOVE_LEGEND`."""
    ax.legend(
        handles,
        labels,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(labels),
        frameon=False,
        fontsize="small",
    )


def say_nothing_to_draw(ax: Axes, why: str) -> None:
    """Write a message on the axes if there is nothing to draw."""
    ax.text(0.5, 0.5, why, ha="center", va="center", transform=ax.transAxes)
    ax.set(xticks=[], yticks=[])


def with_bands(refinement: Refinement | None) -> Refinement | None:
    """Return the refinement if it has uncertainty bands, which model files do not contain."""
    return refinement if refinement is not None and refinement.complete else None


def shade(
    ax: Axes, x: NDArray[np.float64], y: NDArray[np.float64], deviation: NDArray[np.float64], color: str
) -> None:
    """Shade the band around a line. The band has gaps where the standard deviation is not known."""
    known = np.isfinite(deviation)
    if known.any():
        half = BAND * np.where(known, deviation, 0.0)
        ax.fill_between(
            x, y - half, y + half, where=known.tolist(), color=color, alpha=SHADE, lw=0, label="_band"
        )


def pale(color: str) -> str:
    """Return the colour of a shaded band on a white background, without transparency."""
    shares = (1 - SHADE * (1 - int(color[place : place + 2], 16) / 255) for place in (1, 3, 5))
    return "#" + "".join(f"{round(255 * share):02x}" for share in shares)


def shade_path(
    ax: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    deviation: NDArray[np.float64],
    color: str,
    unit: str = "",
) -> None:
    """Shade the band around a path that runs back and forth. The legend states its largest half-width."""
    half = BAND * deviation
    known = np.isfinite(half)
    if not known.any():
        return
    lower, upper = np.column_stack([x, y - half]), np.column_stack([x, y + half])
    corners = np.stack([lower[:-1], lower[1:], upper[1:], upper[:-1]], axis=1)
    both = known[:-1] & known[1:]
    text = f"{BAND_LABEL}, at most \u00b1{half[known].max():.2g} {unit}".rstrip()
    # A colour without transparency, so that overlapping branches do not look darker.
    band = PolyCollection(
        list(corners[both]), facecolors=[pale(color)], edgecolors="none", zorder=1, label=text
    )
    # Where the data do not determine the loop, the band may exceed the axes.
    ax.add_collection(band, autolim=False)
