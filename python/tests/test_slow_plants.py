"""Plants that are slower than the longest impulse response, and inputs that are not held between samples."""

import json

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.reproduce import bouc_wen
from plants import textbook

pytestmark = pytest.mark.slow


# The first estimate of G for seed 1003 has no slow pole. All seeds once led to plays in place of the curve.
@pytest.mark.parametrize("seed", [1000, 1002, 1003, 1004])
def test_a_heater_is_a_curve_before_two_lags(seed: int) -> None:
    run, other = textbook.draw("heater", seed), textbook.draw("heater", seed, 1)
    model = gpi.identify(gpi.Record(run.u, run.y, rate=run.rate))
    assert len(model.linear.poles) == 2
    assert model.error(gpi.Record(run.u, run.y, rate=run.rate), fit_start=True)["rms"] < 1.03 * run.noise
    again = model.error(gpi.Record(other.u, other.y, rate=other.rate), fit_start=True)["rms"]
    assert again < 1.3 * run.noise


def test_a_force_is_found_where_the_input_is_not_held_between_samples() -> None:
    """Part of the answer of the mass is there at once."""
    motion = bouc_wen.multisine()
    noise = 0.0075 * np.random.default_rng(7).standard_normal((motion.samples, 1))
    (u,), (y,) = motion.u, motion.y
    found = gpi.explain(gpi.Record(u, y + noise, rate=bouc_wen.RATE))
    assert found.effects == ["hysteretic-stiffness"]
    assert found.model.linear.D[0, 0] != 0.0
    (law,) = (loop["law"]["bouc-wen"] for loop in json.loads(found.model.to_json())["effects"][0]["loops"])
    assert law["beta"] == pytest.approx(0.8, rel=0.01)
    assert law["gamma"] == pytest.approx(-1.1, rel=0.01)
    assert law["exponent"] == pytest.approx(1.0, abs=0.01)
