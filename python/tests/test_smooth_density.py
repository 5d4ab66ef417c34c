"""A smooth density of plays: what a record of one amplitude leaves open is held by a prior."""

import numpy as np
import pytest

import gpi_hammerstein as gpi

RATE = 200.0
NOISE = 1e-3


def actuator(u):
    """Plays at all half-widths with a density that falls linearly."""
    half_widths = np.linspace(0, 2.0, 400)
    bank = gpi.PlayBank(half_widths, [4.0, *(0.02 * (1 - r / 3) for r in half_widths[1:])])
    return bank(u)


def triangle(periods, sizes, samples=4000):
    """Triangles from zero to each of the sizes, one after the other."""
    phase = periods * np.arange(samples) / samples
    size = np.asarray(sizes)[np.minimum(phase.astype(int) * len(sizes) // periods, len(sizes) - 1)]
    return size * (1 - np.abs(2 * (phase % 1) - 1))


def record(periods, sizes, seed):
    u = triangle(periods, sizes)
    random = np.random.default_rng(seed)
    u = np.where(np.arange(len(u)) < 20, 0.0, u)
    y = actuator(u) + NOISE * random.standard_normal(len(u))
    return gpi.Record(u, y, rate=RATE)


@pytest.fixture(scope="module")
def training():
    return record(5, [4.0, 3.0, 4.0, 2.0, 4.0], 1)


def test_the_density_is_smooth_and_predicts_other_amplitudes(training):
    model = gpi.identify(training, delay=0)
    [chosen] = [one for one in model.identification.candidates if one["chosen"]]
    assert chosen["plays"] == 40
    # as many parameters as the data determine, not as many as there are plays and deadzones
    assert chosen["parameters"] < 50
    weights = np.array(model.hysteresis[0].plays.weights)[1:]
    assert np.all(weights >= 0)
    inside = np.arange(2, len(weights) - 2)
    straight = np.polyval(np.polyfit(inside, weights[inside], 1), inside)
    assert np.std(weights[inside] - straight) < 0.05 * np.mean(weights)
    other = record(8, [1.0, 2.5, 1.5, 3.5, 0.7, 2.2, 3.2, 1.2], 2)
    few = gpi.identify(training, delay=0, half_widths=np.linspace(0, 2.0, 9)[:-1])
    assert model.error(other)["rms"] < 1.6 * NOISE < 0.5 * few.error(other)["rms"]


def test_a_few_plays_stay_a_few():
    u = triangle(5, [4.0, 3.0, 4.0, 2.0, 4.0])
    u[:20] = 0.0
    y = gpi.PlayBank([0.0, 0.5, 1.2], [3.0, 0.8, 0.6])(u)
    y += NOISE * np.random.default_rng(3).standard_normal(len(u))
    model = gpi.identify(gpi.Record(u, y, rate=RATE), delay=0)
    assert len(model.hysteresis[0].plays.half_widths) < 10


def test_given_half_widths_are_kept(training):
    model = gpi.identify(training, delay=0, half_widths=[0.0, 0.5, 1.0])
    assert set(model.hysteresis[0].plays.half_widths) <= {0.0, 0.5, 1.0}
