"""Loops around G, against their equation in plain NumPy."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gpi_hammerstein as gpi
import oracle
from gpi_hammerstein.explanation import in_words, to_dict
from records import RATE, model_of

# One process, so that what they share is made once.
pytestmark = pytest.mark.xdist_group("inner loops")

SAMPLES = 500
NOISE = 2e-3
WIDTHS, WEIGHTS = [0.2, 0.5, 1.1], [0.4, -0.3, 1.0]
SEEN_STATES, SEEN_INPUTS = np.array([0.8, -0.3, 0.5]), np.array([0.2, -0.4])
DRIVES, CUBIC = np.array([0.05, -0.08, 0.04]), np.array([-0.004, 0.002, 0.001])


def plant():
    """Two inputs and two outputs, a resonance and a pole, a play each."""
    pole = 0.9 * np.exp(0.4j)
    resonance = oracle.Section(
        a=np.real(np.poly([pole, pole.conjugate()]))[1:],
        b=np.array([[0.3, 0.1], [0.1, -0.2]]),
        c=np.array([[1.0, 0.0], [0.3, 0.4]]),
    )
    lag = oracle.Section(a=np.array([-0.5]), b=np.array([[0.2, 0.1]]), c=np.array([[0.2], [1.0]]))

    def play():
        return oracle.Hysteresis(
            thresholds=np.zeros(1),
            deadzone_weights=np.ones(1),
            half_widths=np.array([0.0, 0.4]),
            weights=np.array([1.0, 0.5]),
        )

    return oracle.Plant(
        hysteresis=[play(), play()],
        sections=[resonance, lag],
        feedthrough=np.zeros((2, 2)),
        held=[(0, 1.0), (1, 1.0)],
        offsets=[np.zeros((1, 2))],
        starts=[None],
        inputs=["u1", "u2"],
        outputs=["y1", "y2"],
    )


def stops_loop(drives=DRIVES, states=SEEN_STATES, inputs=SEEN_INPUTS, widths=WIDTHS, weights=WEIGHTS):
    mixture = {"states": list(states), "inputs": list(inputs)}
    law = {"stops": {"half_widths": list(widths), "weights": list(weights)}}
    return {"sees": {"mixture": mixture}, "law": law, "drives": list(drives)}


def cubic_loop(drives=CUBIC):
    return {"sees": {"output": 1}, "law": {"power": {"exponent": 3, "scale": 1.5}}, "drives": list(drives)}


def wander(samples=SAMPLES, seed=0):
    random = np.random.default_rng(seed)
    t = np.arange(samples)[:, None, None]
    phases = random.uniform(0, 6, (2, 4))
    u = np.sum(np.sin(np.array([0.013, 0.05, 0.17, 0.6]) * t + phases) * [1.5, 1, 0.6, 0.3], axis=2)
    u[:12] = 0.0
    return u


def with_loops(model, *loops, transform=None, delay=0):
    """The model with loops; its states transformed, and behind shift registers."""
    described = json.loads(model.to_json())
    a, b, c, d = plant().state_space()
    loops = [json.loads(json.dumps(loop)) for loop in loops]
    if transform is not None:
        inverse = np.linalg.inv(transform)
        a, b, c = transform @ a @ inverse, transform @ b, c @ inverse
        for loop in loops:
            loop["drives"] = list(transform @ loop["drives"])
            if "mixture" in loop["sees"]:
                loop["sees"]["mixture"]["states"] = list(inverse.T @ loop["sees"]["mixture"]["states"])
    if delay:
        n, m = len(a), 2
        chain = np.eye(m * delay, k=-m)
        late = np.zeros((m, m * delay))
        late[:, -m:] = np.eye(m)
        a = np.block([[chain, np.zeros((m * delay, n))], [b @ late, a]])
        c = np.hstack([d @ late, c])
        b = np.vstack([np.eye(m * delay, m), np.zeros((n, m))])
        d = np.zeros_like(d)
    described["linear"] = {
        name: [np.ravel(value, order="F").tolist(), *value.shape]
        for name, value in zip("abcd", (a, b, c, d), strict=True)
    }
    described["effects"] = [{"name": "stiffness", "loops": loops}]
    return gpi.Model.from_json(json.dumps(described))


def simulated(u, *loops, own=None, delay=0):
    """The same sample by sample."""
    own = own or plant()
    v = own.intermediate(u)
    v = v[np.maximum(np.arange(len(v)) - delay, 0)]
    a, b, c, d = own.state_space()
    x = np.linalg.solve(np.eye(len(a)) - a, b @ v[0])
    places = [np.zeros(3) for _ in loops]
    y = np.zeros((len(u), 2))
    for k in range(len(u)):
        y[k] = c @ x + d @ v[k]
        push = np.zeros(len(a))
        for loop, place in zip(loops, places, strict=True):
            if "output" in loop["sees"]:
                z, (exponent, scale) = y[k, loop["sees"]["output"]], loop["law"]["power"].values()
                w = (z / scale) ** exponent * scale
            else:
                mixture, stops = loop["sees"]["mixture"], loop["law"]["stops"]
                z = np.dot(mixture["states"], x) + np.dot(mixture["inputs"], v[k])
                widths = np.array(stops["half_widths"])
                place[:] = np.maximum(z - widths, np.minimum(z + widths, place))
                w = np.dot(stops["weights"], z - place)
            push += np.array(loop["drives"]) * w
        x = a @ x + b @ v[k] + push
    return y


@pytest.mark.parametrize("delay", [0, 2])
def test_loops_do_what_their_equation_says(delay):
    u, loops = wander(), [stops_loop(), cubic_loop()]
    model = with_loops(model_of(plant()), *loops, delay=delay)
    expected = simulated(u, *loops, delay=delay)
    assert np.abs(expected - simulated(u, delay=delay)).max() > 0.05
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-10)


def test_a_record_in_parts_is_the_whole():
    model, u = with_loops(model_of(plant()), stops_loop(), cubic_loop(), delay=1), wander()
    state, pieces = model.start(u[0]), []
    for piece in (u[:1], u[1:170], u[170:]):
        y, state = model.run(piece, state)
        pieces.append(y)
    np.testing.assert_allclose(np.concatenate(pieces), model.simulate(u), rtol=0, atol=1e-12)


@pytest.mark.parametrize("delay", [0, 2])
def test_loops_follow_their_states_into_other_coordinates(delay):
    u, loops = wander(), [stops_loop(), cubic_loop()]
    transform = np.random.default_rng(1).standard_normal((3, 3))
    model = with_loops(model_of(plant()), *loops, transform=transform, delay=delay)
    expected = simulated(u, *loops, delay=delay)
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-9)
    found = gpi.sensitivities(model, gpi.Record(u, expected, rate=RATE))
    assert found["cost"] < 1e-16 * u.size


def moved_loops(place, step):
    """Both loops with one of their values changed, in the order of the values."""
    values = np.concatenate([DRIVES, SEEN_STATES, SEEN_INPUTS, np.log(WIDTHS), WEIGHTS, CUBIC])
    values[place] += step
    drives, states, inputs, widths, weights, cubic = np.split(values, [3, 6, 8, 11, 14])
    return stops_loop(drives, states, inputs, np.exp(widths), weights), cubic_loop(cubic)


def test_derivatives_go_around_the_loops():
    u, loops = wander(), [stops_loop(), cubic_loop()]
    model = with_loops(model_of(plant()), *loops)
    found = gpi.sensitivities(model, gpi.Record(u, simulated(u, *loops), rate=RATE))
    names, jacobians = list(found["names"]), found["jacobians"][0]
    step, own = 1e-6, plant()

    def compare(label, there, back):
        for output in range(2):
            expected = (there - back)[:, output] / (2 * step)
            error = np.abs(jacobians[output][:, names.index(label)] - expected)
            # a sample at which something turns within the step may differ
            assert np.quantile(error, 0.97) <= 1e-5 * np.abs(expected).max(), (label, output)

    held = {10, 13}  # the widest stop sets both scales
    for place in set(range(17)) - held:
        label = f"stiffness.value[{place}]"
        compare(label, simulated(u, *moved_loops(place, step)), simulated(u, *moved_loops(place, -step)))
    assert not {f"stiffness.value[{place}]" for place in held} & set(names)
    for label in ["u1.weights[1]", "section[0].a1", "section[0].b2[u2]", "section[1].c1[y1]"]:
        value = own.value(label)
        there, back = (
            simulated(u, *loops, own=own.with_values({label: value + sign * step})) for sign in (1, -1)
        )
        compare(label, there, back)


def test_a_refinement_finds_the_loop():
    u, truth = wander(3000), stops_loop()
    record = gpi.Record(u, simulated(u, truth), rate=RATE)
    start = with_loops(model_of(plant()), stops_loop(DRIVES * 0.6, widths=[0.25, 0.6, 1.1]))
    before = start.error(record)["rms"]
    refined = gpi.refine(start, record)
    assert refined.error(record)["rms"] < 1e-4 * before
    stops = json.loads(refined.to_json())["effects"][0]["loops"][0]["law"]["stops"]
    np.testing.assert_allclose(stops["half_widths"], WIDTHS, rtol=1e-3)


@settings(max_examples=20, deadline=None)
@given(gain=st.floats(-1e3, 1e3), seed=st.integers(0, 1000))
def test_stops_keep_a_stable_stage_bounded(gain, seed):
    loop = stops_loop(DRIVES * gain)
    y = with_loops(model_of(plant()), loop).simulate(wander(seed=seed))
    a, _, c, _ = plant().state_space()
    reach = sum(np.abs(c @ np.linalg.matrix_power(a, k) @ loop["drives"]) for k in range(400))
    bound = reach * np.dot(np.abs(WEIGHTS), WIDTHS)
    linear = model_of(plant()).simulate(wander(seed=seed))
    assert np.all(np.abs(y - linear) <= bound + 1e-9)


@pytest.mark.parametrize(
    ("loop", "message"),
    [
        (stops_loop(states=[1.0]), "sees 1 states, but drives 3"),
        (stops_loop(inputs=[1.0]), "sees 1 inputs, but the dynamics have 2"),
        (stops_loop(widths=[0.1]), "1 half-widths, but 3 weights"),
        (stops_loop(widths=[0.1, 0.0, 0.3]), "half-widths of its stops must be positive"),
        ({**cubic_loop(), "sees": {"output": 2}}, "sees output 2 of 2"),
    ],
)
def test_loops_that_do_not_fit_are_refused(loop, message):
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=message):
        with_loops(model_of(plant()), loop)


def multisine(samples: int, seed: int) -> np.ndarray:
    """Two inputs, random phases, from rest."""
    random = np.random.default_rng(seed)
    lines = np.arange(1, samples // 5)
    phases = random.uniform(0, 2 * np.pi, (len(lines), 2))
    spectrum = np.zeros((samples // 2 + 1, 2), dtype=complex)
    spectrum[lines] = np.exp(1j * phases)
    u = np.fft.irfft(spectrum, samples, axis=0)
    u *= np.minimum(np.arange(samples) / 30, 1)[:, None] / u.std(axis=0)
    return np.vstack([np.zeros((12, 2)), u])


@pytest.fixture(scope="session")
def explained() -> gpi.Explanation:
    """What a plant with stops around G lacks, driven at three swings."""
    drives = [-0.06, 0.05, 0.01]
    around = stops_loop(drives, [1.0, 0.0, 0.2], [0.0, 0.0], [0.3, 1.0, 2.5], [0.5, 0.7, 1.0])
    model = with_loops(model_of(plant()), around)
    inputs = [swing * multisine(2500, seed) for seed, swing in enumerate((0.3, 1.0, 3.0))]
    random = np.random.default_rng(9)
    outputs = [np.asarray(model.simulate(u)) + random.normal(0, NOISE, u.shape) for u in inputs]
    record = gpi.Record(inputs, outputs, rate=RATE)
    return gpi.explain(record, order=3, half_widths=[0.0, 0.4], thresholds=0)


def test_hysteresis_inside_the_loop_is_named_first_and_explained(explained: gpi.Explanation) -> None:
    assert explained.effects[0] == "stiffness"
    assert explained.after["holdout"]["rms"] < 0.2 * explained.before["holdout"]["rms"]
    assert len(explained.models) == len(explained.steps)


def test_a_resonance_that_moves_with_the_swing_rules_the_input_out(explained: gpi.Explanation) -> None:
    assert explained.moved_resonance is not None
    small, large = explained.moved_resonance
    assert large["swing"] > 5 * small["swing"]
    # stops that slip no longer hold the displacement
    moved = abs(large["frequency"] - small["frequency"])
    assert moved > 5 * np.hypot(small["std"], large["std"])
    words = " ".join(in_words(to_dict(explained)))
    assert "cannot move a resonance" in words


def test_a_sentence_says_how_many_parameters_it_leaves_out(explained: gpi.Explanation) -> None:
    result = to_dict(explained)
    (added,) = (step for step in result["steps"] if step["effect"] == "stiffness")
    (sentence,) = (words for words in in_words(result) if words.startswith("stiffness ("))
    assert sentence.count("±") <= 6
    assert sentence.endswith(f", {len(added['parameters']) - 6} more.")


def test_a_resonance_stays_where_it_is_without_loops() -> None:
    model = model_of(plant())
    inputs = [swing * multisine(1500, seed) for seed, swing in enumerate((0.3, 1.0, 3.0))]
    random = np.random.default_rng(9)
    outputs = [np.asarray(model.simulate(u)) + random.normal(0, NOISE, u.shape) for u in inputs]
    record = gpi.Record(inputs, outputs, rate=RATE)
    found = gpi.explain(record, order=3, half_widths=[0.0, 0.4], thresholds=0, require=["stiffness"])
    assert found.moved_resonance is None
