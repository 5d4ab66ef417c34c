"""The compensator of one sample at a time against the oracle's hysteresis and creep."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gpi_hammerstein as gpi
import oracle
from records import model_of
from test_effects import CASES, lag, plant, with_effect

CREEP = CASES["creep"][0]
LAGS = list(zip(CREEP["gains"], CREEP["time_constants"], strict=True))
STILL = "only the DC gain of G is inverted"


def creeping():
    return with_effect(model_of(plant()), name="creep", **CREEP)


def path(samples=3000, seed=1):
    """Loops within loops about the offset, within what the envelope reaches."""
    steps = np.random.default_rng(seed).normal(size=samples)
    return 0.7 + np.sin(0.03 * np.cumsum(steps)) + 0.05 * steps


def still_output(u, model):
    """What the oracle's hysteresis, creep and DC gain make of a drive from zero to its first sample on."""
    own = plant().hysteresis[0]
    v, _ = oracle.gpi(u, own.thresholds, own.deadzone_weights, own.half_widths, own.weights)
    return 0.7 + model.linear.dc_gain[0, 0] * v + sum(gain * lag(v, time) for gain, time in LAGS)


def test_hysteresis_and_creep_are_undone():
    found = creeping().compensator()
    wanted = path()
    u, state = found.run(wanted, found.standing_at(wanted[0]))
    assert np.max(np.abs(still_output(u, creeping()) - wanted)) < 1e-12
    assert (found.compensated, found.left) == (["hysteresis", "creep"], [("dynamics", STILL)])
    assert state[0] == u[-1] and state[1] == 0


def test_the_same_as_with_the_whole_reference():
    wanted = path()
    found = model_of(plant()).compensator(limits=(-2.0, 2.0))
    u, _ = found.run(wanted, found.standing_at(wanted[0]))
    whole = model_of(plant()).compensate(wanted, quasi_static=True, limits=(-2.0, 2.0))
    np.testing.assert_allclose(u, whole.drive, rtol=0, atol=1e-12)


@given(st.integers(0, 10**6), st.lists(st.integers(0, 500), max_size=4), st.floats(0.1, 5.0))
def test_parts_are_the_whole(seed, cuts, size):
    found = creeping().compensator(limits=(-1.5, 1.2))
    wanted = 0.7 + size * (path(500, seed) - 0.7)
    state = found.standing_at(wanted[0])
    whole, last = found.run(wanted, state)
    parts = []
    for part in np.split(wanted, sorted(cuts)):
        drive, state = found.run(part, state)
        parts.append(drive)
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    np.testing.assert_array_equal(state, last)
    assert whole.min() >= -1.5 and whole.max() <= 1.2


def test_what_is_missing_holds_the_drive():
    found = creeping().compensator()
    wanted = path()
    u, _ = found.run(wanted, found.standing_at(0.7))
    gaps = np.insert(wanted, [100, 100, 200], [np.nan, np.inf, -np.inf])
    with_gaps, _ = found.run(gaps, found.standing_at(0.7))
    np.testing.assert_array_equal(np.delete(with_gaps, [100, 101, 202]), u)
    assert with_gaps[100] == with_gaps[101] == u[99] and with_gaps[202] == u[199]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("drift", "the input does not drive it"),
        ("delay", "it is compensated only if the reference is known in advance"),
        ("linear-dynamics", "only the DC gain of its dynamics is inverted"),
    ],
)
def test_what_it_leaves_is_said(name, why):
    found = with_effect(model_of(plant()), name=name, **CASES[name][0]).compensator()
    assert found.left == [("dynamics", STILL), (name, why)]
    assert found.compensated == ["hysteresis"]


def test_the_static_gain_of_a_mode_counts():
    parameters = CASES["linear-dynamics"][0]
    found = with_effect(model_of(plant()), name="linear-dynamics", **parameters).compensator()
    own = np.sum(parameters["numerator"]) / (1 + np.sum(parameters["denominator"]))
    np.testing.assert_allclose(found.gain, model_of(plant()).linear.dc_gain[0, 0] + own, rtol=1e-13)


def test_the_curve_is_the_sum_of_deadzones():
    inverse = model_of(plant()).compensator().hysteresis
    knots, heights, slopes = inverse.curve
    z = np.linspace(-5, 5, 1001)
    piece = np.searchsorted(knots, z, side="right")
    j = np.maximum(piece - 1, 0)
    np.testing.assert_allclose(
        heights[j] + slopes[piece] * (z - knots[j]), inverse.envelope(z), rtol=0, atol=1e-14
    )


def test_wrong_calls_are_named():
    found = creeping().compensator()
    with pytest.raises(gpi.ParameterError, match="`state` has 2 elements, but 9 are needed"):
        found.run([1.0], [0.0, 0.0])
    with pytest.raises(gpi.ParameterError, match="`reference` = inf"):
        found.standing_at(np.inf)
    with pytest.raises(gpi.ParameterError, match="`limits` = 2, 1"):
        creeping().compensator(limits=(2.0, 1.0))
