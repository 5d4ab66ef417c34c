"""Before and after: what an explanation took out of the residual."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.explanation import is_above
from gpi_hammerstein.plot.style import BLACK, BLUE, ORANGE, VERMILION, axes, label

# More points than a picture has pixels only make its file large.
MOST_POINTS = 20_000


def residual_in_time(
    found: Explanation, ax: Axes | None = None, *, experiment: int = 0, output: int = 0
) -> Axes:
    """Draw the residual before and after over time, the held-out blocks shaded.

    Parameters
    ----------
    found
        What `explain` returned.
    ax
        Axes to draw on.
    experiment, output
        Which one to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> ax = gpi.plot.residual_in_time(found)  # doctest: +SKIP
    """
    ax = axes(ax, 9.0, 4.0)
    before, after = pair(found, experiment, output)
    t = np.arange(len(before)) / found.record.rate
    unit = found.record.output_units[output]
    ax.plot(t, before, color=ORANGE, lw=0.6, label=f"before: {rms(before):.3g} {unit} rms")
    ax.plot(t, after, color=BLUE, lw=0.6, label=f"after: {rms(after):.3g} {unit} rms")
    for first, last in found.held_out[experiment]:
        ax.axvspan(t[first], t[last - 1], color=BLACK, alpha=0.08, lw=0)
    # Wrong samples must not hide the rest.
    limit = 1.5 * float(np.quantile(np.abs(before), 0.999)) + 1e-300
    ax.set_ylim(-limit, limit)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(residual_label(found, output))
    ax.set_title(title(found) + " (grey: held out)")
    ax.legend(loc="upper right")
    return ax


def residual_spectrum(
    found: Explanation, ax: Axes | None = None, *, experiment: int = 0, output: int = 0
) -> Axes:
    """Draw the residual's amplitude density before and after over frequency.

    Parameters
    ----------
    found
        What `explain` returned.
    ax
        Axes to draw on.
    experiment, output
        Which one to draw, counted from 0.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> ax = gpi.plot.residual_spectrum(found)  # doctest: +SKIP
    """
    import scipy.signal

    ax = axes(ax)
    for values, color, name in zip(
        pair(found, experiment, output), (ORANGE, BLUE), ("before", "after"), strict=True
    ):
        segment = min(len(values), 8192)
        frequency, power = scipy.signal.welch(values, found.record.rate, nperseg=segment)
        ax.loglog(frequency[1:], np.sqrt(power[1:]), color=color, lw=0.9, label=name)
    floor = found.noise_floor["rms"][output]
    if not is_above(floor, rms(pair(found, experiment, output)[1])):
        density = floor / np.sqrt(found.record.rate / 2)
        ax.axhline(density, color=BLACK, lw=0.8, ls=":", label="noise floor, if white")
    ax.set_xlabel("frequency [Hz]")
    unit = found.record.output_units[output]
    ax.set_ylabel(label("residual density", f"{unit}/√Hz" if unit else ""))
    ax.set_title(title(found))
    ax.grid(True, which="both", lw=0.3)
    ax.legend(loc="lower left")
    return ax


def residual_over_input(
    found: Explanation, ax: Axes | None = None, *, experiment: int = 0, input: int = 0, output: int = 0
) -> Axes:
    """Draw the residual before and after against the input.

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
    >>> ax = gpi.plot.residual_over_input(found)  # doctest: +SKIP
    """
    ax = axes(ax)
    u = found.record.u[experiment][:, input]
    every = max(1, len(u) // MOST_POINTS)
    for values, color, name in zip(
        pair(found, experiment, output), (ORANGE, BLUE), ("before", "after"), strict=True
    ):
        ax.plot(u[::every], values[::every], ".", ms=1.5, color=color, label=name, rasterized=True)
    limit = 1.5 * float(np.quantile(np.abs(pair(found, experiment, output)[0]), 0.999)) + 1e-300
    ax.set_ylim(-limit, limit)
    ax.set_xlabel(label(found.record.input_names[input], found.record.input_units[input]))
    ax.set_ylabel(residual_label(found, output))
    ax.set_title(title(found))
    ax.legend(loc="upper right", markerscale=6)
    return ax


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
    before, after = pair(found, experiment, output)
    ax.plot(u, y, color=BLACK, lw=0.9, label="measured")
    ax.plot(u, y - before, color=ORANGE, lw=0.6, label="before")
    ax.plot(u, y - after, color=VERMILION, lw=0.6, ls="--", label="after")
    ax.set_xlabel(label(record.input_names[input], record.input_units[input]))
    ax.set_ylabel(label(record.output_names[output], record.output_units[output]))
    ax.set_title(title(found))
    ax.legend(loc="upper left")
    return ax


def pair(found: Explanation, experiment: int, output: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return one output's residual before and after."""
    before, after = found.residuals_before[experiment], found.residuals_after[experiment]
    return before[:, output], after[:, output]


def rms(values: NDArray[np.float64]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def residual_label(found: Explanation, output: int) -> str:
    """Return the label of a residual's axis."""
    return label(f"residual of {found.record.output_names[output]}", found.record.output_units[output])


def title(found: Explanation) -> str:
    """Return what was added, in a few words."""
    return f"Added: {', '.join(found.effects)}" if found.effects else "No effect added"
