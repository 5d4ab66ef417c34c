"""Picture of a record."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gpi_hammerstein._native import Record
from gpi_hammerstein.plot.style import ABOVE_LEGEND, BLACK, axes, label, legend_above, line_style


def record(record: Record, ax: Axes | None = None, *, experiment: int = 0) -> Axes:
    """Draw the inputs and outputs of an experiment over time. Samples that are not scored are shaded.

    Parameters
    ----------
    record
        The record.
    ax
        Axes for the outputs. The inputs have their own axis on the right.
    experiment
        The number of the experiment to draw, counted from 0.

    Returns
    -------
    Axes
        The outputs' axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> ax = gpi.plot.record(record)
    """
    ax = axes(ax, 9.0, 4.0)
    u, y = record.u[experiment], record.y[experiment]
    t = np.arange(len(y)) / record.rate
    right = ax.twinx()
    lines: list[Line2D] = []
    sides = (
        (ax, y, record.output_names, record.output_units),
        (right, u, record.input_names, record.input_units),
    )
    for side, signals, names, units in sides:
        for name, unit, signal in zip(names, units, signals.T, strict=True):
            color, dashes = line_style(len(lines))
            lines += side.plot(t, signal, color=color, ls=dashes, lw=0.8, label=label(name, unit))
        side.set_ylabel(", ".join(label(name, unit) for name, unit in zip(names, units, strict=True)))
    if warmup := record.warmup[experiment]:
        ax.axvspan(0.0, (warmup - 1) / record.rate, color=BLACK, alpha=0.08, lw=0)
    ax.set_xlabel("time [s]")
    which = f", experiment {experiment}" if len(record.u) > 1 else ""
    ax.set_title(f"Measured{which}", pad=ABOVE_LEGEND)
    legend_above(ax, lines, [str(line.get_label()) for line in lines])
    return ax
