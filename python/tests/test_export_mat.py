"""Exported MAT files, simulated by their script in GNU Octave, against the library."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import gpi_hammerstein as gpi
from exported_models import CASES, Case, random_case, with_effects
from gpi_hammerstein import cli
from test_export_model import NEAR, farthest, read

OCTAVE = shutil.which("octave-cli") or shutil.which("octave")
needs_octave = pytest.mark.skipif(OCTAVE is None, reason="NO OCTAVE: the script simulate_gpi.m is not run")


def octave(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    (folder / "whole.m").write_text(text)
    call = [str(OCTAVE), "--norc", "--quiet", "--no-gui", "whole.m"]
    return subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=300, check=False)


def simulated(folder: Path, cases: dict[str, Case]) -> None:
    """Simulate all cases in one process, and compare y and v."""
    lines = []
    for name, case in cases.items():
        gpi.export_mat(case.model, folder / f"{name}.mat")
        x = np.zeros((len(case.u), 0)) if case.covariates is None else read(case)
        # a covariate that no effect reads is no column of the file
        x = x if len(x) == len(case.u) else np.zeros((len(case.u), 0))
        scipy.io.savemat(folder / f"{name}-given.mat", {"u": case.u, "x": x})
        lines += [
            f"load('{name}-given.mat');",
            f"[y, v] = simulate_gpi('{name}.mat', u, x);",
            f"save('-v7', '{name}-made.mat', 'y', 'v');",
        ]
    done = octave(folder, "\n".join(lines))
    for name, case in cases.items():
        assert (folder / f"{name}-made.mat").exists(), done.stderr
        made = scipy.io.loadmat(folder / f"{name}-made.mat")
        assert farthest(made["y"], case.expected) < NEAR, name
        v = np.reshape(case.model.intermediate(case.u), (len(case.u), -1))
        assert farthest(made["v"], v) < NEAR, name


@needs_octave
def test_octave_is_the_library(tmp_path):
    simulated(tmp_path, {name: case() for name, case in CASES.items()})


@needs_octave
@pytest.mark.slow
def test_octave_is_the_library_for_random_models(tmp_path):
    simulated(tmp_path, {f"model_{seed}": random_case(seed) for seed in range(60, 100)})


@needs_octave
def test_octave_says_what_is_wrong(tmp_path):
    gpi.export_mat(with_effects("covariate"), tmp_path / "model.mat")
    for call, message in {
        "simulate_gpi('model.mat', ones(5, 1))": "The model needs the covariates temperature: 1 columns of 5",
        "simulate_gpi('model.mat', ones(5, 2))": "u has 2 columns and 5 samples; the model has 1 inputs",
    }.items():
        done = octave(tmp_path, call)
        assert done.returncode != 0 and message in done.stderr


def test_the_file_has_the_parameters(tmp_path, capsys):
    model = with_effects("creep", "covariate")
    model.save(tmp_path / "model.json")
    assert cli.run(["export", str(tmp_path / "model.json"), "--mat", str(tmp_path / "model.mat")]) == 0
    assert "simulate_gpi.m" in capsys.readouterr().out
    found = scipy.io.loadmat(tmp_path / "model.mat", simplify_cells=True)["gpi"]
    for name in "ABCD":
        np.testing.assert_array_equal(
            np.reshape(found[name], getattr(model.linear, name).shape), getattr(model.linear, name)
        )
    plays = model.hysteresis[0].plays
    np.testing.assert_array_equal(found["hysteresis"]["half_widths"], plays.half_widths)
    np.testing.assert_array_equal(found["hysteresis"]["weights"], plays.weights)
    assert (found["rate"], found["offsets"], found["covariates"]) == (1000.0, 0.7, "temperature")
    assert [own["kind"] for own in found["operations"]] == ["lags", "leak"]
    first = (tmp_path / "model.mat").read_bytes()
    gpi.export_mat(model, tmp_path / "model.mat")
    assert (tmp_path / "model.mat").read_bytes() == first


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--mat", "model.m"], "the name must end with .mat, as model.mat"),
        (["--mat", "model.mat", "--what", "compensator"], "--mat writes models only"),
        (["--mat", "model.mat", "--limits=0,1"], "only a compensator has limits"),
        (["--mat", "missing/model.mat"], "cannot be written"),
    ],
)
def test_wrong_calls_write_nothing(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    with_effects("creep").save("model.json")
    assert cli.run(["export", "model.json", *arguments]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert [file.name for file in tmp_path.iterdir()] == ["model.json"]
