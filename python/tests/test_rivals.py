"""Simple rivals, and the verdict that the declared structure is wrong."""

import json

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run
from gpi_hammerstein.explanation import in_words
from gpi_hammerstein.report import report_html

RATE = 500.0


def drive(samples=6000, seed=1):
    """Return slow filtered noise in volts, and a generator for noise."""
    random = np.random.default_rng(seed)
    u = np.zeros(samples)
    for k in range(1, samples):
        u[k] = 0.98 * u[k - 1] + random.normal()
    return 5.0 + u, random


def integrating(samples=6000):
    """Return a record of a stage that integrates its input, with friction that depends on the direction."""
    u, random = drive(samples)
    position, speed, y = 0.0, 0.0, np.empty(samples)
    for k in range(samples):
        speed += 0.1 * (u[k] - 5.0 - speed - 0.5 * np.sign(speed))
        position += speed / RATE
        y[k] = position
    return gpi.Record(u, y + random.normal(0.0, 1e-3, samples), rate=RATE, output_units=["um"])


@pytest.fixture(scope="module")
def outside():
    return gpi.explain(integrating(), effects=[], order=2, half_widths=6, thresholds=0)


def test_polynomials_are_those_of_numpy():
    u, random = drive()
    record = gpi.Record(u, 0.3 * u**2 - u + 4.0 + random.normal(0.0, 0.05, len(u)), rate=RATE)
    train, test = record.split(0.8)
    row = next(row for row in gpi.rivals(train, test) if row["name"] == "static-polynomial")
    degree = int(row["detail"].removeprefix("degree "))
    assert degree >= 2
    share = int(0.8 * len(u))
    known = np.polynomial.Polynomial.fit(u[:share], record.y[0][:share, 0], degree)
    expected = np.sqrt(np.mean((record.y[0][share:, 0] - known(u[share:])) ** 2))
    assert row["holdout_rms"] == pytest.approx(expected, rel=1e-6)


def test_without_held_out_data_blocks_are_held_out():
    u, _ = drive()
    y = 0.5 * np.r_[u[:1], u[:-1]] + 0.3 * np.r_[u[:1], u[:1], u[:-2]]
    rows = {row["name"]: row for row in gpi.rivals(gpi.Record(u, y, rate=RATE))}
    assert rows["fir"]["holdout_rms"] < 1e-6 < 1e-2 < rows["static-polynomial"]["holdout_rms"]


def test_other_channels_are_refused():
    u, _ = drive(300)
    one, two = gpi.Record(u, u, rate=RATE), gpi.Record(np.column_stack([u, u]), u, rate=RATE)
    with pytest.raises(gpi.DataError, match="inputs"):
        gpi.rivals(one, two)


def test_an_integrating_stage_is_outside_the_class(outside):
    answer = outside.to_dict()
    assert answer["verdict"] == "outside-class"
    assert "integrates the input" in answer["verdict_reason"]
    assert answer["next_experiment"] is None
    assert answer["residual"]["structured"]
    words = list(in_words(answer, "um"))
    assert any("integrates the input" in sentence for sentence in words)
    assert any("best simple model" in sentence for sentence in words)


def test_the_report_shows_reason_and_rivals(outside):
    page = report_html(outside)
    assert 'class="verdict outside-class"' in page and "integrates the input" in page
    assert all(row["name"] in page for row in outside.rivals)


def test_identify_prints_the_rivals(tmp_path, capsys):
    u, _ = drive(3000)
    y = np.convolve(u, [0.0, 0.5, 0.3])[: len(u)]
    path = tmp_path / "run.csv"
    t = np.arange(len(u)) / RATE
    np.savetxt(path, np.column_stack([t, u, y]), delimiter=",", header="t,u,y", comments="")
    choices = ["--order", "2", "--half-widths", "1", "--thresholds", "0"]
    assert run(["identify", str(path), *choices, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rivals"]
    assert {row["name"] for row in rows} == {"static-polynomial", "plays", "fir", "arx"}
    assert run(["identify", str(path), *choices]) == 0
    text = capsys.readouterr().out
    assert "static-polynomial" in text and "best simple model" in text
