"""Model files and states may come from anybody: they are read, or refused with an error of the package."""

import json
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from data_folder import DATA
from records import RATE, actuator, drive

CASES = DATA / "cases" / "models"


def case_files() -> list[Path]:
    return sorted(CASES.glob("*.json")) if CASES.is_dir() else []


@pytest.mark.skipif(not CASES.is_dir(), reason=f"{CASES} does not exist; set GPI_DATA_DIR")
@pytest.mark.parametrize("path", case_files(), ids=lambda path: path.name)
def test_files_that_broke_something_are_refused_or_simulated(path: Path) -> None:
    try:
        model = gpi.load(path)
        u = np.linspace(0.0, 1.0, 200)
        y = model.simulate(u if len(model.input_names) == 1 else np.tile(u[:, None], len(model.input_names)))
    except gpi.GpiError as error:
        assert str(error)
        return
    assert np.isfinite(y).all()


@pytest.fixture(scope="module")
def model() -> gpi.Model:
    """A model with effects that remember different things."""
    u = drive()
    described = json.loads(gpi.identify(gpi.Record(u, actuator(u), RATE)).to_json())
    described["effects"] = [
        {"name": "delay", "input": 0, "samples": 1.5},
        {"name": "creep", "input": 0, "time_constants": [0.3], "gains": [0.05], "dead_time": 2},
        {"name": "backlash", "output": 0, "half_width": 0.01},
        {
            "name": "periodic-disturbance",
            "output": 0,
            "frequency": 50.0,
            "cosine": 0.1,
            "sine": 0.1,
            "duration": 10.0,
            "span": 1.0,
        },
    ]
    return gpi.Model.from_json(json.dumps(described))


def test_a_wrong_state_is_refused(model: gpi.Model) -> None:
    u = drive()[:50]
    _, right = model.run(u, model.start(u[0]))
    random = np.random.default_rng(4)
    refused = 0
    for _ in range(400):
        state = right.copy()
        match random.integers(4):
            case 0:
                place = random.integers(len(state))
                state[place] = random.choice([np.nan, np.inf, -1.0, 1e17, 1e300, 0.5, -0.0])
            case 1:
                state = np.delete(state, random.integers(len(state), size=random.integers(1, 4)))
            case 2:
                state = np.insert(state, random.integers(len(state)), random.normal(size=2))
            case _:
                state = random.normal(size=random.integers(0, 2 * len(state))) * 10.0 ** random.integers(
                    -3, 9
                )
        try:
            y, after = model.run(u, state)
        except gpi.GpiError:
            refused += 1
            continue
        assert np.isfinite(y).all() and np.isfinite(after).all()
    # most sizes are wrong; a changed value is another past
    assert 200 < refused < 400, refused


def test_an_unstable_model_says_so(model: gpi.Model) -> None:
    described = json.loads(model.to_json())
    described["effects"] = []
    elements, rows, columns = described["linear"]["a"]
    described["linear"]["a"] = [[60.0 * value for value in elements], rows, columns]
    unstable = gpi.Model.from_json(json.dumps(described))
    with pytest.raises(gpi.NumericalError, match="largest pole of the linear model has modulus"):
        unstable.simulate(drive())


def test_a_byte_order_mark_is_skipped(model: gpi.Model) -> None:
    assert gpi.Model.from_json("\ufeff" + model.to_json()).to_json() == model.to_json()
