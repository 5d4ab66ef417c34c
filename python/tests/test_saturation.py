"""Limits of states inside the dynamics, against their equations in plain NumPy, and in records of tanks."""

import json

import numpy as np
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import oracle
from data_folder import MEASURED, needs_measured
from records import RATE, model_of
from test_inner_loops import plant, wander, with_loops

pytestmark = pytest.mark.xdist_group("inner loops")

Array = NDArray[np.float64]


def limit_loop(limit: float, is_lower: bool, mixture: bool) -> dict:
    sees = {"mixture": {"states": [0.6, -0.2, 0.3], "inputs": [0.1, 0.2]}} if mixture else {"output": 1}
    return {
        "sees": sees,
        "law": {"excess": {"limit": limit, "is_lower": is_lower}},
        "drives": [-0.3, 0.1, -0.2],
    }


def simulated(u: Array, loop: dict, own: oracle.Plant) -> tuple[Array, float]:
    """The plant with the loop, sample by sample, and the part of the samples beyond the limit."""
    v = own.intermediate(u)
    a, b, c, d = own.state_space()
    x = np.linalg.solve(np.eye(len(a)) - a, b @ v[0])
    law, sees = loop["law"]["excess"], loop["sees"]
    y, beyond = np.zeros((len(u), 2)), 0
    for k in range(len(u)):
        y[k] = c @ x + d @ v[k]
        if "mixture" in sees:
            z = np.dot(sees["mixture"]["states"], x) + np.dot(sees["mixture"]["inputs"], v[k])
        else:
            z = y[k, sees["output"]]
        w = z - law["limit"]
        w = min(w, 0.0) if law["is_lower"] else max(w, 0.0)
        beyond += w != 0.0
        x = a @ x + b @ v[k] + np.array(loop["drives"]) * w
    return y, beyond / len(u)


@pytest.mark.parametrize("mixture", [False, True])
@pytest.mark.parametrize("is_lower", [False, True])
def test_the_limit_obeys_its_equations(is_lower: bool, mixture: bool) -> None:
    u = wander(400)
    free, _ = simulated(u, limit_loop(1e9, False, mixture), plant())
    limit = float(np.quantile(free[:, 1], 0.3 if is_lower else 0.7))
    loop = limit_loop(limit, is_lower, mixture)
    expected, part = simulated(u, loop, plant())
    assert 0.05 < part < 0.95
    np.testing.assert_allclose(with_loops(model_of(plant()), loop).simulate(u), expected, rtol=0, atol=1e-9)


def test_derivatives_go_through_the_limit() -> None:
    u = wander(400)
    free, _ = simulated(u, limit_loop(1e9, False, False), plant())
    limit = float(np.quantile(free[:, 1], 0.6))

    def model(limit: float) -> gpi.Model:
        return with_loops(model_of(plant()), limit_loop(limit, False, False))

    found = gpi.sensitivities(model(limit), gpi.Record(u, model(limit).simulate(u), rate=RATE))
    names, step = list(found["names"]), 1e-6
    there, back = (np.asarray(model(limit + sign * step).simulate(u)) for sign in (1, -1))
    for output in range(2):
        expected = (there - back)[:, output] / (2 * step)
        # behind the three values of E
        column = found["jacobians"][0][output][:, names.index("stiffness.value[3]")]
        # a sample at which z crosses the limit within the step may differ
        assert np.quantile(np.abs(column - expected), 0.97) <= 1e-4 * np.abs(expected).max()


def tanks(seed: int, tops: tuple[float, float], sensor: float) -> tuple[Array, Array]:
    """Return the inflow and the level of the lower of two tanks with linear outflow, as a sensor shows it.

    What runs over the rim of the upper tank enters the lower one in part; what runs over that of the lower
    one is lost.
    """
    random = np.random.default_rng(seed)
    levels = np.repeat(random.uniform(0.0, 1.0, 80), 25)
    u = np.convolve(levels, np.ones(8) / 8, mode="full")[: len(levels)]
    upper = lower = u[0]
    y = np.zeros(len(u))
    for k, q in enumerate(u):
        y[k] = lower + 0.003 * random.standard_normal()
        flow = 0.08 * upper
        upper += 0.08 * q - flow
        over = max(upper - tops[0], 0.0)
        upper -= over
        lower = min(lower + 0.05 * ((flow + 0.6 * over) / 0.08 - lower), tops[1])
    return u, np.minimum(y, sensor)


def test_an_overflow_is_named() -> None:
    u, y = tanks(3, tops=(0.6, 0.55), sensor=0.55)
    found = gpi.explain(gpi.Record(u, y, rate=1.0))
    assert found.effects == ["saturation"], found.rejected
    assert found.after["holdout"]["rms"] < 0.5 * found.before["holdout"]["rms"]


def test_a_sensor_that_clips_is_no_saturation() -> None:
    u, y = tanks(3, tops=(9.0, 9.0), sensor=0.62)
    assert np.mean(y == 0.62) > 0.05
    found = gpi.explain(gpi.Record(u, y, rate=1.0))
    assert found.effects in ([], ["output-nonlinearity"]), found.effects


def clipped(drive: np.ndarray, lowest: float, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Simulate three plays before a lag, and a sensor that ends; return the reading and the displacement."""
    v = np.zeros_like(drive)
    for half_width, weight in ((0.0, 0.6), (0.8, 0.3), (1.7, 0.2)):
        play = 0.0
        for k, u in enumerate(drive):
            play = max(u - half_width, min(u + half_width, play))
            v[k] += weight * play
    x = np.zeros_like(v)
    for k in range(1, len(v)):
        x[k] = 0.8 * x[k - 1] + 0.2 * v[k - 1]
    noise = 0.003 * np.random.default_rng(5).standard_normal(len(x))
    return np.clip(x + noise, lowest, highest), x


def test_a_sensor_that_clips_is_named_and_the_stage_behind_it_is_found() -> None:
    k = np.arange(6000)
    drive = 3.0 * np.sin(0.011 * k) + 1.5 * np.sin(0.031 * k + 1.0) + 0.6 * np.sin(0.17 * k)
    # the upper end is reached often, the lower one hardly
    y, x = clipped(drive, -3.9, 2.6)
    assert np.mean(y == 2.6) > 0.02
    found = gpi.explain(gpi.Record(drive, y, rate=100.0))
    assert found.effects == ["output-nonlinearity"]
    assert found.verdict == "explained"
    assert found.after["holdout"]["rms"] < 0.0035
    (sensor,) = json.loads(found.model.to_json())["effects"]
    offset = found.model.offsets[0]
    assert sensor["highest"] + offset == pytest.approx(2.6, abs=0.005)
    assert sensor["coefficients"] == []
    # a model without the sensor's range shows where the stage was, which the record does not
    beyond = json.loads(found.model.to_json())
    beyond["effects"] = []
    for estimated in ("estimates", "prediction"):
        beyond.pop(estimated, None)
    stage = gpi.Model.from_json(json.dumps(beyond)).simulate(drive)
    assert np.max(x) > 3.0
    assert np.max(np.abs(np.ravel(stage)[500:] - x[500:])) < 0.05
    # what the sensor cannot show is no reference, and what it can show is reached
    slow = np.sin(0.01 * k[:1000])
    with pytest.raises(gpi.ParameterError, match=r"`reference` = .* reads -3\.[89]\d* to 2\.[56]\d* only"):
        found.model.compensate(3.0 * slow)
    assert found.model.compensate(2.0 * slow).error["rms"] < 1e-9
    # the reading that the model shows ends where the sensor's does
    assert np.max(found.model.simulate(drive)) == pytest.approx(2.6, abs=0.005)


@pytest.mark.slow
@needs_measured
def test_the_overflow_of_measured_tanks_is_named() -> None:
    record = gpi.read_record(MEASURED / "cascaded-tanks/estimation.csv.gz")
    found = gpi.explain(record)
    assert found.effects == ["saturation"]
    step = next(own for own in found.to_dict()["steps"] if own["effect"] == "saturation")
    # the rim of the lower tank
    assert abs(step["parameters"]["limit[0]"]["value"] - 10.0) < 0.3
    rivals = [rival["holdout_rms"] for rival in found.to_dict()["rivals"]]
    assert found.after["holdout"]["rms"] < 0.8 * min(rivals)
