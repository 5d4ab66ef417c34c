"""The linear stages against the oracle: FIR, realization, state space, noncausal inverse."""

import functools
import json
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize

import gpi_hammerstein as gpi
import oracle

TESTDATA = Path(__file__).resolve().parents[2] / "testdata"
PRECISION = 1e-9


def assert_agree(actual, expected, precision=PRECISION):
    """Equal to `precision` of the largest element."""
    expected = np.asarray(expected)
    largest = np.max(np.abs(expected), initial=0.0)
    assert np.shape(actual) == expected.shape
    np.testing.assert_allclose(actual, expected, rtol=0, atol=precision * largest)


def assert_same_set(actual, expected, tolerance=PRECISION):
    """The same complex numbers in any order."""
    assert np.shape(actual) == np.shape(expected)
    distance = np.abs(np.asarray(actual)[:, None] - np.asarray(expected)[None, :])
    pairs = scipy.optimize.linear_sum_assignment(distance)
    assert np.max(distance[pairs], initial=0.0) <= tolerance


def random_system(seed, order, inputs, outputs, radius=0.8, feedthrough=True):
    """A stable system without structure."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(order, order))
    a *= radius / np.max(np.abs(np.linalg.eigvals(a)))
    d = rng.normal(size=(outputs, inputs)) if feedthrough else np.zeros((outputs, inputs))
    return a, rng.normal(size=(order, inputs)), rng.normal(size=(outputs, order)), d


LAG = oracle.from_transfer_function([0.5], [1.0, -0.5])
SECOND_ORDER = oracle.from_transfer_function([1.0, 0.3], [1.0, -1.2, 0.6])
TWO_BY_TWO = (
    np.array([[0.6, 0.3, 0.0], [-0.3, 0.6, 0.1], [0.0, 0.2, -0.4]]),
    np.array([[1.0, 0.0], [0.5, -1.0], [0.0, 2.0]]),
    np.array([[1.0, 0.0, 1.0], [0.0, 1.0, -1.0]]),
    np.array([[0.5, 0.0], [0.0, -0.5]]),
)
SYSTEMS = {
    "static": (np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[2.5]])),
    "lag": LAG,
    "second order": SECOND_ORDER,
    "nonminimum phase": oracle.from_transfer_function([1.0, -2.5, 1.0], [1.0, -0.9, 0.5, 0.0]),
    "two by two": TWO_BY_TWO,
    "dense": random_system(1, 8, 1, 1),
    "three by three": random_system(2, 6, 3, 3),
}
OBLONG = {"wide": random_system(3, 5, 3, 1), "tall": random_system(4, 5, 1, 3, feedthrough=False)}

square = pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS.keys())
any_shape = pytest.mark.parametrize("system", (SYSTEMS | OBLONG).values(), ids=(SYSTEMS | OBLONG).keys())

# --- finite impulse response ---------------------------------------------------------------------


def experiments(seed, inputs, outputs, lengths, taps=6, colour=0.0, noise=0.05):
    """Noisy responses of one FIR system with another offset in each experiment."""
    rng = np.random.default_rng(seed)
    markov = rng.normal(size=(outputs, inputs, taps))
    runs = []
    for samples in lengths:
        u = rng.normal(size=(samples, inputs))
        for k in range(1, samples):
            u[k] += colour * u[k - 1]
        u += rng.normal(scale=5, size=inputs)
        y = oracle.convolve(markov, u) + rng.normal(scale=20, size=outputs)
        runs.append((u, y + noise * rng.normal(size=y.shape)))
    return runs


def estimate(runs, taps, **options):
    return gpi.fir([u for u, _ in runs], [y for _, y in runs], taps, **options)


def check_fir(runs, taps, ridge=0.0):
    found = estimate(runs, taps, ridge=ridge)
    expected = oracle.fir([(u, y, 0) for u, y in runs], taps, ridge)
    assert_agree(found.markov, expected.markov)
    assert_agree(found.offsets, expected.offsets)
    assert_agree(found.singular_values, expected.singular_values)
    assert_agree(found.residual_rms, expected.residual_rms)
    assert (found.rank, found.samples) == (expected.rank, expected.samples)
    s = expected.singular_values
    assert found.condition == pytest.approx(s[0] / s[-1], rel=PRECISION)


@pytest.mark.parametrize("ridge", [0.0, 1e-3, 1.0])
@pytest.mark.parametrize("lengths", [[400], [150, 90, 40]], ids=["one experiment", "three experiments"])
@pytest.mark.parametrize(("inputs", "outputs"), [(1, 1), (1, 2), (3, 1), (2, 3)])
def test_fir_agrees_with_the_oracle(inputs, outputs, lengths, ridge):
    check_fir(experiments(0, inputs, outputs, lengths), 6, ridge)


@pytest.mark.parametrize("taps", [1, 2, 7, 8, 9, 31])
def test_fir_of_any_length_agrees_with_the_oracle(taps):
    check_fir(experiments(1, 2, 1, [200, 73], taps=12), taps)


def test_fir_of_coloured_input_agrees_with_the_oracle():
    runs = experiments(2, 1, 1, [3000], taps=20, colour=0.95)
    assert 20 < estimate(runs, 20).condition < 100
    check_fir(runs, 20)


def test_fir_recovers_a_finite_response_and_its_offsets():
    rng = np.random.default_rng(3)
    truth = rng.normal(size=(2, 2, 5))
    inputs = [rng.normal(size=(60, 2)), rng.normal(size=(30, 2))]
    offsets = np.array([[1.0, -30.0], [250.0, 0.0]])
    outputs = [oracle.convolve(truth, u) + offset for u, offset in zip(inputs, offsets, strict=True)]
    found = gpi.fir(inputs, outputs, 8)
    assert_agree(found.markov[:, :, :5], truth, 1e-12)
    assert_agree(found.markov[:, :, 5:] + 1, np.ones((2, 2, 3)), 1e-12)
    assert_agree(found.offsets, offsets, 1e-12)


def test_fir_of_one_channel_is_the_one_by_one_case():
    rng = np.random.default_rng(4)
    u = rng.normal(size=100)
    y = 3 + np.convolve(u, [0.5, 1.0, -0.25])[:100]
    vectors, columns = gpi.fir(u, y, 3), gpi.fir(u[:, None], y[:, None], 3)
    assert vectors.markov.shape == (1, 1, 3)
    np.testing.assert_array_equal(vectors.markov, columns.markov)
    assert_agree(vectors.markov[0, 0], [0.5, 1.0, -0.25], 1e-12)
    assert vectors.offsets == pytest.approx(3, abs=1e-12)


def test_fir_reports_the_excitation_of_the_published_input():
    """sum_{i=1}^{1000} 5 sin(i Ts k) excites 31 taps at 1e-2 s and nearly nothing at 1e-5 s."""

    def published(period, samples):
        x = period * np.arange(samples)
        half = np.where(x == 0, 1.0, np.sin(x / 2))
        return 5 * np.sin(500 * x) * np.sin(500.5 * x) / half

    k = np.arange(40)
    direct = 5 * np.sin(np.outer(k, np.arange(1, 1001)) * 1e-2).sum(axis=1)
    np.testing.assert_allclose(published(1e-2, 40), direct, atol=1e-9)
    rng = np.random.default_rng(5)
    y = rng.normal(size=100_000)
    excited = gpi.fir(published(1e-2, 100_000), y, 31)
    assert excited.rank == 31
    assert excited.condition == pytest.approx(1.16, abs=0.005)
    starved = gpi.fir(published(1e-5, 100_000), y, 31)
    assert starved.rank < 10
    assert starved.condition > 1e7


@pytest.mark.parametrize(("tones", "rank"), [([0.7], 2), ([0.3, 1.1], 4), ([0.2, 0.9, 2.0, np.pi], 7)])
def test_fir_of_too_few_tones_is_the_minimum_norm_estimate(tones, rank):
    rng = np.random.default_rng(6)
    k = np.arange(500)
    u = np.sum([np.cos(w * k + w) for w in tones], axis=0)[:, None]
    y = np.roll(u, 1, axis=0) + 0.1 * rng.normal(size=u.shape)
    found = gpi.fir(u, y, 12)
    expected = oracle.fir([(u, y, 0)], 12)
    assert found.rank == expected.rank == rank
    assert_agree(found.markov, expected.markov)
    assert_agree(found.offsets + 1, expected.offsets + 1)
    assert_agree(found.singular_values[:rank], expected.singular_values[:rank])
    assert found.condition > 1e7


def test_fir_of_a_constant_input_has_no_rank():
    rng = np.random.default_rng(7)
    found = gpi.fir(np.full(50, 2.0), rng.normal(size=50), 3)
    assert found.rank == 0
    np.testing.assert_array_equal(found.markov, np.zeros((1, 1, 3)))


def test_ridge_damps_noise_where_nothing_is_excited():
    """Plain estimates are noise in a band without excitation; what is excited stays unbiased."""
    rng = np.random.default_rng(8)
    truth = np.exp(-np.arange(24) / 4)
    spectrum = np.fft.rfft(rng.normal(size=2000))
    spectrum[300:] *= 1e-3
    u = np.fft.irfft(spectrum)
    y = np.convolve(truth, u)[:2000] + 1e-2 * rng.normal(size=2000)
    plain, damped = gpi.fir(u, y, 24).markov[0, 0], gpi.fir(u, y, 24, ridge=1e-3).markov[0, 0]

    def response(taps, lines):
        return np.exp(-2j * np.pi / 2000 * np.outer(lines, np.arange(24))) @ taps

    excited, silent = [10, 100, 250], [500, 700, 900]
    assert np.max(np.abs(response(damped - truth, excited))) < 0.01
    assert np.max(np.abs(response(damped - truth, silent))) < 0.03
    assert np.max(np.abs(response(plain - truth, silent))) > 0.3


def test_fir_simulates_from_rest_without_its_offsets():
    runs = experiments(9, 2, 3, [120])
    found = estimate(runs, 6)
    u = np.random.default_rng(9).normal(size=(40, 2))
    assert_agree(found.simulate(u), oracle.convolve(found.markov, u), 1e-13)
    assert_agree(found.simulate(u[:3]), oracle.convolve(found.markov, u[:3]), 1e-13)


def test_fir_explains_itself():
    runs = experiments(10, 1, 1, [120])
    found = estimate(runs, 6)
    text = repr(found)
    assert "6 taps" in text and "rank 6 of 6" in text
    assert f"{found.condition:.3e}".split("e")[0] in text


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda u, y: gpi.fir(u, y, 0), gpi.ParameterError, ["taps", "0"]),
        (lambda u, y: gpi.fir(u, y, 3, ridge=-1.0), gpi.ParameterError, ["ridge", "-1"]),
        (lambda u, y: gpi.fir(u, y, 3, ridge=np.nan), gpi.ParameterError, ["ridge", "NaN"]),
        (lambda u, y: gpi.fir(u, y[:-1], 3), gpi.DataError, ["50", "49"]),
        (lambda u, y: gpi.fir(u, y, 26), gpi.DataError, ["25 usable", "27", "26 taps"]),
        (lambda u, y: gpi.fir(u, y, 60), gpi.DataError, ["0 usable", "61"]),
        (lambda u, y: gpi.fir(np.r_[u[:7], np.nan, u[8:]], y, 3), gpi.DataError, ["u", "row 7"]),
        (
            lambda u, y: gpi.fir(u, np.r_[y[:9], np.inf, np.nan, y[11:]], 3),
            gpi.DataError,
            ["y", "row 9", "2"],
        ),
        (lambda u, y: gpi.fir([u, u], [y], 3), gpi.ParameterError, ["`u`", "2", "`y`", "1"]),
    ],
)
def test_fir_refuses(call, error, words):
    rng = np.random.default_rng(11)
    with pytest.raises(error) as caught:
        call(rng.normal(size=50), rng.normal(size=50))
    for word in words:
        assert word in str(caught.value)


def test_fir_takes_exactly_enough_samples():
    rng = np.random.default_rng(12)
    u, y = rng.normal(size=51), rng.normal(size=51)
    assert gpi.fir(u, y, 25).samples == 27
    found = gpi.fir(u[:50], y[:50], 25)
    assert found.samples == 26
    assert_agree(found.simulate(u[:50, None])[24:, 0] + found.offsets[0, 0], y[24:50], 1e-6)


# --- realization ---------------------------------------------------------------------------------


def matrices(system):
    return system.A, system.B, system.C, system.D


@any_shape
def test_era_agrees_with_the_oracle(system):
    markov = oracle.markov(*system, 41)
    found = gpi.era(markov, order=len(system[0]))
    expected, s = oracle.era(markov, order=len(system[0]))
    np.testing.assert_allclose(found.singular_values, s, rtol=0, atol=1e-12 * max(s[0], 1e-300))
    assert_agree(found.markov(60), oracle.markov(*expected, 60))
    assert_agree(found.markov(60), oracle.markov(*system, 60))
    assert_same_set(found.poles, oracle.poles(system[0]), 1e-8)
    assert found.reflected == 0
    np.testing.assert_array_equal(found.D, markov[:, :, 0])


@pytest.mark.parametrize("blocks", [None, 5, 12])
@pytest.mark.parametrize("order", [None, 1, 3, 4])
def test_era_of_noisy_taps_agrees_with_the_oracle(order, blocks):
    rng = np.random.default_rng(20)
    markov = oracle.markov(*TWO_BY_TWO, 26)
    markov = markov + 0.02 * rng.normal(size=markov.shape)
    found = gpi.era(markov, order, blocks)
    expected, s = oracle.era(markov, order, blocks)
    assert_agree(found.singular_values, s)
    assert found.order == len(expected[0])
    if found.reflected == 0:
        assert_agree(found.markov(30), oracle.markov(*expected, 30))
    else:
        mended, count = oracle.reflect(expected[0])
        assert found.reflected == count
        assert_agree(found.markov(30), oracle.markov(mended, *expected[1:], 30))


def test_era_chooses_the_order_from_the_singular_values():
    rng = np.random.default_rng(21)
    for system in (LAG, SECOND_ORDER, TWO_BY_TWO):
        assert gpi.era(oracle.markov(*system, 41)).order == len(system[0])
    # no gap: a slope of singular values is cut where 1e-4 of the energy is left
    slope = rng.normal(size=(1, 1, 81)) * np.exp(-np.arange(81) / 15)
    found = gpi.era(slope)
    assert found.order == oracle.choose_order(np.asarray(found.singular_values))
    assert 5 < found.order < 39


def test_era_balances():
    """Observability and controllability of the realization are both diag(s)."""
    markov = oracle.markov(*TWO_BY_TWO, 25)
    found = gpi.era(markov, blocks=11)
    a, b, c, _ = matrices(found)
    powers = [np.linalg.matrix_power(a, j) for j in range(11)]
    observability = sum(p.T @ c.T @ c @ p for p in powers)
    controllability = sum(p @ b @ b.T @ p.T for p in powers)
    s = np.diag(found.singular_values[: found.order])
    assert_agree(observability, s)
    assert_agree(controllability, s)


def test_era_of_a_static_gain_has_no_state():
    markov = np.zeros((2, 2, 15))
    markov[:, :, 0] = [[1.0, 2.0], [3.0, 4.0]]
    found = gpi.era(markov)
    assert found.order == 0
    np.testing.assert_array_equal(found.dc_gain, markov[:, :, 0])
    np.testing.assert_array_equal(found.simulate(np.eye(2)), markov[:, :, 0].T)


def test_era_keeps_a_pure_delay():
    markov = np.zeros((1, 1, 21))
    markov[0, 0, 3] = 2.0
    found = gpi.era(markov)
    assert found.order == 3
    assert_agree(found.markov(12), markov[:, :, :12])
    assert found.spectral_radius < 1e-4  # a defective pole at 0: the cube root of the rounding


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-2])
def test_era_of_a_large_hankel_matrix_takes_its_leading_singular_values(noise):
    """A given order needs no more than those, if they stand out of noise; all are as of the whole matrix."""
    markov = oracle.markov(*TWO_BY_TWO, 321)
    markov = markov + noise * np.random.default_rng(23).normal(size=markov.shape)
    found = gpi.era(markov, order=3)
    (a, b, c, d), s = oracle.era(markov, 3)
    assert len(found.singular_values) == (3 if noise < 1e-3 else len(s))
    assert_agree(found.singular_values[:3], s[:3], 1e-12)
    assert_agree(found.markov(12), oracle.markov(a, b, c, d, 12), 1e-9)


def test_era_reflects_unstable_poles_and_says_so():
    growing = oracle.from_transfer_function([1.0, 0.2], [1.0, -1.2, 1.21])  # modulus 1.1
    found = gpi.era(oracle.markov(*growing, 21))
    assert (found.order, found.reflected) == (2, 2)
    assert found.spectral_radius == pytest.approx(1 / 1.1, abs=1e-9)
    expected = oracle.poles(growing[0])
    assert_same_set(found.poles, expected / np.abs(expected) ** 2)


def test_era_of_a_fit_is_the_system():
    rng = np.random.default_rng(22)
    u = rng.normal(size=(4000, 2))
    y, _ = oracle.simulate(*TWO_BY_TWO, u)
    found = gpi.era(gpi.fir(u, y, 61).markov)
    assert found.order == 3
    assert_agree(found.markov(40), oracle.markov(*TWO_BY_TWO, 40), 1e-4)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda m: gpi.era(m, order=3), gpi.ParameterError, ["order", "3", "rank 2"]),
        (lambda m: gpi.era(m, blocks=11), gpi.ParameterError, ["blocks", "11", "21 taps", "10"]),
        (lambda m: gpi.era(m[:, :, :2]), gpi.DataError, ["2 ", "3"]),
        (lambda m: gpi.era(np.where(m == m[0, 0, 4], np.nan, m)), gpi.ParameterError, ["markov", "finite"]),
        (lambda m: gpi.era(m, blocks=0), gpi.ParameterError, ["blocks", "0"]),
    ],
)
def test_era_refuses(call, error, words):
    with pytest.raises(error) as caught:
        call(oracle.markov(*SECOND_ORDER, 21))
    for word in words:
        assert word in str(caught.value)


# --- state space ---------------------------------------------------------------------------------


@any_shape
def test_state_space_agrees_with_the_oracle(system):
    a, b, c, d = system
    found = gpi.StateSpace(*system)
    for matrix, expected in zip(matrices(found), system, strict=True):
        np.testing.assert_array_equal(matrix, expected)
    assert found.order == len(a)
    assert found.singular_values is None
    v = np.random.default_rng(30).normal(size=(150, b.shape[1]))
    assert_agree(found.simulate(v), oracle.simulate(*system, v)[0], 1e-12)
    start = np.linspace(-1, 2, len(a))
    y, final = found.run(v, start)
    expected, expected_final = oracle.simulate(*system, v, start)
    assert_agree(y, expected, 1e-12)
    assert_agree(final, expected_final, 1e-12)
    assert_agree(found.markov(25), oracle.markov(*system, 25), 1e-12)
    assert_same_set(found.poles, oracle.poles(a))
    assert found.spectral_radius == pytest.approx(np.max(np.abs(oracle.poles(a)), initial=0), abs=1e-10)
    assert_agree(found.dc_gain, oracle.dc_gain(*system), 1e-11)
    w = np.array([0.0, 1e-3, 0.5, 2.0, np.pi, 4.0, -1.0])
    assert_agree(found.frequency_response(w), oracle.frequency_response(*system, w), 1e-11)


@square
def test_zeros_agree_with_the_oracle(system):
    assert_same_set(gpi.StateSpace(*system).zeros, oracle.zeros(*system), 1e-8)


@pytest.mark.parametrize(
    ("numerator", "denominator", "zeros"),
    [
        ([1.0, -0.5], [1.0, 0.2], [0.5]),
        ([3.0, -7.5, 3.0], [1.0, -0.9, 0.5, 0.0], [2.0, 0.5]),
        ([1.0], [1.0, -0.5, 0.06, 0.0, 0.0], []),
        ([1.0, 0.0, 0.64], [1.0, 0.5, 0.1], [0.8j, -0.8j]),
        ([2.0, 200.0], [1.0, -0.3, 0.02], [-100.0]),
        ([1.0, 0.0], [1.0, -0.3, 0.02], [0.0]),
        ([1.0, -1.0], [1.0, -0.3, 0.02], [1.0]),
        (np.poly([1.234_567_8, 0.5]), np.poly([0.1, 0.2, 0.3]), [1.234_567_8, 0.5]),
        (np.poly([1.234_567_9, 0.5]), np.poly([0.1, 0.2, 0.3]), [1.234_567_9, 0.5]),
        ([1.0, -0.5], np.poly([0.1, 0.2, 0.3, 0.4, -0.5]), [0.5]),
        ([1.0, -0.5], np.poly([0.1, 0.2, 0.3, 0.4, -0.5, 0.7, 0.6]), [0.5]),
    ],
)
def test_zeros_are_the_roots_of_the_numerator(numerator, denominator, zeros):
    system = oracle.from_transfer_function(numerator, denominator)
    assert_same_set(gpi.StateSpace(*system).zeros, zeros, 1e-7)
    assert_same_set(gpi.StateSpace.from_transfer_function(numerator, denominator).zeros, zeros, 1e-7)
    # the same system in other coordinates
    turn = np.linalg.qr(np.random.default_rng(31).normal(size=system[0].shape))[0]
    turned = turn @ system[0] @ turn.T, turn @ system[1], system[2] @ turn.T, system[3]
    assert_same_set(gpi.StateSpace(*turned).zeros, zeros, 1e-7)


def test_state_space_in_two_parts_equals_one():
    found = gpi.StateSpace(*TWO_BY_TWO)
    v = np.random.default_rng(32).normal(size=(50, 2))
    whole, final = found.run(v)
    np.testing.assert_array_equal(whole, found.simulate(v))
    first, middle = found.run(v[:20])
    second, last = found.run(v[20:], middle)
    np.testing.assert_allclose(np.vstack([first, second]), whole, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(last, final, rtol=1e-13, atol=1e-13)


def test_state_space_of_one_channel_takes_vectors():
    found = gpi.StateSpace(*SECOND_ORDER)
    v = np.random.default_rng(33).normal(size=30)
    expected, _ = oracle.simulate(*SECOND_ORDER, v[:, None])
    assert_agree(found.simulate(v), expected[:, 0], 1e-12)
    assert_agree(found.simulate(v[:, None]), expected, 1e-12)


def test_markov_of_any_count():
    found = gpi.StateSpace(*SECOND_ORDER)
    assert found.markov(0).shape == (1, 1, 0)
    np.testing.assert_array_equal(found.markov(1), SECOND_ORDER[3][:, :, None])


@any_shape
def test_transfer_function_agrees_with_the_oracle(system):
    numerator, denominator = gpi.StateSpace(*system).to_transfer_function()
    expected = oracle.to_transfer_function(*system)
    assert_agree(numerator, expected[0])
    assert_agree(denominator, expected[1])
    point = 0.3 + 1.1j
    value = np.polyval(np.moveaxis(numerator, 2, 0), point) / np.polyval(denominator, point)
    assert_agree(value, oracle.evaluate(*system, point))


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [
        ([0.2, -0.3], [2.0, -1.0, 0.6]),
        ([4.0, 1.0, 0.5], [-2.0, 0.1, 0.2]),
        ([3.0], [2.0]),
        ([1.0], [1.0, 0, 0, 0]),
    ],
)
def test_transfer_function_there_and_back(numerator, denominator):
    system = gpi.StateSpace.from_transfer_function(numerator, denominator)
    back = system.to_transfer_function()
    padded = np.zeros(len(denominator))
    padded[len(denominator) - len(numerator) :] = numerator
    assert_agree(back[0][0, 0] + 1, padded / denominator[0] + 1, 1e-14)
    assert_agree(back[1], np.array(denominator) / denominator[0], 1e-14)
    assert_agree(
        system.markov(20), oracle.markov(*oracle.from_transfer_function(numerator, denominator), 20), 1e-12
    )


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ([(2, 3), (2, 1), (1, 3), (1, 1)], ["A", "2", "3"]),
        ([(2, 2), (3, 1), (1, 2), (1, 1)], ["A", "B", "2", "3"]),
        ([(2, 2), (2, 1), (1, 1), (1, 1)], ["A", "C", "2", "1"]),
        ([(2, 2), (2, 1), (1, 2), (1, 2)], ["B", "D", "1", "2"]),
        ([(2, 2), (2, 1), (1, 2), (2, 1)], ["C", "D", "1", "2"]),
    ],
)
def test_matrices_that_do_not_fit_are_named(sizes, words):
    with pytest.raises(gpi.DataError) as caught:
        gpi.StateSpace(*(np.ones(size) for size in sizes))
    for word in words:
        assert word in str(caught.value)


def transfer_function(numerator, denominator):
    return gpi.StateSpace.from_transfer_function(numerator, denominator)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: gpi.StateSpace([[np.nan]], [[1.0]], [[1.0]], [[0.0]]), gpi.ParameterError, ["A", "finite"]),
        (lambda: gpi.StateSpace(*TWO_BY_TWO).simulate(np.ones((5, 3))), gpi.DataError, ["3", "2"]),
        (lambda: gpi.StateSpace(*LAG).run(np.ones(5), [0.0, 0.0]), gpi.DataError, ["state", "2", "1"]),
        (lambda: gpi.StateSpace(*OBLONG["wide"]).zeros, gpi.DataError, ["3", "1"]),
        (lambda: transfer_function([1.0], [1.0, -1.0]).dc_gain, gpi.NumericalError, ["z = 1"]),
        (lambda: transfer_function([1.0, 2.0], [1.0]), gpi.ParameterError, ["numerator", "2", "1"]),
        (lambda: transfer_function([1.0], [0.0, 1.0]), gpi.ParameterError, ["denominator", "0"]),
        (lambda: transfer_function([1.0], []), gpi.ParameterError, ["denominator"]),
        (lambda: gpi.StateSpace(*LAG).zero_order_hold(0.0), gpi.ParameterError, ["period", "0"]),
        (lambda: gpi.StateSpace(*LAG).zero_order_hold(np.inf), gpi.ParameterError, ["period", "inf"]),
    ],
)
def test_state_space_refuses(call, error, words):
    with pytest.raises(error) as caught:
        call()
    for word in words:
        assert word in str(caught.value)


# --- zero-order hold -----------------------------------------------------------------------------

CONTINUOUS = [3.391e10], [1.0, 3759.0, 2.063e7, 7.514e10]  # (48)


@pytest.mark.parametrize(
    ("period", "numerator", "denominator", "rounding"),
    [
        (1e-2, [0, 0.255977, 0.0243899, 0.134935], [1, -0.574648, 0.494901, -9.8e-17], 3e-6),
        (1e-5, [0, 5.598e-6, 2.218e-5, 5.494e-6], [1, -2.96105, 2.92423, -0.963108], 2.5e-4),
    ],
)
def test_published_example_is_sampled_every_ten_milliseconds(period, numerator, denominator, rounding):
    """(49) is (48) held for 1e-2 s; at 1e-5 s, as printed, other figures come out."""
    sampled = gpi.StateSpace.from_transfer_function(*CONTINUOUS).zero_order_hold(period)
    found = sampled.to_transfer_function()
    np.testing.assert_allclose(found[0][0, 0], numerator, rtol=rounding, atol=1e-14)
    np.testing.assert_allclose(found[1], denominator, rtol=2e-6, atol=1e-15)
    expected = oracle.to_transfer_function(
        *oracle.zero_order_hold(*oracle.from_transfer_function(*CONTINUOUS), period)
    )
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-7, atol=1e-14)
    np.testing.assert_allclose(found[1], expected[1], rtol=PRECISION, atol=1e-15)


@pytest.mark.parametrize("period", [1e-6, 0.02, 0.7, 5.0])
def test_zero_order_hold_agrees_with_the_oracle(period):
    rng = np.random.default_rng(40)
    stable = rng.normal(size=(4, 4)) - 3 * np.eye(4)
    system = stable, rng.normal(size=(4, 2)), rng.normal(size=(3, 4)), rng.normal(size=(3, 2))
    found = gpi.StateSpace(*system).zero_order_hold(period)
    for matrix, expected in zip(matrices(found), oracle.zero_order_hold(*system, period), strict=True):
        assert_agree(matrix, expected, 1e-12)


def test_zero_order_hold_of_an_integrator():
    held = gpi.StateSpace([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]]).zero_order_hold(
        0.5
    )
    assert_agree(held.A, [[1.0, 0.5], [0.0, 1.0]], 1e-15)
    assert_agree(held.B, [[0.125], [0.5]], 1e-15)


# --- noncausal inverse ---------------------------------------------------------------------------

INVERTIBLE = {
    "static": SYSTEMS["static"],
    "proper": oracle.from_transfer_function([1.0, -0.5], [1.0, 0.2]),
    "strictly proper": SECOND_ORDER,
    "nonminimum phase": SYSTEMS["nonminimum phase"],
    "all pass": oracle.from_transfer_function([-0.8, 1.0], [1.0, -0.8]),
    "delay": oracle.from_transfer_function([2.0], [1.0, 0.0, 0.0, 0.0]),
    "zero at infinity but one": oracle.from_transfer_function([1e-3, 1.0], [1.0, -0.5]),
    "two by two": TWO_BY_TWO,
    "two by two, strictly proper": (*TWO_BY_TWO[:3], np.zeros((2, 2))),
}  # fmt: skip
invertible = pytest.mark.parametrize("name", INVERTIBLE)
LAGS = 4000


@functools.cache
def series_of(name):
    """The oracle's Laurent coefficients of lags -LAGS .. LAGS."""
    return oracle.laurent(*INVERTIBLE[name], LAGS)


@invertible
@pytest.mark.parametrize(("r", "d"), [(0, 0), (12, 5), (3, 40), (None, None), (None, 2), (7, None)])
def test_noncausal_inverse_agrees_with_the_oracle(name, r, d):
    inverse = gpi.StateSpace(*INVERTIBLE[name]).noncausal_inverse(r, d)
    assert r is None or inverse.r == r
    assert d is None or inverse.d == d
    series = series_of(name)
    assert inverse.taps.shape[2] == inverse.r + inverse.d + 1
    expected = series[:, :, LAGS - inverse.d : LAGS + inverse.r + 1]
    largest = np.max(np.abs(series))
    np.testing.assert_allclose(inverse.taps, expected, rtol=0, atol=PRECISION * largest)
    assert inverse.error == pytest.approx(oracle.truncation_error(series, inverse.r, inverse.d), abs=1e-11)


@invertible
@pytest.mark.parametrize("tolerance", [1e-2, 1e-6, 1e-9])
def test_chosen_window_is_short_and_its_error_honest(name, tolerance):
    system = INVERTIBLE[name]
    inverse = gpi.StateSpace(*system).noncausal_inverse(tolerance=tolerance)
    assert inverse.error <= tolerance
    series = series_of(name)
    norms = np.linalg.norm(series, axis=(0, 1))
    total = norms.sum()
    # each side may leave out half of the tolerance; one tap less would be too much
    if inverse.r > 0:
        assert norms[LAGS + inverse.r :].sum() > 0.5 * tolerance * total * (1 - 1e-6)
    if inverse.d > 0:
        assert norms[: LAGS - inverse.d + 1].sum() > 0.5 * tolerance * total * (1 - 1e-6)
    # the error bounds what is missing at every frequency
    w = np.linspace(0, np.pi, 101)
    lags = np.arange(-inverse.d, inverse.r + 1)
    kept = np.einsum("iol,wl->wio", inverse.taps, np.exp(-1j * np.outer(w, lags)))
    missing = np.linalg.inv(oracle.frequency_response(*system, w)) - kept
    assert np.max(np.linalg.norm(missing, axis=(1, 2))) <= (inverse.error + 1e-13) * total


@invertible
def test_inverse_returns_the_intermediate_signal(name):
    system = INVERTIBLE[name]
    rng = np.random.default_rng(50)
    v = rng.normal(size=(600, system[1].shape[1]))
    y, _ = oracle.simulate(*system, v)
    inverse = gpi.StateSpace(*system).noncausal_inverse(tolerance=1e-9)
    seen = inverse(y)
    assert (seen.valid.start, seen.valid.stop) == (inverse.r, len(y) - inverse.d)
    assert_agree(seen.values, oracle.apply_noncausal(inverse.taps, inverse.d, y), 1e-12)
    valid = seen.valid
    bound = np.linalg.norm(series_of(name), axis=(0, 1)).sum() * np.max(np.linalg.norm(y, axis=1))
    assert valid.stop - valid.start > 100
    np.testing.assert_allclose(seen.values[valid], v[valid], rtol=0, atol=1e-9 * bound + 1e-12)


def test_inverse_of_one_channel_takes_vectors():
    inverse = gpi.StateSpace(*SECOND_ORDER).noncausal_inverse()
    y = np.sin(0.1 * np.arange(300))
    assert_agree(inverse(y).values, inverse(y[:, None]).values[:, 0], 1e-15)


def test_inverse_holds_the_ends():
    """1 / (2 q^-1) is half the next sample; the last one has no next."""
    inverse = gpi.StateSpace.from_transfer_function([2.0], [1.0, 0.0]).noncausal_inverse(0, 1)
    seen = inverse([1.0, 4.0, -2.0])
    np.testing.assert_allclose(seen.values, [2.0, -1.0, -1.0], atol=1e-14)
    assert (seen.valid.start, seen.valid.stop) == (0, 2)


@pytest.mark.parametrize(
    ("numerator", "lags", "expected"),
    [
        ([1.0, -0.9], np.arange(0, 40), lambda i: 0.9**i),
        ([1.0, -2.0], np.arange(-40, 0), lambda i: -(0.5 ** (-i))),
        ([2.0, 0.0], np.arange(-3, 4), lambda i: 0.5 * (i == 0)),
    ],
)
def test_series_in_closed_form(numerator, lags, expected):
    inverse = gpi.StateSpace.from_transfer_function(numerator, [1.0, 0.0]).noncausal_inverse(60, 60)
    np.testing.assert_allclose(
        inverse.taps[0, 0, 60 + lags], expected(lags.astype(float)), rtol=0, atol=1e-13
    )


def test_published_example_needs_one_noncausal_tap():
    system = gpi.StateSpace.from_transfer_function(*CONTINUOUS).zero_order_hold(1e-2)
    assert np.abs(system.zeros) == pytest.approx([0.726, 0.726], abs=5e-4)
    assert_same_set(system.poles, [0.28732 + 0.64214j, 0.28732 - 0.64214j, 0], 1e-5)
    inverse = system.noncausal_inverse()
    assert inverse.d == 1
    assert inverse.taps[0, 0, 0] == pytest.approx(1 / 0.2559766, rel=1e-6)


def test_slow_zeros_are_inverted_to_the_tolerance():
    numerator = np.poly([0.99, 1 / 0.99])
    system = oracle.from_transfer_function(numerator, np.poly([0.1, 0.2]))
    inverse = gpi.StateSpace(*system).noncausal_inverse()
    assert inverse.error <= 1e-6
    series = oracle.laurent(*system, LAGS)
    assert inverse.error == pytest.approx(oracle.truncation_error(series, inverse.r, inverse.d), rel=1e-3)
    assert inverse.r > 1000 and inverse.d > 1000


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: inverse_of([1.0, 1.0], [1.0, 0.0]), gpi.NumericalError, ["zero", "unit circle", "3.14"]),
        (lambda: inverse_of([1.0, -1.0], [1.0, 0.3]), gpi.NumericalError, ["zero", "unit circle"]),
        (lambda: inverse_of([1.0, -1.00005], [1.0, 0.3]), gpi.NumericalError, ["zero", "0.0001"]),
        (
            lambda: inverse_of([1.0, -2 * np.cos(0.5), 1.0], [1.0, 0.3, 0.0]),
            gpi.NumericalError,
            ["zero", "0.5"],
        ),
        # next to a zero where a numerical search for zeros might have its blind spot
        (lambda: inverse_of(np.poly([1.2345678, 1.0]), [1.0, 0.0, 0.0]), gpi.NumericalError, ["zero"]),
        (lambda: inverse_of([0.0], [1.0, 0.3]), gpi.NumericalError, ["zero"]),
        (lambda: inverse_of([1.0, 0.5], [1.0, -1.1]), gpi.NumericalError, ["unstable", "1.1"]),
        (lambda: inverse_of([1.0, 0.5], [1.0, -1.0]), gpi.NumericalError, ["unstable", "1"]),
        (lambda: gpi.StateSpace(*OBLONG["wide"]).noncausal_inverse(), gpi.DataError, ["3", "1"]),
        (lambda: inverse_of([1.0], [1.0, 0.3], tolerance=0.0), gpi.ParameterError, ["tolerance", "0"]),
        (lambda: inverse_of([1.0], [1.0, 0.3], tolerance=1.5), gpi.ParameterError, ["tolerance", "1.5"]),
        (lambda: inverse_of([1.0, 0.5], [1.0, 0.3], 20, 3)(np.ones(23)), gpi.DataError, ["23", "24"]),
        (lambda: inverse_of([1.0, 0.5], [1.0, 0.3], 20, 3)(np.ones((30, 2))), gpi.DataError, ["2", "1"]),
    ],
)
def test_inverse_refuses(call, error, words):
    with pytest.raises(error) as caught:
        call()
    for word in words:
        assert word in str(caught.value)


def inverse_of(numerator, denominator, *window, **options):
    return gpi.StateSpace.from_transfer_function(numerator, denominator).noncausal_inverse(*window, **options)


def test_singular_gain_at_one_frequency_is_refused():
    """Two channels that move as one at zero frequency: no zero in either entry, one in the matrix."""
    a = np.diag([0.5, 0.5])
    coupling = np.array([[1.0, 1.0], [1.0, 1.0]])
    system = a, np.eye(2), 0.5 * coupling + 0.5 * np.diag([1.0, 1.0]), -np.eye(2)
    assert np.linalg.det(oracle.dc_gain(*system)) == pytest.approx(0, abs=1e-12)
    with pytest.raises(gpi.NumericalError, match="unit circle"):
        gpi.StateSpace(*system).noncausal_inverse()


def test_zero_just_off_the_circle_is_accepted():
    assert inverse_of([1.0, -1.001], [1.0, 0.3], tolerance=1e-2).error <= 1e-2


# --- vectors shared with the other language ------------------------------------------------------

SHARED = json.loads((TESTDATA / "linear.json").read_text(encoding="utf-8"))


def shared(section):
    cases = SHARED[section]
    return pytest.mark.parametrize("case", cases, ids=[case["name"] for case in cases])


def read(case):
    return tuple(np.array(case[key], dtype=float).reshape(shape) for key, shape in shapes(case))


def shapes(case):
    return [(key, np.shape(case[key])) for key in "ABCD"]


def as_complex(pairs):
    pairs = np.array(pairs).reshape(-1, 2)
    return pairs[:, 0] + 1j * pairs[:, 1]


@shared("fir")
def test_shared_fir(case):
    taps = case["taps"]
    runs = [(np.array(e["input"]), np.array(e["output"]), e["warmup"]) for e in case["experiments"]]
    # without a warm-up the rows begin where the past is complete
    cut = [(u[max(w - taps + 1, 0) :], y[max(w - taps + 1, 0) :]) for u, y, w in runs]
    for found in (estimate(cut, taps, ridge=case["ridge"]), oracle.fir(runs, taps, case["ridge"])):
        for name in ("markov", "residual_rms"):
            assert_agree(getattr(found, name), case[name])
        assert_agree(found.offsets + 1, np.array(case["offsets"]) + 1)
        excited = slice(0, case["rank"])
        assert_agree(found.singular_values[excited], case["singular_values"][excited])
        assert (found.rank, found.samples) == (case["rank"], case["samples"])


@shared("era")
def test_shared_era(case):
    markov = np.array(case["markov"])
    found = gpi.era(markov, case["order"], case["blocks"])
    assert_agree(found.singular_values, case["singular_values"])
    assert found.order == case["realized_order"]
    assert_agree(found.markov(12), case["realized_markov"])
    assert_same_set(found.poles, as_complex(case["poles"]))
    assert_agree(found.dc_gain, case["dc_gain"])
    (a, b, c, d), _ = oracle.era(markov, case["order"], case["blocks"])
    assert_agree(oracle.markov(a, b, c, d, 12), case["realized_markov"])


@shared("zero_order_hold")
def test_shared_zero_order_hold(case):
    continuous, discrete = read(case["continuous"]), read(case["discrete"])
    found = gpi.StateSpace(*continuous).zero_order_hold(case["period"])
    for matrix, expected in zip(matrices(found), discrete, strict=True):
        assert_agree(matrix, expected)
    for matrix, expected in zip(oracle.zero_order_hold(*continuous, case["period"]), discrete, strict=True):
        assert_agree(matrix, expected)


@shared("zero_order_hold_transfer_function")
def test_shared_zero_order_hold_of_a_transfer_function(case):
    system = gpi.StateSpace.from_transfer_function(case["numerator"], case["denominator"])
    numerator, denominator = system.zero_order_hold(case["period"]).to_transfer_function()
    assert_agree(numerator[0, 0], case["discrete_numerator"])
    assert_agree(denominator, case["discrete_denominator"])


@shared("laurent")
def test_shared_laurent(case):
    system = read(case["system"])
    inverse = gpi.StateSpace(*system).noncausal_inverse(case["r"], case["d"])
    assert_agree(inverse.taps, case["taps"])
    assert inverse.error == pytest.approx(case["error"], rel=PRECISION, abs=1e-12)
    assert_agree(inverse(case["y"]).values, case["v"])
    assert_agree(oracle.apply_noncausal(np.array(case["taps"]), case["d"], np.array(case["y"])), case["v"])


@pytest.mark.parametrize("numerator", [[1.0], [np.nan]])
def test_transfer_functions_that_are_not_finite_are_refused(numerator):
    with pytest.raises(gpi.ParameterError, match="finite"):
        gpi.StateSpace.from_transfer_function(numerator, [1.0, np.nan])


def test_taps_without_channels_are_refused():
    with pytest.raises(gpi.ParameterError, match="at least one"):
        gpi.era(np.ones((0, 0, 5)))
