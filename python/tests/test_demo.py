"""The demonstration finds what its simulator put in, and its record can be made again."""

import gzip
import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import make_demo_record
from gpi_hammerstein.cli import run

# One process, so that what they share is made once.
pytestmark = pytest.mark.xdist_group("demo")

DATA = Path(gpi.__file__).parent / "data"


class Demonstration(NamedTuple):
    """One run, for all tests: it takes a while."""

    folder: Path
    told: str
    result: dict[str, Any]


@pytest.fixture(scope="session")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Demonstration:
    out = tmp_path_factory.mktemp("demo") / "out"
    told = io.StringIO()
    with redirect_stdout(told):
        assert run(["demo", "-o", str(out)]) == 0
    return Demonstration(out, told.getvalue(), json.loads((out / "demo.json").read_text()))


def test_the_demonstration_names_what_was_put_in(shown: Demonstration) -> None:
    result = shown.result
    found, truth = result["explanation"], result["truth"]
    assert sorted(found["effects"]) == sorted(truth["effects"])
    assert found["verdict"] == "explained"
    for part in ("train", "holdout"):
        before, after = (found["error"][when][part]["rms"] for when in ("before", "after"))
        assert after < 1.1 * truth["noise_rms_um"] < 0.25 * before
    lines = [step["parameters"] for step in found["steps"] if step["effect"] == "periodic-disturbance"]
    hum = lines[0]["frequency"]
    assert abs(hum["value"] - truth["hum_hz"]) < 4 * hum["std"]
    assert result["left"]["lag1"] > 0.5


@pytest.mark.slow
def test_where_the_input_hardly_is_the_model_stays_plausible() -> None:
    """Only the half that is not scored reaches the largest inputs, for nine samples."""
    record = gpi.read_record(DATA / "demo.csv.gz")
    model = gpi.identify(record.split(0.5)[1])
    slopes = np.cumsum(model.hysteresis[0].envelope.weights)
    assert np.all(np.abs(slopes) < 10)
    assert model.error(record)["nrmse"] < 0.03


def test_the_demonstration_writes_model_json_and_pictures(shown: Demonstration) -> None:
    folder, _, result = shown
    assert sorted(file.name for file in folder.iterdir()) == result["files"]
    assert {"demo.json", "model.json", "residual_time.png", "residual_spectrum.png"} <= set(result["files"])
    model = gpi.load(folder / "model.json")
    assert sorted({effect["name"] for effect in model.effects}) == sorted(result["explanation"]["effects"])
    error = model.error(gpi.read_record(DATA / "demo.csv.gz"), fit_start=True)["rms"]
    assert error < 1.1 * result["truth"]["noise_rms_um"]


def test_the_demonstration_tells_its_story(shown: Demonstration) -> None:
    told = shown.told
    steps = [
        "1 Identification",
        "2 Residual",
        "3 Missing effects",
        "4 Before and after",
        "simulator contains",
    ]
    places = [told.index(step) for step in steps]
    assert places == sorted(places)
    for words in ("creep", "periodic-disturbance", "Verdict: explained", "before, held out"):
        assert words in told
    lines = [
        step for step in shown.result["explanation"]["steps"] if step["effect"] == "periodic-disturbance"
    ]
    assert told.count("periodic-disturbance (one more)") == len(lines) - 1 > 0


def rows(path: Path) -> NDArray[np.float64]:
    return np.loadtxt(gzip.decompress(path.read_bytes()).decode().splitlines()[1:], delimiter=",")


def test_the_record_is_made_again_exactly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(make_demo_record, "DATA", tmp_path)
    make_demo_record.main()
    assert (tmp_path / "demo.truth.json").read_bytes() == (DATA / "demo.truth.json").read_bytes()
    again, bundled = (rows(path / "demo.csv.gz") for path in (tmp_path, DATA))
    # other processors round the last digit otherwise
    np.testing.assert_allclose(again, bundled, rtol=0, atol=1.5e-4)


@pytest.mark.slow
def test_its_first_part_is_inverted_though_nothing_lies_just_above_rest() -> None:
    """The envelope that fits best falls between rest and the next sample, where it was not measured."""
    whole = gpi.read_record(DATA / "demo.csv.gz")
    samples = 3 * len(whole.u[0]) // 4
    u = whole.u[0][:samples]
    found = gpi.explain(gpi.Record(u, whole.y[0][:samples], whole.rate))
    lowest, next_lowest = np.unique(u)[:2]
    assert lowest == 0.0 and next_lowest > 5.0
    ways_up = np.diff(found.model.hysteresis[0].envelope(np.linspace(0.0, next_lowest, 100)))
    assert ways_up.min() > 0.0
    assert found.after["holdout"]["rms"] < 1.1 * found.noise_floor["rms"][0]
    assert found.model.compensate(np.linspace(5.0, 8.0, 1000)).error["max"] < 1e-9
