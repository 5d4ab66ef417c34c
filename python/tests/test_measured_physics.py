"""What measured records of known physics must and must not be said to lack."""

from pathlib import Path

import pytest

import gpi_hammerstein as gpi
from data_folder import FOREIGN, MEASURED, needs_measured

pytestmark = [pytest.mark.slow, needs_measured]


def explained(file: str | Path, **columns: object) -> dict[str, object]:
    return gpi.explain(gpi.read_record(Path(MEASURED) / file, **columns)).to_dict()


def held_out(answer) -> float:
    return answer["error"]["after"]["holdout"]["rms"]


def best_rival(answer) -> float:
    return min(rival["holdout_rms"] for rival in answer["rivals"])


@pytest.mark.parametrize("columns", [{}, {"covariate": []}], ids=["with the reference", "without"])
def test_friction_of_a_stage_that_integrates_is_named_alone(columns):
    answer = explained("emps/emps_train.csv.gz", input="motor_V", output="position_m", **columns)
    assert answer["effects"] == ["friction"] and answer["verdict"] == "outside-class"
    assert "integrates the input" in answer["verdict_reason"]
    assert held_out(answer) < best_rival(answer)


def test_a_friction_damper_is_a_bank_of_stops():
    options = {"input": "displacement_in", "output": "force_kip", "covariate": []}
    # plays with weights of any sign are about as good at 0.5 Hz
    for file, most in (("0.5Hz_30lb", 1.05), ("1Hz_20lb", 1.0)):
        answer = explained(f"friction-damper/{file}.csv.gz", **options)
        assert answer["effects"] == []
        assert held_out(answer) <= most * best_rival(answer)


@pytest.mark.parametrize("file", ["throttle1", "throttle3"])
def test_a_throttle_valve_rubs_between_end_stops(file):
    answer = explained(f"throttle-valve/{file}.csv")
    assert answer["effects"] == ["friction", "saturation"]
    assert held_out(answer) < 0.25 * best_rival(answer)
    found = {step["effect"]: step["parameters"] for step in answer["steps"]}
    friction, stops = found["friction"], found["saturation"]
    # a positive input lowers the output
    assert all(friction[name]["value"] > 0.0 for name in ("friction_force", "mass", "damping"))
    limits = sorted(stops[f"limit[{number}]"]["value"] for number in (0, 1))
    assert limits == pytest.approx([0.7, 4.4], abs=0.1)


def test_an_effect_that_is_refused_in_the_end_leaves_no_worse_a_model():
    # an integrating stage: a drift that stands for its whole output is added first
    answer = explained(FOREIGN / "plant-16.csv.gz")
    assert answer["effects"] == []
    before, after = (answer["error"][when]["train"]["rms"] for when in ("before", "after"))
    assert after <= 1.001 * before


def test_the_last_fit_leaves_no_creep_that_relaxes_backwards():
    # one sine, whose flat parts are those of a gap: lags of both signs fit it best
    columns = {"input": "u_deg", "output": "y_deg", "resample": True, "covariate": []}
    answer = explained("tendon-sheath-backlash/conf90_60.csv", **columns)
    steps = [step["parameters"] for step in answer["steps"] if step["effect"] == "creep"]
    gains = [row["value"] for rows in steps for name, row in rows.items() if name.startswith("gain")]
    assert -sum(gain for gain in gains if gain < 0.0) <= 0.5 * sum(gains)


@pytest.mark.parametrize(
    ("file", "effect"),
    [("silverbox/train", "stiffness"), ("bouc-wen/train_multisine", "hysteretic-stiffness")],
)
def test_the_spring_of_an_oscillator_is_named(file, effect):
    answer = explained(f"{file}.csv.gz")
    assert answer["effects"] == [effect]
    assert held_out(answer) < best_rival(answer)
