"""Loops between two samples, against the differential equation of the plant."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import gpi_hammerstein as gpi
from exported_models import changed
from test_effects import model_of, plant

Array = NDArray[np.float64]

#: Time between samples in s, at one radian a second: 0.7 radians a sample.
STEP = 0.7
#: Stiffness 1, with a cubic part.
CUBIC, DAMPING = 0.2, 0.8
#: The speed at which a force that depends on it is near its limit.
SPEED = 0.3
F = np.array([[0.0, 1.0], [-1.0, -DAMPING]])
G = np.array([[0.0], [1.0]])


def driven(samples: int = 120) -> Array:
    k = np.arange(samples)
    return 0.7 * np.sin(0.5 * k) + 0.5 * np.cos(0.23 * k) - 0.5


def sampled(hold: str) -> tuple[Array, ...]:
    """A, B, C, D of the linear oscillator in observer form, and what a constant force drives."""
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:3], block[2, 3] = F, G, 1.0
    moved = expm(STEP * block)
    a, constant, ramp = moved[:2, :2], moved[:2, 2:3], moved[:2, 3:] / STEP
    late = ramp if hold == "first" else np.zeros((2, 1))
    c = np.array([[1.0, 0.0]])
    # the states are the displacement, and a1 times it plus the next one
    transform = np.vstack([c, c @ a - np.trace(a) * c])
    b = transform @ (constant + (a - np.eye(2)) @ late)
    a = np.array([[np.trace(a), 1.0], [-np.linalg.det(a), 0.0]])
    return a, b, c, c @ late, transform @ constant


def oscillator(hold: str, substeps: int, limit: float = 0.0) -> gpi.Model:
    """The oscillator; a force up to `limit` opposes its speed, besides the linear damping."""
    a, b, c, d, force = sampled(hold)
    described = json.loads(model_of(plant()).to_json())
    described["hysteresis"] = [
        {
            "envelope": {"thresholds": [0.0], "weights": [1.0], "reading": "one-sided"},
            "plays": {"half_widths": [0.0], "weights": [1.0]},
        }
    ]
    described["linear"] = {
        name: [np.ravel(value, order="F").tolist(), *value.shape]
        for name, value in zip("abcd", (a, b, c, d), strict=True)
    }
    cubic = {
        "sees": {"output": 0},
        "law": {"power": {"exponent": 3, "scale": 1.0}},
        "drives": (-CUBIC * force[:, 0]).tolist(),
    }
    damping = {
        "sees": {"output": 0},
        "law": {"damping": {"scale": SPEED * STEP}},
        "drives": (-limit / (SPEED * STEP) * force[:, 0]).tolist(),
    }
    described["effects"] = [{"name": "stiffness", "loops": [cubic, *([damping] if limit else [])]}]
    described["intersample"] = {"substeps": substeps, "hold": hold}
    described["offsets"] = [0.0]
    return gpi.Model.from_json(json.dumps(described))


def integrated(v: Array, hold: str, limit: float = 0.0) -> Array:
    """The displacement by an integrator of others, sample by sample; v is zero before the record."""
    x = np.zeros(2)
    y = np.zeros(len(v))
    for k in range(len(v)):
        y[k] = x[0]
        if k + 1 == len(v):
            break
        slope = (v[k + 1] - v[k]) / STEP if hold == "first" else 0.0

        def motion(t: float, x: Array, k: int = k, slope: float = slope) -> list[float]:
            rubs = limit * np.tanh(x[1] / SPEED)
            return [x[1], v[k] + slope * t - DAMPING * x[1] - x[0] - CUBIC * x[0] ** 3 - rubs]

        x = solve_ivp(motion, (0.0, STEP), x, rtol=1e-10, atol=1e-12).y[:, -1]
    return y


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_more_steps_come_nearer_to_the_differential_equation(hold: str) -> None:
    v = driven()
    v[0] = 0.0
    expected = integrated(v, hold)
    errors = [
        float(np.abs(oscillator(hold, substeps).simulate(v) - expected).max()) for substeps in (1, 2, 4, 8)
    ]
    # one step is half a sample late; the error of the midpoint rule falls with the square of the step
    assert errors[0] > 4 * errors[1], errors
    assert errors[2] < errors[1] / 3 and errors[3] < errors[2] / 3, errors
    assert errors[3] < 0.01 * np.abs(expected).max(), errors


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_the_force_of_a_damping_comes_nearer_too(hold: str) -> None:
    v = driven()
    v[0] = 0.0
    expected = integrated(v, hold, 0.2)
    assert np.abs(integrated(v, hold) - expected).max() > 0.1
    errors = [
        float(np.abs(oscillator(hold, substeps, 0.2).simulate(v) - expected).max()) for substeps in (4, 8, 16)
    ]
    # the change of a step is the speed half a step before
    assert errors[1] < errors[0] / 1.7 and errors[2] < errors[1] / 1.7, errors
    assert errors[2] < 0.01 * np.abs(expected).max(), errors


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_derivatives_go_through_the_steps(hold: str) -> None:
    model, v = oscillator(hold, 3, 0.1), driven()
    v[:2] = 0.0

    def moved(name: str, step: float) -> Array:
        """The output where one value is changed."""
        own = json.loads(model.to_json())
        linear, (cubic, damping) = own["linear"], own["effects"][0]["loops"]
        match name:
            case "u.weights[0]":
                own["hysteresis"][0]["plays"]["weights"][0] += step
            case "section[0].a1" | "section[0].a2":
                linear["a"][0][int(name[-1]) - 1] -= step
            case "section[0].b1[u]" | "section[0].b2[u]":
                linear["b"][0][int(name[-4]) - 1] += step
            case "stiffness.value[0]" | "stiffness.value[1]":
                cubic["drives"][int(name[-2])] += step
            case "stiffness.value[2]" | "stiffness.value[3]":
                damping["drives"][int(name[-2]) - 2] += step
            case "stiffness.value[4]":
                damping["law"]["damping"]["scale"] *= np.exp(step)
        if hold == "first":
            # D holds the DC gain; a D of zero stays zero
            a, b = np.reshape(linear["a"][0], (2, 2), order="F"), np.reshape(linear["b"][0], (2, 1))
            linear["d"][0][0] = 1.0 - np.linalg.solve(np.eye(2) - a, b)[0, 0]
        return np.asarray(gpi.Model.from_json(json.dumps(own)).simulate(v))

    found = gpi.sensitivities(model, gpi.Record(v, model.simulate(v), rate=model.rate))
    names, jacobian = list(found["names"]), found["jacobians"][0][0]
    tested = [name for name in names if not name.startswith(("offset", "start"))]
    # without a held DC gain, the weight sets the scale
    assert len(tested) == (10 if hold == "first" else 9)
    for name in tested:
        expected = (moved(name, 1e-5) - moved(name, -1e-5)) / 2e-5
        near = 1e-6 * np.abs(expected).max()
        np.testing.assert_allclose(jacobian[:, names.index(name)], expected, rtol=0, atol=near, err_msg=name)


@pytest.mark.parametrize(
    ("intersample", "message"),
    [
        ({"substeps": 0, "hold": "zero"}, "substeps"),
        ({"substeps": 2, "hold": "second"}, "second"),
        ({"substeps": 2, "hold": "zero", "more": 1}, "more"),
    ],
)
def test_wrong_values_are_refused(intersample: dict[str, Any], message: str) -> None:
    with pytest.raises(gpi.GpiError, match=message):
        changed(oscillator("zero", 1), intersample=intersample)


def test_a_model_says_how_its_loops_are_computed() -> None:
    first = oscillator("first", 2)
    rows = first.loop_steps()
    assert [len(row["earlier"]) for row in rows] == [0, 1]
    assert json.loads(first.to_json())["intersample"] == {"substeps": 2, "hold": "first"}
    assert "intersample" not in json.loads(oscillator("zero", 1).to_json())
    # the row of C, and no v behind a sample
    row = oscillator("zero", 1).loop_steps()[0]
    np.testing.assert_array_equal(row["states"], [1.0, 0.0])
    np.testing.assert_array_equal(row["next"], [0.0])
