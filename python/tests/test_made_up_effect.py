"""An effect is one file and one line: a made-up one is found wherever the catalogue's effects are.

A copy of the workspace gets `made_up_effect.rs` and a line in the catalogue, and nothing else. Its bindings
are built in the development profile, in the build folder of the checkout.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from made_up_effect import COSINE, NAME, PERIOD, SINE, displacement, plant, read
from records import RATE, drive, write_csv

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
COPIED = ["Cargo.toml", "Cargo.lock", "README.md", "benches", "crates", "python/gpi_hammerstein"]
CATALOGUE = "crates/gpi-core/src/effects/mod.rs"
FILE = "crates/gpi-core/src/effects/made_up_effect.rs"
NEIGHBOUR = "    output_nonlinearity::OutputNonlinearity: Output,\n"
LINE = "    made_up_effect::MadeUpEffect: Output,\n"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("cargo") is None, reason="NO CARGO: the made-up effect is not built"),
    pytest.mark.skipif(sys.platform != "linux", reason="NOT LINUX: cargo alone does not link the bindings"),
]


def put(path, content):
    """Write what differs, at once: cargo builds what is newer, and other processes may write the same."""
    if path.is_file() and path.read_bytes() == content:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f"{path.name}.{os.getpid()}")
    new.write_bytes(content)
    os.replace(new, path)


def wanted():
    """The files of the workspace with the made-up effect, by their paths."""
    files = {}
    for name in COPIED:
        top = ROOT / name
        for path in [top] if top.is_file() else top.rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts and not path.name.startswith("_native."):
                files[path.relative_to(ROOT).as_posix()] = path.read_bytes()
    catalogue = files[CATALOGUE].decode()
    assert catalogue.count(NEIGHBOUR) == 1
    files[CATALOGUE] = catalogue.replace(NEIGHBOUR, NEIGHBOUR + LINE).encode()
    assert FILE not in files
    files[FILE] = (HERE / "made_up_effect.rs").read_bytes()
    return files


@pytest.fixture(scope="module")
def package():
    """The folder that holds the package with the made-up effect."""
    copy = BUILD / "made-up"
    for name, content in wanted().items():
        put(copy / name, content)
    build = ["cargo", "build", "--quiet", "-p", "gpi-py", "--target-dir", BUILD]
    done = subprocess.run(
        build, cwd=copy, env=os.environ | {"PYO3_PYTHON": sys.executable}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    library = BUILD / "debug" / "lib_native.so"
    put(copy / "python/gpi_hammerstein/_native.abi3.so", library.read_bytes())
    return copy / "python"


def run(package, *command):
    """What a command of the package's Python prints."""
    there = os.environ | {"PYTHONPATH": str(package), "COLUMNS": "200", "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, *map(str, command)], env=there, capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def gpi(package, *arguments):
    """What the command line prints."""
    return run(package, "-c", "from gpi_hammerstein_launcher import main; main()", *arguments)


@pytest.fixture(scope="module")
def answers(package, tmp_path_factory):
    folder = tmp_path_factory.mktemp("answers")
    run(package, HERE / "made_up_effect.py", folder)
    with np.load(folder / "answers.npz") as arrays:
        found = json.loads((folder / "answers.json").read_text()) | dict(arrays)
    assert Path(found["package"]).is_relative_to(package)
    return found


@pytest.fixture(scope="module")
def truth():
    own, u = plant(), drive(1500)
    x, offset = displacement(own, u)
    return own, u, x, offset


def test_it_is_in_the_catalogue(answers):
    assert answers["effects"][NAME] == "the periodic error of an interferometer"


def test_it_is_simulated(answers, truth):
    _, _, x, offset = truth
    expected = read(x) + offset
    np.testing.assert_allclose(answers["simulated"], expected, rtol=0, atol=1e-12 * np.ptp(expected))


def test_its_derivatives_are_exact(answers, truth):
    """Of the reading by its own values, and by a weight of the plays in front of it."""
    own, u, x, _ = truth
    phase = 2 * np.pi * x / PERIOD
    slope = 1 + 2 * np.pi / PERIOD * (SINE * np.cos(phase) - COSINE * np.sin(phase))
    # the displacement is linear in the weights
    more, _ = displacement(own.with_values({"u.weights[1]": own.value("u.weights[1]") + 1}), u)
    expected = {
        f"{NAME}.value[0]": np.sin(phase),
        f"{NAME}.value[1]": np.cos(phase),
        "u.weights[1]": slope * (more - x),
    }
    for name, column in expected.items():
        found = answers["jacobian"][:, answers["names"].index(name)]
        column = column[-len(found) :]  # behind the warm-up
        np.testing.assert_allclose(found, column, rtol=0, atol=1e-8 * np.abs(column).max(), err_msg=name)


def test_it_is_refined(answers, truth):
    own, *_ = truth
    assert answers["refined"] == pytest.approx({"sine": SINE, "cosine": COSINE}, rel=1e-6)
    np.testing.assert_allclose(answers["weights"], own.hysteresis[0].weights, rtol=1e-6)


def test_it_is_saved(answers):
    saved = {"name": NAME, "output": 0, "period": PERIOD, "sine": SINE, "cosine": COSINE}
    assert answers["saved"] == [saved]
    assert answers["loaded"]
    np.testing.assert_array_equal(answers["loaded_output"], answers["simulated"])


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    own, u = plant(), drive(3000)
    x, offset = displacement(own, u)
    y = read(x) + offset + 1e-3 * np.random.default_rng(1).standard_normal(len(u))
    columns = {"t_s": np.round(np.arange(len(u)) / RATE, 9), "u_V": u, "y_um": y}
    return write_csv(tmp_path_factory.mktemp("record") / "record.csv", columns)


OPTIONS = ["--effects", f"{NAME},backlash", "--order", "1", "--half-widths", "0,0.4,1.0", "--thresholds", "0"]


def test_it_is_explained_and_reported(package, record, tmp_path):
    found = json.loads(
        gpi(package, "explain", record, *OPTIONS, "--json", "--report", "-o", tmp_path / "out")
    )
    assert found["effects"] == [NAME]
    assert found["verdict"] == "explained"
    (step,) = (step for step in found["steps"] if step["effect"] == NAME)
    for row, expected in zip(step["parameters"].values(), [SINE, COSINE], strict=True):
        assert row["value"] == pytest.approx(expected, abs=max(5 * row["std"], 1e-3))
        assert row["unit"] == "um"
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for words in (NAME, "the periodic error of an interferometer", "sine", "cosine"):
        assert words in page
    saved = json.loads((tmp_path / "out" / "model.json").read_text())
    assert [effect["name"] for effect in saved["effects"]] == [NAME]


def test_the_command_line_prints_it(package, record):
    printed = gpi(package, "explain", record, *OPTIONS)
    assert NAME in printed and "explained" in printed.lower()
