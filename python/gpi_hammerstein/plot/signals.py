"""Pictures of signals: the hysteresis loop, the fit and the residual."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from gpi_hammerstein._native import Model, Record
from gpi_hammerstein.plot.style import (
    ABOVE_LEGEND,
    BLACK,
    BLUE,
    VERMILION,
    axes,
    label,
    legend_above,
    shade_path,
    with_bands,
)

Array = NDArray[np.float64]


def loop(u: ArrayLike, v: ArrayLike, model: Model | None = None, ax: Axes | None = None) -> Axes:
    """Draw the hysteresis loop, v over u.

    Parameters
    ----------
    u
        Input, shape (samples,), in the input's unit.
    v
        Intermediate signal or output, shape (samples,), in the output's unit.
    model
        A model of one input. Its loop is also drawn, with a 95 % band if the model has a refinement. Its
        units are used for the labels of the axes.
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
    >>> u = np.sin(0.1 * np.arange(200))
    >>> ax = gpi.plot.loop(u, gpi.PlayBank([0.0, 0.5], [1.0, 0.5])(u))
    """
    ax = axes(ax, 5.0, 5.0)
    x = np.asarray(u, dtype=np.float64).reshape(-1)
    ax.plot(x, np.asarray(v, dtype=np.float64).reshape(-1), color=BLUE, lw=0.7, label="v")
    unit_in, unit_out = "", ""
    if model is not None:
        unit_in, unit_out = model.input_units[0], model.output_units[0]
        own = model.intermediate(x).reshape(-1)
        ax.plot(x, own, color=VERMILION, lw=0.7, ls="--", label="model")
        if (known := with_bands(model.refinement)) is not None:
            shade_path(ax, x, own, known.loop_std(x).reshape(-1), VERMILION, unit_out)
        # The place of the legend is fixed, because the search for the best place takes long for long records.
        ax.legend(loc="upper left")
    ax.set_xlabel(label("input u", unit_in))
    ax.set_ylabel(label("intermediate signal v", unit_out))
    ax.set_title("Hysteresis loop")
    return ax


def draw_loop(ax: Axes, model: Model, u: Array, v_hat: Array | None) -> None:
    """Draw the hysteresis loop of the first input: that of the model, and v-hat if it is given."""
    if v_hat is not None:
        loop(u[:, 0], v_hat, model, ax)
    else:
        v = model.intermediate(u)[:, 0]
        loop(u[:, 0], v, ax=ax)
        if (known := with_bands(model.refinement)) is not None:
            shade_path(ax, u[:, 0], v, known.loop_std(u)[:, 0], BLUE, model.output_units[0])
            ax.legend(loc="upper left")
    ax.set_xlabel(label(model.input_names[0], model.input_units[0]))
    ax.set_ylabel(label("intermediate signal v", model.output_units[0]))


def fit(
    model: Model,
    record: Record,
    ax: Axes | None = None,
    *,
    experiment: int = 0,
    output: int = 0,
    fit_start: bool = False,
) -> Axes:
    """Draw the measured and the simulated output over time.

    Parameters
    ----------
    model
        An identified model.
    record
        A record with the sampling rate of the model.
    ax
        Axes to draw on.
    experiment, output
        The numbers of the experiment and the output to draw, counted from 0.
    fit_start
        Fit the unknown initial state, as in :meth:`gpi_hammerstein.Model.error`.

    Returns
    -------
    Axes
        The axes. The warm-up is shaded.

    Raises
    ------
    ParameterError, DataError
        The model does not accept the input of the record.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.fit(model, record)
    """
    ax = axes(ax, 9.0, 4.0)
    measured = record.y[experiment][:, output]
    simulated = measured - model.residual(record, fit_start=fit_start)[experiment][:, output]
    t = np.arange(len(measured)) / record.rate
    ax.plot(t, measured, color=BLUE, lw=1.0, label="measured")
    ax.plot(t, simulated, color=VERMILION, lw=0.9, ls="--", label="simulated")
    _shade_warmup(ax, record, experiment)
    warmup, samples = record.warmup[experiment], len(measured)
    if 2 * warmup > samples:
        # The second part of a split record contains the whole first part as warm-up.
        ax.set_xlim((warmup - 0.1 * (samples - warmup)) / record.rate, samples / record.rate)
    legend_above(ax, *ax.get_legend_handles_labels())
    ax.set_xlabel("time [s]")
    ax.set_ylabel(label(record.output_names[output], record.output_units[output]))
    ax.set_title("Simulation from the input alone", pad=ABOVE_LEGEND)
    return ax


def residual(
    model: Model,
    record: Record,
    ax: Axes | None = None,
    *,
    experiment: int = 0,
    output: int = 0,
    fit_start: bool = False,
) -> Axes:
    """Draw the measured output minus the simulated one over time.

    Parameters
    ----------
    model
        An identified model.
    record
        A record with the sampling rate of the model.
    ax
        Axes to draw on.
    experiment, output
        The numbers of the experiment and the output to draw, counted from 0.
    fit_start
        Fit the unknown initial state, as in :meth:`gpi_hammerstein.Model.error`.

    Returns
    -------
    Axes
        The axes. The warm-up is shaded.

    Raises
    ------
    ParameterError, DataError
        The model does not accept the input of the record.

    Examples
    --------
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> ax = gpi.plot.residual(model, record)
    """
    ax = axes(ax, 9.0, 3.0)
    values = model.residual(record, fit_start=fit_start)[experiment][:, output]
    ax.plot(np.arange(len(values)) / record.rate, values, color=BLUE, lw=0.8)
    _shade_warmup(ax, record, experiment)
    scored = np.abs(values[record.warmup[experiment] :])
    usual, largest = (float(value) for value in np.quantile(scored, [0.99, 1.0]))
    # The first samples or a few outliers may be outside the axes; an annotation then states this.
    limit = largest if largest < 5 * usual else 2 * usual
    if limit > 0:
        ax.set_ylim(-1.15 * limit, 1.15 * limit)
    beyond = int(np.sum(scored > 1.15 * limit))
    if beyond:
        text = f"{beyond} samples outside, up to {largest:.3g}"
        ax.annotate(text, (0.99, 0.97), xycoords="axes fraction", ha="right", va="top", fontsize="small")
    ax.axhline(0.0, color=BLACK, lw=0.5)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(label(f"residual of {record.output_names[output]}", record.output_units[output]))
    ax.set_title("Residual")
    return ax


def _shade_warmup(ax: Axes, record: Record, experiment: int) -> None:
    warmup = record.warmup[experiment]
    if warmup:
        ax.axvspan(0.0, warmup / record.rate, color=BLACK, alpha=0.08, lw=0, label="warm-up, not scored")
