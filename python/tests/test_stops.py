"""Stops in place of plays: a hysteresis whose output leads its input."""

import numpy as np
import polars as pl
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run

RATE = 200.0
NOISE = 0.01
HALF_WIDTHS = [0.0, 0.5, 1.0, 2.0]


def drive(seed, samples=6000):
    random = np.random.default_rng(seed)
    u = np.zeros(samples)
    for k in range(50, samples):
        u[k] = 0.98 * u[k - 1] + 0.25 * random.normal()
    return u


def stage(u, linear, weights):
    """Return the output of stops and a linear part before a lag: g_0 u + sum_i g_i (u - F_i(u))."""
    bank = gpi.PlayBank(HALF_WIDTHS, [linear + sum(weights), *(-weight for weight in weights)])
    lag = gpi.StateSpace.from_transfer_function([0.0, 0.4], [1.0, -0.6])
    return lag.simulate(bank(u)).ravel()


def record(linear=0.5, weights=(0.6, 0.5, 0.9), seed=1):
    u = drive(seed)
    y = stage(u, linear, weights) + NOISE * np.random.default_rng(seed + 100).normal(size=len(u))
    return gpi.Record(u, y, rate=RATE, input_units=["mm"], output_units=["N"])


@pytest.fixture(scope="module")
def model():
    return gpi.identify(record())


def test_stops_are_found(model):
    bank = model.hysteresis[0].plays
    assert bank.weights[0] > 0 and all(weight <= 0 for weight in bank.weights[1:])
    other = record(seed=2)
    assert model.error(other)["rms"] < 1.1 * NOISE
    # the stiffness of all stops, and what is left of them when they slide: sum_i g_i r_i
    for u, y in ((0.2, 0.2 * 2.5), (2.5, 2.5 * 0.5 + 0.6 * 0.5 + 0.5 * 1.0 + 0.9 * 2.0)):
        steady = np.asarray(model.simulate(np.r_[np.zeros(20), np.full(400, u)])).ravel()[-1]
        assert steady - model.offsets[0] == pytest.approx(y, rel=0.02)


def test_plays_cannot_replace_them(model):
    plays = gpi.identify(record(), hysteresis="plays")
    assert all(weight >= 0 for weight in plays.hysteresis[0].plays.weights)
    assert plays.error(record(seed=2))["rms"] > 5 * model.error(record(seed=2))["rms"]


def test_plays_stay_plays():
    u = drive(3)
    bank = gpi.PlayBank(HALF_WIDTHS, [1.0, 0.3, 0.2, 0.3])
    y = bank(u) + NOISE * np.random.default_rng(4).normal(size=len(u))
    found = gpi.identify(gpi.Record(u, y, rate=RATE))
    assert all(weight >= 0 for weight in found.hysteresis[0].plays.weights)


def test_the_inverse_exists_where_a_linear_part_is_left(model):
    wanted = 1.5 * np.sin(2 * np.pi * 1.5 * np.arange(800) / RATE)
    found = model.compensate(wanted)
    assert found.error["rms"] < 1e-6 < 1e-2 < found.error_static_curve["rms"]
    weights = (0.6, 0.5, 0.9)
    with pytest.raises(gpi.ParameterError, match="linear part must be left"):
        gpi.PlayBank(HALF_WIDTHS, [sum(weights), *(-weight for weight in weights)]).inverse()


def test_explain_starts_from_stops():
    found = gpi.explain(record(), effects=[])
    assert found.verdict == "explained"
    assert found.to_dict()["error"]["after"]["holdout"]["rms"] < 1.1 * NOISE


def test_the_option_is_checked():
    with pytest.raises(gpi.ParameterError, match="must be plays or stops"):
        gpi.identify(record(), hysteresis="relays")


def test_the_command_takes_the_option(tmp_path):
    own = record()
    file = tmp_path / "run.csv"
    columns = {"t_s": np.arange(len(own.u[0])) / RATE, "u": own.u[0].ravel(), "y": own.y[0].ravel()}
    pl.DataFrame(columns).write_csv(file)
    small = ["--order", "1", "--half-widths", "4", "--thresholds", "0"]
    for kind, sign in (("stops", -1.0), ("plays", 1.0)):
        out = tmp_path / kind
        assert run(["identify", str(file), "-o", str(out), "--hysteresis", kind, *small]) in (0, None)
        weights = gpi.load(out / "model.json").hysteresis[0].plays.weights
        assert all(sign * weight >= 0 for weight in weights[1:])
