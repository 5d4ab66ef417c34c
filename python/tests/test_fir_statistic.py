"""Finite impulse responses from records that come in parts, and how accurate they are."""

import resource

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

import gpi_hammerstein as gpi
import oracle


def record(seed, samples, inputs=1, outputs=1, taps=5):
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(samples, inputs)) + rng.normal(scale=5, size=inputs)
    markov = rng.normal(size=(outputs, inputs, taps))
    return u, oracle.convolve(markov, u) + rng.normal(scale=20, size=outputs)


def assert_same(found, expected):
    size = np.max(np.abs(expected.markov))
    np.testing.assert_allclose(found.markov, expected.markov, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(found.offsets, expected.offsets, rtol=1e-10)
    np.testing.assert_allclose(found.singular_values, expected.singular_values, rtol=1e-12)
    assert (found.rank, found.samples) == (expected.rank, expected.samples)


@given(st.integers(1, 9), st.lists(st.integers(0, 400), max_size=6), st.integers(1, 2), st.integers(1, 2))
def test_parts_are_the_whole(taps, cuts, inputs, outputs):
    u, y = record(0, 400, inputs, outputs)
    y = y + np.random.default_rng(1).normal(size=y.shape)
    statistic = gpi.FirStatistic(taps, inputs, outputs)
    edges = [0, *sorted(cuts), 400]
    for start, end in zip(edges, edges[1:], strict=False):
        statistic.push(u[start:end], y[start:end])
    assert_same(statistic.solve(), gpi.fir(u, y, taps))


def test_experiments_are_apart_and_add_up():
    runs = [record(seed, samples, 2, 1) for seed, samples in enumerate((150, 90, 3, 400))]
    expected = gpi.fir([u for u, _ in runs], [y for _, y in runs], 6)
    one, other = gpi.FirStatistic(6, inputs=2), gpi.FirStatistic(6, inputs=2)
    for u, y in runs[:2]:
        one.push(u, y)
        one.end_experiment()
    for u, y in runs[2:]:
        other.push(u, y)
        other.end_experiment()
    one.merge(other)
    assert_same(one.solve(), expected)
    assert_same(one.solve(ridge=0.1), gpi.fir([u for u, _ in runs], [y for _, y in runs], 6, ridge=0.1))


@pytest.mark.parametrize("pole", [0.0, 0.9, 0.99, 0.999])
@pytest.mark.parametrize("level", [0.0, 1e3])
def test_as_accurate_as_an_orthogonal_decomposition(pole, level):
    """Against exact taps: normal equations in working precision would lose the square of the condition."""
    rng = np.random.default_rng(2)
    taps, samples = 12, 3000
    u = rng.normal(size=samples)
    for _ in range(3):
        u = scipy.signal.lfilter([1 - pole], [1, -pole], u)
    u = np.round(u * 2**40) / 2**40 + level  # so that the outputs below are exact
    truth = np.arange(1.0, taps + 1)
    y = np.convolve(u, truth)[:samples]
    found = gpi.fir(u, y, taps)
    rows = np.lib.stride_tricks.sliding_window_view(u, taps)[:, ::-1]
    regressor = np.column_stack([rows, np.ones(len(rows))])
    q, r = np.linalg.qr(regressor)
    by_qr = np.linalg.solve(r, q.T @ y[taps - 1 :])[:taps]
    assert found.rank == taps
    ours, theirs = (np.max(np.abs(taps_ - truth)) for taps_ in (found.markov[0, 0], by_qr))
    assert ours <= 3 * theirs + 1e-13
    if pole == 0.999:
        assert found.condition > 1e7


def test_memory_does_not_grow_with_the_record():
    rng = np.random.default_rng(3)
    u, y = rng.normal(size=(2, 200_000))
    statistic = gpi.FirStatistic(31)
    statistic.push(u, y)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(50):
        statistic.push(u, y)
    # what came would take 160 MB
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000
    assert statistic.samples == 51 * 200_000 - 30


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda s: s.push([1.0, 2.0], [1.0]), gpi.GpiError, ["input", "2", "output", "1"]),
        (lambda s: s.push(np.ones((4, 2)), np.ones(4)), gpi.GpiError, ["inputs", "1", "2"]),
        (lambda s: s.push([1.0, np.nan], [1.0, 2.0]), gpi.GpiError, ["input", "NaN", "finite"]),
        (lambda s: s.merge(gpi.FirStatistic(4)), gpi.GpiError, ["taps", "3", "4"]),
        (lambda s: s.solve(), gpi.DataError, ["3 taps", "0"]),
        (lambda s: s.solve(ridge=-1.0), gpi.ParameterError, ["ridge", "-1"]),
        (lambda _: gpi.FirStatistic(0), gpi.ParameterError, ["taps", "0"]),
        (lambda _: gpi.FirStatistic(30_000), gpi.ParameterError, ["taps", "30000", "20000"]),
    ],
)
def test_what_cannot_be_is_refused(call, error, words):
    with pytest.raises(error) as caught:
        call(gpi.FirStatistic(3))
    for word in words:
        assert word in str(caught.value)
