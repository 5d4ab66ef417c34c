"""Rounding the data to nine digits, as a CSV file does, never changes what is named."""

import json

import numpy as np
import pytest

import gpi_hammerstein as gpi
import plants
from data_folder import DEV, FOREIGN

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
    [pytest.param(one, marks=[pytest.mark.slow] if index != 0 else []) for index, one in enumerate(CASES)],
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


def blind_records():
    folders = [folder for folder in (DEV, FOREIGN) if folder.is_dir()]
    paths = [path for folder in folders for path in sorted(folder.glob("*.csv.gz"))]
    return [path for path in paths if ".again." not in path.name]


@pytest.mark.slow
@pytest.mark.skipif(not DEV.is_dir(), reason=f"NO BLIND RECORDS in {DEV}: set GPI_DATA_DIR to run this test")
@pytest.mark.parametrize("path", blind_records(), ids=lambda path: path.name)
def test_names_of_blind_records_survive_rounding(path):
    """Their files hold fewer digits, so that errors of the ninth digit are added instead of removed."""
    label = json.loads((path.parent / "labels.json").read_text())[path.name.removesuffix(".csv.gz")]
    columns = dict(zip(("input", "output"), label.get("columns", "u -> y").split(" -> "), strict=True))
    record = gpi.read_record(path, **columns)
    random = np.random.default_rng(1)

    def shaken(signals):
        return [signal * (1 + random.uniform(-5e-10, 5e-10, signal.shape)) for signal in signals]

    beside = None if record.covariates is None else shaken(record.covariates)
    again = gpi.Record(shaken(record.u), shaken(record.y), record.rate, covariates=beside)
    assert set(gpi.explain(again).effects) == set(gpi.explain(record).effects)
