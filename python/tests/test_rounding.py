"""Rounding the data to nine digits, as a CSV file does, never changes what is named."""

import numpy as np
import pytest

import gpi_hammerstein as gpi
import plants

SECONDS, RATE, DIGITS = 8.0, 1000.0, 9
CASES = [
    (),
    ("creep",),
    ("drift",),
    ("gain-drift",),
    ("coloured-noise",),
    ("covariate",),
    ("backlash", "creep"),
]


def rounded(signal):
    return np.vectorize(lambda value: float(f"{value:.{DIGITS}g}"))(signal)


def names(run, change=lambda signal: signal):
    columns = None if run.x is None else change(run.x)
    return gpi.explain(gpi.Record(change(run.u), change(run.y), run.rate, covariates=columns)).effects


@pytest.mark.parametrize(
    "effects",
    [pytest.param(one, marks=[pytest.mark.slow] if index != 1 else []) for index, one in enumerate(CASES)],
    ids="+".join,
)
@pytest.mark.parametrize(
    "motion", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["rest", "motion"]
)
def test_names_survive_rounding(effects, motion):
    plant = plants.draw(31, effects, 6.0, SECONDS, RATE)
    plant.in_motion = motion
    run = plant.record(0)
    assert names(run, rounded) == names(run)
