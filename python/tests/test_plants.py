"""The simulator that stages with undeclared effects are drawn from obeys its own laws."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
from numpy.typing import NDArray

import plants
from plants.hysteresis import Hysteresis, play_bank, varying_play_bank
from plants.mechanics import Mechanics, Mode, Spring

Array = NDArray[np.float64]

EVERY = [*plants.CATALOGUE, *plants.OUTSIDE]
SCALABLE = [name for name in EVERY if name != "delay"]
SECONDS, RATE = 8.0, 1000.0


def drawn(seed: int, *effects: str, strength: float | None = 10.0) -> plants.Plant:
    return plants.draw(seed, effects, strength, SECONDS, RATE)


def path(*corners: float) -> Array:
    """Straight from corner to corner in 50 steps each."""
    knots = np.arange(len(corners))
    return np.interp(np.linspace(0, len(corners) - 1, 50 * (len(corners) - 1) + 1), knots, corners)


def flat(hysteresis: Hysteresis) -> Hysteresis:
    """Driven by 0 to 1 with no envelope: what is left are the plays."""
    return replace(hysteresis, volts=1.0, envelope=lambda w: w)


def preisach(seed: int) -> Hysteresis:
    plant = plants.draw(seed, ("hysteresis-shape",), seconds=SECONDS, rate=RATE)
    effect = plant.effects["hysteresis-shape"]
    return flat(effect.hysteresis(plant.base.hysteresis, 0.8))


@pytest.mark.parametrize("in_motion", [False, True])
def test_a_seed_is_one_stage_and_one_experiment(in_motion: bool) -> None:
    seed = next(s for s in range(50) if drawn(s).in_motion == in_motion)
    first, second = drawn(seed, "creep", "covariate"), drawn(seed, "creep", "covariate")
    again = second.record(1)  # what was recorded before does not matter
    one, same = first.record(0), second.record(0)
    assert np.array_equal(one.u, same.u) and np.array_equal(one.y, same.y)
    assert one.x is not None and same.x is not None and np.array_equal(one.x, same.x)
    assert first.strengths == second.strengths and one.noise_std == again.noise_std
    assert not np.array_equal(one.u, again.u)
    assert not np.array_equal(one.y, drawn(seed + 1, "creep").record(0).y)


@pytest.mark.parametrize("seed", range(6))
def test_a_record_is_as_long_as_wanted_and_within_the_drive(seed: int) -> None:
    plant = drawn(seed)
    for excitation in range(3):
        record = plant.record(excitation)
        assert len(record.t) == len(record.u) == len(record.y) == SECONDS * RATE
        assert record.t[0] == 0.0 and np.allclose(np.diff(record.t), 1 / RATE)
        assert record.u.min() >= 0 and record.u.max() <= plant.base.hysteresis.volts
        assert plant.in_motion or not record.u[:100].any()


def test_effects_leave_the_stage_and_the_experiment_as_they_are() -> None:
    clean, crept = plants.draw(3, (), 10.0, SECONDS, RATE), drawn(3, "creep", "drift")
    run = crept.experiment(5)
    clean.noise_std = crept.noise_std
    assert np.array_equal(run.u, clean.experiment(5).u)
    assert np.array_equal(crept.simulate(run, {}), clean.simulate(run, {}))
    assert clean.record(0).effect_rms_over_noise == {}


@pytest.mark.parametrize("name", SCALABLE)
def test_an_effect_has_the_wanted_strength(name: str) -> None:
    for seed, wanted in ((1, 3.0), (2, 20.0)):
        found = drawn(seed, name, strength=wanted).record(0).effect_rms_over_noise
        assert found == {name: pytest.approx(wanted, rel=0.02)}


def test_several_effects_have_the_wanted_strengths() -> None:
    wanted = {"backlash": 18.0, "creep": 6.0, "periodic-disturbance": 12.0}
    record = plants.draw(4, list(wanted), wanted, SECONDS, RATE).record(0)
    assert record.effect_rms_over_noise == {name: pytest.approx(rms, rel=0.1) for name, rms in wanted.items()}


@pytest.mark.parametrize("name", EVERY)
def test_an_effect_of_no_strength_is_not_there(name: str) -> None:
    plant = drawn(5, name)
    run = plant.experiment(1)
    without = plant.simulate(run, {})
    assert np.allclose(plant.simulate(run, {name: 0.0}), without, rtol=0, atol=1e-9 * np.ptp(without))


def test_names_outside_the_catalogue() -> None:
    assert set(drawn(6, "unattributed").effects) < set(plants.OUTSIDE)
    with pytest.raises(ValueError, match="no such effect"):
        drawn(6, "gremlins")


def test_plays_follow_their_recursion() -> None:
    random = np.random.default_rng(0)
    z = np.round(np.cumsum(random.standard_normal(500)), 0) / 3  # with plateaus
    half_widths = np.array([0.0, 0.4, 1.3, 6.0])
    state, expected = np.zeros(4), []
    for value in z:
        state = np.clip(state, value - half_widths, value + half_widths)
        expected.append(state)
    assert np.array_equal(play_bank(z, half_widths), expected)
    assert np.array_equal(varying_play_bank(z, np.tile(half_widths, (len(z), 1))), expected)


@pytest.mark.parametrize("seed", range(3))
def test_a_larger_swing_wipes_out_smaller_ones(seed: int) -> None:
    hysteresis = preisach(seed)
    forgotten = hysteresis(path(0, 0.7, 0.2, 0.6, 0.3, 0.5, 0.35, 0.9, 0.1))
    direct = hysteresis(path(0, 0.9, 0.1))
    assert np.isclose(forgotten[-1], direct[-1], rtol=1e-12)
    remembered = hysteresis(path(0, 0.9, 0.1, 0.8, 0.3))
    assert not np.isclose(remembered[-1], hysteresis(path(0, 0.9, 0.1, 0.6, 0.3))[-1], rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_small_loops_differ_along_the_range_in_a_preisach_operator_alone(seed: int) -> None:
    def loops(hysteresis: Hysteresis) -> tuple[Array, Array]:
        v = hysteresis(path(0, 0.9, 0.0, 0.3, 0.15, 0.3, 0.7, 0.55, 0.7))
        return v[150:251] - v[150], v[300:401] - v[300]

    shaped = preisach(seed)
    low, high = loops(shaped)
    assert np.abs(low - high).max() > 1e-3 * np.ptp(low)
    low, high = loops(replace(shaped, readout=None))
    assert np.allclose(low, high, rtol=0, atol=1e-9 * np.ptp(low))


@pytest.mark.parametrize("seed", range(4))
def test_the_resonance_is_where_it_should_be(seed: int) -> None:
    plant = drawn(seed)
    mechanics, hz, damping = plant.base.mechanics, plant.resonance_hz, plant.damping_ratio
    impulse = np.zeros(1 << 14)
    impulse[0] = 1.0
    response = np.fft.rfft(mechanics.respond(impulse))
    f = np.fft.rfftfreq(len(impulse), 1 / RATE)
    # held drive and amplifier pole are divided out, what is left is the mode
    hold = np.exp(-1j * np.pi * f / RATE) * np.sinc(f / RATE) / (1 + 1j * f / mechanics.amplifier_hz)
    near = np.abs(f / hz - 1) < 0.5
    mode = hz**2 / (hz**2 - f**2 + 2j * damping * hz * f)
    peak = f[near][np.argmax(np.abs(response / hold)[near])]
    assert abs(peak / (hz * np.sqrt(1 - 2 * damping**2)) - 1) < 0.02
    assert np.isclose(response[0].real, 1.0)
    assert np.abs(response / hold / mode - 1)[f < 0.3 * hz].max() < 0.02


@pytest.mark.parametrize("softens", [False, True])
def test_a_nonlinear_spring_follows_its_differential_equation(softens: bool) -> None:
    spring = Spring(0.15, centre=4.0, half_travel=5.0, softens=softens)
    mechanics = Mechanics(1000.0, 200.0, (Mode(80.0, 0.02),), spring)
    v = np.repeat([0.0, 9.0, 2.0], [5, 60, 60])

    def slope(t: float, state: Array) -> list[float]:
        a, q, speed = state
        force = spring.force(q) - spring.force(0.0)
        w = 2 * np.pi * 80.0
        return [
            2 * np.pi * 200.0 * (v[min(int(t * 1000.0), len(v) - 1)] - a),
            speed,
            w**2 * (a - q - force) - 2 * 0.02 * w * speed,
        ]

    t = np.arange(len(v)) / 1000.0
    exact = scipy.integrate.solve_ivp(slope, (0, t[-1]), np.zeros(3), t_eval=t, rtol=1e-7, max_step=1e-4)
    linear = replace(mechanics, spring=None).respond(v)
    bent = np.abs(linear - exact.y[1]).max()
    assert bent > 1.0
    assert np.abs(mechanics.respond(v) - exact.y[1]).max() < 0.02 * bent


def test_outliers_stand_alone() -> None:
    plant = drawn(8, "outliers", strength=5.0)
    run = plant.experiment(0)
    wrong = np.flatnonzero(plant.simulate(run, plant.strengths) != plant.simulate(run, {}))
    assert 2 <= len(wrong) < 0.01 * SECONDS * RATE
    assert np.diff(wrong).min() > 1


def test_creep_goes_on_under_a_held_drive_and_drift_under_none() -> None:
    plant = drawn(9, "creep", "drift")
    run = plant.experiment(0)
    held = replace(run, u=np.repeat([0.0, 0.5 * plant.base.hysteresis.volts], [2000, 6000]), history=0)
    plant.noise_std = 0.0
    rest = plant.simulate(held, {})
    crept = plant.simulate(held, {"creep": 0.05}) - rest
    assert np.allclose(crept[:2000], 0, atol=1e-12) and np.all(np.diff(crept[3000::100]) > 0)
    drifted = plant.simulate(held, {"drift": 1.0}) - rest
    assert np.std(drifted[:2000]) > 0.01 and np.isclose(np.std(drifted), 1.0)


def test_a_column_comes_with_the_leak_and_sometimes_without() -> None:
    assert drawn(10, "covariate").record(0).x is not None
    columns = [plants.draw(seed, (), None, SECONDS, RATE).column is not None for seed in range(30)]
    assert any(columns) and not all(columns)
