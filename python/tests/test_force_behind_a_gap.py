"""A force that passes a gap: friction over an imposed displacement, found as stops and `backlash`."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gpi_hammerstein as gpi
from exported_models import with_effects
from records import model_of
from test_effects import chain, plant, wander, with_effect

RATE = 200.0
NOISE = 0.01  # over the standard deviation of the force


def displacement(random, samples=5000):
    """Two sines of changing size, in mm."""
    t = np.arange(samples) / RATE
    size = 0.4 + 0.6 * np.abs(np.sin(2 * np.pi * t / random.uniform(9, 14)))
    turn = 2 * np.pi * random.uniform(0.4, 1.0) * t
    return size * np.sin(turn) + 0.15 * np.sin(3.3 * turn + 1)


def stop(u, half_width):
    """E(k) = clip(E(k-1) + u(k) - u(k-1), -r, r), from zero."""
    place, before, out = 0.0, u[0], np.empty_like(u)
    for k, value in enumerate(u):
        place = min(max(place + value - before, -half_width), half_width)
        before, out[k] = value, place
    return out


def behind_a_gap(u, random):
    """An elastic part with a gap, before an element that slips: the force, the gap, the friction force."""
    reach = random.uniform(0.1, 0.3)
    half = random.uniform(0.2, 0.5) * reach
    x = stop(u, reach + half)
    return 10 * (x - np.clip(x, -half, half)), 2 * half, 10 * reach


def maxwell(u, random):
    """Three elements that slip, one after the other."""
    reach = random.uniform(0.1, 0.3)
    return 10 * sum(w * stop(u, r) for w, r in ((0.5, reach / 3), (0.3, reach), (0.2, 2 * reach)))


def bouc_wen(u, random):
    """z' = u' - beta (|u'| z + u' |z|), which no sum of stops with weights of one sign follows exactly."""
    beta = 0.5 / random.uniform(0.1, 0.3)
    z, before, out = 0.0, u[0], np.empty_like(u)
    for k, value in enumerate(u):
        part = (value - before) / 8
        for _ in range(8):
            z += part - beta * (abs(part) * z + part * abs(z))
        before, out[k] = value, z
    return 10 * out


def saturating(u, random):
    """A field that saturates with the displacement, and stops: no force of friction."""
    return 2 * np.tanh(3 * u) + maxwell(u, random)


def measured(u, force, random):
    noise = NOISE * np.std(force) * random.standard_normal(len(u))
    return gpi.Record(u, force + noise, rate=RATE, input_units=["mm"], output_units=["N"])


@pytest.mark.parametrize(
    "seed", [1, pytest.param(3, marks=pytest.mark.slow), pytest.param(5, marks=pytest.mark.slow)]
)
def test_gap_and_friction_are_found_with_their_sizes(seed):
    random = np.random.default_rng(seed)
    u = displacement(random)
    force, gap, friction = behind_a_gap(u, random)
    found = gpi.explain(measured(u, force, random))
    assert found.effects == ["backlash"]
    sizes = {own["name"]: own for effect in found.model.effects for own in effect["parameters"]}
    assert sizes["gap"]["value"] == pytest.approx(gap, rel=0.01) and sizes["gap"]["unit"] == "mm"
    assert sizes["missing_stiffness"]["value"] == pytest.approx(1, abs=0.02)
    [said] = [note for note in found.notes if "friction" in note]
    force_said = float(said.split("the friction force is ")[1].split(" N")[0])
    assert force_said == pytest.approx(friction, rel=0.02)
    after = found.to_dict()["error"]["after"]["holdout"]["rms"]
    assert after < 1.1 * NOISE * np.std(force)


@pytest.mark.parametrize(
    "kind",
    [maxwell, *(pytest.param(kind, marks=pytest.mark.slow) for kind in (bouc_wen, saturating, behind_a_gap))],
)
@pytest.mark.parametrize("seed", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_no_gap_is_named_where_there_is_none(kind, seed):
    random = np.random.default_rng(seed)
    u = displacement(random)
    force = kind(u, random)
    named = set(gpi.explain(measured(u, force[0] if kind is behind_a_gap else force, random)).effects)
    assert named == {"backlash"} if kind is behind_a_gap else named <= {"hysteresis-shape"}


def test_dry_friction_gets_stops_without_deadzones():
    random = np.random.default_rng(7)
    u = displacement(random, 3000)
    model = gpi.identify(measured(u, 10 * stop(u, 0.03), random))
    bank = model.hysteresis[0].plays
    assert min(bank.weights) < 0 and len(model.hysteresis[0].envelope.thresholds) == 1


@given(seed=st.integers(0, 1000), half_width=st.floats(0.01, 1.0), missing=st.floats(0.01, 1.0))
@settings(max_examples=20, deadline=None)
def test_a_force_lacks_the_part_of_its_stiffness_within_the_gap(seed, half_width, missing):
    u = wander(seed=seed)
    model = with_effect(model_of(plant()), name="backlash", output=0, half_width=half_width, missing=missing)
    expected = chain(u, sense=lambda x: x - missing * np.clip(x, -half_width, half_width))
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("missing", [0.0, 1.5, -1.0])
def test_an_impossible_part_is_refused(missing):
    with pytest.raises(gpi.GpiError, match="part of the stiffness that is missing"):
        with_effect(with_effects(), name="backlash", output=0, half_width=0.1, missing=missing)
