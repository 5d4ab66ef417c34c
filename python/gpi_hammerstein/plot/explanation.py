"""Before and after: what an explanation made of the loop."""

from matplotlib.axes import Axes

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.plot.style import BLACK, ORANGE, VERMILION, axes, label


def loops(
    found: Explanation, ax: Axes | None = None, *, experiment: int = 0, input: int = 0, output: int = 0
) -> Axes:
    """Draw the measured output against the input, with both models' outputs.

    Parameters
    ----------
    found
        What `explain` returned.
    ax
        Axes to draw on.
    experiment, input, output
        Which one to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> ax = gpi.plot.loops(found)  # doctest: +SKIP
    """
    ax = axes(ax, 5.0, 5.0)
    record = found.record
    u, y = record.u[experiment][:, input], record.y[experiment][:, output]
    before, after = found.residuals_before[experiment], found.residuals_after[experiment]
    ax.plot(u, y, color=BLACK, lw=0.9, label="measured")
    ax.plot(u, y - before[:, output], color=ORANGE, lw=0.6, label="before")
    ax.plot(u, y - after[:, output], color=VERMILION, lw=0.6, ls="--", label="after")
    ax.set_xlabel(label(record.input_names[input], record.input_units[input]))
    ax.set_ylabel(label(record.output_names[output], record.output_units[output]))
    ax.set_title(title(found))
    ax.legend(loc="upper left")
    return ax


def title(found: Explanation) -> str:
    """Return what was added, in a few words."""
    return f"Added: {', '.join(found.effects)}" if found.effects else "No effect added"
