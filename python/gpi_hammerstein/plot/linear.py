"""Pictures of linear dynamics: impulse response, frequency response, singular values."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from gpi_hammerstein._native import Fir, Model, ParameterError, Refinement, StateSpace
from gpi_hammerstein.plot.style import (
    BLACK,
    BLUE,
    VERMILION,
    axes,
    line_style,
    say_nothing_to_draw,
    shade,
    with_bands,
)

DECIBELS = 20 / np.log(10)
# Decay of the slowest pole at the end of a drawn impulse response, and limits of the number of taps.
SETTLED, FEWEST_TAPS, MOST_TAPS = 0.01, 20, 400


def markov(response: Fir | Model, ax: Axes | None = None) -> Axes:
    """Draw the Markov parameters of a finite impulse response, or of a model's linear part.

    Parameters
    ----------
    response
        The result of :func:`gpi_hammerstein.fir`, or a model. G of a model is drawn until it has settled,
        with a 95 % band if the model has a refinement.
    ax
        Axes to draw on.

    Returns
    -------
    Axes
        The axes, with one line for each pair of output and input.

    Examples
    --------
    >>> u = np.random.default_rng(0).standard_normal(500)
    >>> ax = gpi.plot.markov(gpi.fir(u, np.convolve(u, [0.0, 0.7, 0.3])[:500], taps=5))
    """
    ax = axes(ax)
    deviations = None
    if isinstance(response, Fir):
        values = response.markov
        title = f"Impulse response, {values.shape[2]} taps, rank {response.rank}"
    else:
        taps = settling_taps(response.linear)
        values = response.linear.markov(taps)
        if (known := with_bands(response.refinement)) is not None:
            deviations = known.markov_std(taps)
        title = f"Impulse response of G, order {response.linear.order}"
    outputs, inputs, taps = values.shape
    lags = np.arange(taps, dtype=np.float64)
    for index, (row, column) in enumerate(np.ndindex(outputs, inputs)):
        color, dashes = line_style(index)
        ax.plot(
            lags,
            values[row, column],
            marker="o" if taps <= 60 else None,
            ms=3,
            lw=1.0,
            color=color,
            ls=dashes,
            label=f"u{column + 1} to y{row + 1}",
        )
        if deviations is not None:
            shade(ax, lags, values[row, column], deviations[row, column], color)
    if outputs * inputs > 1:
        ax.legend(fontsize="small", ncols=max(1, outputs * inputs // 5))
    ax.axhline(0.0, color=BLACK, lw=0.5)
    ax.set_xlabel("lag [samples]")
    ax.set_ylabel("Markov parameter [output per input]")
    ax.set_title(title)
    return ax


def settling_taps(sys: StateSpace) -> int:
    """Return the number of Markov parameters until a system has settled."""
    radius = min(sys.spectral_radius, 1.0)
    if radius >= SETTLED ** (1 / MOST_TAPS):
        return MOST_TAPS
    own = 0.0 if radius <= 0 else np.log(SETTLED) / np.log(radius)
    return int(np.clip(np.ceil(own) + sys.order, FEWEST_TAPS, MOST_TAPS))


def bode(
    sys: StateSpace,
    rate: float | None = None,
    ax: Axes | None = None,
    *,
    refinement: Refinement | None = None,
) -> Axes:
    """Draw the magnitude of the frequency response, and also the phase if the system has a single channel.

    Parameters
    ----------
    sys
        A discrete-time system.
    rate
        Sampling rate in Hz. Without it, the frequency axis is in rad per sample.
    ax
        Axes for the magnitude. The phase has its own axis on the right.
    refinement
        The refinement of the model that contains the system. If it is given, bands are shaded.

    Returns
    -------
    Axes
        The magnitude's axes.

    Raises
    ------
    ParameterError
        The refinement belongs to a system with other numbers of inputs or outputs.

    Examples
    --------
    >>> ax = gpi.plot.bode(gpi.StateSpace([[0.5]], [[1.0]], [[0.5]], [[0.0]]), rate=1000.0)
    """
    ax = axes(ax)
    angles = np.geomspace(1e-3 * np.pi, np.pi, 1000)
    response = sys.frequency_response(angles)
    x = angles if rate is None else angles * rate / (2 * np.pi)
    _, outputs, inputs = response.shape
    known = with_bands(refinement)
    deviations = None if known is None else known.response_std(angles)
    if deviations is not None and deviations[0].shape != response.shape:
        _, rows, columns = deviations[0].shape
        raise ParameterError(
            f"`refinement` belongs to {rows} outputs and {columns} inputs, but `sys` has {outputs} and "
            f"{inputs}; give model.linear and model.refinement of one model"
        )
    for index, (row, column) in enumerate(np.ndindex(outputs, inputs)):
        color, dashes = line_style(index)
        magnitude = np.maximum(np.abs(response[:, row, column]), np.finfo(np.float64).tiny)
        decibels = DECIBELS * np.log(magnitude)
        ax.semilogx(x, decibels, lw=1.2, color=color, ls=dashes, label=f"u{column + 1} to y{row + 1}")
        if deviations is not None:
            shade(ax, x, decibels, DECIBELS * deviations[0][:, row, column], color)
    if outputs * inputs > 1:
        ax.legend(fontsize="small")
    else:
        right = ax.twinx()
        phase = np.degrees(np.unwrap(np.angle(response[:, 0, 0])))
        right.semilogx(x, phase, color=VERMILION, lw=1.0, ls="--")
        if deviations is not None:
            shade(right, x, phase, np.degrees(deviations[1][:, 0, 0]), VERMILION)
        right.set_ylabel("phase [deg] (dashed)")
    bottom, top = ax.get_ylim()
    if top - bottom < 1e-3:
        # The magnitude of a pure delay is constant: rounding errors must not fill the axis.
        ax.set_ylim(bottom - 1.0, top + 1.0)
    ax.set_xlabel("frequency [rad/sample]" if rate is None else "frequency [Hz]")
    ax.set(ylabel="magnitude [dB]", title=f"Frequency response, order {sys.order}")
    ax.grid(True, which="both", lw=0.3)
    return ax


def singular_values(sys: StateSpace, ax: Axes | None = None, *, values: ArrayLike | None = None) -> Axes:
    """Draw the singular values of the block Hankel matrix and the order that was kept.

    Parameters
    ----------
    sys
        The result of :func:`gpi_hammerstein.era`. Other systems have no singular values.
    ax
        Axes to draw on.
    values
        Singular values to draw instead, shape (n,), in descending order, for example those of the
        identification of a model. They are drawn as a ratio to the first one.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> ax = gpi.plot.singular_values(gpi.era([0.0, 0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625]))
    """
    ax = axes(ax)
    own = sys.singular_values if values is None else values
    shown = np.zeros(0) if own is None else np.ravel(own)
    if len(shown) == 0 or shown[0] <= 0:
        say_nothing_to_draw(ax, "no singular values: the system is not a result of ERA")
    else:
        number = np.arange(1, len(shown) + 1)
        ax.semilogy(number, np.maximum(shown / shown[0], 1e-17), "o", ms=3, color=BLUE)
        ax.axvline(sys.order + 0.5, color=VERMILION, ls="--", lw=1.0, label=f"order {sys.order}")
        ax.legend()
    ax.set(xlabel="number [-]", ylabel="singular value over the largest [-]", title="Block Hankel matrix")
    return ax


def response(model: Model, ax: Axes | None = None) -> Axes:
    """Draw the frequency response of the linear part of a model, with bands if they are known.

    Parameters
    ----------
    model
        Any model.
    ax
        Axes for the magnitude. The phase has its own axis on the right.

    Returns
    -------
    Axes
        The magnitude's axes.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.response(model)
    """
    return bode(model.linear, model.rate, ax, refinement=model.refinement)
