"""Hysteresis and friction of the textbook stages have the properties that their sources prove for them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from plants.textbook.friction import BoucWen, Dahl, Element, LuGre, MaxwellSlip
from plants.textbook.operators import bouc_wen_path, duhem_path, ramp_sum, relay_sum

Array = NDArray[np.float64]


def through(*corners: float, steps: int = 400) -> Array:
    """Straight from corner to corner."""
    return np.interp(
        np.linspace(0, len(corners) - 1, steps * (len(corners) - 1) + 1), range(len(corners)), corners
    )


def followed(element: Element, path: Array, seconds: float = 1e-3) -> Array:
    """The element's force along a path that begins at path[0]."""
    return np.array([element.step(dx, seconds) for dx in np.diff(path).tolist()])


def kernels(kind: str, u: Array) -> Array:
    """Forty relays or ramps of random thresholds between 0 and 1."""
    random = np.random.default_rng(5)
    centre, half = random.uniform(0.2, 0.7, 40), random.uniform(0.02, 0.2, 40)
    weights = random.uniform(0.5, 1.5, 40) / 40
    if kind == "relays":
        return relay_sum(u, centre + half, centre - half, weights)
    return ramp_sum(u, centre + half, centre - half, 0.15, weights)


@pytest.mark.parametrize("kind", ["relays", "ramps"])
def test_kernels_wipe_out_what_a_larger_swing_covers(kind: str) -> None:
    plain = kernels(kind, through(0, 0.9, 0.2, 0.5))
    minor = kernels(kind, through(0, 0.9, 0.4, 0.7, 0.45, 0.6, 0.2, 0.5))
    assert abs(np.ptp(plain)) > 0.5
    assert minor[-401:] == pytest.approx(plain[-401:])
    # a swing that is not covered leaves its trace
    assert kernels(kind, through(0, 0.9, 0.15, 0.5))[-401] != pytest.approx(plain[-401])


def test_minor_loops_of_relays_between_the_same_values_are_congruent() -> None:
    low, high = (kernels("relays", through(0, top, 0.35, 0.55, 0.35, 0.55))[-801:] for top in (0.6, 1.0))
    assert low[0] != pytest.approx(high[0])
    assert low - low[0] == pytest.approx(high - high[0])
    assert np.ptp(low) > 0.05


def test_ramps_are_continuous_and_relays_are_not() -> None:
    path = through(0, 1, 0, steps=20_000)
    jumps = {kind: np.abs(np.diff(kernels(kind, path))).max() for kind in ("relays", "ramps")}
    assert jumps["relays"] > 0.02 > 1e-3 > jumps["ramps"]


@pytest.mark.parametrize("stretch", [1, 7])
def test_bouc_wen_depends_on_the_path_alone_and_ends_at_its_limit(stretch: int) -> None:
    a, beta, gamma = 0.5, 4.0, 1.5
    coarse = bouc_wen_path(through(0, 0.4, 0.1, 0.6, steps=200), a, beta, gamma)
    fine = bouc_wen_path(through(0, 0.4, 0.1, 0.6, steps=200 * stretch), a, beta, gamma)
    assert fine[::stretch] == pytest.approx(coarse, abs=1e-4)
    assert bouc_wen_path(through(0, 5), a, beta, gamma)[-1] == pytest.approx(a / (beta + gamma), rel=1e-6)
    # the virgin curve: z = a / (beta + gamma) (1 - exp(-(beta + gamma) u))
    u = through(0, 0.3)
    assert bouc_wen_path(u, a, beta, gamma) == pytest.approx(a / 5.5 * -np.expm1(-5.5 * u), rel=1e-6)


def test_duhem_depends_on_the_path_alone_and_ends_beside_its_line() -> None:
    alpha, slope, b = 3.0, 1.0, 0.6
    once, thrice = (duhem_path(through(0, 0.8, 0.2, 0.7, steps=n), alpha, slope, b) for n in (100, 300))
    assert thrice[::3] == pytest.approx(once, abs=1e-12)
    rising, falling = (
        duhem_path(through(0, 9), alpha, slope, b)[-1],
        duhem_path(through(0, -9), alpha, slope, b)[-1],
    )
    assert rising == pytest.approx(9 + (b - slope) / alpha)
    assert falling == pytest.approx(-9 - (b - slope) / alpha)
    # Euler's method in steps so small that it is right
    path = through(0, 0.8, 0.3, steps=40_000)
    v = 0.0
    for du, u in zip(np.diff(path).tolist(), path[:-1].tolist(), strict=True):
        v += alpha * abs(du) * (slope * u - v) + b * du
    assert duhem_path(path, alpha, slope, b)[-1] == pytest.approx(v, abs=1e-4)


def test_dahl_is_rate_independent_and_ends_at_its_limit() -> None:
    path = through(0, 0.3, -0.2, 0.25)
    slow, fast = (followed(Dahl(2.0, 0.1), path, seconds) for seconds in (1.0, 1e-5))
    assert np.array_equal(slow, fast)
    other = followed(Dahl(2.0, 0.1), through(0, 0.3, -0.2, 0.25, steps=1200))
    assert other[2::3] == pytest.approx(slow, abs=1e-12)
    assert followed(Dahl(2.0, 0.1), through(0, 5))[-1] == pytest.approx(0.1)
    assert Dahl(2.0, 0.1).step(1e-6, 1.0) / 1e-6 == pytest.approx(2.0, rel=1e-4)
    # the loop of a closed path: it takes energy
    loop = through(0.2, -0.2, 0.2, steps=2000)
    element = Dahl(2.0, 0.1)
    followed(element, through(0, 0.2))
    assert followed(element, loop) @ np.diff(loop) > 0.5 * 4 * 0.1 * 0.2


LUGRE = {"stiffness": 1e3, "micro": 1.0, "viscous": 0.4, "coulomb": 1.0, "extra": 0.5, "stribeck": 1e-2}


def test_lugre_breaks_away_at_its_static_force_when_moved_slowly() -> None:
    slow, fast = (
        followed(LuGre(**LUGRE), through(0, 0.02, steps=4000), 5e-6 / speed) for speed in (1e-5, 0.05)
    )
    assert slow.max() == pytest.approx(1.5, rel=0.01)
    # fast, the bristles break at the level of Coulomb's friction
    assert fast.max() < 1.2
    assert fast[-1] == pytest.approx(LuGre(**LUGRE).steady(0.05), rel=1e-6)


def test_lugre_springs_before_it_slides_and_slides_on_the_stribeck_curve() -> None:
    assert LuGre(**LUGRE).step(1e-8, 1.0) / 1e-8 == pytest.approx(1e3, rel=1e-2)
    speeds = [1e-4, 1e-2, 0.1, 1.0]
    forces = [followed(LuGre(**LUGRE), through(0, 0.1, steps=4000), 2.5e-5 / speed)[-1] for speed in speeds]
    assert forces == pytest.approx([LuGre(**LUGRE).steady(speed) for speed in speeds], rel=1e-6)
    assert forces[0] > forces[2] < forces[3]


def test_maxwell_slip_unloads_on_its_virgin_curve_of_twice_the_size() -> None:
    def element() -> MaxwellSlip:
        return MaxwellSlip([0.3, 0.2, 0.1, 0.4], [0.02, 0.04, 0.05, 0.3])

    turned = followed(element(), through(0, 0.5, -0.5, steps=1000))
    virgin = followed(element(), through(0, 0.5, steps=1000))
    # Masing: F(x) = F_t - 2 f((x_t - x) / 2)
    assert turned[1000:] == pytest.approx(
        turned[999] - 2 * np.interp(np.arange(1, 1001) / 2000, np.arange(1, 1001) / 2000, virgin), abs=1e-12
    )
    assert virgin[-1] == pytest.approx(0.02 + 0.04 + 0.05 + 0.4 * 0.5)


def test_wens_element_stays_below_its_limit_and_depends_on_the_path_alone() -> None:
    beta, gamma, power = 8.0, 4.0, 1.5
    limit = (beta + gamma) ** (-1 / power)
    force = followed(BoucWen(0.5, beta, gamma, power), through(0, 3, -3, steps=20_000))
    assert force[19_999] == pytest.approx(0.5 * limit, rel=1e-6)
    assert force[-1] == pytest.approx(-0.5 * limit, rel=1e-6)
    once, four = (
        followed(BoucWen(0.5, beta, gamma, power), through(0, 0.3, -0.1, steps=n)) for n in (500, 2000)
    )
    assert four[3::4] == pytest.approx(once, abs=1e-5)
