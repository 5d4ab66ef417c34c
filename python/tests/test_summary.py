"""A model in text and in numbers, and beside a record."""

import re

import numpy as np
import pytest

import gpi_hammerstein as gpi
from records import RATE, actuator, drive

NOISE = 1e-3


@pytest.fixture(scope="module")
def record() -> gpi.Record:
    u = drive(3000)
    return gpi.Record(u, actuator(u, NOISE), RATE, input_units=["V"], output_units=["um"])


@pytest.fixture(scope="module")
def model(record: gpi.Record) -> gpi.Model:
    return gpi.identify(record, half_widths=[0.0, 0.8], thresholds=0, order=1)


def test_parameters_are_the_truth_within_their_deviations(model: gpi.Model) -> None:
    own = {one.name: one for one in model.parameters}
    for name, truth in {"u.weights[0]": 1.0, "u.weights[1]": 0.6}.items():
        assert own[name].unit == "um/V" and own[name].determined
        assert 0 < own[name].std < 0.01
        assert abs(own[name].value - truth) < 5 * own[name].std
    assert [one.name for one in model.parameters] == [row["name"] for row in model.refinement.parameters]


def test_a_model_without_a_refinement_has_its_numbers(model: gpi.Model, record: gpi.Record) -> None:
    bare = model.on_another_record(record)["model"]
    own = {one.name: one for one in bare.parameters}
    assert bare.refinement is None
    np.testing.assert_allclose(own["u.weights[1]"].value, model.hysteresis[0].plays.weights[1])
    assert own["u.half_widths[1]"].value == 0.8 and own["u.half_widths[1]"].unit == "V"
    assert all(one.std is None for one in own.values())
    assert "gpi.refine(model, record) computes them" in bare.summary()


def test_effects_have_the_numbers_of_an_engineer(record: gpi.Record) -> None:
    hum = 0.05 * np.sin(2 * np.pi * 50.0 * record.time[0])[:, None]
    moved = gpi.Record(record.u, [record.y[0] + hum], RATE, input_units=["V"], output_units=["um"])
    found = gpi.explain(moved, effects="periodic-disturbance", half_widths=[0.0, 0.8], thresholds=0, order=1)
    assert found.effects == ["periodic-disturbance"]
    own = {one.name: one for one in found.model.parameters}
    frequency, amplitude = (own[f"periodic-disturbance.{name}"] for name in ("frequency", "amplitude"))
    assert (frequency.unit, amplitude.unit) == ("Hz", "um")
    assert frequency.value == pytest.approx(50.0, abs=0.05) and amplitude.value == pytest.approx(
        0.05, rel=0.05
    )
    assert not any(".value[" in name for name in own)
    assert "periodic-disturbance.frequency" in found.model.summary()


def test_the_summary_has_every_number_that_is_used(model: gpi.Model) -> None:
    text = model.summary()
    assert repr(text) == str(text) == text
    assert max(map(len, text.splitlines())) <= 96
    row = next(line for line in text.splitlines() if line.startswith("u.weights[1]"))
    value, std, low, high = map(float, re.findall(r"-?\d[\d.e-]*", row.removeprefix("u.weights[1]"))[:4])
    assert low < 0.6 < high and value == pytest.approx(0.6, abs=0.01)
    assert high - low == pytest.approx(2 * 1.96 * std, rel=0.1)
    assert row.endswith("um/V")
    for words in ("u [V]", "y [um]", "1000 Hz", "2 plays", "Residual rms", "Noise floor", "0.0028"):
        assert words in text, words
    # the pole at 0.7 has a time constant of 1 / (1000 ln(1 / 0.7)) s
    assert re.search(r"^0\.\d+ +0\.0028\d* s$", text, re.MULTILINE)
    assert "start[" not in text


def test_a_comparison_counts_by_the_rule_of_held_out_data(model: gpi.Model) -> None:
    u = drive(2000, seed=7)
    other = gpi.Record(u, actuator(u, NOISE, seed=9), RATE, output_units=["um"])
    found = model.compare(other)
    counted = model.on_another_record(other)
    assert found.error == counted["error"] and found.left_out == ()
    assert found.fit_percent["y"] == pytest.approx(found.error["fit_percent"])
    error = other.y[0] - found.simulated[0]
    assert np.sqrt(np.mean(error**2)) == pytest.approx(found.error["rms"], rel=1e-9)
    assert found.error["rms"] == pytest.approx(NOISE, rel=0.2)
    assert "offset of the model kept" in found.rule
    assert re.match(r"y: fit 99\.\d\d %, error 0\.001\d* um rms, at most", repr(found))
    assert len(found.plot().lines) >= 2


def test_the_fit_of_each_output_is_its_own() -> None:
    u = drive(2000)
    y = np.column_stack([actuator(u, NOISE), actuator(u, 0.3, seed=3)])
    record = gpi.Record(u, y, RATE, output_names=["quiet", "noisy"])
    model = gpi.identify(record, half_widths=[0.0, 0.8], thresholds=0, order=1)
    found = model.compare(record, remove_mean=True)
    for column, name in enumerate(record.output_names):
        error = record.y[0][:, column] - found.simulated[0][:, column]
        spread = np.linalg.norm(y[:, column] - y[:, column].mean())
        assert found.fit_percent[name] == pytest.approx(100 * (1 - np.linalg.norm(error) / spread))
        assert abs(error.mean()) < 1e-12
    assert found.fit_percent["quiet"] > 99 > 95 > found.fit_percent["noisy"]
    assert "mean of the residual removed" in found.rule


def test_a_record_is_simulated_experiment_by_experiment(model: gpi.Model) -> None:
    runs = [drive(300), drive(500, seed=4)]
    record = gpi.Record(runs, [0 * u for u in runs], RATE)
    simulated = model.simulate(record)
    assert [y.shape for y in simulated] == [(300, 1), (500, 1)]
    for u, y in zip(runs, simulated, strict=True):
        np.testing.assert_array_equal(model.simulate(u), y[:, 0])
    with pytest.raises(gpi.ParameterError, match="a record has its own"):
        model.simulate(record, covariates=runs[0])


def test_a_path_is_read_where_a_record_is_needed(model: gpi.Model, record: gpi.Record, tmp_path) -> None:
    path = tmp_path / "run.csv"
    record.to_polars().write_csv(path)
    for own in (path, str(path)):
        assert model.error(own) == pytest.approx(model.error(record))
        assert model.compare(own).fit_percent["y"] > 99
        assert model.residual(own)[0].shape == (3000, 1)
    again = gpi.identify(path, half_widths=[0.0, 0.8], thresholds=0, order=1)
    assert again.parameters == model.parameters
    for wrong in (record.u[0], 3, [record]):
        with pytest.raises(gpi.ParameterError, match=r"model\.error\(gpi\.Record\(u, y, rate=1000\.0\)\)"):
            model.error(wrong)
