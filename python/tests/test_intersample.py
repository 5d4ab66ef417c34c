"""Loops between two samples, against the differential equation of the plant."""

import json
from collections.abc import Callable
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
    """A, B, C, D of the linear oscillator for a held or straight input, and what a constant force drives."""
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:3], block[2, 3] = F, G, 1.0
    moved = expm(STEP * block)
    a, constant, ramp = moved[:2, :2], moved[:2, 2:3], moved[:2, 3:] / STEP
    late = ramp if hold == "first" else np.zeros((2, 1))
    c = np.array([[1.0, 0.0]])
    return a, constant + (a - np.eye(2)) @ late, c, c @ late, constant


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
    described = json.loads(model.to_json())

    def simulated(change: Callable[[dict[str, Any], float], None], step: float) -> Array:
        moved = json.loads(json.dumps(described))
        change(moved, step)
        return np.asarray(gpi.Model.from_json(json.dumps(moved)).simulate(v))

    def force(place: int) -> Callable[[dict[str, Any], float], None]:
        def change(moved: dict[str, Any], step: float) -> None:
            moved["effects"][0]["loops"][0]["drives"][place] += step

        return change

    def weight(moved: dict[str, Any], step: float) -> None:
        moved["hysteresis"][0]["plays"]["weights"][0] += step

    found = gpi.sensitivities(model, gpi.Record(v, model.simulate(v), rate=model.rate))
    names, jacobian = list(found["names"]), found["jacobians"][0][0]
    # unknowns belong to the states of the observer form: the displacement, and a1 times it plus the next one
    a, _, c, _, _ = sampled(hold)
    transform = np.vstack([c, c @ a - np.trace(a) * c])
    columns = jacobian[:, [names.index(f"stiffness.value[{place}]") for place in range(2)]] @ transform
    computed = [*columns.T, jacobian[:, names.index("u.weights[0]")]]
    # by the logarithm of the scale
    computed.append(jacobian[:, names.index("stiffness.value[4]")])

    def scale(moved: dict[str, Any], step: float) -> None:
        moved["effects"][0]["loops"][1]["law"]["damping"]["scale"] *= np.exp(step)

    for change, column in zip([force(0), force(1), weight, scale], computed, strict=True):
        expected = (simulated(change, 1e-5) - simulated(change, -1e-5)) / 2e-5
        np.testing.assert_allclose(column, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


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
