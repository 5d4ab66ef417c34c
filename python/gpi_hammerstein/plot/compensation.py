"""Picture of a compensated drive."""

import numpy as np
from matplotlib.axes import Axes

from gpi_hammerstein._native import Compensation
from gpi_hammerstein.plot.style import BLUE, VERMILION, axes, label


def compensation(found: Compensation, ax: Axes | None = None) -> Axes:
    """Draw the predicted output over the reference, for the best static curve and for the compensated drive.

    The drive of a static curve shows the hysteresis loop. For a perfect compensation, the plot is a straight
    line.

    Parameters
    ----------
    found
        The result of ``model.compensate``. The first output is drawn.
    ax
        Axes to draw on.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> reference = 5.0 + np.sin(0.1 * np.arange(200))
    >>> ax = gpi.plot.compensation(model.compensate(reference))
    """
    ax = axes(ax, 5.0, 5.0)

    def first(signal: np.ndarray) -> np.ndarray:
        return signal.reshape(len(found.time), -1)[found.lead :, 0]

    reference = first(found.reference)
    for signal, error, color, what in (
        (found.static_curve, found.error_static_curve, BLUE, "static curve"),
        (found.predicted, found.error, VERMILION, "compensated drive"),
    ):
        fit = f"{what}, {100 * error['nrmse']:.2g} % rms"
        ax.plot(reference, first(signal), color=color, lw=0.9, label=fit)
    ax.set_xlabel(label(f"reference for {found.output_names[0]}", found.output_units[0]))
    ax.set_ylabel(label(f"predicted {found.output_names[0]}", found.output_units[0]))
    ax.set_title("Predicted output over the reference")
    ax.legend(loc="upper left")
    return ax
