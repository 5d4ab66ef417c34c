"""The inverse of the cascade against the oracle's root finding, and its laws at length."""

import numpy as np
import pytest

import gpi_hammerstein as gpi
import oracle

THRESHOLDS, SLOPES = [-2.0, 0.0, 1.0, 2.5], [-0.3, 1.2, 0.4, -0.5]
HALF_WIDTHS, WEIGHTS = [0.0, 0.2, 0.5, 0.9], [0.8, 0.5, -0.4, 0.6]


@pytest.fixture
def cascade():
    return gpi.Gpi(gpi.Deadzones(THRESHOLDS, SLOPES), gpi.PlayBank(HALF_WIDTHS, WEIGHTS))


def random_walk(samples, seed=1):
    steps = np.random.default_rng(seed).normal(size=samples)
    return 3.0 * np.sin(0.1 * np.cumsum(steps)) + 0.2 * steps


@pytest.mark.parametrize("limits", [None, (-1.0, 1.2)])
def test_against_root_finding(cascade, limits):
    v = random_walk(300)
    u, state = cascade.inverse(limits=limits).run(v)
    expected = oracle.inverse_gpi(v, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS, limits=limits or (-1e3, 1e3))
    np.testing.assert_allclose(u, expected, rtol=0, atol=2e-12)
    beyond = np.sum(np.abs(cascade(u) - v) > 1e-9)
    assert state[0] == beyond
    assert (beyond > 20) == (limits is not None)


@pytest.mark.parametrize("shape", [(200_000,), (50_000, 3)])
def test_the_cascade_gives_what_was_wanted(cascade, shape):
    v = random_walk(int(np.prod(shape))).reshape(shape)
    u = cascade.inverse()(v)
    assert u.shape == shape
    assert np.max(np.abs(cascade(u) - v)) < 1e-12


def test_any_past_and_in_parts(cascade):
    _, forward = cascade.run(random_walk(1000, seed=2))
    inverse, v = cascade.inverse(), random_walk(2000)
    state = cascade.inverse_state(forward)
    whole, _ = inverse.run(v, state)
    reached, _ = cascade.run(whole, forward)
    assert np.max(np.abs(reached - v)) < 1e-12
    parts = []
    for part in np.split(v, [1, 700, 701]):
        u, state = inverse.run(part, state)
        parts.append(u)
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=0, atol=1e-13)


def test_kuhnens_formulas(cascade):
    inverse = cascade.plays.inverse()
    slopes = np.cumsum(WEIGHTS)
    plays = list(zip(HALF_WIDTHS, WEIGHTS, strict=True))
    widths = [sum(p * (r - own) for own, p in plays if own <= r) for r in HALF_WIDTHS]
    np.testing.assert_allclose(inverse.half_widths, widths, rtol=1e-15)
    np.testing.assert_allclose(np.cumsum(inverse.weights), 1 / slopes, rtol=1e-15)


def test_out_of_reach_is_said(cascade):
    with pytest.warns(UserWarning, match="samples are out of reach") as told:
        u = cascade.inverse(limits=(-1.5, 2.0))([5.0, 0.0, -5.0, -6.0])
    assert str(told[0].message).startswith("3 samples")
    assert u[[0, 2, 3]].tolist() == [2.0, -1.5, -1.5]


def test_an_envelope_that_ceases_to_rise_is_a_limit():
    op = gpi.Gpi(gpi.Deadzones([0.0, 2.0], [1.0, -1.0]), gpi.PlayBank([0.0], [1.0]))
    assert op.inverse().limits == (-np.inf, 2.0)


@pytest.mark.parametrize(
    ("deadzones", "plays", "limits", "message"),
    [
        (
            ([1.0], [1.0]),
            ([0.0], [1.0]),
            None,
            "`envelope.weights`: the elements up to index 0 sum to a slope of 0e0",
        ),
        (([0.0], [1.0]), ([0.1], [1.0]), None, "`weights`: the elements up to index 0 sum to a slope of 0e0"),
        (
            ([0.0], [1.0]),
            ([0.0, 0.1], [1.0, -3.0]),
            None,
            "`weights`: the elements up to index 1 sum to a slope of -2e0",
        ),
        (([0.0], [1.0], "directional"), ([0.0], [1.0]), None, "only one-sided deadzones have an inverse"),
        (([0.0], [1.0]), ([0.0], [1.0]), (1.0, -1.0), "`limits` = 1, -1"),
        (([0.0], [1.0]), ([0.0], [1.0]), (np.nan, 1.0), "`limits` = NaN, 1"),
    ],
)
def test_what_has_no_inverse_is_refused(deadzones, plays, limits, message):
    op = gpi.Gpi(gpi.Deadzones(*deadzones), gpi.PlayBank(*plays))
    with pytest.raises(gpi.ParameterError) as told:
        op.inverse(limits=limits)
    assert message in str(told.value)


def test_states_that_no_input_brings_about_are_refused(cascade):
    with pytest.raises(
        gpi.ParameterError, match="the output of play 1 differs by 5 from that of the next narrower play"
    ):
        cascade.inverse_state([0.0, 0.0, 5.0, 0.0, 0.0])
    with pytest.raises(gpi.ParameterError, match="`state` has 2 elements, but 5 are needed"):
        cascade.inverse().run([1.0], [0.0, 0.0])
