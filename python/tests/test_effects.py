"""Every effect of the catalogue as a block of the chain, against its equation in plain NumPy."""

import copy
import functools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Legendre

import gpi_hammerstein as gpi
import oracle
from records import RATE, model_of

SAMPLES = 600


def plant(delay=0):
    """Three plays, two deadzones, a resonance and a pole."""
    pole = 0.85 * np.exp(0.5j)
    resonance = oracle.Section(
        a=np.real(np.poly([pole, pole.conjugate()]))[1:], b=np.array([[0.3], [0.1]]), c=np.array([[1.0, 0.0]])
    )
    lag = oracle.Section(a=np.array([-0.4]), b=np.array([[0.2]]), c=np.array([[1.0]]))
    hysteresis = oracle.Hysteresis(
        thresholds=np.array([-1.0, 0.0, 1.2]),
        deadzone_weights=np.array([0.3, 1.0, -0.25]),
        half_widths=np.array([0.0, 0.5, 1.3]),
        weights=np.array([1.0, 0.6, 0.4]),
    )
    return oracle.Plant(
        hysteresis=[hysteresis],
        sections=[resonance, lag],
        feedthrough=np.zeros((1, 1)),
        held=[(0, 1.0)],
        delay=delay,
        offsets=[np.array([[0.7]])],
        starts=[None],
    )


def wander(samples=SAMPLES, seed=0):
    random = np.random.default_rng(seed)
    t = np.arange(samples)[:, None]
    u = np.sum(
        np.sin(np.array([0.013, 0.05, 0.17, 0.6]) * t + random.uniform(0, 6, 4)) * [1.5, 1, 0.6, 0.3], axis=1
    )
    u[:12] = 0.0
    return u


def with_effect(model, **effect):
    described = json.loads(model.to_json())
    described["effects"] = [*described.get("effects", []), effect]
    return gpi.Model.from_json(json.dumps(described))


def chain(
    u,
    own=None,
    delay=0,
    drive=None,
    width=None,
    speed_seen=None,
    read=None,
    beside=None,
    feedback=None,
    displace=None,
    sense=None,
    add=None,
):
    """The declared chain sample by sample, with what an effect does at its place."""
    own = own or plant(delay)
    channel = own.hysteresis[0]
    u = u if drive is None else drive(u)
    z = oracle.deadzones(u, channel.thresholds, channel.deadzone_weights)
    speed = np.abs(np.diff(u, prepend=u[0])) * RATE
    speed = speed if speed_seen is None else speed_seen(speed)
    places = np.zeros(len(channel.half_widths))
    v = np.zeros(len(u))
    for k in range(len(u)):
        for i, r in enumerate(channel.half_widths):
            w = r if width is None else width(r, speed[k])
            places[i] = max(z[k] - w, min(z[k] + w, places[i]))
        curves = (
            places if read is None else [read(r, f) for r, f in zip(channel.half_widths, places, strict=True)]
        )
        v[k] = channel.weights @ curves
    late = v[np.maximum(np.arange(len(v)) - delay, 0)]
    a, b, c, d = own.state_space()
    x = np.linalg.solve(np.eye(len(a)) - a, b[:, 0] * late[0])
    y = np.zeros(len(u))
    for k in range(len(u)):
        y[k] = c[0] @ x + d[0, 0] * late[k]
        x = a @ x + b[:, 0] * late[k] + (0 if feedback is None else feedback(y[k]))
    if beside is not None:
        y = y + beside(late)
    if displace is not None:
        y = y + displace(np.arange(len(u)) / RATE)
    if sense is not None:
        y = sense(y)
    if add is not None:
        y = y + add(np.arange(len(u)) / RATE)
    return y + 0.7


def slew(limit):
    def drive(u):
        out = u.copy()
        for k in range(1, len(u)):
            out[k] = out[k - 1] + np.clip(u[k] - out[k - 1], -limit / RATE, limit / RATE)
        return out

    return drive


def late(samples):
    def drive(u):
        k = np.arange(len(u)) - samples
        return np.interp(np.maximum(k, 0), np.arange(len(u)), u)

    return drive


def lag(x, time_constant, first=None):
    pole = np.exp(-1 / (time_constant * RATE))
    out, state = np.zeros(len(x)), x[0] if first is None else first
    for k in range(len(x)):
        out[k] = state
        state = pole * state + (1 - pole) * x[k]
    return out


def second_order(x, a, b):
    gain = sum(b) / (1 + sum(a))
    out, past_x, past_y = np.zeros(len(x)), [x[0]] * 2, [gain * x[0]] * 2
    for k in range(len(x)):
        out[k] = b[0] * past_x[0] + b[1] * past_x[1] - a[0] * past_y[0] - a[1] * past_y[1]
        past_x, past_y = [x[k], past_x[0]], [out[k], past_y[0]]
    return out


def gap(half_width):
    def sense(x):
        out, state = np.zeros(len(x)), 0.0
        for k in range(len(x)):
            state = max(x[k] - half_width, min(x[k] + half_width, state))
            out[k] = state
        return out

    return sense


def bent(speed):
    """Box and Cox's law with exponent 0.3 and knee 40, behind a lag of 4 ms."""
    out, state, keep = np.zeros(len(speed)), 0.0, np.exp(-1 / (4e-3 * RATE))
    for k in range(len(speed)):
        state = keep * state + (1 - keep) * speed[k]
        out[k] = 40 * ((1 + state / 40) ** 0.3 - 1) / 0.3
    return out


def parabola(t, values):
    """Through values at 0, 0.2 and 0.4 s: what a smooth curve through three knots is; then constant."""
    return np.polyval(np.polyfit([0, 0.2, 0.4], values, 2), np.minimum(t, 0.4))


LAW = {"exponent": 0.3, "knee": 40.0, "lag": 4e-3}


def power_loop(exponent, drives):
    law = {"power": {"exponent": exponent, "scale": 2.0}}
    return {"sees": {"output": 0}, "law": law, "drives": list(drives)}


DRIVES2, DRIVES3 = np.array([0.002, -0.001, 0.003]), np.array([-0.004, 0.002, 0.001])
CURVES = np.array([[0.02, -0.1, 0.05, 0.01], [0.03, 0.02, -0.04, 0.02]])


def shaped(r, f):
    """F + s q, dq/df of Legendre's polynomials of the place and the half-width; q from its integral."""
    if r == 0:
        return f
    x = np.clip((f - 0.3) / 2.5, -1, 1)
    widths = [Legendre.basis(b)(min(2 * r / 1.3 - 1, 1.0)) for b in range(4)]
    density = Legendre([0.0, *(CURVES @ widths)])
    return f + 2.5 * (density.integ()(x) - density.integ()(-1.0))


CASES = {
    "delay": ({"input": 0, "samples": 2.3}, {"drive": late(2.3)}),
    "amplifier-slew": ({"input": 0, "limit": 60.0}, {"drive": slew(60.0)}),
    "rate-dependence": (
        {"input": 0, "relative": 2e-3, "absolute": 5e-4, "law": LAW, "speed": 100.0, "widest": 1.3},
        {"width": lambda r, s: r * (1 + 2e-3 * s) + (5e-4 * s if r > 0 else 0), "speed_seen": bent},
    ),
    "hysteresis-shape": (
        {
            "input": 0,
            "coefficients": CURVES.ravel().tolist(),
            "widths": 4,
            "middle": 0.3,
            "scale": 2.5,
            "widest": 1.3,
        },
        {"read": shaped},
    ),
    "linear-dynamics": (
        {"input": 0, "denominator": [-1.2, 0.9], "numerator": [0.05, 0.02], "rate": RATE, "dead_time": 0},
        {"beside": lambda v: second_order(v, [-1.2, 0.9], [0.05, 0.02])},
    ),
    "creep": (
        {"input": 0, "time_constants": [0.1, 2.0], "gains": [0.1, 0.3], "dead_time": 0},
        {"beside": lambda v: 0.1 * lag(v, 0.1) + 0.3 * lag(v, 2.0)},
    ),
    "stiffness": (
        {"loops": [power_loop(2, DRIVES2), power_loop(3, DRIVES3)]},
        {"feedback": lambda y: 2 * (DRIVES2 * (y / 2) ** 2 + DRIVES3 * (y / 2) ** 3)},
    ),
    "output-nonlinearity": (
        {
            "output": 0,
            "coefficients": [0.05, -0.03],
            "middle": 0.4,
            "scale": 3.0,
            "lowest": -3.5,
            "highest": 4.0,
        },
        {
            "sense": lambda x: np.clip(
                x + 3 * (0.05 * ((x - 0.4) / 3) ** 2 - 0.03 * ((x - 0.4) / 3) ** 3), -3.5, 4.0
            )
        },
    ),
    "gain-drift": (
        {"output": 0, "changes": [0.1, -0.2], "duration": 0.4},
        {"sense": lambda x: x * (1 + parabola(np.arange(len(x)) / RATE, [0, 0.1, -0.2]))},
    ),
    "backlash": ({"output": 0, "half_width": 0.2}, {"sense": gap(0.2)}),
    "drift": (
        {"output": 0, "changes": [0.5, 0.2], "duration": 0.4, "span": 4.0},
        {"add": lambda t: parabola(t, [0, 0.5, 0.2])},
    ),
    "periodic-disturbance": (
        {"output": 0, "frequency": 50.0, "cosine": 0.3, "sine": -0.2, "duration": 0.6, "span": 4.0},
        {"add": lambda t: 0.3 * np.cos(100 * np.pi * t) - 0.2 * np.sin(100 * np.pi * t)},
    ),
    "outliers": ({"count": 3, "samples": 600, "size": 1.0}, {}),
    "coloured-noise": ({"output": 0, "coefficients": [0.9], "innovation": 0.1, "deviation": 0.3}, {}),
}


def test_every_effect_has_a_case():
    # these have tests of their own
    others = {"covariate", "hysteretic-stiffness", "friction", "saturation"}
    assert set(CASES) | others == set(gpi.effect_names())


@pytest.mark.parametrize("name", sorted(CASES))
def test_an_effect_does_what_its_equation_says(name):
    parameters, place = CASES[name]
    u = wander()
    expected = chain(u, **place)
    model = with_effect(model_of(plant()), name=name, **parameters)
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-10)
    if place:
        assert np.std(expected - chain(u)) > 1e-3


@pytest.mark.parametrize("name", ["creep", "linear-dynamics"])
def test_effects_of_the_dynamics_share_the_dead_time(name):
    parameters, place = CASES[name]
    u = wander()
    model = with_effect(model_of(plant(delay=3)), name=name, **(parameters | {"dead_time": 3}))
    np.testing.assert_allclose(model.simulate(u), chain(u, delay=3, **place), rtol=0, atol=1e-10)


@pytest.mark.parametrize("time_constant", [0.0, 0.03])
def test_a_covariate_leaks_in(time_constant):
    u, x = wander(), wander(seed=5)
    effect = {
        "output": 0, "column": 0, "label": "x", "gain": 0.4, "time_constant": time_constant, "step": 1e-3,
    }  # fmt: skip
    model = with_effect(model_of(plant()), name="covariate", **effect)
    # the lag takes the present sample in
    leak = x if time_constant == 0 else np.append(lag(x, time_constant), 0)[1:]
    pole = 0.0
    if time_constant > 0:
        pole = np.exp(-1 / (time_constant * RATE))
        leak[-1] = pole * lag(x, time_constant)[-1] + (1 - pole) * x[-1]
    np.testing.assert_allclose(model.simulate(u, covariates=x), chain(u) + 0.4 * leak, rtol=0, atol=1e-10)
    begun = with_effect(model_of(plant()), name="covariate", **effect, start=0.7, range=2.0)
    decay = 0.7 * pole ** np.arange(1, len(u) + 1)
    np.testing.assert_allclose(
        begun.simulate(u, covariates=x), chain(u) + 0.4 * (leak + decay), rtol=0, atol=1e-10
    )
    # another record has another past
    other = gpi.Record(u, chain(u) + 0.4 * leak, RATE, covariates=x, covariate_names=["x"])
    assert begun.on_another_record(other, fit_start=False)["error"]["rms"] < 1e-9
    for missing in (None, np.zeros((len(u), 0))):
        with pytest.raises(gpi.ParameterError, match="covariates.*covariate.*`x`"):
            model.simulate(u, covariates=missing)
    record = gpi.Record(u, chain(u), RATE, covariates=x, covariate_names=["z"])
    with pytest.raises(gpi.ParameterError, match="z.*covariate.*`x`"):
        model.error(record)


@pytest.mark.parametrize("name", ["drift", "periodic-disturbance"])
def test_what_moves_the_stage_goes_through_the_gap(name):
    (added, place), (gap_of, sensed) = CASES[name], CASES["backlash"]
    u = wander()
    expected = chain(u, displace=place["add"], **sensed)
    model = with_effect(model_of(plant()), name=name, moves_stage=True, **added)
    model = with_effect(model, name="backlash", **gap_of)
    np.testing.assert_allclose(model.simulate(u), expected, rtol=0, atol=1e-10)
    behind = with_effect(with_effect(model_of(plant()), name=name, **added), name="backlash", **gap_of)
    np.testing.assert_allclose(behind.simulate(u), chain(u, **place, **sensed), rtol=0, atol=1e-10)
    found = gpi.sensitivities(model, gpi.Record(u, expected, rate=RATE))
    assert found["cost"] < 1e-16 * len(u)


@pytest.mark.parametrize("name", sorted(CASES))
def test_a_record_in_parts_is_the_whole(name):
    model = with_effect(model_of(plant()), name=name, **CASES[name][0])
    u = wander()
    state, pieces = model.start(u[0]), []
    for piece in (u[:1], u[1:170], u[170:]):
        y, state = model.run(piece, state)
        pieces.append(y)
    np.testing.assert_allclose(np.concatenate(pieces), model.simulate(u), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", sorted(CASES))
def test_a_model_file_keeps_the_effect(name, tmp_path):
    model = with_effect(model_of(plant()), name=name, **CASES[name][0])
    model.save(tmp_path / "model.json")
    again = gpi.load(tmp_path / "model.json")
    assert again.effects == model.effects and [effect["name"] for effect in again.effects] == [name]
    columns = {"name", "value", "std", "unit", "determined"}
    assert all(set(row) == columns for row in again.effects[0]["parameters"])
    u = wander()
    np.testing.assert_array_equal(again.simulate(u), model.simulate(u))


SMOOTH = sorted(set(CASES) - {"outliers", "coloured-noise"})


@pytest.mark.parametrize("name", SMOOTH)
def test_derivatives_pass_through_the_effect(name):
    """The Jacobian against differences of the oracle's chain, with respect to weights and poles."""
    own, (parameters, place) = plant(), CASES[name]
    u = wander()
    model = with_effect(model_of(own), name=name, **parameters)
    record = gpi.Record(u, chain(u, **place), rate=RATE)
    found = gpi.sensitivities(model, record)
    names, jacobian = list(found["names"]), found["jacobians"][0][0]
    assert found["cost"] < 1e-16 * len(u)
    watched = ["u.weights[1]", "u.weights[2]", "u.deadzone_weights[2]", "section[0].a1", "section[0].b2[u]"]
    for label in watched:
        value, step = own.value(label), 1e-6
        there = [chain(u, own.with_values({label: value + sign * step}), **place) for sign in (1, -1)]
        expected = (there[0] - there[1]) / (2 * step)
        error = np.abs(jacobian[:, names.index(label)] - expected)
        # a sample at which something turns within the step may differ
        assert np.quantile(error, 0.97) < 1e-5 * np.abs(expected).max(), label


# Where an effect's values stand in its JSON, in their order. What joins the sections of G has their columns.
OWN_VALUES = {
    "delay": ["samples"],
    "amplifier-slew": ["limit"],
    "rate-dependence": ["relative", "absolute", "law.exponent", "law.knee", "law.lag"],
    "hysteresis-shape": [f"coefficients.{i}" for i in range(CURVES.size)],
    "stiffness": [f"loops.{i}.drives.{j}" for i in range(2) for j in range(3)],
    "output-nonlinearity": ["coefficients.0", "coefficients.1", "lowest", "highest"],
    "gain-drift": ["changes.0", "changes.1"],
    "backlash": ["half_width"],
    "drift": ["changes.0", "changes.1"],
    "periodic-disturbance": ["frequency", "cosine", "sine"],
}


def scaled(parameters, place, factor):
    """The parameters with the number at a place multiplied, and that number before."""
    moved = copy.deepcopy(parameters)
    *path, last = [int(key) if key.isdigit() else key for key in place.split(".")]
    inside = functools.reduce(lambda part, key: part[key], path, moved)
    before = inside[last]
    inside[last] = factor * before
    return moved, before


@pytest.mark.parametrize("name", SMOOTH)
def test_the_effect_has_columns_of_its_own(name):
    """The Jacobian by the effect's own values against central differences of the simulation."""
    parameters, place = CASES[name]
    u = wander()
    model = with_effect(model_of(plant()), name=name, **parameters)
    found = gpi.sensitivities(model, gpi.Record(u, chain(u, **place), rate=RATE))
    own = "section[2]" if name in ("creep", "linear-dynamics") else f"{name}.value"
    labels = [label for label in found["names"] if label.startswith(own)]
    columns = found["jacobians"][0][0][:, [list(found["names"]).index(label) for label in labels]]
    assert labels and np.all(np.linalg.norm(columns, axis=0) > 0)
    if name in ("creep", "linear-dynamics"):
        return
    assert len(labels) == len(OWN_VALUES[name])
    for column, where in zip(columns.T, OWN_VALUES[name], strict=True):
        there, values = zip(
            *(scaled(parameters, where, factor) for factor in (1 + 1e-6, 1 - 1e-6)), strict=True
        )
        high, low = (with_effect(model_of(plant()), name=name, **moved).simulate(u) for moved in there)
        # the estimated value of the knee is its logarithm
        expected = (high - low) / (2e-6 * (1 if where == "law.knee" else values[0]))
        error = np.abs(column - expected)
        # the columns are differences over the effect's steps, within which plays may turn
        assert np.quantile(error, 0.9) < 0.01 * np.abs(expected).max(), where


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), half_width=st.floats(0.01, 1.0))
def test_backlash_follows_within_its_gap(seed, half_width):
    u = wander(300, seed)
    model = with_effect(model_of(plant()), name="backlash", output=0, half_width=half_width)
    assert np.all(np.abs(model.simulate(u) - model_of(plant()).simulate(u)) <= half_width + 1e-12)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), limit=st.floats(1.0, 500.0))
def test_a_slower_amplifier_never_overshoots(seed, limit):
    u = wander(300, seed)
    v = with_effect(model_of(plant()), name="amplifier-slew", input=0, limit=limit).intermediate(u)
    assert np.all(np.abs(v) <= np.abs(model_of(plant()).intermediate(u)).max() + 1e-12)


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        ({"name": "backlash", "output": 1, "half_width": 0.1}, "channel 1 of 1"),
        ({"name": "stiffness", "loops": [power_loop(3, [0.0] * 20)]}, "drives 20 states"),
        (
            {
                "name": "hysteresis-shape",
                "input": 0,
                "coefficients": [0.1],
                "widths": 0,
                "middle": 0.0,
                "scale": 1.0,
                "widest": 1.0,
            },
            "1 coefficients in rows of 0",
        ),
        ({"name": "magic"}, "magic"),
    ],
)
def test_bad_effects_are_refused(effect, message):
    described = json.loads(model_of(plant()).to_json())
    described["effects"] = [effect]
    text = json.dumps(described)
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=message):
        gpi.Model.from_json(text)
