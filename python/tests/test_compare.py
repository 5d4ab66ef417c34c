"""Which values of two models differ beyond their uncertainty, and the command that compares."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpi_hammerstein as gpi
import schemas
from gpi_hammerstein.cli import run
from gpi_hammerstein.difference import significance
from gpi_hammerstein.difference.neighbours import Neighbours
from gpi_hammerstein.difference.pairs import nearest_pairs
from gpi_hammerstein.difference.ranges import common_ranges
from records import RATE, actuator, drive, good_columns, model_of, write_csv
from test_compare_fleets import fleet
from test_effects import plant

CHOICES: dict[str, Any] = {"half_widths": [0.0, 0.8], "thresholds": 0, "order": 1}


def record(seed: int, gain: float = 1.0) -> gpi.Record:
    u = drive(2000, seed)
    y = gain * actuator(u, 1e-3 / gain, seed)
    return gpi.Record(u, y, RATE, input_units=["V"], output_units=["um"])


@pytest.fixture(scope="module")
def before() -> gpi.Model:
    return gpi.identify(record(1), **CHOICES)


@pytest.fixture(scope="module")
def after() -> gpi.Model:
    return gpi.identify(record(2), **CHOICES)


@pytest.fixture(scope="module")
def stronger() -> gpi.Model:
    """A model of the same stage with 1 % more sensitivity."""
    return gpi.identify(record(3, gain=1.01), **CHOICES)


def layout(model: gpi.Model) -> dict[str, Any]:
    return dict(json.loads(model.to_json()))


def changed(model: gpi.Model, **parts: Any) -> gpi.Model:
    return gpi.Model.from_json(json.dumps(layout(model) | parts))


def bare(model: gpi.Model) -> gpi.Model:
    """The model as one writes it by hand: without any uncertainty."""
    parts = layout(model)
    return gpi.Model.from_json(
        json.dumps({key: value for key, value in parts.items() if key not in ("estimates", "prediction")})
    )


def scaled(model: gpi.Model, factor: float) -> gpi.Model:
    parts = copy.deepcopy(layout(bare(model)))
    for own in parts["hysteresis"]:
        own["plays"]["weights"] = [factor * weight for weight in own["plays"]["weights"]]
    return gpi.Model.from_json(json.dumps(parts))


def test_two_records_of_one_stage_do_not_differ(before: gpi.Model, after: gpi.Model) -> None:
    found = gpi.compare(before, after)
    assert found.differing == [] and found.other_structure == () and found.notes == ()
    assert found.only_a == found.only_b == ()
    assert {row.group for row in found.rows} == {"figure", "parameter"}
    assert all(row.differs is False for row in found.rows)
    row = found["sensitivity[u -> y]"]
    assert row.unit == "um/V" and row.std is not None and 0 < row.std < 2e-3
    assert row.std == pytest.approx(np.hypot(row.std_a or 0.0, row.std_b or 0.0))
    own = found.simulation
    assert own is not None and own.drive == "triangle" and own.error_a is None
    # the widest play and its distance from the next narrower one
    [(name, own_range)] = found.ranges
    assert name == "u" and own_range == pytest.approx((-1.6, 1.6), rel=1e-3)
    assert own.rms < 1e-3 and own.explained is not None and own.explained > 0.1


def test_a_changed_sensitivity_is_named_and_nothing_else(before: gpi.Model, stronger: gpi.Model) -> None:
    found = gpi.compare(before, stronger, record(4, gain=1.01))
    figures = [row.name for row in found.rows if row.group == "figure" and row.differs]
    assert figures == ["sensitivity[u -> y]"]
    row = found["sensitivity[u -> y]"]
    assert row.a is not None and row.difference == pytest.approx(0.01 * row.a, rel=0.1)
    # the gain is in the weights of the plays
    assert set(found.differing) - set(figures) <= {"u.weights[0]", "u.weights[1]"}
    own = found.simulation
    assert own is not None and own.error_a is not None and own.error_b is not None
    assert own.error_b["rms"] == pytest.approx(1e-3, rel=0.1) and own.error_a["rms"] > 5e-3
    assert own.rms == pytest.approx(0.01 * own.movement, rel=0.1)
    assert own.explained is not None and own.explained < 0.01
    assert "fitted" in str(own.rule)


def test_models_of_another_structure_have_the_same_figures(before: gpi.Model) -> None:
    finer = gpi.identify(record(2), half_widths=[0.0, 0.75, 0.85], thresholds=0, order=1)
    found = gpi.compare(before, finer, record(5))
    assert any("plays" in reason or "half-widths" in reason for reason in found.other_structure)
    assert {row.group for row in found.rows} == {"figure"}
    assert found.differing == []
    assert "structures differ" in repr(found)


def test_a_deviation_of_a_figure_is_that_of_its_parameter() -> None:
    """Without plays, the sensitivity is the only weight; the offset is a parameter itself."""
    random = np.random.default_rng(1)
    u = drive(2000, 1)
    own = gpi.Record(u, 2.0 * u + 0.3 + 0.01 * random.standard_normal(2000), RATE)
    model = gpi.identify(own, delay=0, half_widths=1, thresholds=0)
    found = gpi.compare(model, model, own)
    known = {one.name: one.std for one in model.parameters}
    assert found["sensitivity[u -> y]"].std_a == pytest.approx(known["u.weights[0]"], rel=1e-3)
    assert found["offset[y]"].std_a == pytest.approx(known["offset[0].y"], rel=1e-3)
    # it has no plays, so that its width is exact; it does not depend on the range, which is not known
    width = gpi.compare(model, model)["hysteresis_width[u]"]
    assert (width.a, width.std_a, width.differs) == (0.0, 0.0, None)


def test_a_deviation_of_a_pole_is_that_of_the_refinement(before: gpi.Model) -> None:
    deviation = Neighbours(before).deviation(lambda own: np.real(own.linear.poles))
    refinement = before.refinement
    assert deviation is not None and refinement is not None
    poles, stds = refinement.poles()
    np.testing.assert_allclose(np.sort(np.real(before.linear.poles)), np.sort(np.real(poles)), rtol=1e-9)
    np.testing.assert_allclose(deviation.max(), np.real(stds).max(), rtol=1e-2)


def test_a_neighbour_that_is_no_model_is_left_out(before: gpi.Model) -> None:
    """The half-width 0 cannot become smaller."""
    place = 2  # behind one threshold and one weight
    prediction = {"numbers": [place], "axes": [[0.1]], "misfit": [0.0], "movement": [1.0]}
    own = Neighbours(changed(before, prediction=prediction))
    deviation = own.deviation(lambda model: model.hysteresis[0].plays.half_widths)
    np.testing.assert_allclose(deviation, [0.1, 0.0], rtol=1e-6)
    alone = Neighbours(bare(before))
    assert alone.deviation(lambda model: model.offsets) is None and not alone.is_known


def test_a_misfit_widens_the_deviation_of_slow_motion(before: gpi.Model, after: gpi.Model) -> None:
    parts = layout(after)
    poor = {"misfit": [0.02], "movement": [1.0]}
    estimates = parts["estimates"] | {"residual_rms": [0.1]}
    own = changed(after, prediction=parts["prediction"] | poor, estimates=estimates)
    found = gpi.compare(before, own)
    row = found["sensitivity[u -> y]"]
    assert row.std_b == pytest.approx(0.02 * (row.b or 0.0), rel=0.01)
    assert found["hysteresis_width[u]"].std_b == pytest.approx(0.02, rel=0.01)
    assert found["offset[y]"].std_b == pytest.approx(0.02, rel=0.01)
    assert found["bandwidth[y]"].std_b == pytest.approx(gpi.compare(before, after)["bandwidth[y]"].std_b)
    assert found.notes == ()


def test_a_model_that_leaves_mostly_misfit_is_not_tested_for_dynamics(
    before: gpi.Model, after: gpi.Model
) -> None:
    parts = layout(after)
    poor = parts["prediction"] | {"misfit": [0.02], "movement": [1.0]}
    estimates = parts["estimates"] | {"residual_rms": [0.021]}
    found = gpi.compare(before, changed(after, prediction=poor, estimates=estimates))
    tested = [row.name for row in found.rows if row.differs is not None]
    assert tested == ["sensitivity[u -> y]", "hysteresis_width[u]", "offset[y]"]
    assert "(0.02 rms)" in found.notes[0]


@pytest.mark.parametrize(
    ("parameter", "lost"),
    [
        ("u.weights[1]", {"sensitivity[u -> y]", "hysteresis_width[u]", "u.weights[1]"}),
        ("section[0].a1", {"bandwidth[y]", "section[0].a1"}),
        ("offset[0].y", {"offset[y]"}),
        ("start[0].state[0]", set()),
    ],
)
def test_a_figure_of_parameters_that_are_not_determined_is_not_tested(
    parameter: str, lost: set[str], before: gpi.Model, after: gpi.Model
) -> None:
    estimates = layout(after)["estimates"]
    rows = [
        one | ({"std": None, "determined": False} if one["name"] == parameter else {})
        for one in estimates["parameters"]
    ]
    assert parameter in {one["name"] for one in rows}
    found = gpi.compare(before, changed(after, estimates=estimates | {"parameters": rows}))
    assert {row.name for row in found.rows if row.differs is None} == lost
    assert found.simulation is not None and (found.simulation.explained is None) == bool(lost)


def test_models_written_by_hand_are_not_tested(before: gpi.Model) -> None:
    found = gpi.compare(bare(before), scaled(before, 1.5))
    assert found.differing == [] and all(row.differs is None for row in found.rows)
    assert len([note for note in found.notes if "no standard deviations" in note]) == 2
    row = found["sensitivity[u -> y]"]
    assert row.difference == pytest.approx(0.5 * (row.a or 0.0))
    own = found.simulation
    assert own is not None and own.explained is None
    assert own.rms == pytest.approx(0.5 * own.movement, rel=0.05)
    assert "None of the values could be tested" in repr(found) and "not tested" in repr(found)


@pytest.mark.parametrize(
    ("parts", "problem"),
    [
        ({"rate": 500.0}, "1000 Hz, but model B at 500 Hz"),
        ({"inputs": [{"name": "u", "unit": "mV"}]}, "unit of input 0 is V in model A, but mV in model B"),
        ({"outputs": [{"name": "y", "unit": "nm"}]}, "unit of output 0 is um in model A, but nm"),
    ],
)
def test_models_of_other_units_or_rates_are_refused(
    parts: dict[str, Any], problem: str, before: gpi.Model
) -> None:
    with pytest.raises(gpi.DataError, match=problem):
        gpi.compare(before, changed(before, **parts))


def test_models_of_other_channels_are_refused(before: gpi.Model) -> None:
    with pytest.raises(gpi.DataError, match="model A has 1 inputs, but model B has 2"):
        gpi.compare(before, of_two_inputs())


def test_other_names_of_channels_are_no_difference(before: gpi.Model, after: gpi.Model) -> None:
    renamed = changed(after, inputs=[{"name": "drive", "unit": ""}], outputs=[{"name": "ai", "unit": "um"}])
    found = gpi.compare(before, renamed)
    assert found["sensitivity[u -> y]"].differs is False
    assert found.other_structure == ("other names of channels",)


def of_two_inputs() -> gpi.Model:
    """Two inputs with plays, and gains to two outputs."""
    own = {
        "envelope": {"thresholds": [0.0], "weights": [1.0], "reading": "one-sided"},
        "plays": {"half_widths": [0.0, 1.0], "weights": [1.0, 0.5]},
    }
    return gpi.Model.from_json(
        json.dumps(
            {
                "schema": "gpi-model/1",
                "rate": 100.0,
                "inputs": [{"name": name, "unit": "V"} for name in "uv"],
                "outputs": [{"name": name, "unit": "um"} for name in "xy"],
                "hysteresis": [own, own],
                "linear": {
                    "a": [[], 0, 0],
                    "b": [[], 0, 2],
                    "c": [[], 2, 0],
                    "d": [[1.0, 0.2, 0.1, 1.0], 2, 2],
                },
                "offsets": [0.5, -0.5],
            }
        )
    )


def test_every_pair_of_channels_has_a_row() -> None:
    model = of_two_inputs()
    found = gpi.compare(model, scaled(model, 2.0))
    # over the range from -2 to 2, the play of half-width 1 moves by half of the input
    for name, gain in (("u -> x", 1.0), ("u -> y", 0.2), ("v -> x", 0.1), ("v -> y", 1.0)):
        row = found[f"sensitivity[{name}]"]
        assert row.a == pytest.approx(gain * 1.25) and row.b == pytest.approx(2 * gain * 1.25)
    assert {"hysteresis_width[u]", "hysteresis_width[v]", "offset[x]"} <= {row.name for row in found.rows}
    with pytest.raises(KeyError):
        found["no such row"]


def with_effects(model: gpi.Model, *effects: dict[str, Any], deviation: float | None = None) -> gpi.Model:
    """A model with effects, whose quantities have the same relative standard deviation."""
    plain = changed(bare(model), effects=list(effects))
    if deviation is None:
        return plain
    estimates = [
        {
            "name": effect["name"],
            "parameters": [
                {key: row[key] for key in ("name", "unit", "value")}
                | {"std": deviation * abs(row["value"]), "determined": True}
                for row in effect["parameters"]
            ],
        }
        for effect in plain.effects
    ]
    known = {"status": "converged", "parameters": [], "residual_rms": [0.1], "outliers": 0, "robust": False}
    known |= {"noise_floor": {"rms": [0.1], "how": "rests"}, "effects": estimates}
    return changed(plain, estimates=known)


def creep(gain: float, lag: float = 1.0) -> dict[str, Any]:
    return {"name": "creep", "input": 0, "time_constants": [lag], "gains": [gain], "dead_time": 0}


def hum(frequency: float, size: float) -> dict[str, Any]:
    own = {"name": "periodic-disturbance", "output": 0, "frequency": frequency, "cosine": size, "sine": 0.0}
    return own | {"duration": 2.0, "span": 1.0, "moves_stage": False}


def curve(scale: float) -> dict[str, Any]:
    own = {"name": "output-nonlinearity", "output": 0, "coefficients": [0.02], "middle": 0.0}
    return own | {"scale": scale}


def test_quantities_of_effects_are_compared(before: gpi.Model) -> None:
    a = with_effects(before, creep(0.10), deviation=0.02)
    b = with_effects(before, creep(0.15, lag=1.02), deviation=0.02)
    found = gpi.compare(a, b)
    assert found.differing == ["creep.gain[0]"]
    row = found["creep.gain[0]"]
    assert row.group == "effect" and row.z == pytest.approx(0.05 / np.hypot(0.002, 0.003))
    assert found["creep.time_constant[0]"].differs is False
    # what a moved effect changes is not known to the simulation
    assert found.simulation is not None and found.simulation.explained is None


def test_an_effect_of_one_model_is_listed(before: gpi.Model) -> None:
    found = gpi.compare(bare(before), with_effects(before, creep(0.1), deviation=0.1))
    assert (found.only_a, found.only_b) == ((), ("creep",))
    row = found["creep.gain[0]"]
    assert (row.a, row.b, row.difference, row.differs) == (None, 0.1, None, None)
    assert "Only B has: creep." in repr(found)
    assert any("do not contain the effects" in note for note in found.notes)
    assert found.other_structure == ("effects none and creep",)


def test_effects_of_time_are_shown_and_not_tested(before: gpi.Model) -> None:
    a = with_effects(before, hum(150.0, 0.1), deviation=0.01)
    b = with_effects(before, hum(50.0, 0.3), hum(150.1, 0.5), deviation=0.01)
    found = gpi.compare(a, b)
    assert found.only_b == ("periodic-disturbance[0]",)
    row = found["periodic-disturbance[1].amplitude"]
    assert (row.a, row.b, row.differs) == (pytest.approx(0.1), pytest.approx(0.5), None)
    assert row.difference == pytest.approx(0.4)
    assert any("depends only on time" in note for note in found.notes)


def test_curves_of_another_scale_are_not_tested(before: gpi.Model) -> None:
    found = gpi.compare(*(with_effects(before, curve(scale), deviation=0.01) for scale in (4.0, 5.0)))
    assert found.differing == []
    assert any("another form or another scale" in note for note in found.notes)
    same = gpi.compare(*(with_effects(before, curve(4.0), deviation=0.01) for _ in range(2)))
    assert same["output-nonlinearity.curve[2]"].differs is False


def test_measured_columns_of_a_model_count_as_zero(before: gpi.Model) -> None:
    leak = {"name": "covariate", "output": 0, "column": 1, "label": "room", "gain": 0.4, "time_constant": 0.0}
    own = leak | {"step": 1e-3, "moves_stage": False}
    found = gpi.compare(bare(before), with_effects(before, own))
    assert found.simulation is not None and found.simulation.rms == pytest.approx(0.0, abs=1e-12)


def resonant(*frequencies: float) -> gpi.Model:
    """A gain and modes in series, which are known to 0.1 %."""
    system = [np.array([1.0]), np.array([1.0])]
    for frequency in frequencies:
        pole = np.exp(2 * np.pi * frequency / RATE * (-0.02 + 1j))
        denominator = np.real(np.poly([pole, pole.conjugate()]))
        system = [system[0] * denominator.sum(), np.convolve(system[1], denominator)]
    numerator = np.append(np.zeros(len(system[1]) - 1), system[0])
    g = gpi.StateSpace.from_transfer_function(numerator, system[1])
    parts = layout(model_of(plant()))
    parts["linear"] = {
        name.lower(): [np.ravel(getattr(g, name), order="F").tolist(), *getattr(g, name).shape]
        for name in "ABCD"
    }
    order, first = g.order, 3 + 3 + 3 + 3
    numbers = [first + k for k in range(order * order)]
    axes = [[1e-6 * value if value not in (0.0, 1.0) else 0.0 for value in parts["linear"]["a"][0]]]
    parts["prediction"] = {"numbers": numbers, "axes": axes, "misfit": [0.0], "movement": [1.0]}
    return gpi.Model.from_json(json.dumps(parts))


def test_resonances_are_paired_by_their_frequency() -> None:
    found = gpi.compare(resonant(90.0), resonant(30.0, 95.0))
    assert (found.only_a, found.only_b) == ((), ("resonance[0] at 30.01 Hz",))
    alone, row = found["resonance[0].frequency"], found["resonance[1].frequency"]
    assert (alone.a, alone.b, alone.unit) == (None, pytest.approx(30.0, rel=0.01), "Hz")
    assert (row.a, row.b) == (pytest.approx(90.0, rel=0.01), pytest.approx(95.0, rel=0.01))
    assert row.differs and row.std_a is not None and 0 < row.std_a < 0.1
    assert found["resonance[1].damping"].a == pytest.approx(0.02, rel=0.05)
    assert nearest_pairs([], [2.0]) == [(None, 0)] and nearest_pairs([0.0], [0.0]) == [(0, 0)]


def hysteresis(half_widths: list[float], thresholds: list[float], slope: float = 1.0) -> dict[str, Any]:
    weights = [slope, *np.zeros(len(thresholds))]
    return {
        "envelope": {"thresholds": [0.0, *thresholds], "weights": weights, "reading": "one-sided"},
        "plays": {"half_widths": half_widths, "weights": list(np.ones(len(half_widths)))},
    }


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        (([0.0], []), ([0.0], []), None),
        (([0.0, 1.0, 2.0], []), ([0.0], []), (-3.0, 3.0)),
        (([0.0, 1.0, 2.0], []), ([0.0, 1.0], []), (-2.0, 2.0)),
        (([0.0, 1.0], [], 2.0), ([0.0], []), (-1.0, 1.0)),
        (([0.0], [2.0, 8.0]), ([0.0, 1.0], []), (3.0, 7.0)),
        (([0.0], [2.0, 8.0]), ([0.0], [6.0, 9.0]), (6.0, 8.0)),
        (([0.0], [2.0, 3.0]), ([0.0], [6.0, 9.0]), None),
        (([0.0], [5.0]), ([0.0], [5.0]), None),
    ],
)
def test_the_range_is_what_both_models_show(
    a: Any, b: Any, expected: tuple[float, float] | None, before: gpi.Model
) -> None:
    models = [changed(bare(before), hysteresis=[hysteresis(*own)]) for own in (a, b)]
    [found] = common_ranges(*models)
    assert found == (None if expected is None else pytest.approx(expected, rel=1e-6))
    if expected is None:
        compared = gpi.compare(*models)
        assert compared.simulation is None and any("not simulated" in note for note in compared.notes)
        # the loop of a gain is known without a range
        is_gain = not a[1]
        assert ("sensitivity[u -> y]" in {row.name for row in compared.rows}) == is_gain


def test_a_model_that_integrates_has_no_sensitivity(before: gpi.Model) -> None:
    parts = layout(before)
    parts["linear"] |= {"a": [[1.0], 1, 1], "b": [[0.1], 1, 1], "c": [[1.0], 1, 1], "d": [[0.0], 1, 1]}
    own = gpi.Model.from_json(json.dumps(parts))
    found = gpi.compare(own, own)
    names = {row.name for row in found.rows if row.group == "figure"}
    assert names == {"hysteresis_width[u]", "offset[y]"} and found.simulation is not None


def test_the_procedure_of_holm() -> None:
    # 0.05/4, 0.05/3, 0.05/2: the third is too large, and ends it
    assert significance.holm([0.03, 0.012, None, 0.016, 0.04]) == [False, True, None, True, False]
    assert significance.holm([0.0125 + 1e-9, 0.001, 0.001, 0.001]) == [True] * 4
    assert significance.holm([0.0126] * 4) == [False] * 4
    assert significance.two_sided(0.0) == 1.0
    assert significance.two_sided(-2.5758) == pytest.approx(0.01, rel=1e-4)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory, before: gpi.Model, stronger: gpi.Model) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("compared")
    before.save(folder / "old.json")
    stronger.save(folder / "new.json")
    write_csv(folder / "run.csv", good_columns(1500, seed=7))
    for name, seed in (("lot1", 1), ("lot2", 2)):
        fleet(30, seed).write_parquet(folder / f"{name}.parquet", metadata={"schema": "gpi-fleet/1"})
    fleet(30, 1).write_parquet(folder / "future.parquet", metadata={"schema": "gpi-fleet/9"})
    (folder / "broken.parquet").write_text("no table")
    return {file.name: str(file) for file in folder.iterdir()}


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["compare", *arguments, "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    result: dict[str, Any] = json.loads(out)
    schemas.require(result, "gpi-comparison/1")
    return result


def test_the_command_compares_models(files: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    pair = (files["old.json"], files["new.json"])
    result = printed(capsys, *pair)
    assert (result["kind"], result["a"], result["b"]) == ("models", *pair)
    assert "sensitivity[u -> y]" in result["differing"] and result["record"] is None
    assert result["simulation"]["drive"] == "triangle"
    on_record = printed(capsys, *pair, files["run.csv"], "--remove-mean", "--no-fit-start")
    assert on_record["simulation"]["drive"] == "record" and on_record["record"]["samples"] == 1500
    assert "mean of the residual removed" in on_record["simulation"]["rule"]
    assert run(["compare", *pair, files["run.csv"]]) == 0
    text = capsys.readouterr().out
    assert "sensitivity[u -> y] [um/V]" in text and "differs" in text and "On the record" in text


def test_the_command_compares_fleets(files: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    result = printed(capsys, files["lot1.parquet"], files["lot2.parquet"])
    assert (result["kind"], result["differing"], result["pairs"]) == ("fleets", [], None)
    assert run(["compare", files["lot1.parquet"], files["lot2.parquet"]]) == 0
    text = capsys.readouterr().out
    assert "30 devices" in text and "creep.gain[0]" in text and "Mann and Whitney" in text


@pytest.mark.parametrize(
    ("names", "code", "problem"),
    [
        (("old.json", "lot1.parquet"), 2, "compare two models, or two tables of gpi batch"),
        (("lot1.parquet", "lot2.parquet", "run.csv"), 2, "a record is compared with models"),
        (("old.json", "no.json"), 3, "cannot be read"),
        (("old.json", "run.csv"), 3, "run.csv"),
        (("lot1.parquet", "broken.parquet"), 3, "is no table of `gpi batch`"),
        (("lot1.parquet", "no.parquet"), 3, "no.parquet"),
        (("lot1.parquet", "future.parquet"), 3, "has the schema gpi-fleet/9"),
    ],
)
def test_the_command_refuses_what_cannot_be_compared(
    names: tuple[str, ...],
    code: int,
    problem: str,
    files: dict[str, str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = Path(files["old.json"]).parent
    assert run(["compare", *(str(folder / name) for name in names)]) == code
    captured = capsys.readouterr()
    assert problem in captured.err and "Traceback" not in captured.err and captured.out == ""


def test_python_takes_paths_and_says_what_it_found(files: dict[str, str]) -> None:
    found = gpi.compare(files["old.json"], Path(files["new.json"]), files["run.csv"])
    assert found.names == (files["old.json"], files["new.json"])
    assert found.simulation is not None and found.simulation.unit == "um"
    schemas.require(found.to_dict())
    assert repr(found).startswith(f"A: {files['old.json']}\nB: ")
    with pytest.raises(gpi.DataError):
        gpi.compare(files["run.csv"], files["new.json"])
