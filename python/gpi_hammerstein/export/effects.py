"""The effects of the catalogue as operations on one sample, from their parameters in a model file.

The equations are those of the page on theory, (E1) to (E13) and (E16). An effect that is not in
:data:`EXPORTED` cannot be exported.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from gpi_hammerstein.export.operations import Array, Operation, Place

Parameters = Mapping[str, Any]


@dataclass(frozen=True)
class Around:
    """What an effect must know of the model."""

    rate: float
    states: int
    inputs: int
    #: The half-widths of the plays of each input.
    half_widths: list[Array]
    #: A and B of the dynamics.
    a: Array
    b: Array
    #: Steps of the loops from one sample to the next.
    substeps: int


def share(time_constant: float, rate: float) -> float:
    """Return the part of a difference that a first-order lag makes up for in one sample."""
    return -float(np.expm1(-1.0 / (time_constant * rate))) if time_constant > 0.0 else 1.0


def delay(own: Parameters, around: Around) -> list[Operation]:
    """(E1): the input of n + f samples before, linearly interpolated."""
    whole = int(own["samples"])
    numbers = {"last": whole + 1, "part": own["samples"] - whole}
    return [Operation("delay", "input", own["input"], numbers, memory=whole + 2, standing=np.ones(whole + 2))]


def amplifier_slew(own: Parameters, around: Around) -> list[Operation]:
    """(E2): the change of the drive from sample to sample is limited."""
    numbers = {"reach": own["limit"] / around.rate}
    return [Operation("slew", "input", own["input"], numbers, memory=1, standing=np.ones(1))]


def rate_dependence(own: Parameters, around: Around) -> list[Operation]:
    """(E3): half-widths grow with the speed of the drive, or with a function of it behind a lag."""
    numbers: dict[str, float | int] = {"relative": own["relative"], "absolute": own["absolute"]}
    law = own.get("law")
    if law is None:
        return [Operation("widened", "widths", own["input"], numbers)]
    numbers |= {"share": share(law["lag"], around.rate), "exponent": law["exponent"], "knee": law["knee"]}
    return [Operation("widened", "widths", own["input"], numbers, memory=1)]


def hysteresis_shape(own: Parameters, around: Around) -> list[Operation]:
    """(E4): plays are read through curves, with one row of factors of Legendre polynomials for each play."""
    half_widths = around.half_widths[own["input"]]
    coefficients = np.reshape(own["coefficients"], (-1, own["widths"]))
    places = np.clip(2.0 * half_widths / own["widest"] - 1.0, -1.0, 1.0)
    rows = legendre.legvander(places, own["widths"] - 1) @ coefficients.T
    # the play without width is read as it is
    rows[half_widths == 0.0] = 0.0
    numbers = {"degrees": len(coefficients), "middle": own["middle"], "scale": own["scale"]}
    return [Operation("curved", "curves", own["input"], numbers, {"rows": rows})]


def linear_dynamics(own: Parameters, around: Around) -> list[Operation]:
    """(E5): a section of second order in parallel with G."""
    (a1, a2), (b1, b2) = own["denominator"], own["numerator"]
    first = (b1 + b2) / (1.0 + a1 + a2)
    numbers = {"a1": a1, "a2": a2, "b1": b1, "b2": b2}
    standing = np.array([first, b2 - a2 * first])
    return [
        Operation(
            "section",
            "parallel",
            own["input"],
            numbers,
            memory=2,
            standing=standing,
            late=own["dead_time"],
        )
    ]


def creep(own: Parameters, around: Around) -> list[Operation]:
    """(E6): first-order lags in parallel with G."""
    shares = np.array([share(time, around.rate) for time in own["time_constants"]])
    count = len(shares)
    if count == 0:
        return []
    arrays = {"shares": shares, "gains": np.array(own["gains"], dtype=np.float64)}
    # the second half holds rounding errors
    standing = np.repeat([1.0, 0.0], count)
    return [
        Operation(
            "lags",
            "parallel",
            own["input"],
            arrays=arrays,
            memory=2 * count,
            standing=standing,
            late=own["dead_time"],
        )
    ]


def stiffness(own: Parameters, around: Around) -> list[Operation]:
    """(E7), (E16), (E17), (E19): forces and limits, which depend on what they see, drive the states."""
    loops = (_loop(inner, around) for inner in own["loops"])
    # stops of which there are none have no force
    return [own for own in loops if own.kind != "stops" or own.memory > 0]


def _driven(drives: Any, around: Around) -> Array:
    """Return a column of E. A force enters where an input does, behind the dead time."""
    column = np.zeros(around.states)
    if isinstance(drives, list):
        column[around.states - len(drives) :] = drives
        return column
    first = around.states - drives["states"]
    entered = around.b if first == 0 else around.a[:, first - around.inputs : first]
    column[first:] = -drives["force"] * entered[first:, drives["input"]]
    return column


def _loop(inner: Parameters, around: Around) -> Operation:
    drives = _driven(inner["drives"], around)
    seen, output = None, 0
    if "output" in inner["sees"]:
        output = inner["sees"]["output"]
    else:
        states, inputs = (np.array(inner["sees"]["mixture"][key]) for key in ("states", "inputs"))
        own = around.states - len(states)
        seen = np.zeros(around.states + around.inputs)
        seen[own : around.states] = states
        # behind a dead time, v leaves the last states of its shift register
        first = own - around.inputs if own > 0 else around.states
        seen[first : first + around.inputs] = inputs
    if "power" in inner["law"]:
        law = inner["law"]["power"]
        numbers = {"exponent": int(law["exponent"]), "scale": law["scale"]}
        return Operation("power", "loops", output, numbers, seen=seen, drives=drives)
    if "bouc-wen" in inner["law"]:
        law = inner["law"]["bouc-wen"]
        return Operation("bouc_wen", "loops", output, dict(law), memory=3, seen=seen, drives=drives)
    if "dahl" in inner["law"]:
        law = inner["law"]["dahl"]
        numbers = {"distance": law["distance"], "averaged": int(law["averaged"])}
        return Operation("dahl", "loops", output, numbers, memory=3, seen=seen, drives=drives)
    if inner["law"] == "speed":
        numbers = {"pace": float(around.substeps)}
        return Operation("speed", "loops", output, numbers, memory=1, seen=seen, drives=drives)
    if "damping" in inner["law"]:
        numbers = {"scale": inner["law"]["damping"]["scale"], "pace": float(around.substeps)}
        return Operation("damping", "loops", output, numbers, memory=1, seen=seen, drives=drives)
    if "excess" in inner["law"]:
        law = inner["law"]["excess"]
        numbers = {"limit": law["limit"], "is_lower": int(law["is_lower"])}
        return Operation("excess", "loops", output, numbers, seen=seen, drives=drives)
    law = inner["law"]["stops"]
    arrays = {key: np.array(law[key]) for key in ("half_widths", "weights")}
    count = len(law["weights"])
    return Operation("stops", "loops", output, arrays=arrays, memory=count, seen=seen, drives=drives)


def output_nonlinearity(own: Parameters, around: Around) -> list[Operation]:
    """(E8): a polynomial of the displacement, within the range of the sensor."""
    operations = []
    if own["coefficients"]:
        numbers = {"middle": own["middle"], "scale": own["scale"]}
        arrays = {"coefficients": np.array(own["coefficients"], dtype=np.float64)}
        operations.append(Operation("polynomial", "output", own["output"], numbers, arrays))
    for end, kind in (("lowest", "no_less"), ("highest", "no_more")):
        if own.get(end) is not None:
            operations.append(Operation(kind, "output", own["output"], {end: own[end]}))
    return operations


def gain_drift(own: Parameters, around: Around) -> list[Operation]:
    """(E9): the sensitivity is a smooth function of time."""
    return [_of_time("scaled", "output", own, around)]


def backlash(own: Parameters, around: Around) -> list[Operation]:
    """(E10): the output follows while the gap is closed; (E18): a force hardly grows while it is open."""
    if own.get("missing") is not None:
        numbers = {"half_width": own["half_width"], "missing": own["missing"]}
        return [Operation("gap", "output", own["output"], numbers)]
    return [Operation("backlash", "output", own["output"], {"half_width": own["half_width"]}, memory=1)]


def drift(own: Parameters, around: Around) -> list[Operation]:
    """(E11): a smooth function of time is added."""
    return [_of_time("at_knots", _added(own), own, around)]


def _of_time(kind: str, place: Place, own: Parameters, around: Around) -> Operation:
    changes = np.array(own["changes"], dtype=np.float64)
    # knots a sample
    numbers = {"pace": len(changes) / (own["duration"] * around.rate)}
    return Operation(kind, place, own["output"], numbers, {"changes": changes}, timed=True)


def periodic_disturbance(own: Parameters, around: Around) -> list[Operation]:
    """(E12): a sinusoid is added; its phase is counted in turns."""
    turns = own["frequency"] / around.rate % 1.0
    numbers = {"turns": turns, "turns_rest": 0.0, "cosine": own["cosine"], "sine": own["sine"]}
    return [Operation("sinusoid", _added(own), own["output"], numbers, memory=2)]


def covariate(own: Parameters, around: Around) -> list[Operation]:
    """(E13): another measured column is added, directly or through a lag."""
    numbers = {"share": share(own["time_constant"], around.rate), "gain": own["gain"]}
    numbers["start"] = own.get("start", 0.0)
    return [
        Operation(
            "leak",
            _added(own),
            own["output"],
            numbers,
            memory=2,
            timed=True,
            column=own["column"],
            label=own["label"],
        )
    ]


def _added(own: Parameters) -> Place:
    return "displaced" if own.get("moves_stage", False) else "added"


def finding(own: Parameters, around: Around) -> list[Operation]:
    """Nothing: a description of the residual is not simulated."""
    return []


#: The operations of every effect that can be exported.
EXPORTED: dict[str, Callable[[Parameters, Around], list[Operation]]] = {
    "delay": delay,
    "amplifier-slew": amplifier_slew,
    "rate-dependence": rate_dependence,
    "hysteresis-shape": hysteresis_shape,
    "linear-dynamics": linear_dynamics,
    "creep": creep,
    "stiffness": stiffness,
    "hysteretic-stiffness": stiffness,
    "friction": stiffness,
    "saturation": stiffness,
    "output-nonlinearity": output_nonlinearity,
    "gain-drift": gain_drift,
    "backlash": backlash,
    "drift": drift,
    "periodic-disturbance": periodic_disturbance,
    "covariate": covariate,
    "outliers": finding,
    "coloured-noise": finding,
}
