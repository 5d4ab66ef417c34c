"""Files are written whole or not at all; models survive them."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.files import staged, write_atomically
from records import RATE, actuator, drive


def test_a_model_survives_its_file(tmp_path: Path) -> None:
    u = drive()
    model = gpi.identify(gpi.Record(u, actuator(u), RATE))
    path = tmp_path / "model.json"
    gpi.save(model, path)
    np.testing.assert_array_equal(gpi.load(path).simulate(u), model.simulate(u))
    model.save(path)
    assert gpi.load(path).to_json() == model.to_json()
    assert [file.name for file in tmp_path.iterdir()] == ["model.json"]


def test_standard_deviations_travel_with_the_file(tmp_path: Path) -> None:
    u = drive()
    model = gpi.identify(gpi.Record(u, actuator(u), RATE, input_units=["V"], output_units=["um"]))
    before = model.refinement
    assert before is not None
    model.save(tmp_path / "model.json")
    for again in (gpi.load(tmp_path / "model.json"), pickle.loads(pickle.dumps(model))):
        after = again.refinement
        assert after is not None and after.parameters == before.parameters
        assert (after.status, after.noise_floor) == (before.status, before.noise_floor)
        np.testing.assert_array_equal(after.residual_rms, before.residual_rms)
        assert {row["unit"] for row in after.parameters if row["name"].startswith("u.weights")} == {"um/V"}
        assert any(row["std"] for row in after.parameters)
        # what is not saved says so
        for part in ("covariance", "history", "residuals"):
            with pytest.raises(gpi.ParameterError, match=f"`{part}` is not saved"):
                getattr(after, part)
        for part in (after.poles, lambda after=after: after.markov_std(3)):
            with pytest.raises(gpi.ParameterError, match="not saved"):
                part()


def test_older_model_files_have_no_deviations(tmp_path: Path) -> None:
    u = drive()
    described = json.loads(gpi.identify(gpi.Record(u, actuator(u), RATE)).to_json())
    assert described["schema"] == "gpi-model/1"
    del described["estimates"]
    (tmp_path / "model.json").write_text(json.dumps(described))
    assert gpi.load(tmp_path / "model.json").refinement is None


def test_unknown_models_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    path.write_text('{"schema": "gpi-model/2"}')
    with pytest.raises(gpi.DataError, match="gpi-model/2"):
        gpi.load(path)
    with pytest.raises(gpi.DataError, match="cannot be read"):
        gpi.load(tmp_path / "none.json")
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(gpi.DataError, match="not a model file"):
        gpi.load(path)


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "note.txt"
    write_atomically(path, "old")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(gpi.ParameterError, match="No space left"):
        write_atomically(path, "new")
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["note.txt"]


def test_staged_files_appear_together(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with staged(out) as folder:
        (folder / "a").write_text("a")
        assert not out.exists()
    assert (out / "a").read_text() == "a"
    with pytest.raises(RuntimeError), staged(out) as folder:
        (folder / "b").write_text("b")
        raise RuntimeError
    assert [file.name for file in out.iterdir()] == ["a"]
    with pytest.raises(RuntimeError), staged(tmp_path / "never") as folder:
        raise RuntimeError
    assert sorted(file.name for file in tmp_path.iterdir()) == ["deep"]
