"""Friction in a loop around G, against its equations in plain NumPy, and in records of stages that rub."""

import json

import numpy as np
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import oracle
from data_folder import MEASURED, needs_measured
from plants import textbook
from records import RATE, model_of
from test_hysteretic_stiffness import path
from test_inner_loops import plant, wander, with_loops

pytestmark = pytest.mark.xdist_group("inner loops")

Array = NDArray[np.float64]
DISTANCE, FORCE = 0.4, 0.15


def friction_loop(force: float = FORCE, distance: float = DISTANCE, averaged: bool = True) -> dict:
    states = plant().state_space()[0].shape[0]
    law = {"dahl": {"distance": distance, "averaged": averaged}}
    return {"sees": {"output": 0}, "law": law, "drives": {"input": 1, "force": force, "states": states}}


def slid(f: float, dz: float, distance: float) -> tuple[float, float]:
    """Df = (dz - |dz| f) / d by 2000 midpoint steps, and the mean of f over the change."""
    step = dz / 2000
    mean = 0.0
    for _ in range(2000):
        middle = f + (step - abs(step) * f) / distance / 2
        mean += middle / 2000
        f += (step - abs(step) * middle) / distance
    return f, mean


def simulated(u: Array, loop: dict, own: oracle.Plant) -> Array:
    """The plant with the loop, sample by sample."""
    v = own.intermediate(u)
    a, b, c, d = own.state_space()
    x = np.linalg.solve(np.eye(len(a)) - a, b @ v[0])
    law, force = loop["law"]["dahl"], loop["drives"]["force"]
    f, z = 0.0, [0.0, 0.0]
    y = np.zeros((len(u), 2))
    for k in range(len(u)):
        y[k] = c @ x + d @ v[k]
        last, points = f, path(y[k, 0], *z)
        # the times between the ends of the last sample and a turning point of the parabola
        times = [-1.0, 0.0]
        if len(points) == 3:
            parabola = np.polyfit([0.0, -1.0, -2.0], [y[k, 0], *z], 2)
            times.insert(1, -parabola[1] / (2 * parabola[0]))
        mean = 0.0
        for dz, part in zip(np.diff(points), np.diff(times), strict=True):
            f, own_mean = slid(f, dz, law["distance"])
            mean += part * own_mean
        w = mean + f - last if law["averaged"] else f
        z = [y[k, 0], z[0]]
        x = a @ x + b @ v[k] - force * b[:, loop["drives"]["input"]] * w
    return y


@pytest.mark.parametrize("averaged", [False, True])
def test_the_friction_obeys_its_equations(averaged: bool) -> None:
    u, loop = wander(250), friction_loop(averaged=averaged)
    expected = simulated(u, loop, plant())
    assert np.abs(expected - simulated(u, friction_loop(force=0.0), plant())).max() > 0.02
    model = with_loops(model_of(plant()), loop)
    # the oracle integrates numerically
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-6)


def test_a_force_enters_behind_the_dead_time() -> None:
    u, loop = wander(250), friction_loop()
    late = with_loops(model_of(plant()), loop, delay=2)
    prompt = with_loops(model_of(plant()), loop)
    first = np.repeat(u[:1], 2, axis=0)
    np.testing.assert_allclose(
        late.simulate(u)[2:], prompt.simulate(np.vstack([first, u]))[2:-2], rtol=0, atol=1e-9
    )


def test_derivatives_go_through_the_friction() -> None:
    u = wander(400)
    values = np.array([FORCE, np.log(DISTANCE)])

    def model(values: Array) -> gpi.Model:
        return with_loops(model_of(plant()), friction_loop(values[0], float(np.exp(values[1]))))

    found = gpi.sensitivities(model(values), gpi.Record(u, model(values).simulate(u), rate=RATE))
    names, step = list(found["names"]), 1e-5
    for place in range(2):
        there, back = (
            np.asarray(model(values + sign * step * np.eye(2)[place]).simulate(u)) for sign in (1, -1)
        )
        for output in range(2):
            expected = (there - back)[:, output] / (2 * step)
            column = found["jacobians"][0][output][:, names.index(f"stiffness.value[{place}]")]
            # a sample at which z turns within the step may differ
            assert np.quantile(np.abs(column - expected), 0.97) <= 1e-4 * np.abs(expected).max(), place


def test_impossible_values_are_refused() -> None:
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=r"distance -0.1.* positive"):
        with_loops(model_of(plant()), friction_loop(distance=-0.1))
    loop = friction_loop()
    loop["drives"]["input"] = 2
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=r"drives input 2 of 2"):
        with_loops(model_of(plant()), loop)
    late = friction_loop()
    late["drives"]["states"] += 1
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=r"are behind the dead time"):
        with_loops(model_of(plant()), late, delay=2)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_friction_is_that_of_a_mass_whichever_way_the_input_moves_it(direction: float) -> None:
    # 0.5 y'' + 3 y' + 4 y + 0.2 f = u: poles of -2 and -4 per second, held at 100 Hz
    poles = np.exp([-0.02, -0.04])
    inputs = direction * np.array([1.0 - poles[0], (poles[1] - 1.0) / 2.0]) / 2.0
    channel = [{"name": "c", "unit": ""}]
    loop = {
        "sees": {"output": 0},
        "law": {"dahl": {"distance": 0.1, "averaged": True}},
        "drives": {"input": 0, "force": 0.2 * direction, "states": 2},
    }
    straight = {
        "envelope": {"thresholds": [0.0], "weights": [1.0], "reading": "one-sided"},
        "plays": {"half_widths": [0.0], "weights": [1.0]},
    }
    model = {
        "schema": "gpi-model/1",
        "rate": 100.0,
        "inputs": channel,
        "outputs": channel,
        "hysteresis": [straight],
        "linear": {
            "a": [[poles[0], 0.0, 0.0, poles[1]], 2, 2],
            "b": [list(inputs), 2, 1],
            "c": [[1.0, 1.0], 1, 2],
            "d": [[0.0], 1, 1],
        },
        "offsets": [0.0],
        "effects": [{"name": "friction", "loops": [loop]}],
    }
    (effect,) = gpi.Model.from_json(json.dumps(model)).effects
    found = {own["name"]: own["value"] for own in effect["parameters"]}
    wanted = {"mass": 0.5, "damping": 3.0, "spring_rate": 4.0, "friction_force": 0.2}
    for name, value in wanted.items():
        assert found[name] == pytest.approx(value), name


@pytest.mark.slow
def test_friction_of_a_motor_is_named() -> None:
    run = textbook.draw("motor", 1002)
    found = gpi.explain(gpi.Record(run.u, run.y, rate=run.rate))
    assert found.effects == ["friction"]
    assert found.after["holdout"]["rms"] < 2 * run.noise


@pytest.mark.slow
def test_friction_and_end_stops_of_a_slide_are_named_together() -> None:
    run = textbook.draw("end-stops", 1001)
    found = gpi.explain(gpi.Record(run.u, run.y, rate=run.rate))
    assert found.effects == ["friction", "saturation"]
    assert found.after["holdout"]["rms"] < 3 * run.noise < 0.2 * found.before["holdout"]["rms"]
    stops = next(own for own in found.to_dict()["steps"] if own["effect"] == "saturation")["parameters"]
    # the slide rests at both stops for some of the time; a stop gives way a little
    expected = np.quantile(run.y, [0.01, 0.99])
    limits = sorted(stops[f"limit[{number}]"]["value"] for number in (0, 1))
    np.testing.assert_allclose(limits, expected, rtol=0, atol=0.1 * np.ptp(run.y))


@pytest.mark.slow
@needs_measured
def test_the_friction_of_a_measured_drive_is_that_of_the_literature() -> None:
    record = gpi.read_record(MEASURED / "emps/emps_train.csv.gz", input="motor_V", output="position_m")
    found = gpi.explain(record)
    assert found.effects == ["friction"]
    step = next(own for own in found.to_dict()["steps"] if own["effect"] == "friction")
    size = {name: own["value"] for name, own in step["parameters"].items()}
    newtons_per_volt = 35.15
    for name, known in (("mass", 94.7), ("damping", 200.0), ("friction_force", 20.8)):
        assert abs(newtons_per_volt * size[name] / known - 1.0) < 0.05, name
    # in m, from its start to its end, and over horizons of a second
    assert found.model.on_another_record(record)["error"]["rms"] < 1.7e-3
    assert found.model.over_horizons(record, 1.0)["rms"] < 0.55e-3
