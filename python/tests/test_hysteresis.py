"""The hysteresis fit and the whole chain, on plants that are simulated by the oracle."""

import json

import numpy as np
import pytest

import gpi_hammerstein as gpi
import oracle

# --- the fit from an intermediate signal ---------------------------------------------------------

HALF_WIDTHS = np.array([0.0, 0.4, 1.0, 1.8])
WEIGHTS = np.array([1.2, 0.5, 0.35, 0.2])
GRID = np.arange(0, 2.41, 0.2)
THRESHOLDS = np.array([-2.0, 0.0, 1.5])
SLOPES = np.array([0.25, 1.0, -0.3])


def excitation(samples=3000, seed=0, amplitude=4.0):
    """Many minor loops of all sizes, from zero."""
    rng = np.random.default_rng(seed)
    k = np.arange(samples)
    tones = [(0.011, 1.0), (0.0237, 0.8), (0.0531, 0.6), (0.097, 0.35)]
    u = np.sum([a * np.sin(w * k + rng.uniform(0, 2 * np.pi)) for w, a in tones], axis=0)
    u *= np.minimum(k / 300, 1)
    return amplitude * u / np.max(np.abs(u))


def weights_on(grid, operator):
    """The operator's play weights, on the grid that was offered."""
    found = np.zeros(len(grid))
    for r, p in zip(operator.plays.half_widths, operator.plays.weights, strict=True):
        found[np.argmin(np.abs(grid - r))] += p
    return found


TRUE_ON_GRID = np.zeros(len(GRID))
TRUE_ON_GRID[[0, 2, 5, 9]] = WEIGHTS


def test_plays_are_recovered():
    u = excitation()
    v, _ = oracle.play_bank(u, HALF_WIDTHS, WEIGHTS)
    fit = gpi.fit_hysteresis(u, v, half_widths=GRID, thresholds=0)
    np.testing.assert_allclose(weights_on(GRID, fit.gpi), TRUE_ON_GRID, rtol=0, atol=1e-6)
    np.testing.assert_allclose(fit.gpi(u) + fit.offset, v, rtol=0, atol=1e-6)
    assert fit.offset == pytest.approx(0, abs=1e-6)
    assert fit.rms < 1e-6
    assert fit.status == "converged"


def test_deadzones_and_plays_are_recovered_together():
    u = excitation()
    v, _ = oracle.gpi(u, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    fit = gpi.fit_hysteresis(u, v + 3, half_widths=GRID, thresholds=[-2.0, -1.0, 0.0, 0.75, 1.5])
    np.testing.assert_allclose(weights_on(GRID, fit.gpi), TRUE_ON_GRID, rtol=0, atol=1e-6)
    found = dict(zip(fit.gpi.envelope.thresholds, fit.gpi.envelope.weights, strict=True))
    expected = {-2.0: 0.25, -1.0: 0.0, 0.0: 1.0, 0.75: 0.0, 1.5: -0.3}
    for threshold, slope in expected.items():
        assert found.get(threshold, 0.0) == pytest.approx(slope, abs=1e-6)
    assert fit.offset == pytest.approx(3, abs=1e-6)
    assert fit.rms < 1e-6
    np.testing.assert_allclose(fit.gpi(u) + fit.offset, v + 3, rtol=0, atol=1e-5)


def test_a_fit_that_starts_within_a_loop_finds_the_start():
    """A record cut out of a longer one: the plays remember what came before it."""
    u = excitation(4000)
    v, _ = oracle.gpi(u, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    cut = 1111
    z = oracle.deadzones(u, THRESHOLDS, SLOPES)
    memory = oracle.plays(z, HALF_WIDTHS)[cut - 1]
    assert np.max(np.abs(memory - z[cut])) > 0.5
    fit = gpi.fit_hysteresis(u[cut:], v[cut:], half_widths=HALF_WIDTHS, thresholds=THRESHOLDS)
    np.testing.assert_allclose(weights_on(HALF_WIDTHS, fit.gpi), WEIGHTS, rtol=1e-6)
    state = np.concatenate([[u[cut - 1]], fit.start])
    np.testing.assert_allclose(fit.gpi.run(u[cut:], state)[0] + fit.offset, v[cut:], rtol=0, atol=1e-6)
    assert fit.rms < 1e-6


def test_noise_is_left_over():
    """The fit ends at the noise and the curve lies much nearer to the truth than the samples."""
    rng = np.random.default_rng(3)
    u = excitation(6000)
    v, _ = oracle.gpi(u, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    noise = 0.05
    fit = gpi.fit_hysteresis(u, v + noise * rng.normal(size=len(v)), half_widths=GRID, thresholds=THRESHOLDS)
    assert fit.rms == pytest.approx(noise, rel=0.03)
    error = oracle.errors(v, fit.gpi(u) + fit.offset)
    assert error["rms"] < 0.2 * noise
    assert np.all(fit.gpi.plays.weights >= 0)


def test_placed_grids_follow_the_curve():
    u = excitation()
    v, _ = oracle.gpi(u, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    errors = []
    for count in (6, 12, 24):
        fit = gpi.fit_hysteresis(u, v, half_widths=count, thresholds=count // 2)
        errors.append(fit.rms / np.ptp(v))
        assert len(fit.gpi.plays.half_widths) <= count
        assert 0.0 in fit.gpi.plays.half_widths
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-3


def test_defaults_fit_a_saturating_loop():
    u = excitation()
    v, _ = oracle.play_bank(6 * np.tanh(0.4 * u), [0.0, 0.5, 1.5, 3.0], [1.0, 0.6, 0.4, 0.3])
    fit = gpi.fit_hysteresis(u, v)
    assert fit.rms < 5e-3 * np.ptp(v)
    assert np.all(np.diff(fit.history) <= 0)
    assert fit.history[-1] == pytest.approx(fit.rms, rel=1e-3)


def test_weights_are_not_negative():
    """A play of negative weight is outside the class; the best inside it is offered."""
    u = excitation()
    v, _ = oracle.play_bank(u, [0.0, 1.0], [2.0, -0.3])
    fit = gpi.fit_hysteresis(u, v, half_widths=[0.0, 1.0], thresholds=0)
    assert np.all(fit.gpi.plays.weights >= 0)
    gain = np.sum((u - u.mean()) * (v - v.mean())) / np.sum((u - u.mean()) ** 2)
    assert weights_on(np.array([0.0, 1.0]), fit.gpi) == pytest.approx([gain, 0], abs=1e-6)


UNITS = [(1.0, 1e-6), (1.0, 1e-9), (1e3, 1.0), (1e-3, 1e6)]  # V and m, V and nm in m, mV, kV and um in pm


@pytest.mark.parametrize(("unit_u", "unit_v"), UNITS)
def test_units_do_not_matter(unit_u, unit_v):
    u = excitation()
    v, _ = oracle.gpi(u, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    fit = gpi.fit_hysteresis(
        unit_u * u, unit_v * v, half_widths=unit_u * HALF_WIDTHS, thresholds=unit_u * THRESHOLDS
    )
    assert fit.rms < 1e-6 * unit_v
    assert fit.gpi.plays.weights == pytest.approx(WEIGHTS * unit_v / unit_u, rel=1e-6)
    assert fit.gpi.envelope.weights == pytest.approx(SLOPES, rel=1e-6)


def test_progress_is_reported_and_can_stop_the_fit():
    u = excitation(1000)
    v, _ = oracle.gpi(u, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    seen = []
    gpi.fit_hysteresis(u, v, progress=seen.append)
    assert {now.stage for now in seen} == {"hysteresis", "done"}
    assert all(0 <= now.done <= 1 for now in seen) and seen[-1].done == 1.0

    def stop(now):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gpi.fit_hysteresis(u, v, progress=stop)


def fit_with(**options):
    u = excitation(500)
    return gpi.fit_hysteresis(u, 2 * u, **options)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: fit_with(half_widths=[0.0, -1.0]), gpi.ParameterError, ["half_widths", "-1"]),
        (lambda: fit_with(half_widths=[np.nan]), gpi.ParameterError, ["half_widths"]),
        (lambda: fit_with(half_widths=0), gpi.ParameterError, ["half_widths", "0"]),
        (lambda: fit_with(thresholds=[np.inf]), gpi.ParameterError, ["thresholds"]),
        (lambda: fit_with(half_widths=400, thresholds=0), gpi.DataError, ["500", "400"]),
        (lambda: gpi.fit_hysteresis(np.ones(50), np.ones(50)), gpi.DataError, ["`u`", "constant"]),
        (lambda: gpi.fit_hysteresis(excitation(50), np.ones(49)), gpi.DataError, ["50", "49"]),
        (lambda: gpi.fit_hysteresis(excitation(50), np.full(50, np.nan)), gpi.DataError, ["`v`", "row 0"]),
    ],
)
def test_fit_refuses(call, error, words):
    with pytest.raises(error) as caught:
        call()
    for word in words:
        assert word in str(caught.value)


# --- the whole chain -----------------------------------------------------------------------------

RATE = 2000.0


def resonance(frequency, damping, delay, gain=1.0):
    """A mode of `frequency` in Hz, held between samples, with a delay in samples."""
    w = 2 * np.pi * frequency
    a = np.array([[0.0, 1.0], [-w * w, -2 * damping * w]])
    continuous = a, np.array([[0.0], [w]]), np.array([[gain * w, 0.0]]), np.zeros((1, 1))
    numerator, denominator = oracle.to_transfer_function(*oracle.zero_order_hold(*continuous, 1 / RATE))
    return oracle.from_transfer_function(numerator[0, 0], np.r_[denominator, np.zeros(delay)])


PLANT = resonance(150.0, 0.15, 2)


def drive(samples, seed, channels=1, band=0.15, amplitude=4.0):
    """A random signal below `band` of the sampling rate, from rest."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.normal(size=(samples, channels)), axis=0)
    lines = np.fft.rfftfreq(samples)
    spectrum[lines > band] = 0
    # more amplitude where it is slow, as a drive of loops has
    spectrum /= np.sqrt(1 + (lines / 0.02) ** 2)[:, None]
    u = np.fft.irfft(spectrum, samples, axis=0)
    u *= np.clip((np.arange(samples) - 20) / 100, 0, 1)[:, None]
    return amplitude * u / np.max(np.abs(u), axis=0)


def respond(u, system=PLANT, offset=0.0):
    v = np.stack([oracle.gpi(column, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)[0] for column in u.T], axis=1)
    return oracle.simulate(*system, v)[0] + offset


NOISE = 1e-3


def measured(seed, samples=6000):
    u = drive(samples, seed)
    y = respond(u, offset=5.0)
    return u, y, y + NOISE * np.ptp(y) * np.random.default_rng(seed + 1000).normal(size=y.shape)


@pytest.fixture(scope="module")
def model():
    u, _, noisy = measured(1)
    record = gpi.Record(
        u, noisy, RATE, input_names=["drive"], output_names=["x"], input_units=["V"], output_units=["um"]
    )
    return gpi.identify(record)


@pytest.mark.slow
def test_identified_model_predicts_another_record(model):
    u, truth, noisy = measured(2)
    error = oracle.errors(truth, model.simulate(u))
    linear = gpi.era(gpi.fir(*measured(1)[::2], 60).markov)
    floor = oracle.errors(noisy, truth)["nrmse"]
    assert floor == pytest.approx(NOISE, rel=0.1)
    assert error["nrmse"] < NOISE
    assert oracle.errors(truth, 5 + linear.simulate(u))["nrmse"] > 50 * NOISE


@pytest.mark.slow
def test_identified_parts_are_the_plants(model):
    w = np.linspace(0.01, 0.15 * 2 * np.pi, 40)
    expected = oracle.frequency_response(*PLANT, w)[:, 0, 0] / oracle.dc_gain(*PLANT)[0, 0]
    found = model.linear.frequency_response(w)[:, 0, 0]
    assert np.linalg.norm(found - expected) / np.linalg.norm(expected) < 0.01
    assert model.linear.dc_gain[0, 0] == pytest.approx(1, abs=1e-9)
    assert model.linear.spectral_radius < 1
    u, _, _ = measured(2)
    v = model.intermediate(u)[:, 0]
    true_v, _ = oracle.gpi(u[:, 0], THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    scaled = true_v * oracle.dc_gain(*PLANT)[0, 0]
    assert oracle.errors(scaled - scaled.mean(), v - v.mean())["nrmse"] < NOISE


@pytest.mark.slow
def test_model_is_what_its_parts_say(model):
    """simulate = hysteresis, then G from its equilibrium, then offsets."""
    u, _, _ = measured(2)
    u = u[500:900]
    op = model.hysteresis[0]
    v = op(u[:, 0])
    np.testing.assert_allclose(model.intermediate(u)[:, 0], v, rtol=0, atol=1e-12 * np.ptp(v))
    system = model.linear.A, model.linear.B, model.linear.C, model.linear.D
    still = np.linalg.solve(np.eye(model.linear.order) - system[0], system[1] @ v[:1])
    y = oracle.simulate(*system, v[:, None], still)[0] + model.offsets
    np.testing.assert_allclose(model.simulate(u), y, rtol=0, atol=1e-10 * np.ptp(y))


@pytest.mark.slow
def test_model_errors_are_those_of_the_definitions(model):
    u, _, noisy = measured(2, 2000)
    record = gpi.Record([u, u[:900]], [noisy, noisy[:900]], RATE, warmup=[200, 0])
    residual = model.residual(record)
    for part, experiment, y in zip(residual, record.u, record.y, strict=True):
        np.testing.assert_allclose(part, y - model.simulate(experiment), rtol=0, atol=1e-12)
    scored = [slice(200, None), slice(None)]
    y = np.concatenate([y[rows] for y, rows in zip(record.y, scored, strict=True)])
    e = [part[rows] for part, rows in zip(residual, scored, strict=True)]
    expected = oracle.errors(y, y - np.concatenate(e))
    assert model.error(record) == pytest.approx(expected, rel=1e-9)
    expected = oracle.errors(y, y - np.concatenate([part - part.mean() for part in e]))
    assert model.error(record, remove_mean=True) == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_model_names_and_origin(model):
    assert (model.rate, model.input_names, model.output_names) == (RATE, ["drive"], ["x"])
    assert (model.input_units, model.output_units) == (["V"], ["um"])
    origin = model.identification
    assert origin.delay is None
    assert origin.supported_taps is None or origin.supported_taps > 30
    assert len(origin.singular_values) > model.linear.order
    assert origin.fir.markov.shape[2] in [entry["taps"] for entry in origin.rounds]
    (chosen,) = [entry for entry in origin.candidates if entry["chosen"]]
    allowed = [entry for entry in origin.candidates if entry["criterion"] is not None]
    best = min(allowed, key=lambda entry: entry["criterion"])
    assert (chosen["plays"], chosen["deadzones"]) == (best["plays"], best["deadzones"])
    assert chosen["rms"] == pytest.approx(best_rms(model), rel=0.02)
    assert chosen["rms"] < min(entry["rms"] for entry in origin.rounds), "refined together"
    assert chosen["order"] + chosen["delay"] == model.linear.order
    assert all(word in repr(model) for word in ["drive [V]", "x [um]", f"order {model.linear.order}"])
    assert gpi.Model.from_json(model.to_json()).identification is None


def best_rms(model):
    u, _, noisy = measured(1)
    return model.error(gpi.Record(u, noisy, RATE))["rms"]


@pytest.mark.slow
def test_model_restarts_from_a_saved_state(model):
    u, _, _ = measured(2, 1500)
    whole = model.simulate(u)
    state = model.start(u[0])
    first, middle = model.run(u[:700], state)
    saved = np.array(json.loads(json.dumps(middle.tolist())))
    second, last = model.run(u[700:], saved)
    scale = np.ptp(whole)
    np.testing.assert_allclose(np.concatenate([first, second]), whole, rtol=0, atol=1e-12 * scale)
    all_at_once, final = model.run(u, state)
    np.testing.assert_allclose(all_at_once, whole, rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(last, final, rtol=0, atol=1e-12 * (1 + np.max(np.abs(final))))
    with pytest.raises(gpi.GpiError, match="state"):
        model.run(u, state[:-1])


@pytest.mark.slow
def test_model_stands_still_where_it_starts(model):
    y = model.simulate(np.full(50, 2.5))
    np.testing.assert_allclose(y, y[0], rtol=0, atol=1e-9)


@pytest.mark.slow
def test_json_round_trip_is_exact(model):
    again = gpi.Model.from_json(model.to_json())
    u, _, _ = measured(2, 1500)
    np.testing.assert_array_equal(again.simulate(u), model.simulate(u))
    assert again.to_json() == model.to_json()
    assert (again.rate, again.input_names, again.output_units) == (RATE, ["drive"], ["um"])
    assert json.loads(model.to_json())["schema"] == "gpi-model/1"


@pytest.mark.slow
def test_model_files_are_the_json(model, tmp_path):
    path = tmp_path / "model.json"
    model.save(path)
    assert path.read_text(encoding="utf-8").strip() == model.to_json().strip()
    u, _, _ = measured(2, 1500)
    np.testing.assert_array_equal(gpi.load(path).simulate(u), model.simulate(u))
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.json"]


@pytest.mark.slow
def test_other_schemas_and_broken_files_are_refused(model):
    text = model.to_json()
    for broken, words in [
        (text.replace("gpi-model/1", "gpi-model/2"), ["gpi-model/2", "gpi-model/1"]),
        (text.replace('"schema"', '"scheme"'), ["schema"]),
        (text[: len(text) // 2], ["not a model"]),
        ("", ["not a model"]),
        ("[1, 2]", ["schema"]),
    ]:
        with pytest.raises(gpi.DataError) as caught:
            gpi.Model.from_json(broken)
        for word in words:
            assert word in str(caught.value)


@pytest.mark.slow
def test_model_file_with_impossible_parameters_is_refused(model):
    content = json.loads(model.to_json())
    text = json.dumps(content)
    weights = content["hysteresis"][0]["plays"]["weights"]
    short = json.loads(text)
    short["hysteresis"][0]["plays"]["weights"] = weights[:-1]
    negative = json.loads(text)
    negative["hysteresis"][0]["plays"]["half_widths"][-1] = -1.0
    stopped = json.loads(text)
    stopped["rate"] = 0.0
    for broken, word in [(short, "weights"), (negative, "half_widths"), (stopped, "rate")]:
        with pytest.raises(gpi.GpiError, match=word):
            gpi.Model.from_json(json.dumps(broken))


# --- a record of one sine ------------------------------------------------------------------------

SINE = 4 * np.sin(2 * np.pi * np.arange(4000) / 500)


@pytest.fixture(scope="module")
def sine_record():
    v, _ = oracle.gpi(SINE, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    y = np.concatenate([np.zeros(3), v[:-3]])
    return gpi.Record(SINE, y + 1e-3 * np.random.default_rng(9).normal(size=len(y)), 500.0)


def test_one_sine_supports_a_gain_and_a_delay(sine_record):
    model = gpi.identify(sine_record)
    origin = model.identification
    assert origin.delay == 3
    assert origin.supported_taps == 2
    assert origin.fir is None
    np.testing.assert_array_equal(model.linear.markov(6)[0, 0], [0, 0, 0, 1, 0, 0])
    assert any("delay of 3" in note for note in origin.notes)
    (begin,) = origin.warmups
    assert 250 <= begin <= 400, "half a period to three quarters, until the widest play has turned"
    scored = gpi.Record(sine_record.u, sine_record.y, 500.0, warmup=begin)
    assert model.error(scored)["nrmse"] < 1e-3
    smaller = np.linspace(1, 0.2, 4000) * SINE
    truth, _ = oracle.gpi(smaller, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    gain = np.dot(smaller, truth) / np.dot(smaller, smaller)
    assert oracle.errors(truth, gain * smaller)["nrmse"] > 0.04
    assert oracle.errors(truth[:-3], model.simulate(smaller)[3:])["nrmse"] < 0.015


@pytest.mark.parametrize(
    ("unit_u", "unit_y"), [UNITS[0], *(pytest.param(*units, marks=pytest.mark.slow) for units in UNITS[1:])]
)
def test_units_do_not_move_the_delay(unit_u, unit_y):
    v, _ = oracle.gpi(SINE, THRESHOLDS, SLOPES, HALF_WIDTHS, WEIGHTS)
    y = np.concatenate([np.zeros(3), v[:-3]])
    model = gpi.identify(gpi.Record(unit_u * SINE, unit_y * y, 500.0))
    assert model.identification.delay == 3


def test_a_given_delay_is_kept(sine_record):
    model = gpi.identify(sine_record, delay=1)
    assert model.identification.delay == 1
    assert model.error(sine_record)["rms"] > 2 * gpi.identify(sine_record).error(sine_record)["rms"]


def test_more_taps_than_one_sine_excites_are_refused(sine_record):
    with pytest.raises(gpi.DataError) as caught:
        gpi.identify(sine_record, taps=31)
    for word in ["31", "2 taps"]:
        assert word in str(caught.value)


def test_an_order_is_refused_where_only_a_delay_is_excited(sine_record):
    with pytest.raises(gpi.ParameterError, match="`order`"):
        gpi.identify(sine_record, order=3)


# --- several channels ----------------------------------------------------------------------------


@pytest.mark.slow
def test_two_inputs_and_two_outputs():
    first, second = resonance(150.0, 0.2, 1), resonance(210.0, 0.2, 1, gain=0.8)
    n, m = len(first[0]), len(second[0])
    a = np.block([[first[0], np.zeros((n, m))], [np.zeros((m, n)), second[0]]])
    b = np.block([[first[1], np.zeros((n, 1))], [np.zeros((m, 1)), second[1]]])
    c = np.block([[first[2], 0.1 * second[2]], [-0.15 * first[2], second[2]]])
    system = a, b, c, np.zeros((2, 2))
    runs = [drive(3000, seed, channels=2) for seed in (11, 12)]
    outputs = [respond(u, system, [3.0, -1.0]) for u in runs]
    rng = np.random.default_rng(13)
    noisy = [y + NOISE * np.ptp(y, axis=0) * rng.normal(size=y.shape) for y in outputs]
    model = gpi.identify(gpi.Record(runs, noisy, RATE), taps=40, half_widths=12, thresholds=5)
    assert len(model.hysteresis) == 2
    held_out = drive(3000, 14, channels=2)
    truth = respond(held_out, system, [3.0, -1.0])
    predicted = model.simulate(held_out)
    assert predicted.shape == (3000, 2)
    for output in range(2):
        assert oracle.errors(truth[:, output], predicted[:, output])["nrmse"] < 2 * NOISE


@pytest.mark.parametrize("seed", range(6))
def test_an_output_that_ignores_its_input_is_no_error(seed):
    rng = np.random.default_rng(seed)
    record = gpi.Record(rng.standard_normal(1500), rng.standard_normal(1500), rate=1.0)
    model = gpi.identify(record)
    assert -5.0 < model.error(record)["fit_percent"] < 40.0
