"""The pictures of the page that do not change: loops, and the responses of the linear part."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from gpi_hammerstein import plot
from gpi_hammerstein._native import Explanation, Model, StateSpace, era
from gpi_hammerstein.plot.linear import settling_taps
from gpi_hammerstein.plot.style import BLACK, BLUE, ORANGE, VERMILION, label, pale, with_bands
from gpi_hammerstein.report.series import Errors
from gpi_hammerstein.report.svg import Draw
from gpi_hammerstein.uncertain import BAND

# Largest number of experiments, and of inputs, whose loop is drawn.
MOST_EXPERIMENTS, MOST_INPUTS = 4, 4
# Largest number of Markov parameters for a Hankel matrix.
MOST_TAPS = 400
# Samples of the loop that are drawn as lines; more lines would cover one another.
STRETCH = 1200
# Samples of the whole record in the picture of the loop.
MOST_POINTS = 20_000
# Samples of each branch of the slow loop.
BRANCH = 80
# Swings of the slow loop, as parts of the range of the input: large and small loops in one picture.
SWINGS = (1.0, 0.6, 0.3)
USUAL, SQUARE = (7.0, 4.2), (5.5, 5.0)


@dataclass(frozen=True)
class Picture:
    """A picture: name, caption, how it is drawn, size in inches, and the experiment if it has one."""

    key: str
    what: str
    draw: Draw
    size: tuple[float, float]
    experiment: int | None = None


def loop_pictures(found: Explanation, errors: Errors) -> Iterator[Picture]:
    """Yield the loops of the record and of the model."""
    record = errors.record
    y, u = record.output_names[0], record.input_names[0]
    for k in range(min(len(errors.after), MOST_EXPERIMENTS)):
        when = f", experiment {k}" if len(errors.after) > 1 else ""
        yield Picture(
            f"loop-{k}",
            f"{y} over {u}{when}: all scored samples in grey; measured, before and after for the samples "
            "around the largest error.",
            partial(draw_loop, errors, k),
            SQUARE,
            k,
        )
    for index, name in enumerate(record.input_names[:MOST_INPUTS]):
        yield Picture(
            f"slow-{index}",
            f"Hysteresis of the model for slow motion of {name}: the intermediate signal, which drives the "
            "linear part, over the input. The band is that of the parameters' uncertainty, 95 %.",
            partial(draw_slow_loop, found, index),
            SQUARE,
        )


def linear_pictures(model: Model) -> Iterator[Picture]:
    """Yield the pictures of the linear part."""
    yield Picture(
        "bode",
        "Frequency response of the linear part, with 95 % bands if they are known.",
        lambda ax: plot.bode(model.linear, model.rate, ax, refinement=model.refinement),
        USUAL,
    )
    yield Picture("markov", "Markov parameters of the linear part.", lambda ax: plot.markov(model, ax), USUAL)
    yield Picture(
        "singular-values",
        "Singular values of the Hankel matrix of these Markov parameters.",
        lambda ax: plot.singular_values(realised(model), ax),
        USUAL,
    )


def draw_loop(errors: Errors, experiment: int, ax: Axes) -> None:
    """Draw the first output over the first input: all samples as pixels, and a stretch of them as lines."""
    record = errors.record
    u, y = record.u[experiment][:, 0], record.y[experiment][:, 0]
    scored = slice(errors.warmups[experiment], None)
    every = max(1, len(u[scored]) // MOST_POINTS)
    ax.plot(u[scored][::every], y[scored][::every], ".", ms=1, color="#888888", alpha=0.5, rasterized=True)
    first, last = errors.largest(experiment, 0)
    middle = (first + last) // 2
    part = slice(max(errors.warmups[experiment], middle - STRETCH // 2), middle + STRETCH // 2)
    before, after = (error[experiment][part, 0] for error in (errors.before, errors.after))
    ax.plot(u[part], y[part] - before, color=ORANGE, lw=0.9, label="before")
    ax.plot(u[part], y[part], color=BLACK, lw=0.9, label="measured")
    ax.plot(u[part], y[part] - after, color=BLUE, lw=0.8, ls="--", label="after")
    ax.set_xlabel(label(record.input_names[0], record.input_units[0]))
    ax.set_ylabel(label(record.output_names[0], record.output_units[0]))
    # the place is fixed, because the search for the best one takes long
    ax.legend(loc="upper left")


def draw_slow_loop(found: Explanation, index: int, ax: Axes) -> None:
    """Draw the intermediate signal of one input for slow loops of several swings."""
    model, record = found.model, found.record
    u = slow_drive(record.u, index)
    v = model.intermediate(u)[:, index]
    drawn = slice(2 * BRANCH, None)
    ax.plot(u[drawn, index], v[drawn], color=VERMILION, lw=1.0)
    if (known := with_bands(model.refinement)) is not None:
        half = BAND * known.loop_std(u)[:, index]
        for first in range(2 * BRANCH, len(u), BRANCH):
            # each branch is a line over the input, with its own band; the last point begins the next branch
            part = slice(first, first + BRANCH + 1)
            ax.fill_between(
                u[part, index],
                v[part] - half[part],
                v[part] + half[part],
                color=pale(VERMILION),
                lw=0,
                zorder=1,
            )
    ax.set_xlabel(label(record.input_names[index], record.input_units[index]))
    unit = record.output_units[0] if len(record.output_names) == 1 else ""
    ax.set_ylabel(label("intermediate signal v", unit))


def slow_drive(u: list[NDArray[np.float64]], index: int) -> NDArray[np.float64]:
    """Return an input that moves slowly over the range of a channel; the others stand still at their means.

    Parameters
    ----------
    u
        Inputs of each experiment, shape (samples, inputs).
    index
        The channel.

    Returns
    -------
    ndarray
        Shape (samples, inputs). The first two branches remove the influence of the initial state.
    """
    low, high = min(float(one[:, index].min()) for one in u), max(float(one[:, index].max()) for one in u)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    corners = [-1.0]
    for swing in (SWINGS[0], *SWINGS):
        corners += [swing, -swing]
    path = np.interp(np.arange(BRANCH * (len(corners) - 1)), BRANCH * np.arange(len(corners)), corners)
    drive = np.tile(np.concatenate(u).mean(axis=0), (len(path), 1))
    drive[:, index] = middle + half * path
    return drive


def realised(model: Model) -> StateSpace:
    """Return the linear part as a result of ERA, which contains singular values."""
    taps = max(settling_taps(model.linear), 4 * model.linear.order + 2)
    return era(model.linear.markov(min(taps, MOST_TAPS)), max(model.linear.order, 1))
