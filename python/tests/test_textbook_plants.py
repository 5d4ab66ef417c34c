"""No false name on stages of other textbooks."""

import numpy as np
import pytest

import gpi_hammerstein as gpi
from textbook_plants import RATE, STAGES

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", STAGES)
def test_nothing_false_is_named(name: str, seed: int) -> None:
    stage, must, may = STAGES[name]
    run = stage(np.random.default_rng(seed))
    columns = {} if run.covariates is None else {"covariates": run.covariates}
    found = gpi.explain(gpi.Record(run.u, run.y, rate=RATE, **columns))
    assert set(found.effects) <= must | may
    assert must <= set(found.effects)
    assert found.verdict != "explained" or found.after["holdout"]["rms"] < 1.5 * run.noise
