"""Models with every effect, with inputs and covariates, for the tests of what is exported."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import test_inner_loops as two_axes
from records import model_of
from test_effects import plant, wander, with_effect

Array = NDArray[np.float64]


class Case(NamedTuple):
    """A model and what drives it."""

    model: gpi.Model
    u: Array
    covariates: Array | None = None

    @property
    def expected(self) -> Array:
        """The outputs of the library, (samples, outputs)."""
        y = self.model.simulate(self.u, covariates=self.covariates)
        return np.reshape(y, (len(self.u), -1))


EFFECTS: dict[str, dict[str, Any]] = {
    "delay": {"input": 0, "samples": 2.25},
    "amplifier-slew": {"input": 0, "limit": 200.0},
    "rate-dependence": {
        "input": 0,
        "relative": 1e-3,
        "absolute": 2e-3,
        "law": {"exponent": 0.4, "knee": 30.0, "lag": 2e-3},
        "speed": 100.0,
        "widest": 1.3,
    },
    "hysteresis-shape": {
        "input": 0,
        "coefficients": [0.2, 0.1, -0.1, 0.05, 0.02, 0.01],
        "widths": 3,
        "middle": 0.1,
        "scale": 3.0,
        "widest": 1.2,
    },
    "linear-dynamics": {
        "input": 0,
        "denominator": [-1.5, 0.9],
        "numerator": [0.02, 0.03],
        "rate": 1000.0,
        "dead_time": 3,
    },
    "creep": {"input": 0, "time_constants": [0.1, 2.0], "gains": [0.1, 0.3], "dead_time": 3},
    "stiffness": {
        "loops": [
            {
                "sees": {"output": 0},
                "law": {"power": {"exponent": 3, "scale": 4.0}},
                "drives": [-0.02, 0.01, 0.005],
            },
            {
                "sees": {"output": 0},
                "law": {"damping": {"scale": 0.2}},
                "drives": [-0.03, 0.02, 0.0],
            },
        ]
    },
    "hysteretic-stiffness": {
        "loops": [
            {
                "sees": {"output": 0},
                "law": {"bouc-wen": {"beta": 0.4, "gamma": -0.3, "exponent": 1.4}},
                "drives": [-0.03, 0.01, 0.002],
            }
        ]
    },
    "friction": {
        "loops": [
            {
                "sees": {"output": 0},
                "law": {"dahl": {"distance": 0.6, "averaged": True}},
                "drives": {"input": 0, "force": 0.15, "states": 3},
            },
            {
                "sees": {"output": 0},
                "law": {"dahl": {"distance": 0.2, "averaged": False}},
                "drives": [-0.04, 0.01, 0.0],
            },
            {"sees": {"output": 0}, "law": "speed", "drives": {"input": 0, "force": -0.1, "states": 3}},
        ]
    },
    "saturation": {
        "loops": [
            {
                "sees": {"output": 0},
                "law": {"excess": {"limit": 0.7, "is_lower": False}},
                "drives": [-0.2, 0.05, 0.0],
            },
            {
                "sees": {"mixture": {"states": [0.5, 0.2, -0.1], "inputs": [0.2]}},
                "law": {"excess": {"limit": -0.2, "is_lower": True}},
                "drives": [-0.1, 0.0, 0.05],
            },
        ]
    },
    "output-nonlinearity": {
        "output": 0,
        "coefficients": [0.02, 0.01],
        "middle": 0.3,
        "scale": 5.0,
        "lowest": -3.8,
        "highest": 4.4,
    },
    "gain-drift": {"output": 0, "changes": [0.02, 0.01, -0.03], "duration": 2.0},
    "backlash": {"output": 0, "half_width": 0.05},
    "drift": {
        "output": 0,
        "moves_stage": True,
        "changes": [0.2, 0.1, -0.3, 0.1],
        "duration": 1.0,
        "span": 1.0,
    },
    "periodic-disturbance": {
        "output": 0,
        "frequency": 50.3,
        "cosine": 0.1,
        "sine": 0.2,
        "duration": 10.0,
        "span": 1.0,
    },
    "covariate": {
        "output": 0,
        "column": 1,
        "label": "temperature",
        "gain": 0.4,
        "time_constant": 0.2,
        "step": 1e-3,
        "start": 1.5,
        "range": 2.0,
    },
}


def changed(model: gpi.Model, **parts: Any) -> gpi.Model:
    described = json.loads(model.to_json())
    return gpi.Model.from_json(json.dumps(described | parts))


def with_effects(*names: str, model: gpi.Model | None = None) -> gpi.Model:
    model = model_of(plant()) if model is None else model
    for name in names:
        model = with_effect(model, name=name, **EFFECTS[name])
    return model


def columns(samples: int) -> Array:
    t = np.arange(samples)
    return np.stack([np.cos(0.1 * t), 3.0 + np.sin(0.01 * t)], axis=1)


def every_effect() -> Case:
    u = wander(2500)
    return Case(with_effects(*EFFECTS), u, columns(len(u)))


def declared() -> Case:
    """Directional deadzones and a pure gain, which has no states."""
    model = model_of(plant())
    hysteresis = json.loads(model.to_json())["hysteresis"]
    hysteresis[0]["envelope"]["reading"] = "directional"
    gain = {"a": [[], 0, 0], "b": [[], 0, 1], "c": [[], 1, 0], "d": [[2.0], 1, 1]}
    return Case(changed(model, hysteresis=hysteresis, linear=gain), 0.3 + wander(1000))


def late_dynamics() -> Case:
    """Dead time in G, creep behind it, and straight growth of the half-widths."""
    model = with_effects("creep", "covariate", model=model_of(plant(delay=5)))
    rates = EFFECTS["rate-dependence"] | {"law": None}
    direct = EFFECTS["covariate"] | {"time_constant": 0.0, "column": 0, "label": "force"}
    model = with_effect(with_effect(model, name="rate-dependence", **rates), name="covariate", **direct)
    return Case(model, wander(1000), columns(1000))


def loops_of_two_axes() -> Case:
    """Two inputs, two outputs, stops that see a mixture of states and inputs behind a dead time."""
    loops = two_axes.stops_loop(), two_axes.cubic_loop()
    model = two_axes.with_loops(model_of(two_axes.plant()), *loops, delay=2)
    model = with_effect(model, name="backlash", output=1, half_width=0.1)
    return Case(model, two_axes.wander(1000))


def loops_between_samples() -> Case:
    """Loops that take three steps a sample and look ahead, behind a dead time."""
    case = loops_of_two_axes()
    return Case(changed(case.model, intersample={"substeps": 3, "hold": "first"}), case.u)


def loops_beside_creep() -> Case:
    """Loops of several effects that take two steps a sample, beside sections in parallel with G."""
    names = "creep", "stiffness", "friction", "hysteretic-stiffness"
    model = changed(with_effects(*names), intersample={"substeps": 2, "hold": "zero"})
    return Case(model, wander(1000))


def force_behind_a_gap() -> Case:
    """The output is a force that passes a gap."""
    model = with_effect(with_effects("delay"), name="backlash", output=0, half_width=0.4, missing=0.8)
    return Case(model, wander(1000))


CASES: dict[str, Callable[[], Case]] = {
    "every-effect": every_effect,
    "declared": declared,
    "late-dynamics": late_dynamics,
    "loops-of-two-axes": loops_of_two_axes,
    "loops-between-samples": loops_between_samples,
    "loops-beside-creep": loops_beside_creep,
    "force-behind-a-gap": force_behind_a_gap,
}


def random_case(seed: int) -> Case:
    """Some of the effects in a random order, with other numbers, on a random drive."""
    random = np.random.default_rng(seed)
    names = [str(name) for name in random.permutation(list(EFFECTS))[: random.integers(1, len(EFFECTS))]]
    model = model_of(plant(delay=int(random.integers(0, 3))))
    for name in names:
        effect = json.loads(json.dumps(EFFECTS[name]))
        for key in ("samples", "limit", "gain", "half_width", "frequency", "time_constant", "duration"):
            if key in effect:
                effect[key] *= random.uniform(0.2, 3.0)
        for key in ("coefficients", "changes", "gains", "numerator"):
            if key in effect:
                effect[key] = (random.uniform(-1.0, 1.0, len(effect[key])) * np.array(effect[key])).tolist()
        if effect.get("law"):
            effect["law"]["exponent"] = float(random.choice([0.0, 1.0, random.uniform(-2.0, 1.0)]))
        model = with_effect(model, name=name, **effect)
    u = wander(600, seed) * random.uniform(0.5, 1.5)
    return Case(model, u, columns(len(u)))
