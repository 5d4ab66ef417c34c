"""Tests of what a model leaves of a record: in Python, and as `gpi validate` prints them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run
from records import RATE, actuator, drive, write_csv

SAMPLES, NOISE = 4000, 0.02
KEYS = {"name", "output", "statistic", "threshold", "p_value", "level", "passed", "points_to"}
NAMES = [
    "mean",
    "whiteness",
    "lines",
    "past-input",
    "past-intermediate",
    "level",
    "speed",
    "direction",
    "amplitude",
    "trend",
    "prediction",
    "level-to-level",
    "higher-order",
    "outliers",
]
KINDS = ("time", "spectrum", "over_input", "over_speed", "autocorrelation")
PICTURES = {f"residual_{kind}.png" for kind in KINDS}


def written_by_hand(pole: float = 0.7, half_width: float = 0.8) -> dict[str, Any]:
    """The model file of `actuator`, as another program would write it."""
    return {
        "schema": "gpi-model/1",
        "rate": RATE,
        "inputs": [{"name": "u", "unit": "V"}],
        "outputs": [{"name": "y", "unit": "um"}],
        "hysteresis": [
            {
                "envelope": {"thresholds": [0.0], "weights": [1.0], "reading": "one-sided"},
                "plays": {"half_widths": [0.0, half_width], "weights": [1.0, 0.6]},
            }
        ],
        "linear": {"a": [[pole], 1, 1], "b": [[1 - pole], 1, 1], "c": [[1.0], 1, 1], "d": [[0.0], 1, 1]},
        "offsets": [0.0],
    }


def model(**changes: float) -> gpi.Model:
    return gpi.Model.from_json(json.dumps(written_by_hand(**changes)))


def measured(extra: Any = 0.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    u = drive(SAMPLES, seed)
    return u, actuator(u, NOISE, seed=seed + 100) + extra


def failing(model: gpi.Model, u: Any, y: Any, **options: bool) -> set[str]:
    residual = gpi.residual_tests(model, gpi.Record(u, y, rate=RATE), **options)
    assert [test["name"] for test in residual["tests"]] == NAMES
    return {test["name"] for test in residual["tests"] if not test["passed"]}


def hum(size: float) -> np.ndarray:
    return size * np.sin(2 * np.pi * 50.0 * np.arange(SAMPLES) / RATE)


@pytest.mark.parametrize("seed", range(5))
def test_the_true_model_passes(seed: int) -> None:
    u, y = measured(seed=seed)
    assert failing(model(), u, y) == set()


@pytest.mark.parametrize("size", [0.3, 3.0, 30.0])
def test_a_missing_mains_line_is_found(size: float) -> None:
    u, y = measured(hum(size * NOISE))
    assert "lines" in failing(model(), u, y)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [({"pole": 0.6}, {"past-input", "past-intermediate"}), ({"half_width": 0.3}, {"direction"})],
)
def test_a_wrong_model_fails(changes: dict[str, float], expected: set[str]) -> None:
    u, y = measured()
    assert expected <= failing(model(**changes), u, y)


def test_gain_that_grows_with_the_swing_fails_from_level_to_level() -> None:
    u, y = measured()
    swing = np.sin(np.linspace(0.0, 12.0, SAMPLES)) ** 2
    u = u * (0.3 + swing)
    y = actuator(u, NOISE)
    assert failing(model(), u, y) == set()
    late = np.concatenate([np.zeros(2), np.diff(u)[:-1]])
    assert "level-to-level" in failing(model(), u, y + 0.05 * swing * late)


def test_an_offset_that_moved_is_named_or_removed() -> None:
    u, y = measured(0.5 * NOISE)
    assert failing(model(), u, y) == {"mean"}
    assert failing(model(), u, y, remove_mean=True) == set()


def test_a_start_in_motion_is_fitted() -> None:
    u, y = measured()
    later = slice(1203, None)
    assert "higher-order" in failing(model(pole=0.99), u[later], y[later])
    assert failing(model(), u[later], y[later], fit_start=True) == set()


def test_effects_and_covariates_take_part() -> None:
    u, y = measured(hum(2 * NOISE))
    effect = {"output": 0, "frequency": 50.0, "cosine": 0.0, "sine": 2 * NOISE, "duration": 4.0, "span": 8.0}
    changed = {**written_by_hand(), "effects": [{"name": "periodic-disturbance", **effect}]}
    assert failing(gpi.Model.from_json(json.dumps(changed)), u, y) == set()


def test_nothing_left_is_no_structure() -> None:
    u, _ = measured()
    exact = gpi.Record(u, model().simulate(u), rate=RATE)
    assert not gpi.residual_tests(model(), exact)["structured"]


def test_another_rate_and_other_channels_are_refused() -> None:
    u, y = measured()
    with pytest.raises(gpi.ParameterError, match="`rate` = 500.*1000 Hz"):
        gpi.residual_tests(model(), gpi.Record(u, y, rate=500.0))
    with pytest.raises(gpi.DataError, match="`model` has 1 inputs, but `record` has 2"):
        gpi.residual_tests(model(), gpi.Record(np.column_stack([u, u]), y, rate=RATE))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("validate")
    for name, changes in {"true": {}, "wrong": {"pole": 0.6}}.items():
        (folder / f"{name}.json").write_text(json.dumps(written_by_hand(**changes)))
    t = np.arange(SAMPLES) / RATE
    for name, extra in {"clean": 0.0, "hum": hum(NOISE)}.items():
        u, y = measured(extra)
        write_csv(folder / f"{name}.csv", {"t_s": np.round(t, 9), "u_V": u, "y_um": y})
    return folder


def validated(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["validate", *map(str, arguments), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert isinstance(result, dict)
    return result


def test_validate_of_the_true_model_passes(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = validated(capsys, files / "true.json", files / "clean.csv")
    assert result["residual"]["structured"] is False
    assert [test["name"] for test in result["residual"]["tests"]] == NAMES
    for test in result["residual"]["tests"]:
        assert set(test) == KEYS | {"picture"}
        assert test["passed"] and test["statistic"] <= test["threshold"] and test["picture"] is None
    [figures] = result["figures"]
    assert figures["noise_rms"] == pytest.approx(NOISE, rel=0.1) == figures["rms"]


@pytest.mark.parametrize(
    ("model_file", "record", "name", "picture"),
    [
        ("true.json", "hum.csv", "lines", "residual_spectrum.png"),
        ("wrong.json", "clean.csv", "whiteness", "residual_autocorrelation.png"),
    ],
)
def test_what_fails_is_named_with_its_picture(
    model_file: str,
    record: str,
    name: str,
    picture: str,
    files: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    arguments = (files / model_file, files / record, "-o", tmp_path / "out")
    result = validated(capsys, *arguments)
    assert result["residual"]["structured"] is True
    rows = {test["name"]: test for test in result["residual"]["tests"]}
    assert not rows[name]["passed"] and rows[name]["picture"] == picture
    written = {file.name for file in (tmp_path / "out").iterdir()}
    assert written == set(result["files"]) == PICTURES | {"validation.json"}
    assert json.loads((tmp_path / "out" / "validation.json").read_text()) == result
    assert run(["validate", *map(str, arguments)]) == 0
    printed = capsys.readouterr().out
    assert "threshold" in printed and "points to" in printed
    assert f"fails the test {name}" in printed and f"(see {picture})" in printed


def test_every_output_has_its_tests_and_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written_by_hand()
    file["outputs"].append({"name": "w", "unit": "um"})
    file["linear"] |= {"c": [[1.0, 0.5], 2, 1], "d": [[0.0, 0.0], 2, 1]}
    file["offsets"] = [0.0, 0.0]
    (tmp_path / "model.json").write_text(json.dumps(file))
    u, y = measured()
    second = 0.5 * actuator(u, 2 * NOISE, seed=300) + hum(NOISE)
    t = np.round(np.arange(SAMPLES) / RATE, 9)
    record = write_csv(tmp_path / "two.csv", {"t_s": t, "u_V": u, "y_um": y, "w_um": second})
    channels = ("--input", "u_V", "--output", "y_um,w_um", "-o", tmp_path / "out")
    result = validated(capsys, tmp_path / "model.json", record, *channels)
    failed = [test for test in result["residual"]["tests"] if not test["passed"]]
    assert {test["output"] for test in failed} == {"w"}
    assert {"lines": "residual_spectrum_2.png"}.items() <= {t["name"]: t["picture"] for t in failed}.items()
    assert {"residual_time_1.png", "residual_time_2.png"} <= set(result["files"])
