"""The operators against the oracle, their laws, and figures that others have published."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import gpi_hammerstein as gpi
import oracle

TESTDATA = Path(__file__).resolve().parents[2] / "testdata"
READINGS = ["one-sided", "directional"]
PRECISION = 1e-12


def assert_agree(actual, expected, magnitude):
    """`actual` equals `expected` to 1e-12 of the magnitude of the terms that were added up."""
    np.testing.assert_array_less(np.abs(actual - expected), PRECISION * np.asarray(magnitude) + 1e-320)


def check_bank(z, half_widths, weights, start=None):
    v, final = gpi.PlayBank(half_widths, weights).run(z, start)
    expected, expected_final = oracle.play_bank(z, half_widths, weights, start)
    terms = np.abs(oracle.plays(z, half_widths, start)) @ np.abs(weights)
    assert_agree(v, expected, terms)
    np.testing.assert_allclose(final, expected_final, rtol=PRECISION, atol=0)


def zones(u, thresholds, reading, previous=0.0):
    columns = [oracle.deadzones(u, [eta], [1.0], reading, previous) for eta in thresholds]
    return np.stack(columns, axis=1) if columns else np.zeros((len(u), 0))


def check_deadzones(u, thresholds, weights, reading, previous=0.0):
    z, last = gpi.Deadzones(thresholds, weights, reading).run(u, previous)
    expected = oracle.deadzones(u, thresholds, weights, reading, previous)
    assert_agree(z, expected, np.abs(zones(u, thresholds, reading, previous)) @ np.abs(weights))
    assert last == (u[-1] if len(u) else previous)


def check_gpi(u, thresholds, slopes, half_widths, weights, reading):
    op = gpi.Gpi(gpi.Deadzones(thresholds, slopes, reading), gpi.PlayBank(half_widths, weights))
    expected, _ = oracle.gpi(u, thresholds, slopes, half_widths, weights, reading)
    # a play passes on no more than the largest rounding error of its input's past
    terms = np.abs(zones(u, thresholds, reading)) @ np.abs(slopes)
    past = np.maximum.accumulate(terms) if len(terms) else terms
    assert_agree(op(u), expected, past * np.sum(np.abs(weights)))


# --- random and adversarial input ----------------------------------------------------------------

finite = st.floats(-1e3, 1e3, allow_subnormal=False)
grid = st.integers(-8, 8).map(lambda n: 0.25 * n)  # exact ties between signal, widths and thresholds
scales = st.sampled_from([1.0, 1e-12, 1e12, 1e-100, 1e100])
random_signals = arrays(np.float64, st.integers(1, 80), elements=finite)
grid_signals = st.lists(grid, min_size=1, max_size=80).map(np.array)
plateaus = st.lists(st.tuples(grid, st.integers(1, 6)), min_size=1, max_size=20).map(
    lambda runs: np.array([value for value, length in runs for _ in range(length)])
)
alternations = st.builds(
    lambda amplitude, ratio, count: amplitude * (-ratio) ** np.arange(count),
    finite,
    st.floats(0.05, 1.0),
    st.integers(1, 60),
)
signals = st.one_of(random_signals, grid_signals, plateaus, alternations)
values = st.one_of(grid, finite)


def parameters(first):
    """Equal-length arrays of `first` and of weights of any sign, with repetitions."""
    pairs = st.lists(st.tuples(first, values), min_size=0, max_size=6)
    doubled = st.tuples(pairs, st.booleans()).map(lambda drawn: drawn[0] * (2 if drawn[1] else 1))
    return doubled.map(lambda rows: np.array(rows, dtype=float).reshape(-1, 2).T)


widths = st.one_of(st.just(0.0), values.map(abs))


@given(signals, parameters(widths), scales)
@example(np.array([1.0, 1.0, 2.0, 0.0, 2.0]), np.array([[0.0, 1.0, 1.0], [1.0, -2.0, 2.0]]), 1.0)
def test_play_bank_agrees_with_the_oracle(z, bank, scale):
    check_bank(scale * z, scale * bank[0], bank[1])


@given(signals, parameters(widths), st.data())
def test_play_bank_from_a_state_agrees_with_the_oracle(z, bank, data):
    start = data.draw(arrays(np.float64, len(bank[0]), elements=values))
    check_bank(z, bank[0], bank[1], start)


@pytest.mark.parametrize("reading", READINGS)
@given(signals, parameters(values), values, scales)
@example(np.array([1.0, 1.0, 2.0, 0.0, -1.0]), np.array([[0.0, 1.0, -1.0], [1.0, -2.0, 2.0]]), 1.0, 1.0)
def test_deadzones_agree_with_the_oracle(reading, u, envelope, previous, scale):
    check_deadzones(scale * u, scale * envelope[0], envelope[1], reading, scale * previous)


@pytest.mark.parametrize("reading", READINGS)
@given(signals, parameters(values), parameters(widths), scales)
def test_gpi_agrees_with_the_oracle(reading, u, envelope, bank, scale):
    check_gpi(scale * u, scale * envelope[0], envelope[1], scale * bank[0], bank[1], reading)


def test_long_records_agree_with_the_oracle():
    rng = np.random.default_rng(0)
    for samples in [255, 256, 257, 4099]:
        z = np.cumsum(rng.normal(size=samples))
        for plays in [1, 3, 4, 8, 9, 33]:
            check_bank(z, rng.uniform(0, 5, plays), rng.normal(size=plays))
        for count in [1, 5, 17]:
            thresholds, slopes = 4 * rng.normal(size=count), rng.normal(size=count)
            for reading in READINGS:
                check_gpi(z, thresholds, slopes, [0.0, 0.3, 2.0], [1.0, -0.5, 2.0], reading)


def test_channels_have_states_of_their_own():
    rng = np.random.default_rng(8)
    z = np.cumsum(rng.normal(size=(3000, 3)), axis=0)
    bank, start = gpi.PlayBank([0.0, 0.5, 2.0], [1.0, 0.5, 2.0]), rng.normal(size=(3, 3))
    v, state = bank.run(z, start)
    cascade = gpi.Gpi(gpi.Deadzones([-1.0, 0.0, 1.0], [0.1, 1.0, 0.2]), bank)
    together = cascade(z)
    for channel in range(3):
        alone, after = bank.run(z[:, channel], start[:, channel])
        np.testing.assert_array_equal(v[:, channel], alone)
        np.testing.assert_array_equal(state[:, channel], after)
        np.testing.assert_array_equal(together[:, channel], cascade(z[:, channel]))
    with pytest.raises(gpi.ParameterError, match="2 channels.*3"):
        bank.run(z, start[:, :2])


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_threads_change_nothing(threads):
    rng = np.random.default_rng(9)
    bank = gpi.PlayBank([0.0, 0.3, 1.5], [1.0, 0.5, 2.0])
    for z in (np.sin(0.01 * np.arange(20_000)), rng.normal(size=20_000), 1e-3 * rng.normal(size=20_000)):
        start = np.array([0.1, 0.2, -1.0])
        v, state = bank.run(z, start)
        found, after = bank.run(z, start, threads=threads)
        np.testing.assert_allclose(found, v, rtol=0, atol=1e-13)
        np.testing.assert_allclose(after, state, rtol=0, atol=1e-13)
    with pytest.raises(gpi.ParameterError, match="threads"):
        bank(z, threads=0)


def test_lists_integers_strides_and_single_precision_are_read():
    bank = gpi.PlayBank([0, 1], [1, 2])
    expected, _ = oracle.play_bank([1, 3, 2, 0], [0, 1], [1, 2])
    wide = np.zeros((4, 2))
    wide[:, 0] = [1, 3, 2, 0]
    for z in [[1, 3, 2, 0], (1.0, 3.0, 2.0, 0.0), wide[:, 0], np.array([1, 3, 2, 0], dtype=np.float32)]:
        np.testing.assert_array_equal(bank(z), expected)
    np.testing.assert_array_equal(
        bank(np.array([0, 2, 3, 1])[::-1]), oracle.play_bank([1, 3, 2, 0], [0, 1], [1, 2])[0]
    )
    assert bank([]).shape == (0,)


def test_parameters_can_be_read_back():
    bank = gpi.PlayBank([0.0, 0.5], [1.0, -2.0])
    np.testing.assert_array_equal(bank.half_widths, [0.0, 0.5])
    np.testing.assert_array_equal(bank.weights, [1.0, -2.0])
    envelope = gpi.Deadzones([0.0, 0.5, -1.0], [1.0, -2.0, 0.25], "directional")
    np.testing.assert_array_equal(envelope.thresholds, [0.0, 0.5, -1.0])
    np.testing.assert_array_equal(envelope.weights, [1.0, -2.0, 0.25])
    assert envelope.reading == "directional"
    assert gpi.Deadzones([0.0], [1.0]).reading == "one-sided"
    op = gpi.Gpi(envelope, bank)
    np.testing.assert_array_equal(op.envelope.weights, envelope.weights)
    np.testing.assert_array_equal(op.plays.half_widths, bank.half_widths)


# --- state ---------------------------------------------------------------------------------------


@given(signals, parameters(widths), st.data())
def test_play_bank_in_two_parts_equals_one(z, bank, data):
    cut = data.draw(st.integers(0, len(z)))
    op = gpi.PlayBank(*bank)
    whole, final = op.run(z)
    first, middle = op.run(z[:cut])
    second, last = op.run(z[cut:], middle)
    np.testing.assert_array_equal(np.concatenate([first, second]), whole)
    np.testing.assert_array_equal(last, final)
    np.testing.assert_array_equal(op(z), whole)


@pytest.mark.parametrize("reading", READINGS)
@given(signals, parameters(values), parameters(widths), st.data())
def test_gpi_in_two_parts_equals_one(reading, u, envelope, bank, data):
    cut = data.draw(st.integers(0, len(u)))
    op = gpi.Gpi(gpi.Deadzones(*envelope, reading), gpi.PlayBank(*bank))
    whole, final = op.run(u)
    first, middle = op.run(u[:cut])
    second, last = op.run(u[cut:], middle)
    np.testing.assert_array_equal(np.concatenate([first, second]), whole)
    np.testing.assert_array_equal(last, final)
    np.testing.assert_array_equal(op(u), whole)


@pytest.mark.parametrize("reading", READINGS)
@given(signals, parameters(values), st.data())
def test_deadzones_in_two_parts_equal_one(reading, u, envelope, data):
    cut = data.draw(st.integers(0, len(u)))
    op = gpi.Deadzones(*envelope, reading)
    whole, final = op.run(u)
    first, middle = op.run(u[:cut])
    second, last = op.run(u[cut:], middle)
    np.testing.assert_array_equal(np.concatenate([first, second]), whole)
    assert last == final
    np.testing.assert_array_equal(op(u), whole)


def test_calls_do_not_share_state():
    bank = gpi.PlayBank([1.0], [1.0])
    saved = np.array([0.5])
    assert bank.run([5.0], saved)[0][0] == 4.0
    assert bank([0.5])[0] == 0.0
    np.testing.assert_array_equal(saved, [0.5])


# --- laws of the play operator -------------------------------------------------------------------


def play(z, half_width, start=0.0):
    return gpi.PlayBank([half_width], [1.0]).run(np.asarray(z, dtype=float), [start])[0]


@given(signals, widths, st.data())
def test_play_is_rate_independent(z, half_width, data):
    """Only the order of values counts: samples between two others on the way change nothing."""
    dense, kept = [z[0]], [0]
    for before, after in zip(z[:-1], z[1:], strict=True):
        fractions = sorted(data.draw(st.lists(st.floats(0, 1), max_size=3)))
        between = np.clip([before + f * (after - before) for f in fractions], *sorted((before, after)))
        dense.extend(np.sort(between) if before <= after else np.sort(between)[::-1])
        dense.append(after)
        kept.append(len(dense) - 1)
    np.testing.assert_array_equal(play(dense, half_width)[kept], play(z, half_width))


@given(st.integers(1, 60).flatmap(lambda n: st.tuples(*[arrays(np.float64, n, elements=values)] * 2)), widths)
def test_play_is_lipschitz_with_constant_one(pair, half_width):
    first, second = pair
    distance = np.maximum.accumulate(np.abs(first - second))
    rounding = PRECISION * (np.max(np.abs(pair)) + half_width)
    assert np.all(np.abs(play(first, half_width) - play(second, half_width)) <= distance + rounding)


@given(
    st.integers(1, 60).flatmap(lambda n: st.tuples(*[arrays(np.float64, n, elements=values)] * 2)),
    widths,
    st.tuples(values, values),
)
def test_play_preserves_order(pair, half_width, starts):
    below, above = np.minimum(*pair), np.maximum(*pair)
    assert np.all(play(below, half_width, min(starts)) <= play(above, half_width, max(starts)))


@given(signals, widths, widths, values, st.floats(-1, 1))
def test_plays_form_a_semigroup(z, r, s, inner, position):
    """F_r F_s = F_{r+s} when the outer play starts within its gap around the inner one."""
    outer = inner + position * r
    cascade = play(play(z, s, inner), r, outer)
    magnitude = np.max(np.abs(z)) + r + s + abs(inner)
    np.testing.assert_allclose(cascade, play(z, r + s, outer), rtol=0, atol=PRECISION * magnitude)


def nested(low, high):
    """A closed excursion that starts at `low`, stays within the range, and comes back."""
    inside = st.floats(0, 1).map(lambda f: min(max(low + f * (high - low), low), high))
    return st.lists(inside, min_size=1, max_size=5)


@given(parameters(widths), st.lists(grid, min_size=2, max_size=20), st.data())
def test_inner_loops_are_wiped_out(bank, extremes, data):
    """Passing the extremes of an inner loop erases it: the bank goes on as if it had never been."""
    dense, kept = [extremes[0]], [0]
    for before, after in zip(extremes[:-1], extremes[1:], strict=True):
        if data.draw(st.booleans()):
            # any excursion between the two values, on the way from one to the other
            low, high = min(before, after), max(before, after)
            dense.extend(data.draw(nested(low, high)))
        dense.append(after)
        kept.append(len(dense) - 1)
    op = gpi.PlayBank(*bank)
    whole, final = op.run(dense)
    direct, expected = op.run(extremes)
    np.testing.assert_array_equal(whole[kept], direct)
    np.testing.assert_array_equal(final, expected)


@given(parameters(widths), grid_signals, grid_signals, st.tuples(grid, grid))
def test_minor_loops_are_congruent(bank, one_past, other_past, ends):
    """Loops between the same ends have the same shape, whatever went before."""
    low, high = min(ends), max(ends)
    loop = np.concatenate([[low], np.linspace(low, high, 9), np.linspace(high, low, 9)])
    op = gpi.PlayBank(*bank)
    minor = []
    for past in (one_past, other_past):
        # a first turn of the loop leaves the past behind up to a constant
        signal = np.concatenate([past, [low, high], loop])
        v = op(signal)[-len(loop) :]
        minor.append(v - v[0])
    magnitude = 16 * np.sum(np.abs(bank[1])) + 1
    np.testing.assert_allclose(minor[0], minor[1], rtol=0, atol=PRECISION * magnitude)


@given(signals, parameters(values), st.sampled_from(READINGS))
def test_deadzones_are_odd(u, envelope, reading):
    """Mirrored thresholds (one-sided) or the same ones (directional) mirror the output."""
    thresholds, slopes = envelope
    mirrored = -thresholds if reading == "one-sided" else thresholds
    there = gpi.Deadzones(thresholds, slopes, reading)(u)
    back = gpi.Deadzones(mirrored, slopes, reading)(-u)
    np.testing.assert_array_equal(back, -there)


@given(signals, parameters(values))
def test_one_sided_deadzones_have_no_memory(u, envelope):
    op = gpi.Deadzones(*envelope)
    np.testing.assert_array_equal(op(u)[::-1], op(u[::-1]))


# --- figures of others ---------------------------------------------------------------------------

HALF_WIDTHS = np.array([0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7])
WEIGHTS = np.array([0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012])


def test_published_walk():
    bank = gpi.PlayBank([0.1, 0.2, 0.3, 0.4], [0.25] * 4)
    v = bank([0, 0.2, 0.5, 1.1, 1.25, 1, 0.2, -1])
    np.testing.assert_allclose(v, [0, 0.025, 0.25, 0.85, 1, 0.9875, 0.45, -0.75], rtol=0, atol=1e-15)


def test_published_loop():
    """Peak and area of the steady loop of 4 sin, sampled so that it meets every corner of the loop."""
    levels = np.linspace(-4, 4, 161)
    turns = np.concatenate([levels[80:], levels[-2:0:-1], levels[:80]])
    phase = np.unwrap(np.concatenate([np.arcsin(levels[80:] / 4), np.pi - np.arcsin(levels[-2:0:-1] / 4),
                                      2 * np.pi + np.arcsin(levels[:80] / 4)]))  # fmt: skip
    assert np.all(np.diff(phase) > 0)
    z = np.tile(4 * np.sin(phase), 2)
    np.testing.assert_allclose(z[: len(turns)], turns, atol=1e-14)
    v = gpi.PlayBank(HALF_WIDTHS, WEIGHTS)(z)
    steady = slice(len(turns), None)
    assert np.max(v[steady]) == pytest.approx(8.2056, abs=1e-12)
    assert oracle.loop_area(z[steady], v[steady]) == pytest.approx(20.20248, abs=1e-11)


def test_published_loop_uniformly_sampled():
    """Uniform samples cut the loop's corners, by the square of the step."""
    period = 4000
    z = 4 * np.sin(2 * np.pi * np.arange(2 * period) / period)
    v = gpi.PlayBank(HALF_WIDTHS, WEIGHTS)(z)[period:]
    assert np.max(v) == pytest.approx(8.2056, abs=1e-12)
    assert oracle.loop_area(z[period:], v) == pytest.approx(20.20248, abs=2e-5)


def test_published_tanh_envelope():
    """The envelope acts before the plays: v = P[6 tanh(0.4 u)], u of amplitude 5.

    In the other order the output saturates below 6 and could not reach the published peak.
    """
    half_widths = 0.45 * np.arange(7)
    bank = gpi.PlayBank(half_widths, 0.65 * np.exp(-7.75e-4 * half_widths))
    u = 5 * np.sin(2 * np.pi * np.arange(800) / 400)
    assert np.max(bank(6 * np.tanh(0.4 * u))) == pytest.approx(20.157213586, abs=5e-10)
    assert np.max(6 * np.tanh(0.4 * bank(u))) < 6


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: gpi.PlayBank([0.0, 1.0], [1.0]), ["weights", "1", "2"]),
        (lambda: gpi.PlayBank([0.0, -1.0], [1.0, 1.0]), ["half_widths", "[1]", "negative"]),
        (lambda: gpi.PlayBank([np.nan], [1.0]), ["half_widths", "[0]", "finite"]),
        (lambda: gpi.PlayBank([0.0, 1.0, 2.0], [1.0, 1.0, np.inf]), ["weights", "[2]", "finite"]),
        (lambda: gpi.PlayBank([0.0], [1.0]).run([1.0], [0.0, 0.0]), ["state", "2", "1"]),
        (lambda: gpi.PlayBank([0.0], [1.0]).run([1.0], [np.nan]), ["state", "[0]", "finite"]),
        (lambda: gpi.PlayBank([0.0], [1.0])(np.zeros((3, 2, 1))), ["`z`", "[3, 2, 1]", "channels"]),
        (lambda: gpi.PlayBank(["wide"], [1.0]), ["half_widths", "numbers"]),
        (lambda: gpi.Deadzones([0.0, 1.0, 2.0], [1.0]), ["weights", "1", "3"]),
        (lambda: gpi.Deadzones([0.0, np.inf], [1.0, 1.0]), ["thresholds", "[1]", "finite"]),
        (lambda: gpi.Deadzones([0.0], [np.nan]), ["weights", "[0]", "finite"]),
        (
            lambda: gpi.Deadzones([0.0], [1.0], "sideways"),
            ["reading", "sideways", "one-sided", "directional"],
        ),
        (
            lambda: gpi.Gpi(gpi.Deadzones([0.0], [1.0]), gpi.PlayBank([0.0], [1.0])).run([1.0], [0.0] * 9),
            ["state", "9"],
        ),
    ],
)
def test_bad_parameters_are_named(build, words):
    with pytest.raises(gpi.ParameterError) as caught:
        build()
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, gpi.GpiError)
    for word in words:
        assert word in str(caught.value)


# --- vectors shared with the other language ------------------------------------------------------

SHARED = json.loads((TESTDATA / "operators.json").read_text(encoding="utf-8"))


def shared(section):
    cases = SHARED[section]
    return pytest.mark.parametrize("case", cases, ids=[case["name"] for case in cases])


def assert_equal_vectors(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=PRECISION, atol=PRECISION * np.max(np.abs(expected)))


@shared("deadzones")
def test_shared_deadzones(case):
    parameters = case["thresholds"], case["weights"], case["reading"]
    z, _ = gpi.Deadzones(*parameters).run(case["input"], case["previous"])
    assert_equal_vectors(z, case["output"])
    assert_equal_vectors(oracle.deadzones(case["input"], *parameters, case["previous"]), case["output"])


@shared("plays")
def test_shared_plays(case):
    assert_equal_vectors(play(case["input"], case["half_width"], case["start"]), case["output"])
    assert_equal_vectors(oracle.play(case["input"], case["half_width"], case["start"]), case["output"])


@shared("banks")
def test_shared_banks(case):
    for run in (gpi.PlayBank(case["half_widths"], case["weights"]).run, oracle_bank(case)):
        v, final = run(case["input"], case["start"])
        assert_equal_vectors(v, case["output"])
        assert_equal_vectors(final, case["final"])


def oracle_bank(case):
    return lambda z, start: oracle.play_bank(z, case["half_widths"], case["weights"], start)


@shared("gpis")
def test_shared_gpis(case):
    envelope = case["thresholds"], case["deadzone_weights"]
    bank = case["half_widths"], case["weights"]
    op = gpi.Gpi(gpi.Deadzones(*envelope, case["reading"]), gpi.PlayBank(*bank))
    assert_equal_vectors(op(case["input"]), case["output"])
    assert_equal_vectors(oracle.gpi(case["input"], *envelope, *bank, case["reading"])[0], case["output"])
