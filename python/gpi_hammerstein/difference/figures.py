"""Figures of a stage that follow from the numbers of its model, with standard deviations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Model, NumericalError
from gpi_hammerstein.difference.neighbours import Neighbours
from gpi_hammerstein.difference.ranges import is_linear
from gpi_hammerstein.stage import Range, loops, natural, resonant_poles

Array = NDArray[np.float64]

# Frequencies of the search for the bandwidth, over half the sampling rate.
FREQUENCIES: Array = np.geomspace(1e-5, 1.0, 2000)


@dataclass(frozen=True)
class Figure:
    """A figure of a model: its name, unit, value and standard deviation, None if it is not known."""

    name: str
    unit: str
    value: float
    std: float | None


@dataclass(frozen=True)
class Figures:
    """The figures of a model: those that every model has, and frequency and damping of each resonance."""

    plain: list[Figure]
    resonances: list[tuple[Figure, Figure]]


def figures_of(own: Neighbours, ranges: Sequence[Range | None]) -> Figures:
    """Return the figures of a model.

    Parameters
    ----------
    own
        The model.
    ranges
        The range of each input, in its unit; None leaves its sensitivities and its hysteresis out.

    Returns
    -------
    Figures
        For each pair of channels ``sensitivity``, the change of the output over the change of the input in
        slow motion over the range; for each input ``hysteresis_width``, the largest opening of this loop over
        its travel; for each output ``bandwidth``, the lowest frequency at which ``|G|`` is below ``|G(1)| /
        sqrt 2``, for the input with the largest gain; for each output ``offset``; the natural frequency and
        the damping ratio of each resonance. Effects are not contained.
    """
    model = own.model
    poles = resonant_poles(model)
    plain = _plain(model, ranges)

    def follows(neighbour: Model) -> Array:
        values = [one.value for one in _plain(neighbour, ranges)]
        near = [_nearest(neighbour, pole) for pole in poles]
        return np.array([*values, *(part for pole in near for part in natural(pole, model.rate))])

    deviation = own.deviation(follows)
    deviations: list[float | None] = [None] * (len(plain) + 2 * len(poles))
    if deviation is not None:
        total = np.hypot(deviation, _beyond_the_axes(own, ranges, len(poles)))
        deviations = [std if np.isfinite(std) else None for std in total.tolist()]
    sure = [replace(one, std=std) for one, std in zip(plain, deviations, strict=False)]
    resonances = []
    for place, pole in enumerate(poles):
        frequency, damping = natural(pole, model.rate)
        first, second = deviations[len(plain) + 2 * place :][:2]
        pair = Figure("frequency", "Hz", frequency, first), Figure("damping", "", damping, second)
        resonances.append(pair)
    return Figures([one for one in sure if np.isfinite(one.value)], resonances)


def _plain(model: Model, ranges: Sequence[Range | None]) -> list[Figure]:
    """Return the figures that every model has; nan where the figure does not exist."""
    gain = _gain(model)
    found = loops(model, ranges, gain)
    values = [
        Figure(f"sensitivity[{one['input']} -> {one['output']}]", one["unit"], one["sensitivity"], None)
        for one in found
    ]
    widths = _widths(model, found)
    values += [Figure(f"hysteresis_width[{name}]", "", width, None) for name, width in widths.items()]
    for name, frequency in zip(model.output_names, _bandwidths(model, gain), strict=True):
        values.append(Figure(f"bandwidth[{name}]", "Hz", frequency, None))
    for name, unit, offset in zip(model.output_names, model.output_units, model.offsets, strict=True):
        values.append(Figure(f"offset[{name}]", unit, float(offset), None))
    return values


def _widths(model: Model, found: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the width of the loop of each input; that of a gain is zero, without rounding."""
    gains = {name for name, own in zip(model.input_names, model.hysteresis, strict=True) if is_linear(own)}
    return {one["input"]: 0.0 if one["input"] in gains else one["width"] for one in found}


def _gain(model: Model) -> Array:
    """Return the DC gain of the linear part; nan if it integrates or is unstable."""
    try:
        return model.linear.dc_gain
    except NumericalError:
        return np.full((len(model.output_names), len(model.input_names)), np.nan)


def _bandwidths(model: Model, gain: Array) -> list[float]:
    gain = np.abs(gain)
    response = np.abs(model.linear.frequency_response(np.pi * FREQUENCIES))
    found = []
    for output, gains in enumerate(gain):
        strongest = int(np.argmax(gains))
        with np.errstate(divide="ignore", invalid="ignore"):
            level = np.log2(response[:, output, strongest] / gains[strongest]) + 0.5
        below = np.flatnonzero(level < 0)
        if not np.isfinite(gains[strongest]) or not len(below) or below[0] == 0:
            found.append(np.nan)
            continue
        after, before = below[0], below[0] - 1
        part = level[before] / (level[before] - level[after])
        frequency = FREQUENCIES[before] * (FREQUENCIES[after] / FREQUENCIES[before]) ** part
        found.append(float(0.5 * model.rate * frequency))
    return found


def _nearest(model: Model, pole: complex) -> complex:
    poles = model.linear.poles
    return complex(poles[np.argmin(np.abs(poles - pole))])


def _beyond_the_axes(own: Neighbours, ranges: Sequence[Range | None], resonances: int) -> Array:
    """Return what the axes do not contain of the standard deviations: misfit, and what is not determined.

    The ends of a loop are uncertain by about twice the misfit of the training data, scaled to the movement,
    as in the expected error of `compensate`. Over a ramp, this is about the same part of the travel as the
    misfit is of the movement. How much the misfit changes the dynamics is not known. A figure of parameters
    that the data do not determine is infinitely uncertain.
    """
    model, part = own.model, own.misfit / own.movement
    found = loops(model, ranges, _gain(model))
    widths = _widths(model, found)
    opened = dict(zip(model.input_names, own.open_inputs, strict=True))
    # with a single input and output, the gain of G is one
    is_gain_open = own.is_open and len(own.open_inputs) * len(own.open_outputs) > 1
    of_dynamics = np.inf if own.is_open or own.is_biased else 0.0
    sensitivities = [
        np.inf
        if opened[one["input"]] or is_gain_open
        else abs(one["sensitivity"]) * part[model.output_names.index(one["output"])]
        for one in found
    ]
    openings = [np.inf if opened[name] else part.max() if width else 0.0 for name, width in widths.items()]
    bandwidths = np.full(len(part), of_dynamics)
    offsets = np.where(own.open_outputs, np.inf, own.misfit)
    return np.array([*sensitivities, *openings, *bandwidths, *offsets, *np.full(2 * resonances, of_dynamics)])
