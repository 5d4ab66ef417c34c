"""One rule for the error on another record, and simulated.csv, which agrees with the printed error."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run
from records import RATE, actuator, drive, model_of, write_csv
from test_effects import CASES, plant, with_effect

SAMPLES = 2500
LEAK = {"output": 0, "column": 0, "label": "temp", "gain": 0.4, "time_constant": 0.05, "step": 1e-3}


def call(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, Any]:
    assert run([*map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)  # type: ignore[no-any-return]


def in_motion(samples: int = SAMPLES, seed: int = 0) -> dict[str, object]:
    """The columns of an experiment that begins in motion."""
    u = drive(samples + 700, seed)
    y = actuator(u, seed=seed + 1)
    t = np.round(np.arange(samples) / RATE, 9)
    return {"t_s": t, "u": np.round(u[700:], 6), "y": np.round(y[700:], 6)}


def whole_model() -> gpi.Model:
    """A model with a covariate, drift and a line at the mains frequency."""
    model = model_of(plant())
    for name in ("drift", "periodic-disturbance"):
        model = with_effect(model, name=name, **CASES[name][0])
    return with_effect(model, name="covariate", **LEAK)


@pytest.mark.parametrize("cut", [False, True], ids=["whole", "gaps"])
@pytest.mark.parametrize("options", [[], ["--fit-start"], ["--remove-mean"], ["--skip", "0.1"]], ids=str)
def test_the_file_and_the_printed_error_agree(
    cut: bool, options: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = in_motion()
    columns["temp"] = np.round(20 + np.cumsum(np.random.default_rng(1).normal(0, 0.05, SAMPLES)), 6)
    if cut:
        t = np.asarray(columns["t_s"])
        columns["t_s"] = np.round(t + 1.0 * (t > 0.8) + 2.0 * (t > 1.7), 9)
        options = [*options, "--resample", "auto"]
    path, model = write_csv(tmp_path / "record.csv", columns), tmp_path / "model.json"
    whole_model().save(model)
    found = call(capsys, "simulate", model, path, *options, "-o", tmp_path / "out")
    written = pl.read_csv(tmp_path / "out" / "simulated.csv")
    parts = written.partition_by("experiment") if cut else [written]
    assert len(parts) == found["record"]["experiments"] == (3 if cut else 1)
    record = gpi.read_record(path, resample=True if cut else None)
    squares, samples = 0.0, 0
    for part, measured in zip(parts, record.y, strict=True):
        error = (measured[:, 0] - part["y"].to_numpy())[100 if "--skip" in options else 0 :]
        error = error - error.mean() if "--remove-mean" in options else error
        squares, samples = squares + float(error @ error), samples + len(error)
    np.testing.assert_allclose(np.sqrt(squares / samples), found["error"]["rms"], rtol=1e-9)
    # the covariate is a large part of it
    dry = whole_model().simulate(record.u[0], covariates=np.zeros_like(record.covariates[0]))
    assert np.std(parts[0]["y"].to_numpy() - dry[:, 0]) > 0.01


def test_a_missing_covariate_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_csv(tmp_path / "record.csv", in_motion())
    whole_model().save(tmp_path / "model.json")
    for command in ("simulate", "validate"):
        assert run([command, str(tmp_path / "model.json"), str(path)]) == 2
        assert "`covariate`" in capsys.readouterr().err


def test_identify_explain_and_validate_count_alike(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = write_csv(tmp_path / "record.csv", in_motion())
    other = write_csv(tmp_path / "other.csv", in_motion(1800, seed=8))
    grids = ["--order", "1", "--half-widths", "0,0.8", "--thresholds", "0"]
    for command in (["identify"], ["explain", "--effects", "none"]):
        out = tmp_path / command[0]
        found = call(capsys, *command, record, "--holdout-record", other, *grids, "-o", out)
        own = found["error"]["holdout"] if "holdout" in found["error"] else found["error"]["after"]["holdout"]
        again = call(capsys, "validate", out / "model.json", other)
        assert again["rule"] == found["rule"] and again["start_fitted"] is True
        np.testing.assert_allclose(again["error"]["rms"], own["rms"], rtol=1e-9)
        from_rest = call(capsys, "validate", out / "model.json", other, "--no-fit-start")
        assert from_rest["rule"] != found["rule"] and from_rest["error"]["rms"] > 1.5 * own["rms"]
        model = gpi.load(out / "model.json").on_another_record(gpi.read_record(other))
        np.testing.assert_allclose(model["error"]["rms"], own["rms"], rtol=1e-9)


def test_functions_of_time_are_left_out_on_another_record(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = whole_model()
    columns = in_motion() | {"temp": np.sin(np.arange(SAMPLES) / 300)}
    path = write_csv(tmp_path / "record.csv", columns)
    model.save(tmp_path / "model.json")
    found = call(capsys, "validate", tmp_path / "model.json", path)
    assert found["left_out"] == model.functions_of_time == ["drift", "periodic-disturbance"]
    assert found["rule"].endswith("without drift, periodic-disturbance")
    driven = with_effect(model_of(plant()), name="covariate", **LEAK)
    expected = driven.error(gpi.read_record(path), fit_start=True)["rms"]
    np.testing.assert_allclose(found["error"]["rms"], expected, rtol=1e-9)
    own = call(capsys, "validate", tmp_path / "model.json", path, "--own-record")
    assert own["left_out"] == []
    np.testing.assert_allclose(
        own["error"]["rms"], model.error(gpi.read_record(path), fit_start=True)["rms"], rtol=1e-9
    )


def slide() -> gpi.Model:
    """x' = v, v' = u - 5 v, held between samples: a slide with viscous friction that integrates its input."""
    pole = np.exp(-5 / RATE)
    reach = (1 - pole) / 5
    layout = json.loads(model_of(plant()).to_json())
    layout["hysteresis"][0]["envelope"].update(thresholds=[0.0], weights=[1.0])
    layout["hysteresis"][0]["plays"].update(half_widths=[0.0], weights=[1.0])
    layout["linear"] = {
        "a": [[1.0, 0.0, reach, pole], 2, 2],
        "b": [[(1 / RATE - reach) / 5, reach], 2, 1],
        "c": [[1.0, 0.0], 1, 2],
        "d": [[0.0], 1, 1],
    }
    return gpi.Model.from_json(json.dumps(layout))


def slid(u: NDArray[np.float64]) -> gpi.Record:
    """A record of the slide."""
    return gpi.Record(u, slide().simulate(u), rate=RATE)


def test_predictions_over_a_limited_time_begin_at_the_measured_state() -> None:
    model = slide()
    assert model.over_horizons(slid(drive(4000)), 0.5)["fit_percent"] > 99.9
    # a force that the model does not know moves the slide by about force t^2 / 2
    pushed = gpi.Record(drive(4000), model.simulate(drive(4000) + 0.02), rate=RATE)
    whole = model.on_another_record(pushed)["error"]["rms"]
    half, quarter = (model.over_horizons(pushed, seconds)["rms"] for seconds in (0.5, 0.25))
    assert quarter < 0.4 * half < 0.1 * whole


def test_parts_of_a_record_do_not_begin_at_rest() -> None:
    """The slide coasts while its input is zero."""
    model, u = slide(), drive(3000)
    u[1000:1400] = 0.0
    moved = model.simulate(u)
    assert np.ptp(moved[1000:1400]) > 0.1 * np.ptp(moved)
    coasting = gpi.Record(u[1000:], moved[1000:], rate=RATE)
    assert model.over_horizons(coasting, 0.3)["fit_percent"] > 99.9


@pytest.mark.parametrize("seconds", [0.0, 1e-4, 1e6, float("nan")])
def test_a_horizon_that_is_no_part_of_the_record_is_refused(seconds: float) -> None:
    with pytest.raises(gpi.ParameterError, match="horizon"):
        slide().over_horizons(slid(drive(2000)), seconds)


def test_the_command_prints_the_error_over_a_horizon(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, model = write_csv(tmp_path / "record.csv", in_motion()), tmp_path / "model.json"
    model_of(plant()).save(model)
    found = call(capsys, "validate", model, path, "--horizon", "0.2")["horizons"]
    assert found["seconds"] == 0.2
    assert found["error"] == gpi.load(model).over_horizons(gpi.read_record(path), 0.2)
    assert call(capsys, "validate", model, path)["horizons"] is None
