"""What an engineer asks of a stage first: sensitivity, width of the loop, first resonance."""

from typing import Any

import numpy as np

from gpi_hammerstein._native import Model, Record

# Samples of each branch of the loop.
BRANCH = 500
# Pairs of input and output that sentences can hold.
FEW = 2
# A pair of poles that is damped more shows no peak.
DAMPED = 0.7


def stage(model: Model, record: Record) -> dict[str, Any]:
    """Return what a model says of the stage, in the range of a record's inputs.

    The loop is that of slow motion from end to end of each input's range, through hysteresis and the gain of
    the linear part at rest, ``G(1) v``; effects such as creep come on top of it.

    Parameters
    ----------
    model
        A model of the stage.
    record
        The record whose inputs give the range.

    Returns
    -------
    dict
        ``loops``, rows of ``input``, ``output``, ``range``, ``sensitivity`` (output over input from end to
        end, in ``unit``) and ``width`` (the loop's largest opening over the output's travel);
        ``first_resonance`` with ``frequency_hz`` and ``damping``, None where no pair of poles is damped less
        than 0.7.

    Examples
    --------
    >>> found = gpi.explain(record)  # doctest: +SKIP
    >>> stage(found.model, record)["first_resonance"]  # doctest: +SKIP
    {'frequency_hz': 812.3, 'damping': 0.021}
    """
    gain = model.linear.dc_gain
    loops = []
    for i, (name, unit) in enumerate(zip(model.input_names, model.input_units, strict=True)):
        low = min(float(u[:, i].min()) for u in record.u)
        high = max(float(u[:, i].max()) for u in record.u)
        rise, fall = np.linspace(low, high, BRANCH), np.linspace(high, low, BRANCH)
        # the first way up and down forgets what was before
        v = model.hysteresis[i](np.concatenate([rise, fall, rise, fall]))
        up, down = v[2 * BRANCH : 3 * BRANCH], v[3 * BRANCH :][::-1]
        travel = float(up[-1] - up[0])
        width = float(np.abs(down - up).max() / abs(travel)) if travel else 0.0
        for o, (output, output_unit) in enumerate(zip(model.output_names, model.output_units, strict=True)):
            loops.append(
                {
                    "input": name,
                    "output": output,
                    "range": [low, high],
                    "sensitivity": float(gain[o, i]) * travel / (high - low) if high > low else 0.0,
                    "unit": f"{output_unit}/{unit}" if output_unit and unit else "",
                    "width": width,
                }
            )
    return {"loops": loops, "first_resonance": first_resonance(model)}


def first_resonance(model: Model) -> dict[str, float] | None:
    """Return the lowest frequency of a pair of poles that shows as a peak, and its damping."""
    found = []
    for pole in model.linear.poles:
        if pole.imag > 0:
            frequency, damping = natural(pole, model.rate)
            if damping < DAMPED:
                found.append({"frequency_hz": frequency, "damping": damping})
    return min(found, key=lambda one: one["frequency_hz"]) if found else None


def natural(pole: complex, rate: float) -> tuple[float, float]:
    """Return natural frequency in Hz and damping ratio of a pole at a sampling rate in Hz."""
    continuous = np.log(complex(pole)) * rate
    return float(abs(continuous)) / (2 * np.pi), float(-continuous.real / abs(continuous))


def stage_in_words(found: dict[str, Any]) -> list[str]:
    """Return the same in words: a sentence a pair of channels, where they are few, and the resonance."""
    loops = found["loops"] if len(found["loops"]) <= FEW else []
    sentences = []
    for one in loops:
        gain = f"{one['sensitivity']:.4g} {one['unit']}".rstrip()
        low, high = (f"{end:.4g}" for end in one["range"])
        ends = f"between {low} and {high} {one['unit'].partition('/')[2]}".rstrip()
        sentences.append(
            f"From {one['input']} to {one['output']} in slow motion: {gain} {ends}, a hysteresis loop "
            f"{100 * one['width']:.2g} % of the travel wide."
        )
    resonance = found["first_resonance"]
    if resonance:
        sentences.append(
            f"The first resonance is at {resonance['frequency_hz']:.4g} Hz with a damping of "
            f"{resonance['damping']:.2g}."
        )
    return sentences
