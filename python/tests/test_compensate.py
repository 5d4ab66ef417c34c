"""Drives that make the oracle's chain follow a reference, effect by effect."""

import json

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gpi_hammerstein as gpi
from gpi_hammerstein import cli
from records import RATE, model_of
from test_effects import CASES, chain, plant, with_effect

SAMPLES = 500
SIZES, SPEEDS = [1.2, 0.5, 0.2], [0.02, 0.06, 0.15]
LEFT = {"gain-drift", "drift", "periodic-disturbance", "outliers", "coloured-noise"}
# An ideal drive meets the reference to rounding. A delay between two samples smooths the drive a little.
NEAR = {"delay": 1e-4}


def reference(samples=SAMPLES, seed=3):
    """A smooth path that begins and ends at rest, of either direction, with minor loops."""
    random = np.random.default_rng(seed)
    t = np.arange(samples)
    phases = random.uniform(0, 6, 3)
    waves = [a * np.sin(w * t + p) for a, w, p in zip(SIZES, SPEEDS, phases, strict=True)]
    inside = np.clip((t - 20) / 60, 0, 1) * np.clip((samples - 20 - t) / 60, 0, 1)
    return 0.7 + np.sum(waves, axis=0) * inside**2 * (3 - 2 * inside)


def reached(found, **place):
    """What the oracle makes of the drive, behind the lead."""
    return chain(found.drive, **place)[found.lead :]


def test_the_declared_model_follows_exactly():
    wanted = reference()
    found = model_of(plant()).compensate(wanted)
    assert np.max(np.abs(reached(found) - wanted)) < 1e-11
    assert found.error["max"] < 1e-11 and found.error_static_curve["max"] > 0.1
    assert found.out_of_reach == found.too_fast == 0
    assert (found.compensated, found.left) == ([], [])
    np.testing.assert_array_equal(found.reference[found.lead :], wanted)
    np.testing.assert_allclose(found.time[[0, found.lead]], [-found.lead / RATE, 0.0])


@pytest.mark.parametrize("name", sorted(set(CASES) - LEFT - {"amplifier-slew"}))
def test_what_the_input_drives_is_compensated(name):
    parameters, place = CASES[name]
    wanted = reference()
    found = with_effect(model_of(plant()), name=name, **parameters).compensate(wanted)
    without = model_of(plant()).compensate(wanted)
    assert np.max(np.abs(reached(found, **place) - wanted)) < NEAR.get(name, 1e-9)
    assert found.compensated == [name] and found.left == []
    assert np.max(np.abs(reached(without, **place) - wanted)) > 1e-3


def test_the_drive_stays_below_what_the_amplifier_can():
    parameters, place = CASES["amplifier-slew"]
    found = with_effect(model_of(plant()), name="amplifier-slew", **parameters).compensate(reference())
    assert found.left == [("amplifier-slew", "the slope of the drive is kept below its limit instead")]
    assert found.too_fast > 0
    assert np.max(np.abs(np.diff(found.drive))) <= parameters["limit"] / RATE * (1 + 1e-12)
    np.testing.assert_allclose(reached(found, **place), found.predicted[found.lead :], rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", sorted(LEFT))
def test_what_no_input_drives_is_left_and_said(name):
    wanted = reference()
    found = with_effect(model_of(plant()), name=name, **CASES[name][0]).compensate(wanted)
    assert found.left == [(name, "the input does not drive it")]
    np.testing.assert_array_equal(found.drive, model_of(plant()).compensate(wanted).drive)


def test_dead_time_is_driven_ahead_of():
    wanted = reference()
    found = model_of(plant(delay=5)).compensate(wanted)
    assert found.lead >= 5
    assert np.max(np.abs(chain(found.drive, delay=5)[found.lead :] - wanted)) < 1e-11


def test_dynamics_left_alone():
    slow = np.repeat(reference(), 40)
    smooth = np.convolve(np.pad(slow, 200, mode="edge"), np.ones(401) / 401, mode="valid")
    found = model_of(plant()).compensate(smooth, quasi_static=True)
    assert found.lead == 0 and len(found.drive) == len(smooth)
    model = model_of(plant())
    still = 0.7 + model.linear.dc_gain[0, 0] * model.intermediate(found.drive).ravel()
    assert np.max(np.abs(still - smooth)) < 1e-12
    # what is left is what G takes to get there
    assert np.max(np.abs(chain(found.drive) - smooth)) < 0.1 * found.error_static_curve["max"]


def test_within_limits_and_speed():
    wanted = reference()
    free = model_of(plant()).compensate(wanted).drive
    low, high = 0.5 * free.min(), 0.5 * free.max()
    found = model_of(plant()).compensate(wanted, limits=(low, high))
    assert found.out_of_reach > 20
    assert found.drive.min() >= low and found.drive.max() <= high
    slew = 0.5 * np.max(np.abs(np.diff(free))) * RATE
    found = model_of(plant()).compensate(wanted, slew=slew)
    assert found.too_fast > 0
    assert np.max(np.abs(np.diff(found.drive))) <= slew / RATE * (1 + 1e-12)


@given(st.integers(0, 10**6), st.floats(0.1, 3.0))
def test_any_path_is_followed(seed, size):
    wanted = 0.7 + size * (reference(200, seed) - 0.7)
    found = model_of(plant()).compensate(wanted)
    assert np.max(np.abs(reached(found) - wanted)) < 1e-10 * max(size, 1.0)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"limits": (1.0, -1.0)}, gpi.ParameterError, "`limits` = 1, -1"),
        ({"limits": "wide"}, gpi.ParameterError, "`limits` must be a pair of numbers"),
        ({"limits": [(0.0, 1.0)] * 3}, gpi.DataError, "`limits` has 3 inputs, but `model` has 1"),
        ({"slew": 0.0}, gpi.ParameterError, "`slew` = 0"),
        ({"slew": float("nan")}, gpi.ParameterError, "`slew` = NaN"),
        ({"reference": [0.0, np.nan]}, gpi.DataError, "has 1 NaN or infinite samples, the first in row 1"),
        ({"start": [0.0, 1.0]}, gpi.DataError, "`start` has 2 inputs, but `model` has 1"),
        ({"start": float("nan")}, gpi.ParameterError, "`start` = [NaN]"),
        ({"start_output": 1.0}, gpi.ParameterError, "`start_output` needs `start`"),
        ({"start": 0.5, "start_output": 99.0}, gpi.ParameterError, "`start_output` = 99"),
        ({"start": 0.5, "start_state": [1.0]}, gpi.ParameterError, "`state` has 1 elements"),
        ({"start": 0.5, "start_state": [1.0], "start_output": 0.0}, gpi.ParameterError, "exclude each other"),
        ({"reference": []}, gpi.DataError, "0 usable samples"),
        ({"reference": np.zeros((5, 2))}, gpi.DataError, "`reference` has 2 outputs, but `model` has 1"),
    ],
)
def test_wrong_calls_are_named(arguments, error, message):
    with pytest.raises(error) as told:
        model_of(plant()).compensate(**({"reference": reference()} | arguments))
    assert message in str(told.value)


@pytest.fixture(scope="module")
def estimated():
    """A model of the oracle's plant that was identified from noisy data."""
    random = np.random.default_rng(5)
    u = gpi.multisine(6000, RATE, (0.5, 0.3 * RATE), (-2.0, 2.0), seed=1)
    u = np.concatenate([np.zeros(200), u - u[0] * np.linspace(1, 0, len(u)) ** 50])
    y = chain(u) + random.normal(0.0, 0.01, len(u))
    return gpi.identify(gpi.Record(u, y, RATE))


def test_the_expected_error_is_in_the_model_file(estimated):
    wanted = reference()
    found = estimated.compensate(wanted, start=0.0)
    expected = found.expected_error
    parts = expected["parts"]
    assert expected["missing"] == [] and parts["past"] == 0.0
    assert parts["parameters"] > 1e-4 and found.error["rms"] == pytest.approx(parts["inversion"])
    assert expected["rms"] == pytest.approx(np.sqrt(sum(part**2 for part in parts.values())))
    made = np.sqrt(np.mean((reached(found) - wanted) ** 2))
    assert 0.3 < expected["rms"] / made < 3.0
    assert np.max(np.abs(reached(found) - wanted)) < 2 * expected["bound"]
    again = gpi.Model.from_json(estimated.to_json()).compensate(wanted, start=0.0)
    assert again.expected_error == expected


def test_a_changed_model_knows_less(estimated):
    text = json.loads(estimated.to_json())
    del text["prediction"]
    found = gpi.Model.from_json(json.dumps(text)).compensate(reference())
    assert found.expected_error["missing"] == ["parameters", "model"]
    assert found.expected_error["parts"]["model"] is None
    text = json.loads(estimated.to_json())
    text["prediction"]["numbers"][0] = 10_000
    with pytest.raises(gpi.GpiError, match="prediction.numbers"):
        gpi.Model.from_json(json.dumps(text))


def test_the_past_decays_where_the_plays_are_swept(estimated):
    model = model_of(plant())
    assert model.compensate(reference()).expected_error["parts"]["past"] == 0.0  # it begins at rest
    path = model.compensate(reference() + 0.8)
    still = model.compensate(np.full(SAMPLES, 1.5))
    assert 0 < path.expected_error["parts"]["past"] < still.expected_error["parts"]["past"]
    state = model.start([0.4])
    known = model.compensate(reference(), start=0.4, start_state=state)
    assert known.expected_error["parts"]["past"] == 0.0
    u, _ = model.run(known.drive, state)
    np.testing.assert_allclose(u, known.predicted, rtol=0, atol=1e-12)


def test_the_static_curve_is_better_than_a_line():
    wanted = reference()
    found = model_of(plant()).compensate(wanted)
    line = np.polyval(np.polyfit(found.reference, found.drive, 1), found.reference)
    missed = chain(line)[found.lead :] - wanted
    assert found.error_static_curve["rms"] < 1.001 * np.sqrt(np.mean(missed**2))


def write(path, column="y_um", rate=RATE):
    wanted = reference()
    pl.DataFrame({"t_s": np.arange(len(wanted)) / rate, column: wanted}).write_csv(path)
    return path


@pytest.fixture
def saved(tmp_path):
    model_of(plant()).save(tmp_path / "model.json")
    return str(tmp_path / "model.json")


def test_the_command_writes_a_drive_that_works(saved, tmp_path, capsys):
    path = write(tmp_path / "path.csv")
    assert cli.run(["compensate", saved, str(path), "-o", str(tmp_path / "out"), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["schema"] == "gpi-compensation/1" and result["out_of_reach"] == 0
    assert result["error"]["inversion"]["max"] < 1e-11 < 0.1 < result["error"]["static_curve"]["max"]
    table = pl.read_csv(tmp_path / "out" / "drive.csv")
    assert table.columns == ["t", "u", "reference_y", "predicted_y", "static_curve_y"]
    assert (
        np.max(np.abs(chain(table["u"].to_numpy()) - table["reference_y"].to_numpy())[table["t"] >= 0])
        < 1e-11
    )
    assert json.loads((tmp_path / "out" / "compensation.json").read_text()) == result
    assert (tmp_path / "out" / "compensation.png").stat().st_size > 10_000


def test_the_command_speaks(saved, tmp_path, capsys):
    path = write(tmp_path / "path.csv", column="wanted")
    assert cli.run(["compensate", saved, str(path)]) == 3
    assert "name the reference's columns (--reference)" in capsys.readouterr().err
    assert (
        cli.run(["compensate", saved, str(path), "-r", "wanted", "--limits", "-0.5,0.5", "--slew", "5"]) == 0
    )
    said = capsys.readouterr().out
    assert "Expected error" in said and "are at a limit" in said and "slope of the drive is limited" in said
    assert "parameters and model are missing" in " ".join(said.split())
    assert cli.run(["compensate", saved, str(path), "-r", "wanted", "--start", "0", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["expected_error"]["parts"]["past"] == 0.0
    asked = ["--start", "0.5", "--start-output", "99"]
    assert cli.run(["compensate", saved, str(path), "-r", "wanted", *asked]) == 2
    assert "start_output" in capsys.readouterr().err
    assert cli.run(["compensate", saved, str(path), "-r", "wanted", "--limits", "5"]) == 2
    assert "such as -10,150" in capsys.readouterr().err
    other = write(tmp_path / "slow.csv", rate=500.0)
    assert cli.run(["compensate", saved, str(other)]) == 3
    assert "resample it (--resample 1000)" in capsys.readouterr().err
