"""The closed loop on plants of an independent simulator, and on measured records with an effect injected."""

import json

import numpy as np
import pytest
import scipy.signal

import gpi_hammerstein as gpi
import plants
import scores
from data_folder import DEV
from gpi_hammerstein.explanation import in_words
from records import actuator, drive

SECONDS, RATE = 10.0, 1000.0


def record_of(run):
    columns = {} if run.x is None else {"covariates": run.x}
    return gpi.Record(run.u, run.y, rate=run.rate, input_units=["V"], output_units=["um"], **columns)


def explained(seed, effects, strength, **options):
    plant = plants.draw(seed, effects, strength, SECONDS, RATE)
    return plant, gpi.explain(record_of(plant.record(0)), **options)


# Strong enough that the record decides: how much of an effect the declared model can take for itself
# differs, and with it what is left to be seen.
def not_yet(name, strength, why):
    return pytest.param(
        name, strength, marks=[pytest.mark.unmet, pytest.mark.xfail(reason=why, strict=False)]
    )


def slow(name, strength):
    return pytest.param(name, strength, marks=pytest.mark.slow)


CASES = [
    ("creep", 15.0),
    ("periodic-disturbance", 8.0),
    slow("output-nonlinearity", 25.0),
    ("outliers", 8.0),
    ("coloured-noise", 4.0),
    ("covariate", 10.0),
    slow("drift", 10.0),
    slow("rate-dependence", 20.0),
    slow("gain-drift", 10.0),
    ("backlash", 15.0),
    not_yet("stiffness", 15.0, "named, but a part of it is left"),
]


@pytest.mark.parametrize(("name", "strength"), CASES)
def test_a_missing_effect_is_named(name, strength):
    plant, found = explained(21, (name,), strength, order=3)
    assert found.effects == [name]
    if name != "coloured-noise":
        assert found.after["holdout"]["rms"] < 1.3 * plant.noise_std
        assert found.before["train"]["rms"] > 1.1 * found.after["train"]["rms"]


@pytest.mark.parametrize("seed", [1, 2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (3, 4))])
def test_a_clean_record_lacks_nothing(seed):
    plant, found = explained(seed, (), None)
    assert found.effects == []
    assert found.after["holdout"]["rms"] < 1.1 * plant.noise_std
    # a hundredth of the residual's variance may be left in its correlations
    assert found.verdict == "explained" or seed == 1
    lacks_nothing = next(iter(in_words(found.to_dict()))).startswith("The model lacks no effect")
    assert lacks_nothing == (found.verdict == "explained")


@pytest.mark.parametrize(
    ("frequency", "amplitude"),
    [(50.0, 0.01), *(pytest.param(*hum, marks=pytest.mark.slow) for hum in ((50.3, 0.05), (60.7, 0.01)))],
)
def test_a_hum_is_no_mode_that_rings_on(frequency, amplitude):
    # a mode that rings longer than the record follows a hum from where it began
    u = drive()
    hum = amplitude * np.sin(2 * np.pi * frequency * np.arange(len(u)) / 1000.0)
    found = gpi.explain(gpi.Record(u, actuator(u) + hum, 1000.0))
    assert found.effects == ["periodic-disturbance"] and found.verdict == "explained"
    values = {row["name"]: row["value"] for row in found.steps[1]["parameters"]}
    assert values["frequency"] == pytest.approx(frequency, abs=0.05)
    assert values["amplitude"] == pytest.approx(amplitude, rel=0.05)


@pytest.mark.parametrize("channel", ["u", pytest.param("y", marks=pytest.mark.slow)])
def test_a_column_that_repeats_a_channel_is_no_effect(channel):
    # the reference of an amplifier or of a control loop, or a second sensor
    run = plants.draw(2, ("creep",), 15.0, SECONDS, RATE).record(0)
    reference = 3.0 * getattr(run, channel) + 1.0 + 1e-3 * np.sin(np.arange(len(run.u)))
    found = gpi.explain(gpi.Record(run.u, run.y, RATE, covariates=reference))
    assert found.effects == ["creep"]


@pytest.mark.slow
def test_grids_are_refined_where_a_promising_effect_is_not_confirmed():
    # beside its gain drift, a shape of the hysteresis promises what finer grids do
    plant = plants.draw(1002, ("gain-drift",), None, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert found.effects == ["gain-drift"]
    assert found.after["holdout"]["rms"] < 1.1 * plant.noise_std


@pytest.mark.slow
@pytest.mark.skipif(not DEV.is_dir(), reason=f"NO BLIND RECORDS in {DEV}: set GPI_DATA_DIR to run this test")
def test_creep_is_neither_a_drift_nor_a_slow_mode():
    found = gpi.explain(gpi.read_record(DEV / "record-18.csv.gz"))
    assert set(found.effects) == {"creep", "gain-drift"}


@pytest.mark.slow
def test_a_slew_limit_that_few_jumps_show_is_named_where_it_explains_all():
    plant = plants.draw(8011, ("amplifier-slew",), None, 20.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert found.effects == ["amplifier-slew"]
    assert found.after["holdout"]["rms"] < 1.1 * plant.noise_std


@pytest.mark.slow
def test_loops_that_open_with_speed_are_fitted_on_grids_that_move():
    # without it, what the grid has bent to is taken for a shape of the loops
    plant, found = explained(8024, ("rate-dependence",), 20.0)
    assert found.effects == ["rate-dependence"]
    assert found.after["holdout"]["rms"] < 1.1 * plant.noise_std


@pytest.mark.slow
def test_a_fit_that_ends_far_above_the_noise_begins_again_at_another_law():
    # from the most promising exponent and knee, it ends at four times the noise
    plant = plants.draw(1045, ("rate-dependence",), None, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert found.effects == ["rate-dependence"]
    assert found.after["holdout"]["rms"] < 1.1 * plant.noise_std


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "first", "lacking", "effects"),
    [
        (0, 100_000, ("creep", "backlash"), ["backlash", "creep"]),
        (0, 400_000, ("creep", "backlash"), ["backlash", "creep"]),
        (1, 400_000, ("creep", "backlash"), ["backlash", "creep"]),
        # a sine, whose fourth harmonic a resonance amplifies
        (0, 850_000, ("creep", "backlash"), []),
        # triangles of one frequency: a shape of the loops follows what few plays and the creep leave
        (1, 700_000, ("creep", "backlash"), ["backlash"]),
        (1, 700_000, ("creep",), ["creep"]),
    ],
)
def test_a_piece_of_a_long_record_gets_no_false_name(number, first, lacking, effects):
    # the creep is older than the piece
    run = plants.draw(3, lacking, seconds=1000.0, rate=1000.0).record(number)
    found = gpi.explain(record_of(scores.cut(run, first, first + 30_000)))
    assert sorted(found.effects) == effects


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "lacking", "found"),
    [
        # a shape of the loops explains nearly as much as knots of the gain, with many more terms
        (4012, ("gain-drift", "amplifier-slew"), ("gain-drift",)),
        # the harmonics of a sine that lie above half of the sampling rate return below it
        (4037, ("output-nonlinearity", "rate-dependence"), ("rate-dependence",)),
    ],
)
def test_many_terms_and_folded_harmonics_get_no_name(seed, lacking, found):
    assert scores.piece(seed, lacking, 30.0).found == found


@pytest.mark.slow
def test_a_spring_that_softens_up_to_a_limit_needs_no_second_name():
    # its force is no cube: four powers of the displacement take the place of a hysteretic force
    plant = plants.draw(1081, ("stiffness",), None, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert found.effects == ["stiffness"]
    assert found.after["holdout"]["rms"] < 1.1 * plant.noise_std


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "effects", "most"), [(1113, ("backlash",), 1.2), (1037, ("stiffness", "amplifier-slew"), 1.5)]
)
def test_plays_are_chosen_anew_beside_an_effect_that_is_found(seed, effects, most):
    # few plays that move downhill leave an error that other effects would take
    plant = plants.draw(seed, effects, None, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert sorted(found.effects) == sorted(effects)
    assert found.after["holdout"]["rms"] < most * plant.noise_std


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "lacking", "most"),
    [
        # the search for coloured noise adds a hysteretic spring that the held-out data hardly show
        (1037, {"stiffness", "amplifier-slew"}, 1.9),
        # a drift and two lags of G follow the creep at first
        (1098, {"covariate", "stiffness", "creep"}, 1.02),
        # creep takes the place of a drift, and then also explains what speed-dependent plays did beside it
        (1116, {"creep"}, 1.02),
        # friction follows what the spring leaves in a few held-out blocks
        (1135, {"stiffness"}, 1.1),
        # the held-out blocks do not confirm the shape of the loops before the gain's drift is known
        (1148, {"stiffness", "hysteresis-shape", "gain-drift"}, 1.1),
        # a wide hysteresis resembles an integral of the input, which a force in the mechanics would follow
        (1182, {"output-nonlinearity"}, 1.02),
        # smooth errors of the model pass for coloured noise, whose search finds the way to a better one
        (1197, {"stiffness", "rate-dependence"}, 1.9),
        # the drift is a small part of the training squares, and a large one of the held-out squares
        (1198, {"gain-drift", "stiffness", "drift"}, 1.02),
    ],
)
def test_all_that_is_lacking_is_named(seed, lacking, most):
    plant = plants.draw(seed, tuple(sorted(lacking)), None, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert set(found.effects) == lacking
    assert found.after["holdout"]["rms"] < most * plant.noise_std


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "effect", "why"),
    [
        (1109, "gain-drift", "follows how the input moves"),
        # knots follow the gain better than any shape of loops, but do not predict gaps
        (1179, "hysteresis-shape", "function of time that was refused"),
    ],
)
def test_a_gain_that_past_peaks_change_has_no_name(seed, effect, why):
    plant = plants.draw(seed, ("peak-memory",), None, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert not found.effects
    reasons = {one["effect"]: one["why"] for one in found.to_dict()["rejected"]}
    assert why in reasons[effect]


@pytest.mark.slow
def test_an_effect_that_is_smaller_than_coloured_noise_is_named():
    # white noise of the same size would hide the sensor's curve; the past of this noise predicts most of it
    lacking = ("backlash", "coloured-noise", "output-nonlinearity")
    plant = plants.draw(1068, lacking, 30.0, 30.0)
    found = gpi.explain(record_of(plant.record(0)))
    assert sorted(found.effects) == sorted(lacking) and found.verdict == "explained"
    # the noise remains, and no more
    assert found.after["train"]["rms"] == pytest.approx(30.0 * plant.noise_std, rel=0.02)
    # the errors of a step are those of the output, not of the innovations
    curve = next(step for step in found.steps if step["effect"] == "output-nonlinearity")
    for part in ("train", "holdout"):
        assert curve[f"{part}_rms"] == pytest.approx(found.after[part]["rms"], rel=0.05)


def test_creep_is_named_where_samples_are_too_slow_to_show_dynamics():
    rate, random = 10.0, np.random.default_rng(1)
    levels = np.repeat(random.uniform(0.0, 10.0, 60), 50)
    u = np.concatenate([np.zeros(20), levels])
    y = 2.0 * u + 0.005 * random.standard_normal(len(u))
    for time_constant, gain in ((3.0, 0.2), (30.0, 0.3)):
        pole = np.exp(-1 / (rate * time_constant))
        y += scipy.signal.lfilter([0.0, gain * (1 - pole)], [1.0, -pole], u)
    found = gpi.explain(gpi.Record(u, y, rate=rate))
    assert found.effects == ["creep"]
    found_times = [q["value"] for q in found.steps[1]["parameters"] if q["name"].startswith("time_constant")]
    for time_constant in (3.0, 30.0):
        assert min(abs(value / time_constant - 1) for value in found_times) < 0.1
    assert found.after["holdout"]["rms"] < 1.1 * 0.005


def test_only_allowed_effects_are_added():
    run = plants.draw(21, ("drift",), 10.0, SECONDS, RATE).record(0)
    found = gpi.explain(record_of(run), effects=["backlash", "periodic-disturbance"], order=3)
    assert set(found.effects) <= {"backlash", "periodic-disturbance"}
    assert "drift" not in [other["effect"] for other in found.rejected]


def test_a_required_effect_is_added_whatever_it_gains():
    plant = plants.draw(2, (), None, SECONDS, RATE)
    record = record_of(plant.record(0))
    found = gpi.explain(record, effects=[], require=["backlash"])
    assert found.effects == ["backlash"]
    assert found.steps[1]["evidence"]["deviance"] < found.steps[1]["evidence"]["chance"]
    with pytest.raises(gpi.ParameterError, match="`require`.*magic"):
        gpi.explain(record, require=["magic"])
    with pytest.raises(gpi.ParameterError, match="`require`.*coloured-noise.*do not require it"):
        gpi.explain(record, effects=[], require=["coloured-noise"])


def test_an_unknown_effect_is_refused():
    plant = plants.draw(1, (), None, SECONDS, RATE)
    with pytest.raises(gpi.ParameterError, match="Give one of delay, amplifier-slew"):
        gpi.explain(record_of(plant.record(0)), effects=["magic"])


def test_the_search_can_be_stopped_and_keeps_what_it_found():
    plant = plants.draw(21, ("periodic-disturbance",), 8.0, SECONDS, RATE)
    seen = []

    def stop(now):
        seen.append(now.trial)
        # the score test of a second round begins when a first effect was taken
        if "periodic-disturbance" in seen and now.stage == "score test":
            raise KeyboardInterrupt

    found = gpi.explain(record_of(plant.record(0)), progress=stop, order=3)
    assert found.interrupted
    assert found.effects == ["periodic-disturbance"]
    assert next(iter(in_words(found.to_dict()))).startswith("The search was stopped before it was complete")


def test_a_stop_at_the_last_report_is_not_lost():
    def stop(now):
        if now.done == 1.0:
            raise KeyboardInterrupt

    record = record_of(plants.draw(1, (), None, SECONDS, RATE).record(0))
    choices = {"delay": 0, "half_widths": [0.0, 1.0], "thresholds": 0, "effects": []}
    assert gpi.explain(record, **choices, progress=stop).interrupted


def test_wrong_samples_are_told_however_few():
    plant = plants.draw(3, (), None, SECONDS, RATE)
    run = plant.record(0)
    y = np.array(run.y, dtype=float).reshape(-1)
    span = np.ptp(y)
    y[5000] += 0.3 * span
    y[7200] -= 0.2 * span
    found = gpi.explain(gpi.Record(run.u, y, rate=run.rate), order=3, effects=[])
    assert [row["row"] for row in found.wrong_samples] == [5000, 7200]
    assert found.wrong_samples[0] | {"row": 0} == {"experiment": 0, "output": "y", "row": 0}
    words = " ".join(in_words(found.to_dict()))
    assert (
        "2 samples differ strongly from their neighbours" in words and "row 5000 of y and row 7200" in words
    )


def bouc_wen(u, rate):
    """0.5 u + 0.5 z before a mode at 170 Hz, z' = 0.9 u' - 0.05 |u'| z - 0.02 u' |z|."""
    steps, z, v = 4, 0.0, np.empty_like(u)
    for k, du in enumerate(np.diff(u, prepend=u[0]) / steps):
        for _ in range(steps):
            z += 0.9 * du - 0.05 * abs(du) * z - 0.02 * du * abs(z)
        v[k] = 0.5 * (u[k] + z)
    omega = 2 * np.pi * 170.0
    mode = scipy.signal.bilinear([omega**2], [1.0, 0.04 * omega, omega**2], rate)
    return scipy.signal.lfilter(*mode, v - v[0]) + v[0]


@pytest.mark.slow
def test_a_mode_is_kept_where_slow_poles_are_not():
    """Its memory of the path looks like slow poles; without them a lower order would drop the mode first."""
    rate, t = 2000.0, np.arange(20_000) / 2000.0
    random = np.random.default_rng(5)
    lines = np.array([0.5, 1.3, 3.1, 7.7, 19.1, 41.3, 97.7, 151.1, 203.3])
    phases = random.uniform(0, 2 * np.pi, len(lines))
    u = (np.sin(2 * np.pi * np.outer(t, lines) + phases) / np.maximum(1.0, lines / 10)).sum(axis=1)
    u = 60 * (u - u.min()) / np.ptp(u)
    y = bouc_wen(u, rate) + 0.01 * random.standard_normal(len(u))
    found = gpi.explain(gpi.Record(u, y, rate=rate), effects=[])
    angles = np.angle(found.base.linear.poles) * rate / (2 * np.pi)
    assert np.abs(angles - 166.0).min() < 3.0
    assert found.before["train"]["rms"] < 0.5  # 1.64 where the mode is dropped


def test_an_interrupt_before_anything_is_known_is_raised():
    plant = plants.draw(1, (), None, SECONDS, RATE)

    def stop(now):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gpi.explain(record_of(plant.record(0)), progress=stop)


def test_the_contract_of_the_answer():
    _, found = explained(21, ("periodic-disturbance",), 8.0, order=3)
    answer = found.to_dict()
    assert answer["schema"] == "gpi-explanation/1"
    assert set(answer["record"]) == {"samples", "rate_hz", "inputs", "outputs", "covariates"}
    assert set(answer["error"]) == {"before", "after"}
    for errors in answer["error"].values():
        for figures in errors.values():
            assert set(figures) == {"rms", "nrmse", "fit_percent", "max"}
    assert answer["steps"][0]["effect"] is None
    assert [step["effect"] for step in answer["steps"][1:]].count("periodic-disturbance") >= 1
    assert {"value", "std", "unit", "determined"} == set(answer["steps"][1]["parameters"]["frequency"])
    assert {"name", "statistic", "threshold", "passed"} <= set(answer["residual"]["tests"][0])
    assert answer["verdict"] in ("explained", "partly-explained", "unattributed", "outside-class")
    assert (answer["verdict"] == "outside-class") == (answer["verdict_reason"] is not None)
    assert [row["name"] for row in answer["rivals"]] == ["static-polynomial", "plays", "fir", "arx"]
    assert set(answer["rivals"][0]) == {"name", "detail", "train_rms", "holdout_rms"}
    json.dumps(answer)
    words = " ".join(in_words(answer, "um"))
    assert "periodic-disturbance" in words and "um" in words and "Verdict" in words


def test_the_model_of_an_explanation_runs_and_is_saved(tmp_path):
    plant, found = explained(21, ("creep",), 15.0, order=3)
    again = record_of(plant.record(1))
    assert (
        found.model.error(again, fit_start=True)["rms"] < 0.5 * found.base.error(again, fit_start=True)["rms"]
    )
    found.model.save(tmp_path / "model.json")
    loaded = gpi.load(tmp_path / "model.json")
    assert [effect["name"] for effect in loaded.effects] == ["creep"]
    np.testing.assert_array_equal(loaded.simulate(again.u[0]), found.model.simulate(again.u[0]))


def test_held_out_samples_do_not_touch_the_fit():
    plant = plants.draw(3, (), None, SECONDS, RATE)
    run = plant.record(0)
    found = gpi.explain(record_of(run), effects=[])
    spoiled = run.y.copy()
    for first, last in found.held_out[0]:
        # neither spikes nor steps that the search for wrong samples would mend
        spoiled[first:last] += np.hanning(last - first) * np.ptp(run.y)
    other = gpi.explain(
        gpi.Record(run.u, spoiled, rate=run.rate, **({} if run.x is None else {"covariates": run.x})),
        effects=[],
    )
    assert other.held_out == found.held_out
    # but for the mean that is taken from the whole output
    np.testing.assert_allclose(
        other.base.simulate(run.u), found.base.simulate(run.u), rtol=0, atol=1e-3 * np.ptp(run.y)
    )
    assert other.before["holdout"]["rms"] > 100 * found.before["holdout"]["rms"]
