"""Joint refinement, its derivatives and what it says about its own accuracy, against the oracle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gpi_hammerstein as gpi
import oracle
from records import RATE, model_of

# --- plants and records --------------------------------------------------------------------------


def sections_of(poles, rng, inputs, outputs):
    """Sections two poles at a time; the first output sees the first state alone."""
    sections = []
    for group in poles:
        order = len(group)
        c = rng.uniform(-1, 1, (outputs, order))
        c[0] = np.eye(order)[0]
        b = rng.uniform(0.2, 0.6, (order, inputs)) * rng.choice([-1, 1], (order, inputs))
        sections.append(oracle.Section(np.real(np.poly(group))[1:], b, c))
    return sections


def complex_pair(radius, angle):
    pole = radius * np.exp(1j * angle)
    return [pole, pole.conjugate()]


POLES = {
    "real": [[0.6]],
    "two real": [[0.8, -0.3]],
    "complex": [complex_pair(0.85, 0.5)],
    "complex and real": [complex_pair(0.8, 1.1), [0.55]],
    "two complex": [complex_pair(0.85, 0.4), complex_pair(0.6, 1.9)],
    "complex and two real": [complex_pair(0.8, 0.9), [0.7, 0.1]],
}


def plant_of(poles, seed=0, channels=1, delay=0, reading="one-sided", start=None):
    """A plant with three plays and two deadzones on every input, of the given poles."""
    rng = np.random.default_rng(seed)
    hysteresis = [
        oracle.Hysteresis(
            thresholds=np.array([-1.0, 0.0, 1.2]) * (1 + 0.2 * i),
            deadzone_weights=np.array([0.3, 1.0, -0.25]) * rng.uniform(0.8, 1.2, 3),
            half_widths=np.array([0.0, 0.5, 1.3]) * (1 + 0.1 * i),
            weights=np.array([1.0, 0.6, 0.4]) * rng.uniform(0.8, 1.2, 3),
            reading=reading,
        )
        for i in range(channels)
    ]
    gains = [[1.0, -0.4], [0.3, -1.0]]
    plant = oracle.Plant(
        hysteresis=hysteresis,
        sections=sections_of(POLES[poles], rng, channels, channels),
        feedthrough=np.zeros((channels, channels)),
        held=[(i, gains[i][i]) for i in range(channels)],
        delay=delay,
        offsets=[rng.uniform(-2, 2, (1, channels))],
        starts=[start],
        inputs=["u"] if channels == 1 else ["u1", "u2"],
        outputs=["y"] if channels == 1 else ["y1", "y2"],
    )
    others = ~np.eye(channels, dtype=bool)
    dc = oracle.dc_gain(*plant.state_space())
    plant.feedthrough[others] += (np.array(gains)[:channels, :channels] - dc)[others]
    return plant


def wander(samples, channels=1, seed=0, quiet=10, amplitude=4.0):
    """Slow and fast swings of all sizes; the first samples stand at zero."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples)[:, None, None]
    tones = np.array([0.013, 0.031, 0.067, 0.17, 0.41, 1.1])
    sizes = np.array([1.0, 0.8, 0.6, 0.35, 0.2, 0.12])
    phases = rng.uniform(0, 2 * np.pi, (1, channels, len(tones)))
    detuned = tones * rng.uniform(0.9, 1.1, (1, channels, len(tones)))
    u = (sizes * np.sin(detuned * t + phases)).sum(axis=2)
    u = amplitude * u / np.abs(u).max()
    u[:quiet] = 0.0
    return u


def record_of(us, ys, plant, warmup=0):
    names = {"input_names": plant.inputs, "output_names": plant.outputs}
    return gpi.Record(us, ys, rate=RATE, warmup=[warmup] * len(us), **names)


# --- derivatives ---------------------------------------------------------------------------------


def assumed(model, found, plant, experiments):
    """The plant that the parameters of a refinement describe: what they do not name is held."""
    names = dict(zip(found["names"], found["values"], strict=True))
    knots = 1 + max(
        [int(n[:-1].split("[")[-1]) for n in names if n.startswith("offset") and n[-1] == "]"] + [0]
    )
    dc = oracle.dc_gain(*plant.state_space())
    held = []
    for i, u in enumerate(plant.inputs):
        (row,) = [j for j, y in enumerate(plant.outputs) if f"feedthrough[{y}, {u}]" not in names]
        held.append((row, dc[row, i]))
    sections = []
    for number in range(sum(name.startswith("section") and name.endswith(".a1") for name in names)):
        order = sum(name.startswith(f"section[{number}].a") for name in names)
        c = np.tile(np.eye(order)[0], (len(plant.outputs), 1))
        sections.append(oracle.Section(np.zeros(order), np.zeros((order, len(plant.inputs))), c))
    order = sum(len(section.a) for section in sections)
    starts = []
    for e in range(experiments):
        sides = [np.zeros(len(h.weights)) for h in plant.hysteresis]
        known = not any(name.startswith(f"start[{e}].{plant.inputs[0]}") for name in names)
        begun = any(name.startswith(f"start[{e}].state") for name in names)
        starts.append(oracle.Start(None if known else sides, np.zeros(order)) if begun or not known else None)
    described = oracle.Plant(
        hysteresis=plant.hysteresis,
        sections=sections,
        feedthrough=np.zeros_like(dc),
        held=held,
        delay=plant.delay,
        offsets=[np.zeros((knots, len(plant.outputs))) for _ in range(experiments)],
        starts=starts,
        inputs=plant.inputs,
        outputs=plant.outputs,
    )
    return described.with_values(names)


@settings(max_examples=14, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    poles=st.sampled_from(sorted(POLES)),
    channels=st.sampled_from([1, 2]),
    reading=st.sampled_from(["one-sided", "directional"]),
    begins=st.sampled_from(["at rest", "in motion", "after a warm-up"]),
    delay=st.integers(0, 3),
    offset_knots=st.sampled_from([1, 4]),
    free=st.booleans(),
)
def test_derivatives_are_those_of_the_oracle(
    seed, poles, channels, reading, begins, delay, offset_knots, free
):
    plant = plant_of(poles, seed, channels, delay, reading)
    rng = np.random.default_rng(seed)
    plant.offsets, plant.starts = 2 * plant.offsets, 2 * plant.starts
    us = [wander(n, channels, seed + n, quiet=10 if begins == "at rest" else 0) for n in (300, 360)]
    ys = [plant.simulate(u) + 0.1 * rng.normal(size=u.shape) for u in us]
    record = record_of(us, ys, plant, warmup=40 if begins == "after a warm-up" else 0)
    model = model_of(plant)
    found = gpi.sensitivities(model, record, thresholds=free, half_widths=free, offset_knots=offset_knots)
    described = assumed(model, found, plant, len(us))
    names = found["names"]
    if free:
        assert {f"{u}.half_widths[1]" for u in plant.inputs} <= set(names)
        assert {f"{u}.thresholds[0]" for u in plant.inputs} <= set(names)
    jacobians = found["jacobians"]
    scored = [jacobian.shape[1] for jacobian in jacobians]
    errors = [
        (y - described.simulate(u, e, len(u) - rows))[len(y) - rows :]
        for e, (u, y, rows) in enumerate(zip(us, ys, scored, strict=True))
    ]
    assert found["cost"] == pytest.approx(sum(np.sum(e**2) for e in errors), rel=1e-9)
    for column, name in enumerate(names):
        step = 1e-6 * max(1.0, abs(described.value(name)))
        above, below = (
            described.with_values({name: described.value(name) + sign * step}) for sign in (1, -1)
        )
        for e, (u, rows) in enumerate(zip(us, scored, strict=True)):
            first = len(u) - rows
            here = described.simulate(u, e, first)
            up, down = above.simulate(u, e, first) - here, here - below.simulate(u, e, first)
            difference = ((up + down) / (2 * step))[first:].T
            derivative = jacobians[e][:, :, column]
            tolerance = 1e-5 * max(1.0, np.abs(difference).max())
            # there is no derivative where a play turns within the step; it may keep its other place for long
            bends = (np.abs(up - down) / (2 * step))[first:].T > tolerance
            differs = (np.abs(derivative - difference) > tolerance) & ~bends
            assert np.mean(differs) <= 0.01 and np.mean(bends) < 0.5, (name, e)
    stacked = np.concatenate([j.reshape(-1, len(names)) for j in jacobians])
    error = np.concatenate([e.T.ravel() for e in errors])
    scale = np.sqrt(np.sum(stacked**2, axis=0))
    scale[scale == 0] = 1.0
    np.testing.assert_allclose(
        found["hessian"] / np.outer(scale, scale), (stacked / scale).T @ (stacked / scale), atol=1e-10
    )
    gradient = -(stacked / scale).T @ error
    np.testing.assert_allclose(found["gradient"] / scale, gradient, rtol=0, atol=1e-7 * np.linalg.norm(error))


# --- recovery ------------------------------------------------------------------------------------


def described_by(plant, record, **options):
    """The plant in the parameters that a refinement estimates, and these by name."""
    found = gpi.sensitivities(model_of(plant), record, **options)
    names = dict(zip(found["names"], found["values"], strict=True))
    return assumed(model_of(plant), found, plant, len(record.u)), names


FACTORS = {
    ".weights": (1.2, 0.8),
    "deadzone_weights": (0.85, 1.1),
    "thresholds": (1.04, 0.97),
    "half_widths": (0.94, 1.05),
    ".a": (0.98, 0.97),
    ".b": (1.15, 0.9),
    ".c": (1.1, 0.9),
}


def perturbed(plant, names):
    """A model whose weights are off by up to 20 % and whose poles by some percent."""
    values = {}
    for number, (name, value) in enumerate(names.items()):
        factors = [pair for part, pair in FACTORS.items() if part in name]
        values[name] = value * factors[0][number % 2] if factors else value
    return model_of(plant.with_values(values))


def values_of(refined):
    return {p["name"]: p["value"] for p in refined.refinement.parameters}


def require_lawful(refined):
    """What holds for every result, whatever the data."""
    how = refined.refinement
    assert how.status in ("converged", "stalled", "limit")
    assert np.all(np.diff(how.history) <= 1e-14 * how.history[0])
    assert all(np.all(operator.plays.weights >= 0) for operator in refined.hysteresis)
    assert refined.linear.spectral_radius < 1
    assert np.abs(how.poles()[0]).max(initial=0) < 1
    count = len(how.parameters)
    assert how.covariance.shape == (count, count)
    variances = np.diag(how.covariance)
    np.testing.assert_allclose(
        [p["std"] ** 2 for p in how.parameters if p["std"] is not None],
        [v for p, v in zip(how.parameters, variances, strict=True) if p["std"] is not None],
        rtol=1e-9,
    )


def require_recovered(plant, us, warmup=0, **free):
    ys = [plant.simulate(u, e) for e, u in enumerate(us)]
    record = record_of(us, ys, plant, warmup)
    described, names = described_by(plant, record, **free)
    refined = gpi.refine(perturbed(described, names), record, **free)
    require_lawful(refined)
    found = values_of(refined)
    assert set(found) == set(names)
    # which section comes first is not part of the contract, so G is compared by its response
    known = [name for name in names if not name.startswith(("start", "section", "feedthrough", "offset"))]
    wrong = {name: (found[name], names[name]) for name in known if abs(found[name] - names[name]) > 1e-6}
    assert not wrong
    for e, knots in enumerate(plant.offsets):
        offset = [found[f"offset[{e}].{output}"] for output in plant.outputs]
        np.testing.assert_allclose(offset, knots[0], rtol=0, atol=1e-6)
    markov = oracle.markov(*plant.delayed_state_space(), 60)
    np.testing.assert_allclose(refined.linear.markov(60), markov, rtol=0, atol=1e-6)
    poles = np.sort_complex(refined.refinement.poles()[0])
    np.testing.assert_allclose(
        poles, np.sort_complex(oracle.poles(plant.state_space()[0])), rtol=0, atol=1e-5
    )
    assert np.all(refined.refinement.residual_rms < 1e-6)
    return refined


@pytest.mark.parametrize("reading", ["one-sided", "directional"])
@pytest.mark.parametrize("poles", sorted(POLES))
def test_a_perturbed_model_is_recovered(poles, reading):
    plant = plant_of(poles, delay=2, reading=reading)
    require_recovered(plant, [wander(2000)])


def test_two_experiments_are_one_record():
    plant = plant_of("complex", seed=3)
    plant.offsets, plant.starts = [plant.offsets[0], plant.offsets[0] + 0.7], [None, None]
    require_recovered(plant, [wander(900, seed=1), wander(1300, seed=2, amplitude=3.0)])


@pytest.mark.parametrize("poles", ["complex", "complex and two real"])
def test_two_channels_are_recovered(poles):
    require_recovered(plant_of(poles, seed=5, channels=2, delay=1), [wander(3000, 2)])


def test_thresholds_and_half_widths_are_recovered():
    plant = plant_of("complex", seed=7)
    require_recovered(plant, [wander(4000, seed=4)], thresholds=True, half_widths=True)


@pytest.mark.parametrize("poles", ["complex", "complex and real"])
def test_a_start_in_motion_is_recovered(poles):
    """The second experiment is cut out of a longer run and wider plays than its swings remember it."""
    plant = plant_of(poles, seed=2)
    plant.hysteresis[0].half_widths[2] = 3.2
    long = wander(3000, seed=6)
    cut = 1500
    v = plant.intermediate(long)
    a, b, c, d = plant.state_space()
    _, state = oracle.simulate(a, b, c, d, v[:cut], np.linalg.solve(np.eye(len(a)) - a, b @ v[0]))
    channel = plant.hysteresis[0]
    z = oracle.deadzones(long[:, 0], channel.thresholds, channel.deadzone_weights)
    before = oracle.plays(z, channel.half_widths)[cut - 1]
    sides = np.zeros(3)
    sides[1:] = np.clip((before - z[cut])[1:] / channel.half_widths[1:], -1, 1)
    state = state - np.linalg.solve(np.eye(len(a)) - a, b @ v[cut])
    plant.offsets = 2 * plant.offsets
    plant.starts = [None, oracle.Start([sides], state)]
    whole = plant.simulate(long)
    us = [wander(1500, seed=8), long[cut:]]
    np.testing.assert_allclose(plant.simulate(us[1], 1), whole[cut:], atol=1e-9)
    refined = require_recovered(plant, us)
    found = values_of(refined)
    assert [found[f"start[1].u[{i}]"] for i in (1, 2)] == pytest.approx(sides[1:], abs=1e-5)


def test_dynamics_that_remember_longer_than_the_plays_are_recovered_from_a_start_in_motion():
    """The plays forget their past within a few samples, G does not."""
    plant = plant_of("two real", seed=9)
    plant.hysteresis[0].half_widths[1:] = [0.1, 0.2]
    plant.sections[0].a[:] = np.poly([0.9, 0.3])[1:]
    u = wander(4000, seed=10, quiet=0)
    cut = 1000
    record = record_of([u[cut:]], [plant.simulate(u)[cut:]], plant)
    refined = gpi.refine(model_of(plant), record)
    require_lawful(refined)
    assert refined.refinement.residual_rms[0] < 1e-6
    operator = refined.hysteresis[0]
    np.testing.assert_allclose(operator.plays.weights, plant.hysteresis[0].weights, rtol=0, atol=1e-6)
    expected = oracle.poles(plant.state_space()[0])
    np.testing.assert_allclose(np.sort(refined.refinement.poles()[0].real), np.sort(expected), atol=1e-6)


@pytest.mark.parametrize("poles", ["real", "complex", "complex and two real"])
def test_a_strictly_proper_system_keeps_its_order(poles):
    """Without feedthrough the first response comes a sample late, and that is no chain of states."""
    plant = plant_of(poles, seed=11)
    _, _, _, feedthrough = plant.state_space()
    for section in plant.sections:
        section.b /= 1 - feedthrough[0, 0]
    assert plant.state_space()[3][0, 0] == pytest.approx(0, abs=1e-12)
    u = wander(2000, seed=12)
    record = record_of([u], [plant.simulate(u)], plant)
    refined = gpi.refine(model_of(plant), record)
    require_lawful(refined)
    count = sum(len(section.a) for section in plant.sections)
    assert len(refined.refinement.poles()[0]) == count
    assert refined.refinement.residual_rms[0] < 1e-6


# --- outliers and drift --------------------------------------------------------------------------


def noisy(plant, u, seed=0, level=0.01):
    y = plant.simulate(u)
    sigma = level * y.std()
    return y + sigma * np.random.default_rng(seed).normal(size=y.shape), sigma


def deviations_from(refined, names):
    """Errors in units of their standard deviations, and those of the play weights in percent."""
    rows = [p for p in refined.refinement.parameters if p["name"] in names]
    errors = np.array([p["value"] - names[p["name"]] for p in rows])
    weights = [e / p["value"] for e, p in zip(errors, rows, strict=True) if ".weights" in p["name"]]
    return errors / np.array([p["std"] for p in rows]), 100 * np.abs(weights)


def test_the_band_around_a_loop_is_that_of_all_parameters():
    plant, u = plant_of("complex", seed=7), wander(4000, seed=4)
    free = {"thresholds": True, "half_widths": True}
    record = record_of([u], [noisy(plant, u)[0]], plant)
    described, names = described_by(plant, record, **free)
    refined = gpi.refine(perturbed(described, names), record, **free)
    found = values_of(refined)
    loop = 3.5 * np.sin(np.linspace(0, 3 * np.pi, 151))[:, None]

    def loop_at(name, value):
        return described.with_values(found | {name: value}).intermediate(loop)[:, 0]

    steps = {name: 1e-6 * max(1.0, abs(value)) for name, value in found.items()}
    columns = [(loop_at(n, found[n] + h) - loop_at(n, found[n] - h)) / (2 * h) for n, h in steps.items()]
    jacobian = np.stack(columns, axis=1)
    covariance = refined.refinement.covariance
    expected = np.sqrt(np.einsum("ki,ij,kj->k", jacobian, covariance, jacobian))
    np.testing.assert_allclose(refined.refinement.loop_std(loop)[:, 0], expected, rtol=1e-3, atol=1e-7)


def with_outliers(seed):
    """A plant, a record with and without 1 % of its samples 50 standard deviations off, and how many."""
    plant = plant_of("complex", seed=seed)
    u = wander(4000, seed=1)
    clean, sigma = noisy(plant, u)
    rng = np.random.default_rng(seed)
    places = rng.choice(len(u), len(u) // 100, replace=False)
    y = clean.copy()
    y[places, 0] += 50 * sigma * rng.choice([-1, 1], len(places))
    return plant, record_of([u], [y], plant), record_of([u], [clean], plant), len(places)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_outliers_are_found_and_cost_little(seed):
    plant, record, clean, count = with_outliers(seed)
    described, names = described_by(plant, record)
    start = perturbed(described, names)
    found = gpi.refine(start, record)
    squares = gpi.refine(start, record, robust=False)
    assert found.refinement.robust and found.refinement.outliers == pytest.approx(count, rel=0.1)
    assert not squares.refinement.robust and squares.refinement.outliers > 0
    assert np.abs(deviations_from(found, names)[0]).max() < 4
    truth = np.array(list(names.values()))
    errors = [np.array([values_of(model)[name] for name in names]) - truth for model in (found, squares)]
    deviations = np.array([p["std"] for p in found.refinement.parameters])
    sizes = [np.sqrt(np.mean((error / deviations) ** 2)) for error in errors]
    assert sizes[1] > 3 * sizes[0]
    without = gpi.refine(start, clean)
    assert without.refinement.outliers == 0 and not without.refinement.robust


@pytest.mark.parametrize("robust", [True, False])
def test_every_accepted_step_lowers_the_history(robust):
    for seed in range(4):
        plant, record, _, _ = with_outliers(seed)
        described, names = described_by(plant, record)
        require_lawful(gpi.refine(perturbed(described, names), record, robust=robust))


def test_a_slow_drift_does_not_become_hysteresis():
    plant = plant_of("complex", seed=4)
    u = wander(6000, seed=3)
    y, _ = noisy(plant, u)
    drift = 0.02 * np.ptp(y) * np.sin(np.linspace(0.3, 4.0, len(u)))[:, None]
    record = record_of([u], [y + drift], plant)
    described, names = described_by(plant, record)
    start = perturbed(described, names)
    constant, slow = (gpi.refine(start, record, offset_knots=knots) for knots in (1, 8))
    kept = {name: value for name, value in names.items() if not name.startswith("offset")}
    errors = [deviations_from(model, kept)[1].max() for model in (constant, slow)]
    assert errors[1] < 1 and errors[0] > 5, errors
    # the model keeps the mean
    assert slow.offsets[0] == pytest.approx(plant.offsets[0][0, 0] + drift.mean(), abs=0.05 * np.ptp(y))


# --- noise floor ---------------------------------------------------------------------------------


def floor_of(u, seed):
    plant = plant_of("complex", seed=6)
    y, sigma = noisy(plant, u, seed, level=0.02)
    record = record_of([u], [y], plant)
    floor = gpi.refine(model_of(plant), record).refinement.noise_floor
    assert floor["rms"] == pytest.approx([sigma], rel=0.1)
    return floor


def test_the_noise_of_repeated_periods():
    once = wander(700, seed=5, quiet=0) * np.sin(np.linspace(0, np.pi, 700))[:, None]
    floor = floor_of(np.tile(once, (4, 1)), 1)
    assert floor["how"] == "repeated-periods" and floor["period"] == 700


def test_the_noise_of_rests():
    u = wander(6000, seed=7)
    levels = u[::500]
    for k, level in enumerate(levels):
        u[500 * k + 100 : 500 * (k + 1)] = level
    floor = floor_of(u, 2)
    assert floor["how"] == "rests" and floor["samples"] >= 1500


def test_the_noise_above_the_drive():
    floor = floor_of(wander(5000, seed=8), 3)
    assert floor["how"] == "high-frequency-residual" and set(floor) == {"rms", "how"}


# --- what the data do not say --------------------------------------------------------------------


def test_a_deadzone_that_is_never_reached_is_named():
    plant = plant_of("complex", seed=8)
    u = wander(2000, seed=9, amplitude=2.0)
    plant.hysteresis[0].thresholds[2] = 2.5
    y, _ = noisy(plant, u)
    refined = gpi.refine(model_of(plant), record_of([u], [y], plant))
    rows = {p["name"]: p for p in refined.refinement.parameters}
    named = {name for shares in refined.refinement.undetermined for name, _ in shares}
    assert "u.deadzone_weights[2]" in named
    assert rows["u.deadzone_weights[2]"]["std"] is None
    others = [row["std"] for name, row in rows.items() if name not in named]
    assert others and all(std is not None and std > 0 for std in others)


def test_a_play_that_never_moves_is_named():
    plant = plant_of("complex", seed=8)
    plant.hysteresis[0].half_widths[2] = 5.0
    u = wander(2000, seed=9, amplitude=2.0)
    y, _ = noisy(plant, u)
    refined = gpi.refine(model_of(plant), record_of([u], [y], plant))
    ((share,),) = refined.refinement.undetermined
    assert share[0] == "u.weights[2]" and abs(share[1]) == pytest.approx(1)
    without = [p["name"] for p in refined.refinement.parameters if p["std"] is None]
    assert without == ["u.weights[2]"]


def test_two_inputs_that_move_together_are_named():
    """What one input does, the other one could do as well."""
    plant = plant_of("real", seed=9, channels=2)
    u = np.repeat(wander(2000, seed=10), 2, axis=1)
    for channel in plant.hysteresis:
        channel.half_widths = np.array([0.0, 0.5, 1.3])
        channel.thresholds = np.array([-2.0, 0.0, 2.0])
        channel.deadzone_weights = np.array([0.3, 1.0, -0.25])
    refined = gpi.refine(model_of(plant), record_of([u], [plant.simulate(u)], plant))
    assert refined.refinement.undetermined
    named = {name for shares in refined.refinement.undetermined for name, _ in shares}
    assert any(name.startswith("u1") for name in named) and any(name.startswith("u2") for name in named)
    rows = {p["name"]: p["std"] for p in refined.refinement.parameters}
    largest = {shares[0][0] for shares in refined.refinement.undetermined}
    assert all(rows[name] is None for name in largest)


# --- refusals ------------------------------------------------------------------------------------


def test_another_rate_is_refused():
    plant = plant_of("real")
    u = wander(500)
    record = gpi.Record(u, plant.simulate(u), rate=250.0)
    for call in (gpi.refine, gpi.sensitivities):
        with pytest.raises(gpi.ParameterError, match=r"rate(?s:.)*250(?s:.)*1000"):
            call(model_of(plant), record)


@pytest.mark.parametrize("call", [gpi.refine, gpi.sensitivities])
def test_other_channels_are_refused(call):
    single, double = plant_of("real"), plant_of("real", channels=2)
    u = wander(500, 2)
    y = double.simulate(u)
    with pytest.raises(gpi.DataError, match=r"model.* 1 inputs.*record.* 2"):
        call(model_of(single), gpi.Record(u, y[:, :1], rate=RATE))
    with pytest.raises(gpi.DataError, match=r"model.* 2 outputs.*record.* 1"):
        call(model_of(double), gpi.Record(u, y[:, :1], rate=RATE))


def test_a_constant_input_is_refused():
    plant = plant_of("real")
    u = np.full((500, 1), 2.0)
    y = plant.simulate(wander(500))
    with pytest.raises(gpi.DataError, match="u"):
        gpi.refine(model_of(plant), gpi.Record(u, y, rate=RATE))


def test_fewer_samples_than_parameters_are_refused():
    plant = plant_of("complex")
    u = wander(9, quiet=1)
    with pytest.raises(gpi.DataError, match=r"9.*1[0-9]|1[0-9].*9"):
        gpi.refine(model_of(plant), gpi.Record(u, plant.simulate(u), rate=RATE))
