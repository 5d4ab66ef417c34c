"""The pictures of an identified model."""

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from gpi_hammerstein import plot
from gpi_hammerstein._native import GpiError, Model, Record
from gpi_hammerstein.cli.output import picture

# v-hat is worth a look while the noise that the inverse of G makes of the residual stays below this
# fraction of the span of v.
NOISE_SHARE = 0.05


def write_pictures(folder: Path, model: Model, train: Record, test: Record | None) -> None:
    """Draw fit, residual, loop, impulse response, frequency response and singular values."""
    shown = train if test is None else test
    picture(folder / "fit.png", partial(plot.fit, model, shown), 10.0)
    picture(folder / "residual.png", partial(plot.residual, model, shown), 10.0, 3.5)
    u = train.u[0]
    v_hat = intermediate_seen(model, train)
    picture(folder / "loop.png", partial(draw_loop, model=model, u=u, v_hat=v_hat), 6.0, 6.0)
    picture(folder / "bode.png", partial(plot.bode, model.linear, model.rate))
    found = model.identification
    if found is None:
        return
    if found.fir is not None:
        picture(folder / "markov.png", partial(plot.markov, found.fir))
    if len(found.singular_values):
        values = found.singular_values
        picture(folder / "singular_values.png", partial(plot.singular_values, model.linear, values=values))


def draw_loop(ax: Axes, model: Model, u: NDArray[np.float64], v_hat: NDArray[np.float64] | None) -> None:
    """Draw the loop of the first input: the model's, and v-hat where it can be seen."""
    if v_hat is not None:
        plot.loop(u[:, 0], v_hat, model, ax)
    else:
        plot.loop(u[:, 0], model.intermediate(u)[:, 0], ax=ax)
    ax.set_xlabel(plot.label(model.input_names[0], model.input_units[0]))
    ax.set_ylabel(plot.label("intermediate signal v", model.output_units[0]))


def intermediate_seen(model: Model, record: Record) -> NDArray[np.float64] | None:
    """Return v of the first experiment as its measured output shows it, or None where noise hides it.

    Samples that the inverse of G does not reach are NaN. Only a model of one input and one output has
    a loop of its own.
    """
    single = len(model.input_names) == len(model.output_names) == 1
    if not single:
        return None
    try:
        inverse = model.linear.noncausal_inverse()
        seen = inverse(record.y[0][:, 0] - model.offsets[0])
    except GpiError:
        return None
    v_hat = np.full(len(record.y[0]), np.nan)
    v_hat[seen.valid] = seen.values[seen.valid]
    noise = model.error(record)["rms"] * float(np.linalg.norm(inverse.taps))
    return v_hat if noise < NOISE_SHARE * float(np.ptp(model.intermediate(record.u[0]))) else None
