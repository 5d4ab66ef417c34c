"""The main properties of a stage: sensitivity, width of the hysteresis loop, first resonance."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Model, Record

Range = tuple[float, float]  # lowest and highest value of an input

# Number of samples of each branch of the loop.
BRANCH = 500
# Largest number of pairs of input and output that are described by sentences.
FEW = 2
# Width of a loop, relative to the travel, below which it is rounding.
ROUNDING = 1e-12
# Damping ratio above which a pair of poles shows no peak in the frequency response.
DAMPED = 0.7


def stage(model: Model, record: Record) -> dict[str, Any]:
    """Return the main properties of a stage, for the range of a record's inputs.

    The loop is that of slow motion over the range of each input. It contains the hysteresis and the DC gain
    of the linear part, ``G(1) v``. It does not contain effects such as creep, or forces inside the mechanics.

    Parameters
    ----------
    model
        A model of the stage.
    record
        The record that defines the range of the inputs.

    Returns
    -------
    dict
        ``loops``, a list of ``input``, ``output``, ``range``, ``sensitivity`` (change of the output over
        change of the input, over the whole range, in ``unit``) and ``width`` (the largest opening of the loop
        over the travel of the output); ``first_resonance`` with ``frequency_hz`` and ``damping``, or None if
        no pair of poles has a damping ratio below 0.7; ``without``, the effects that are forces inside the
        mechanics, which change the sensitivity and the resonance.

    Examples
    --------
    >>> found = gpi.explain(record)  # doctest: +SKIP
    >>> stage(found.model, record)["first_resonance"]  # doctest: +SKIP
    {'frequency_hz': 812.3, 'damping': 0.021}
    """
    found = loops(model, input_ranges(record), model.linear.dc_gain)
    return {"loops": found, "first_resonance": first_resonance(model), "without": inner_forces(model)}


def inner_forces(model: Model) -> list[str]:
    """Return the names of the effects that are forces inside the mechanics."""
    described = json.loads(model.to_json()).get("effects", [])
    return sorted({effect["name"] for effect in described if "loops" in effect})


def input_ranges(record: Record) -> list[Range]:
    """Return the smallest and the largest value of each input of a record."""
    lows, highs = (np.array([end(u, axis=0) for u in record.u]) for end in (np.min, np.max))
    return [(float(low), float(high)) for low, high in zip(lows.min(axis=0), highs.max(axis=0), strict=True)]


def loops(model: Model, ranges: Sequence[Range | None], gain: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return the loops of slow motion, with all outputs, of every input whose range is given.

    `gain` is the DC gain of the linear part, shape (outputs, inputs).
    """
    found = []
    for i, (name, unit) in enumerate(zip(model.input_names, model.input_units, strict=True)):
        own = ranges[i]
        if own is None:
            continue
        low, high = own
        rise, fall = np.linspace(low, high, BRANCH), np.linspace(high, low, BRANCH)
        # the first cycle removes the influence of the initial state
        v = model.hysteresis[i](np.concatenate([rise, fall, rise, fall]))
        up, down = v[2 * BRANCH : 3 * BRANCH], v[3 * BRANCH :][::-1]
        travel = float(up[-1] - up[0])
        width = float(np.abs(down - up).max() / abs(travel)) if travel else 0.0
        # rounding
        width = width if width > ROUNDING else 0.0
        for o, (output, output_unit) in enumerate(zip(model.output_names, model.output_units, strict=True)):
            found.append(
                {
                    "input": name,
                    "output": output,
                    "range": [low, high],
                    "sensitivity": float(gain[o, i]) * travel / (high - low) if high > low else 0.0,
                    "unit": f"{output_unit}/{unit}" if output_unit and unit else "",
                    "width": width,
                }
            )
    return found


def first_resonance(model: Model) -> dict[str, float] | None:
    """Return the lowest natural frequency of a pair of poles that shows a peak, and its damping ratio."""
    found = [natural(pole, model.rate) for pole in resonant_poles(model)]
    return dict(zip(("frequency_hz", "damping"), found[0], strict=True)) if found else None


def resonant_poles(model: Model) -> list[complex]:
    """Return one pole of each pair that shows a peak, the lowest natural frequency first."""
    upper = [complex(pole) for pole in model.linear.poles if pole.imag > 0]
    known = [(natural(pole, model.rate), pole) for pole in upper]
    peaks = [(frequency, pole) for (frequency, damping), pole in known if damping < DAMPED]
    return [pole for _, pole in sorted(peaks, key=lambda one: one[0])]


def natural(pole: complex, rate: float) -> tuple[float, float]:
    """Return the natural frequency in Hz and the damping ratio of a pole, for a sampling rate in Hz."""
    continuous = np.log(complex(pole)) * rate
    return float(abs(continuous)) / (2 * np.pi), float(-continuous.real / abs(continuous))


def stage_in_words(found: dict[str, Any]) -> list[str]:
    """Return the properties as sentences: the pairs of channels, unless there are many, and the resonance."""
    loops = found["loops"] if len(found["loops"]) <= FEW else []
    without = " and ".join(found["without"])
    where = f"of the linear part, without {without}, " if without else ""
    sentences = []
    for one in loops:
        gain = f"{one['sensitivity']:.4g} {one['unit']}".rstrip()
        low, high = (f"{end:.4g}" for end in one["range"])
        ends = f"between {low} and {high} {one['unit'].partition('/')[2]}".rstrip()
        sentences.append(
            f"For slow motion, the sensitivity {where}from {one['input']} to {one['output']} is {gain} "
            f"{ends}. The width of the hysteresis loop is {100 * one['width']:.2g} % of the travel."
        )
    resonance = found["first_resonance"]
    if resonance:
        sentences.append(
            f"The first resonance {where}is at {resonance['frequency_hz']:.4g} Hz with a damping of "
            f"{resonance['damping']:.2g}."
        )
    return sentences
