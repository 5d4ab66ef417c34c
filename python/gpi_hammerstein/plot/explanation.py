"""Picture of the hysteresis loop before and after an explanation."""

from matplotlib.axes import Axes

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.io import raise_warmup
from gpi_hammerstein.plot.style import BLACK, ORANGE, VERMILION, axes, label


def loops(
    found: Explanation, ax: Axes | None = None, *, experiment: int = 0, input: int = 0, output: int = 0
) -> Axes:
    """Draw the measured output and the outputs of both models over the input, for all scored samples.

    Parameters
    ----------
    found
        The result of `explain`.
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
    >>> ax = gpi.plot.loops(found)
    """
    ax = axes(ax, 5.0, 5.0)
    # The first samples of the models depend on the unknown initial state and are not drawn.
    record = raise_warmup(found.record, found.warmups)
    scored = slice(record.warmup[experiment], None)
    u, y = record.u[experiment][scored, input], record.y[experiment][scored, output]
    before, after = (
        residuals[experiment][scored, output] for residuals in (found.residuals_before, found.residuals_after)
    )
    ax.plot(u, y, color=BLACK, lw=0.9, label="measured")
    ax.plot(u, y - before, color=ORANGE, lw=0.6, label="before")
    ax.plot(u, y - after, color=VERMILION, lw=0.6, ls="--", label="after")
    ax.set_xlabel(label(record.input_names[input], record.input_units[input]))
    ax.set_ylabel(label(record.output_names[output], record.output_units[output]))
    ax.set_title(title(found))
    ax.legend(loc="upper left")
    return ax


def title(found: Explanation) -> str:
    """Return a title that lists the added effects."""
    return f"Added effects: {', '.join(found.effects)}" if found.effects else "No effect added"
