"""Pictures of an identification: the structures that were compared, and the steps of the refinement."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter

from gpi_hammerstein._native import Identification, Model, Refinement
from gpi_hammerstein.escaping import in_plot
from gpi_hammerstein.plot.style import (
    ABOVE_LEGEND,
    BLUE,
    GREEN,
    VERMILION,
    axes,
    label,
    legend_above,
    say_nothing_to_draw,
)


def candidates(found: Model | Identification, ax: Axes | None = None) -> Axes:
    """Draw the information criterion and the rms of every structure that was compared.

    Parameters
    ----------
    found
        The result of :func:`gpi_hammerstein.identify`, or its `identification`.
    ax
        Axes for the criterion. The rms has its own axis on the right.

    Returns
    -------
    Axes
        The axes of the criterion. The legend contains the chosen structure.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.candidates(model)
    """
    ax = axes(ax, 8.0, 4.5)
    ax.set(xlabel="parameters used [-]", ylabel="criterion minus the best [-]")
    ax.set_title("Structures compared", pad=ABOVE_LEGEND)
    known = found.identification if isinstance(found, Model) else found
    rows = [] if known is None else known.candidates
    if not rows:
        say_nothing_to_draw(ax, "no structures: only models that `identify` returns contain them")
        return ax
    used = np.array([row["used"] for row in rows])
    # structures that are ruled out have no criterion
    known_criteria = [row["criterion"] for row in rows if row["criterion"] is not None]
    least = min(known_criteria, default=0.0)
    above = np.array([np.nan if row["criterion"] is None else row["criterion"] - least for row in rows])
    # Other structures may be tens of thousands above the best one, with up to four times the parameters.
    ax.set_yscale("symlog", linthresh=10.0)
    ax.set_ylim(-3.0, 10 * max([10.0, *(value - least for value in known_criteria)]))
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlim(0.8 * float(used.min()), 1.4 * float(used.max()))
    right = ax.twinx()
    [squares] = right.plot(used, [row["rms"] for row in rows], "s", ms=5, mfc="none", color=VERMILION)
    right.set_yscale("log")
    right.set_ylabel(label("residual rms", found.output_units[0] if isinstance(found, Model) else ""))
    [points] = ax.plot(used, above, "o", ms=5, color=BLUE)
    chosen = next(place for place, row in enumerate(rows) if row["chosen"])
    [ring] = ax.plot(used[chosen], above[chosen], "o", ms=12, mfc="none", mec=GREEN, mew=2)
    best = rows[chosen]
    what = (
        f"chosen: order {best['order']}, plays {best['plays']}, deadzones {best['deadzones']}, "
        f"delay {best['delay']}"
    )
    legend_above(ax, [points, squares, ring], ["criterion", "rms (right)", what])
    return ax


def history(found: Model | Refinement, ax: Axes | None = None) -> Axes:
    """Draw the rms residual over the steps of the joint refinement, and the noise floor.

    Parameters
    ----------
    found
        The result of :func:`gpi_hammerstein.identify` or :func:`gpi_hammerstein.refine`, or its `refinement`.
    ax
        Axes to draw on.

    Returns
    -------
    Axes
        The axes. For several outputs, the residuals are weighted, so that no noise floor is drawn.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.history(model)
    """
    ax = axes(ax)
    refinement = found.refinement if isinstance(found, Model) else found
    unit = found.output_units[0] if isinstance(found, Model) and len(found.output_names) == 1 else ""
    ax.set(xlabel="accepted steps [-]", ylabel=label("residual rms", unit or "-"), title="Joint refinement")
    if refinement is None or not refinement.complete:
        why = "the model was not refined" if refinement is None else "model files do not contain them"
        say_nothing_to_draw(ax, f"no steps: {why}")
        return ax
    steps = refinement.history
    ax.plot(np.arange(len(steps)), steps, "o-", ms=3, lw=1.0, color=BLUE, label=in_plot(refinement.status))
    if steps.max() > 10 * steps.min():
        ax.set_yscale("log")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    if len(refinement.residual_rms) == 1:
        floor = refinement.noise_floor
        ax.axhline(
            floor["rms"][0], color=VERMILION, ls="--", lw=1.0, label=f"noise floor: {in_plot(floor['how'])}"
        )
    ax.legend()
    return ax
