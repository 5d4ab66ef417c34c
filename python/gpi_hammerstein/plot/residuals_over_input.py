"""Pictures of residuals over the input and over its speed."""

import numpy as np
from matplotlib.axes import Axes

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.plot.residuals import Array, Residuals, taken
from gpi_hammerstein.plot.style import axes, label

# More points than a picture has pixels would only increase the size of the file.
MOST_POINTS = 20_000


def residual_over_input(
    found: Explanation | Residuals,
    ax: Axes | None = None,
    *,
    experiment: int = 0,
    input: int = 0,
    output: int = 0,
) -> Axes:
    """Draw the residual over the input.

    Parameters
    ----------
    found
        The result of `explain`, or residuals.
    ax
        Axes to draw on.
    experiment, input, output
        The numbers of the experiment, the input and the output to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> found = gpi.explain(record, effects=[], delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual_over_input(found)
    """
    found = taken(found)
    u = found.record.u[experiment][:, input]
    ax = scattered(found, u, ax, experiment, output)
    ax.set_xlabel(label(found.record.input_names[input], found.record.input_units[input]))
    return ax


def residual_over_speed(
    found: Explanation | Residuals,
    ax: Axes | None = None,
    *,
    experiment: int = 0,
    input: int = 0,
    output: int = 0,
) -> Axes:
    """Draw the residual over the speed of the input, du/dt, which is computed by central differences.

    Parameters
    ----------
    found
        The result of `explain`, or residuals.
    ax
        Axes to draw on.
    experiment, input, output
        The numbers of the experiment, the input and the output to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> found = gpi.explain(record, effects=[], delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual_over_speed(found)
    """
    found = taken(found)
    record = found.record
    speed = np.gradient(record.u[experiment][:, input]) * record.rate
    ax = scattered(found, speed, ax, experiment, output)
    # a few steps of the input must not determine the axis limits
    most = float(np.quantile(np.abs(speed), 0.999)) or 1.0
    ax.set_xlim(-1.2 * most, 1.2 * most)
    unit = record.input_units[input]
    ax.set_xlabel(label(f"d{record.input_names[input]}/dt", f"{unit}/s" if unit else "1/s"))
    return ax


def scattered(found: Residuals, x: Array, ax: Axes | None, experiment: int, output: int) -> Axes:
    """Draw every residual as points over x."""
    ax = axes(ax)
    scored = slice(found.record.warmup[experiment], None)
    every = max(1, len(x[scored]) // MOST_POINTS)
    for name, color, values in found.of(experiment, output):
        points = x[scored][::every], values[scored][::every]
        ax.plot(*points, ".", ms=1.5, color=color, label=name, rasterized=True)
    limit = found.limit(experiment, output)
    ax.set_ylim(-limit, limit)
    ax.set_ylabel(found.label(output))
    ax.set_title(found.title)
    ax.legend(loc="upper right", markerscale=6)
    return ax
