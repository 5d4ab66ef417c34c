"""Pictures of stages and results, on Matplotlib axes.

Every function draws on the axes it is given and returns them. Without axes it makes a figure with
`matplotlib.pyplot.subplots`, which the caller shows, saves or closes.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from gpi_hammerstein._native import Fir, Model, Record, StateSpace

__all__ = ["bode", "fit", "loop", "markov", "residual", "singular_values"]

# Okabe and Ito: told apart with every kind of colour vision.
BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
PURPLE, SKY, BLACK = "#CC79A7", "#56B4E9", "#000000"
CYCLE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
STYLES = ("-", "--", ":", "-.")


def _axes(ax: Axes | None, width: float = 7.0, height: float = 4.0) -> Axes:
    if ax is not None:
        return ax
    return plt.subplots(figsize=(width, height), layout="constrained")[1]


def label(name: str, unit: str) -> str:
    """Return the name of an axis with its unit in brackets."""
    return f"{name} [{unit}]" if unit else name


def loop(u: ArrayLike, v: ArrayLike, model: Model | None = None, ax: Axes | None = None) -> Axes:
    """Draw the hysteresis loop, v over u.

    Parameters
    ----------
    u
        Input, (samples,).
    v
        Intermediate signal or output, (samples,).
    model
        A model of one input; its own loop is drawn on top, and its units label the axes.
    ax
        Axes to draw on.

    Returns
    -------
    Axes
        The axes.

    Raises
    ------
    ParameterError, DataError
        The model does not accept u.

    Examples
    --------
    >>> ax = gpi.plot.loop(u, model.intermediate(u))  # doctest: +SKIP
    """
    ax = _axes(ax, 5.0, 5.0)
    x = np.asarray(u, dtype=np.float64).reshape(-1)
    ax.plot(x, np.asarray(v, dtype=np.float64).reshape(-1), color=BLUE, lw=0.7, label="v")
    unit_in, unit_out = "", ""
    if model is not None:
        unit_in, unit_out = model.input_units[0], model.output_units[0]
        ax.plot(x, model.intermediate(x).reshape(-1), color=VERMILION, lw=0.7, ls="--", label="model")
        ax.legend()
    ax.set_xlabel(label("input u", unit_in))
    ax.set_ylabel(label("intermediate signal v", unit_out))
    ax.set_title("Hysteresis loop")
    return ax


def markov(fir: Fir, ax: Axes | None = None) -> Axes:
    """Draw the Markov parameters of a finite impulse response.

    Parameters
    ----------
    fir
        Result of :func:`gpi_hammerstein.fir`.
    ax
        Axes to draw on.

    Returns
    -------
    Axes
        The axes; one line a pair of output and input.

    Examples
    --------
    >>> ax = gpi.plot.markov(gpi.fir(u, y, taps=31))  # doctest: +SKIP
    """
    ax = _axes(ax)
    outputs, inputs, taps = fir.markov.shape
    for index, (row, column) in enumerate(np.ndindex(outputs, inputs)):
        ax.plot(
            np.arange(taps),
            fir.markov[row, column],
            marker="o" if taps <= 60 else None,
            ms=3,
            lw=1.0,
            color=CYCLE[index % len(CYCLE)],
            ls=STYLES[index // len(CYCLE) % len(STYLES)],
            label=f"u{column + 1} to y{row + 1}",
        )
    if outputs * inputs > 1:
        ax.legend(fontsize="small", ncols=max(1, outputs * inputs // 5))
    ax.axhline(0.0, color=BLACK, lw=0.5)
    ax.set_xlabel("lag [samples]")
    ax.set_ylabel("Markov parameter [output per input]")
    ax.set_title(f"Impulse response, {taps} taps, rank {fir.rank}")
    return ax


def bode(sys: StateSpace, rate: float | None = None, ax: Axes | None = None) -> Axes:
    """Draw the magnitude of the frequency response, and the phase of a single-channel system.

    Parameters
    ----------
    sys
        A discrete-time system.
    rate
        Sampling rate in Hz; without it the axis is in rad per sample.
    ax
        Axes for the magnitude; the phase gets an axis at the right.

    Returns
    -------
    Axes
        The magnitude's axes.

    Examples
    --------
    >>> ax = gpi.plot.bode(gpi.era(fir.markov), rate=1000.0)  # doctest: +SKIP
    """
    ax = _axes(ax)
    angles = np.geomspace(1e-3 * np.pi, np.pi, 1000)
    response = sys.frequency_response(angles)
    x = angles if rate is None else angles * rate / (2 * np.pi)
    _, outputs, inputs = response.shape
    for index, (row, column) in enumerate(np.ndindex(outputs, inputs)):
        magnitude = np.maximum(np.abs(response[:, row, column]), np.finfo(np.float64).tiny)
        ax.semilogx(
            x,
            20 * np.log10(magnitude),
            lw=1.2,
            color=CYCLE[index % len(CYCLE)],
            ls=STYLES[index // len(CYCLE) % len(STYLES)],
            label=f"u{column + 1} to y{row + 1}",
        )
    if outputs * inputs > 1:
        ax.legend(fontsize="small")
    else:
        right = ax.twinx()
        right.semilogx(
            x, np.degrees(np.unwrap(np.angle(response[:, 0, 0]))), color=VERMILION, lw=1.0, ls="--"
        )
        right.set_ylabel("phase [deg] (dashed)")
    bottom, top = ax.get_ylim()
    if top - bottom < 1e-3:
        # A pure delay: rounding errors are not worth the whole axis.
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
        Result of :func:`gpi_hammerstein.era`; other systems have no singular values.
    ax
        Axes to draw on.
    values
        Singular values to draw instead, such as those of a model's identification.

    Returns
    -------
    Axes
        The axes.

    Examples
    --------
    >>> ax = gpi.plot.singular_values(gpi.era(fir.markov))  # doctest: +SKIP
    """
    ax = _axes(ax)
    own = sys.singular_values if values is None else values
    shown = np.zeros(0) if own is None else np.ravel(own)
    if len(shown) == 0 or shown[0] <= 0:
        ax.text(0.5, 0.5, "no singular values: not realised from Markov parameters", ha="center", va="center")
        ax.set(xticks=[], yticks=[])
    else:
        number = np.arange(1, len(shown) + 1)
        ax.semilogy(number, np.maximum(shown / shown[0], 1e-17), "o", ms=3, color=BLUE)
        ax.axvline(sys.order + 0.5, color=VERMILION, ls="--", lw=1.0, label=f"order {sys.order}")
        ax.legend()
    ax.set(xlabel="number [-]", ylabel="singular value over the largest [-]", title="Block Hankel matrix")
    return ax


def fit(
    model: Model, record: Record, ax: Axes | None = None, *, experiment: int = 0, output: int = 0
) -> Axes:
    """Draw the measured and the simulated output over time.

    Parameters
    ----------
    model
        An identified model.
    record
        A record at the model's rate.
    ax
        Axes to draw on.
    experiment, output
        Which one to draw, counted from 0.

    Returns
    -------
    Axes
        The axes; the warm-up is shaded.

    Raises
    ------
    ParameterError, DataError
        The model does not accept the record's input.

    Examples
    --------
    >>> ax = gpi.plot.fit(model, record)  # doctest: +SKIP
    """
    ax = _axes(ax, 9.0, 4.0)
    measured = record.y[experiment][:, output]
    simulated = measured - model.residual(record)[experiment][:, output]
    t = np.arange(len(measured)) / record.rate
    ax.plot(t, measured, color=BLUE, lw=1.0, label="measured")
    ax.plot(t, simulated, color=VERMILION, lw=0.9, ls="--", label="simulated")
    _shade_warmup(ax, record, experiment)
    ax.legend(loc="upper right")
    ax.set_xlabel("time [s]")
    ax.set_ylabel(label(record.output_names[output], record.output_units[output]))
    ax.set_title("Simulation from the input alone")
    return ax


def residual(
    model: Model, record: Record, ax: Axes | None = None, *, experiment: int = 0, output: int = 0
) -> Axes:
    """Draw the measured output minus the simulated one over time.

    Parameters
    ----------
    model
        An identified model.
    record
        A record at the model's rate.
    ax
        Axes to draw on.
    experiment, output
        Which one to draw, counted from 0.

    Returns
    -------
    Axes
        The axes; the warm-up is shaded.

    Raises
    ------
    ParameterError, DataError
        The model does not accept the record's input.

    Examples
    --------
    >>> ax = gpi.plot.residual(model, record)  # doctest: +SKIP
    """
    ax = _axes(ax, 9.0, 3.0)
    values = model.residual(record)[experiment][:, output]
    ax.plot(np.arange(len(values)) / record.rate, values, color=BLUE, lw=0.8)
    _shade_warmup(ax, record, experiment)
    scored = np.abs(values[record.warmup[experiment] :])
    usual, largest = (float(value) for value in np.quantile(scored, [0.99, 1.0]))
    # An unknown start or a few outliers may leave the picture, but it says so.
    limit = largest if largest < 5 * usual else 2 * usual
    if limit > 0:
        ax.set_ylim(-1.15 * limit, 1.15 * limit)
    beyond = int(np.sum(scored > 1.15 * limit))
    if beyond:
        text = f"{beyond} samples beyond, up to {largest:.3g}"
        ax.annotate(text, (0.99, 0.97), xycoords="axes fraction", ha="right", va="top", fontsize="small")
    ax.axhline(0.0, color=BLACK, lw=0.5)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(label(f"residual of {record.output_names[output]}", record.output_units[output]))
    ax.set_title("What the model does not explain")
    return ax


def _shade_warmup(ax: Axes, record: Record, experiment: int) -> None:
    warmup = record.warmup[experiment]
    if warmup:
        ax.axvspan(0.0, warmup / record.rate, color=BLACK, alpha=0.08, lw=0, label="warm-up, not scored")
