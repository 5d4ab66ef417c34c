"""The refinement of a stage that integrates, with friction, on a record that begins in motion."""

import json

import numpy as np
import pytest

import gpi_hammerstein as gpi

NOISE = 1e-3
LOOP = {
    "sees": {"output": 0},
    "law": {"dahl": {"distance": 1e-5, "averaged": True}},
    "drives": {"input": 0, "force": -1.0, "states": 2},
}


@pytest.fixture(scope="module")
def stage() -> gpi.Model:
    a = np.poly((0.99998, 0.998))
    return gpi.Model.from_json(
        json.dumps(
            {
                "schema": "gpi-model/1",
                "rate": 1000.0,
                "inputs": [{"name": "u", "unit": "V"}],
                "outputs": [{"name": "y", "unit": "m"}],
                "hysteresis": [
                    {
                        "envelope": {"thresholds": [0.0], "weights": [1.0], "reading": "one-sided"},
                        "plays": {"half_widths": [0.0], "weights": [1.0]},
                    }
                ],
                "linear": {
                    "a": [[-a[1], -a[2], 1.0, 0.0], 2, 2],
                    "b": [[1e-7, 1e-7], 2, 1],
                    "c": [[1.0, 0.0], 1, 2],
                    "d": [[0.0], 1, 1],
                },
                "offsets": [0.0],
                "effects": [{"name": "friction", "loops": [LOOP]}],
            }
        )
    )


def test_the_refinement_of_the_truth_is_the_truth(stage: gpi.Model) -> None:
    """The fit of the start begins at the steady state for the first input, which is far away."""
    k = np.arange(12_000)
    u = 8 * np.sin(2 * np.pi * k / 2500) + 2 * np.sign(np.sin(2 * np.pi * k / 1300 + 0.3))
    y = np.ravel(stage.simulate(u))
    in_motion = slice(3500, None)
    noise = NOISE * np.ptp(y[in_motion])
    y = y + noise * np.random.default_rng(1).standard_normal(len(y))
    record = gpi.Record(u[in_motion], y[in_motion], rate=1000.0)
    refined = gpi.refine(stage, record)
    assert refined.error(record, fit_start=True)["rms"] < 1.02 * noise
    np.testing.assert_allclose(np.sort(refined.linear.poles.real), (0.998, 0.99998), atol=2e-6)
