"""Bouc and Wen's force in a loop around G, against its differential equation in plain NumPy."""

import json
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import oracle
from exported_models import EFFECTS
from plants import textbook
from records import RATE, model_of
from test_inner_loops import plant, wander, with_loops

pytestmark = pytest.mark.xdist_group("inner loops")

Array = NDArray[np.float64]
DRIVES, BETA, GAMMA, EXPONENT = np.array([0.02, -0.06, 0.01]), 0.5, -0.3, 1.3


def force_loop(
    drives: Array = DRIVES, beta: float = BETA, gamma: float = GAMMA, exponent: float = EXPONENT
) -> dict:
    law = {"bouc-wen": {"beta": beta, "gamma": gamma, "exponent": exponent}}
    return {"sees": {"output": 0}, "law": law, "drives": list(drives)}


def moved(w: float, dz: float, beta: float, gamma: float, exponent: float) -> float:
    """Dw = dz - (beta |dz| w + gamma dz |w|) |w|^(n - 1), by 400 steps of the method of Runge and Kutta."""
    step = dz / 400

    def change(w: float) -> float:
        return step - (beta * abs(step) * w + gamma * step * abs(w)) * abs(w) ** (exponent - 1)

    for _ in range(400):
        first = change(w)
        second = change(w + first / 2)
        third = change(w + second / 2)
        w += (first + 2 * second + 2 * third + change(w + third)) / 6
    return w


def path(newest: float, before: float, older: float) -> list[float]:
    """The last sample's extremes: those of the parabola through three samples, at t = 0, -1 and -2."""
    parabola = np.polyfit([0.0, -1.0, -2.0], [newest, before, older], 2)
    turn = -parabola[1] / (2 * parabola[0]) if abs(parabola[0]) > 1e-12 else 0.0
    return [before, float(np.polyval(parabola, turn)), newest] if -1 < turn < 0 else [before, newest]


def simulated(u: Array, loop: dict, own: oracle.Plant) -> Array:
    """The plant with the loop, sample by sample."""
    v = own.intermediate(u)
    a, b, c, d = own.state_space()
    x = np.linalg.solve(np.eye(len(a)) - a, b @ v[0])
    law = loop["law"]["bouc-wen"].values()
    w, z = 0.0, [0.0, 0.0]
    y = np.zeros((len(u), 2))
    for k in range(len(u)):
        y[k] = c @ x + d @ v[k]
        for first, last in pairwise(path(y[k, 0], *z)):
            w = moved(w, last - first, *law)
        z = [y[k, 0], z[0]]
        x = a @ x + b @ v[k] + np.array(loop["drives"]) * w
    return y


def test_the_force_obeys_its_differential_equation() -> None:
    u, loop = wander(250), force_loop()
    expected = simulated(u, loop, plant())
    without = simulated(u, force_loop(0 * DRIVES), plant())
    assert np.abs(expected - without).max() > 0.05
    model = with_loops(model_of(plant()), loop)
    # both integrate numerically
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-6)


def test_a_record_in_parts_is_the_whole() -> None:
    model, u = with_loops(model_of(plant()), force_loop(), delay=1), wander()
    state, pieces = model.start(u[0]), []
    for piece in (u[:1], u[1:170], u[170:]):
        y, state = model.run(piece, state)
        pieces.append(y)
    np.testing.assert_allclose(np.concatenate(pieces), model.simulate(u), rtol=0, atol=1e-12)


def test_derivatives_go_through_the_force() -> None:
    u = wander(400)
    values = np.concatenate([DRIVES, [BETA, GAMMA, EXPONENT]])

    def model(values: Array) -> gpi.Model:
        return with_loops(model_of(plant()), force_loop(values[:3], *values[3:]))

    found = gpi.sensitivities(model(values), gpi.Record(u, model(values).simulate(u), rate=RATE))
    names = list(found["names"])
    for place in range(6):
        columns = [own[:, names.index(f"stiffness.value[{place}]")] for own in found["jacobians"][0]]
        errors = []
        for step in (1e-4, 1e-5, 1e-6):
            there, back = (
                np.asarray(model(values + sign * step * np.eye(6)[place]).simulate(u)) for sign in (1, -1)
            )
            differences = np.abs((there - back).T / (2 * step) - columns)
            errors.append(np.quantile(differences, 0.97, axis=1))
        # all samples differ behind one at which z turns, or the number of steps changes, within a difference
        assert np.all(np.min(errors, axis=0) <= 1e-6 * np.abs(columns).max(axis=1)), (place, errors)


def test_a_negative_beta_is_refused() -> None:
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=r"beta = -0.1.* beta >= 0"):
        with_loops(model_of(plant()), force_loop(beta=-0.1))
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=r"exponent 0.9.* at least 1"):
        with_loops(model_of(plant()), force_loop(exponent=0.9))


def test_the_numbers_are_those_of_the_mechanics() -> None:
    """Relative to the linear stiffness: what w = 1 moves in steady state, positive where it opposes."""
    described = json.loads(with_loops(model_of(plant()), force_loop()).to_json())
    described["effects"] = [{"name": "hysteretic-stiffness", **EFFECTS["hysteretic-stiffness"]}]
    model = gpi.Model.from_json(json.dumps(described))
    a, _, c, _ = plant().state_space()
    drives = EFFECTS["hysteretic-stiffness"]["loops"][0]["drives"]
    expected = -(c @ np.linalg.solve(np.eye(3) - a, drives))[0]
    (effect,) = model.effects
    found = {one["name"]: one["value"] for one in effect["parameters"]}
    assert found["hysteretic_over_linear[0]"] == pytest.approx(expected, rel=1e-9)
    assert [found[f"{name}[0]"] for name in ("beta", "gamma", "exponent")] == [0.4, -0.3, 1.4]


def benchmark(samples: int, seed: int) -> tuple[Array, Array]:
    """The equations of the public Bouc-Wen benchmark: u in N, y in mm, at 750 Hz.

    2 y'' + 10 y' + 5e4 y + z = u, z' = 5e4 y' - 1e3 (0.8 |y'| z - 1.1 y' |z|), integrated at 15 kHz. From
    https://www.nonlinearbenchmark.org (Noel and Schoukens).
    """
    random, steps = np.random.default_rng(seed), 20
    lines = np.arange(int(5 / 750 * samples), int(150 / 750 * samples))
    spectrum = np.zeros(samples * steps + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * random.random(len(lines)))
    fine = np.fft.irfft(spectrum, 2 * samples * steps)
    fine *= 50 / fine.std()
    y, speed, z, h = 0.0, 0.0, 0.0, 1 / 750 / steps
    motion = np.zeros(samples)

    def slopes(y: float, speed: float, z: float, u: float) -> tuple[float, float, float]:
        dz = 5e4 * speed - 1e3 * (0.8 * abs(speed) * z - 1.1 * speed * abs(z))
        return speed, (u - 10 * speed - 5e4 * y - z) / 2, dz

    for k in range(samples * steps):
        if k % steps == 0:
            motion[k // steps] = 1e3 * y
        a = slopes(y, speed, z, fine[2 * k])
        b = slopes(y + h * a[0], speed + h * a[1], z + h * a[2], fine[(2 * k + 2) % len(fine)])
        y, speed, z = (value + h * (p + q) / 2 for value, p, q in zip((y, speed, z), a, b, strict=True))
    return fine[:: 2 * steps], motion


def test_the_physics_of_the_public_benchmark_are_found() -> None:
    u, y = benchmark(5000, 1)
    noise = 0.005
    y += np.random.default_rng(2).normal(0, noise, len(y))
    found = gpi.explain(gpi.Record(u, y, rate=750.0))
    assert found.effects == ["hysteretic-stiffness"]
    assert found.after["holdout"]["rms"] < 1.15 * noise < 0.1 * found.before["holdout"]["rms"]
    (step,) = (step for step in found.to_dict()["steps"] if step["effect"])
    of = {name: own["value"] for name, own in step["parameters"].items()}
    assert of["beta[0]"] == pytest.approx(0.8, rel=0.03)
    assert of["gamma[0]"] == pytest.approx(-1.1, rel=0.03)
    assert of["hysteretic_over_linear[0]"] == pytest.approx(1.0, rel=0.05)
    assert of["exponent[0]"] == pytest.approx(1.0, abs=0.05)
    # the plays and deadzones that stood for the force are gone
    (hysteresis,) = json.loads(found.model.to_json())["hysteresis"]
    assert hysteresis["plays"]["half_widths"] == hysteresis["envelope"]["thresholds"] == [0.0]


@pytest.mark.parametrize(
    ("stage", "effect"),
    [
        # the benchmark of the same force is a faster test
        pytest.param("bouc-wen-spring", "hysteretic-stiffness", marks=pytest.mark.slow),
        ("dahl", "friction"),
    ],
)
def test_forces_of_other_textbooks_are_named(stage: str, effect: str) -> None:
    record = textbook.draw(stage, 1002)
    found = gpi.explain(gpi.Record(record.u, record.y, rate=record.rate))
    assert found.effects == [effect]
    assert found.after["holdout"]["rms"] < 0.05 * found.before["holdout"]["rms"]


@pytest.mark.slow
@pytest.mark.parametrize(("stage", "seed"), [("clipped", 1002), ("bouc-wen", 1004)])
def test_no_force_stands_for_a_limit_or_for_hysteresis_before_the_dynamics(stage: str, seed: int) -> None:
    record = textbook.draw(stage, seed)
    found = gpi.explain(gpi.Record(record.u, record.y, rate=record.rate))
    assert not {"stiffness", "hysteretic-stiffness", "friction"} & set(found.effects)
