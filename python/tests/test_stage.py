"""Sensitivity, loop width and first resonance against closed forms."""

import json

import numpy as np
import pytest
import scipy.signal

import gpi_hammerstein as gpi
from gpi_hammerstein.stage import stage, stage_in_words

RATE, RANGE = 1000.0, 10.0
HALF_WIDTHS, WEIGHTS = np.array([0.0, 1.0, 3.0]), np.array([1.0, 0.5, 0.4])
RESONANCE, DAMPING, GAIN = 80.0, 0.05, 2.5


def resonant(angular: float, damping: float) -> gpi.StateSpace:
    """A mode of gain `GAIN`, exact at the samples."""
    a = np.array([[0.0, 1.0], [-(angular**2), -2 * damping * angular]])
    b, c, d = np.array([[0.0], [angular**2]]), np.array([[GAIN, 0.0]]), np.zeros((1, 1))
    discrete = scipy.signal.cont2discrete((a, b, c, d), 1 / RATE, method="zoh")
    return gpi.StateSpace(*discrete[:4])


def model(damping: float) -> gpi.Model:
    """A stage with this damping."""

    def matrix(values: np.ndarray) -> list[object]:
        return [np.ravel(values, order="F").tolist(), *values.shape]

    g = resonant(2 * np.pi * RESONANCE, damping)
    envelope = {"thresholds": [0.0], "weights": [1.0], "reading": "one-sided"}
    plays = {"half_widths": HALF_WIDTHS.tolist(), "weights": WEIGHTS.tolist()}
    layout = {
        "schema": "gpi-model/1",
        "rate": RATE,
        "inputs": [{"name": "u", "unit": "V"}],
        "outputs": [{"name": "y", "unit": "um"}],
        "hysteresis": [{"envelope": envelope, "plays": plays}],
        "linear": {key.lower(): matrix(getattr(g, key)) for key in "ABCD"},
        "offsets": [0.0],
    }
    return gpi.Model.from_json(json.dumps(layout))


def record() -> gpi.Record:
    u = RANGE * np.abs(np.sin(np.arange(200) * np.pi / 200 * 3.0))
    u[0], u[100] = 0.0, RANGE
    return gpi.Record(u, np.zeros_like(u) + u, RATE)


def test_the_figures_are_those_of_the_closed_form():
    found = stage(model(DAMPING), record())
    (loop,) = found["loops"]
    # a play of half-width r moves by the range less 2 r, and its branches are 2 r apart
    travel = WEIGHTS @ (RANGE - 2 * HALF_WIDTHS)
    assert loop["range"] == [0.0, RANGE] and loop["unit"] == "um/V"
    assert loop["sensitivity"] == pytest.approx(GAIN * travel / RANGE, rel=1e-9)
    # in the middle all are open as far as they go
    opening = np.minimum(2 * HALF_WIDTHS, RANGE - 2 * HALF_WIDTHS)
    assert loop["width"] == pytest.approx(WEIGHTS @ opening / travel, rel=1e-9)
    assert found["first_resonance"]["frequency_hz"] == pytest.approx(RESONANCE, rel=1e-9)
    assert found["first_resonance"]["damping"] == pytest.approx(DAMPING, rel=1e-9)
    words = " ".join(stage_in_words(found))
    assert "um/V between 0 and 10 V" in words and "80 Hz with a damping of 0.05" in words


def test_what_shows_no_peak_is_no_resonance():
    assert stage(model(0.9), record())["first_resonance"] is None
