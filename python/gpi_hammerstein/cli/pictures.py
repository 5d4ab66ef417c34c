"""The pictures of an identified model."""

from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein import plot
from gpi_hammerstein._native import GpiError, Model, Record
from gpi_hammerstein.cli.output import picture
from gpi_hammerstein.plot.signals import draw_loop

# v-hat is drawn only if its noise is below this fraction of the span of v. This noise is the residual,
# amplified by the inverse of G.
NOISE_SHARE = 0.05


def write_pictures(
    folder: Path, model: Model, train: Record, test: Record | None, *, fit_start: bool = False
) -> None:
    """Draw the fit, the residual, the loop, responses, singular values and the structures that were compared.

    `fit_start` applies to `test`. The initial state of `train` was part of the fit.
    """
    shown, fitted = (train, True) if test is None else (test, fit_start)
    picture(folder / "fit.png", partial(plot.fit, model, shown, fit_start=fitted), 10.0)
    picture(folder / "residual.png", partial(plot.residual, model, shown, fit_start=fitted), 10.0, 3.5)
    u = train.u[0]
    v_hat = intermediate_seen(model, train)
    picture(folder / "loop.png", partial(draw_loop, model=model, u=u, v_hat=v_hat), 6.0, 6.0)
    picture(folder / "bode.png", partial(plot.bode, model.linear, model.rate, refinement=model.refinement))
    found = model.identification
    if found is None:
        return
    if found.candidates:
        picture(folder / "candidates.png", partial(plot.candidates, model))
    if found.fir is not None:
        picture(folder / "markov.png", partial(plot.markov, found.fir))
    if len(found.singular_values):
        values = found.singular_values
        picture(folder / "singular_values.png", partial(plot.singular_values, model.linear, values=values))


def intermediate_seen(model: Model, record: Record) -> NDArray[np.float64] | None:
    """Return the estimate of v from the measured output of the first experiment, or None if it is too noisy.

    Samples at the ends that the inverse of G cannot estimate are NaN. The result is None for a model of
    several inputs or outputs.
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
    noise = model.error(record, fit_start=True)["rms"] * float(np.linalg.norm(inverse.taps))
    return v_hat if noise < NOISE_SHARE * float(np.ptp(model.intermediate(record.u[0]))) else None
