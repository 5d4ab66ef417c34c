"""The paper's example against reference figures that were computed apart from this package."""

import json
from pathlib import Path

import numpy as np
import pytest

from gpi_hammerstein.cli import run
from gpi_hammerstein.reproduce import Paper, paper

# reading: taps; then order 2 and 3: G, v-hat
REFERENCE = {
    "one-sided": (0.3413, {2: (0.3755, 7.268e-3), 3: (0.4002, 6.375e-2)}),
    "directional": (0.0406, {2: (0.1960, 6.109e-3), 3: (0.0404, 1.277e-3)}),
    "symmetric": (0.0118, {2: (0.1913, 9.871e-4), 3: (0.0066, 4.545e-5)}),
}


@pytest.fixture(scope="module")
def found() -> Paper:
    return paper()


def test_the_plant_is_the_one_printed(found: Paper) -> None:
    numerator, denominator = found.system.to_transfer_function()
    np.testing.assert_allclose(np.ravel(numerator)[-3:], [0.255977, 0.0243899, 0.134935], rtol=1e-5)
    np.testing.assert_allclose(np.ravel(denominator)[:3], [1.0, -0.574648, 0.494901], rtol=1e-5)


@pytest.mark.parametrize("name", REFERENCE)
def test_figures_are_within_two_percent(name: str, found: Paper) -> None:
    [reading] = [one for one in found.readings if one.name == name]
    taps, orders = REFERENCE[name]
    assert reading.condition == pytest.approx(1.16, rel=0.02)
    assert reading.markov_error == pytest.approx(taps, rel=0.02)
    for realisation in reading.realisations:
        system, v = orders[realisation.order]
        assert realisation.system_error == pytest.approx(system, rel=0.02)
        assert realisation.v_error == pytest.approx(v, rel=0.02)


@pytest.mark.parametrize("name", ["one-sided", "directional"])
def test_the_refinement_removes_the_bias(name: str, found: Paper) -> None:
    [reading] = [one for one in found.readings if one.name == name]
    assert reading.refined.system_error < 1e-6
    assert reading.refined.deadzone_weights_error < 1e-4
    if name == "one-sided":
        assert reading.refined.undetermined == 0
        assert reading.refined.weights_error < 1e-4
    else:
        # z jumps at every turn, so that all plays slide and only the sum of their weights is seen
        assert reading.refined.undetermined > 0
        assert np.isnan(reading.refined.weights_error)


def test_the_command_prints_and_draws_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(["reproduce", "paper", "-o", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [reading["reading"] for reading in result["readings"]] == list(REFERENCE)
    assert "1e-2 s" in result["errata"]
    assert sorted(file.name for file in out.iterdir()) == result["files"]
    pictures = [name for name in result["files"] if name.endswith(".png")]
    assert len(pictures) == 15
    assert all((out / name).stat().st_size > 5000 for name in pictures)
