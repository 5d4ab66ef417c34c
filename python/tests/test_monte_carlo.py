"""Accuracy and what is said about it, over repeated noise; `tools/monte_carlo.py` does it at length."""

import functools

import numpy as np
import pytest
import scipy.stats

import trials

# One process, so that what they share is made once.
pytestmark = pytest.mark.xdist_group("monte carlo")

RUNS = 300
CHANCE = 1e-4  # that a correct estimator fails one of these tests under another seed


@functools.cache
def found(noise, robust=None):
    return trials.run(RUNS, noise, seed=1, robust=robust)


def test_estimates_reach_the_cramer_rao_bound():
    """Sums of squared errors over the bound's variance follow chi-squared."""
    white = found(trials.white)
    each = CHANCE / len(white.names) / 2
    low, high = np.sqrt(scipy.stats.chi2.ppf([each, 1 - each], RUNS) / RUNS)
    ratios = dict(zip(white.names, white.efficiency(), strict=True))
    assert white.robust == 0
    assert not {name: ratio for name, ratio in ratios.items() if not low < ratio < high}
    # and no systematic error
    errors = white.parameters.errors
    scaled = np.sqrt(RUNS) * errors.mean(axis=0) / errors.std(axis=0, ddof=1)
    assert np.abs(scaled).max() < scipy.stats.t.ppf(1 - each, RUNS - 1)


@pytest.mark.parametrize("quantity", ["parameters", "markov", "magnitude", "loop"])
@pytest.mark.parametrize(
    ("noise", "robust"),
    [
        (trials.coloured, None),
        pytest.param(trials.white, None, marks=pytest.mark.slow),
        pytest.param(trials.white, True, marks=pytest.mark.slow),
    ],
)
def test_intervals_hold_the_truth(noise, robust, quantity):
    inside = getattr(found(noise, robust), quantity).inside()
    # intervals of one run move together: the shares of the runs are independent, those within are not
    shares = inside.mean(axis=1)
    error = scipy.stats.t.ppf(1 - CHANCE / 2, RUNS - 1) * shares.std(ddof=1) / np.sqrt(RUNS)
    assert 0.95 == pytest.approx(shares.mean(), abs=error)
    each = CHANCE / inside.shape[1] / 2
    low, high = scipy.stats.binom.ppf([each, 1 - each], RUNS, 0.95)
    assert np.all((inside.sum(axis=0) >= low) & (inside.sum(axis=0) <= high))
