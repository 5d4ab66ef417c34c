"""The monitor of machines: what is noticed, what is not, streams, the command, and the monitor in C."""

import io
import json
import shutil
import subprocess
import sys
import time

import numpy as np
import polars as pl
import pytest

import gpi_hammerstein as gpi
import schemas
from gpi_hammerstein.cli import run
from gpi_hammerstein.monitoring import streams
from gpi_hammerstein.monitoring.words import changes_in_words

RATE = 100.0
NOISE = 0.01


def stage(u, gain=1.0, frequency=12.0, wider=1.0):
    """Return the output of a stage with plays and a resonance, without noise."""
    w = 2 * np.pi * frequency / RATE
    pole = np.exp(w * complex(-0.05, np.sqrt(1 - 0.05**2)))
    a = [1.0, -2 * pole.real, abs(pole) ** 2]
    g = gpi.StateSpace.from_transfer_function([0.0, sum(a)], a)
    bank = gpi.PlayBank(wider * np.array([0.0, 0.8, 1.6, 2.4]), [1.0, 0.3, 0.2, 0.2])
    return gain * g.simulate(bank(u)).ravel()


def drive(seed, seconds=60):
    return gpi.multisine(int(seconds * RATE), RATE, (0.1, 30.0), (0.0, 10.0), seed=seed)


def noise(seed, samples):
    return NOISE * np.random.default_rng(seed).normal(size=samples)


@pytest.fixture(scope="module")
def model():
    u = np.r_[np.zeros(100), drive(1), drive(2)]
    record = gpi.Record(
        u, stage(u) + noise(0, len(u)), RATE, input_units=["V"], output_units=["um"], input_names=["u"]
    )
    return gpi.identify(record, half_widths=[0.0, 0.8, 1.6, 2.4], thresholds=0, order=2)


def monitored(model, seconds=120, before=60, added=0.0, **changed):
    """Return a monitor of a stage that has changed after a time."""
    u = drive(3, seconds)
    y = stage(u)
    split = int(before * RATE)
    y[split:] = (stage(u, **changed) + added)[split:]
    monitor = gpi.Monitor(model)
    monitor.push(u, y + noise(4, len(u)))
    return monitor


def test_an_unchanged_machine_raises_no_alarm(model):
    monitor = monitored(model, seconds=1200)
    assert not monitor.changed and monitor.changes == []
    assert monitor.seconds == 1200 and "no change" in repr(monitor)
    assert monitor.watched == ["offset", "gain", "resonance", "hysteresis-width", "noise", "line"]


def test_what_the_training_record_contains_is_no_change():
    u = np.r_[np.zeros(100), drive(1), drive(2)]
    y = stage(u) + noise(0, len(u))
    # the machine ran in for three seconds, which the model does not describe
    y[2000:2300] += 20 * NOISE
    model = gpi.identify(gpi.Record(u, y, RATE), half_widths=[0.0, 0.8, 1.6, 2.4], thresholds=0, order=2)
    known = json.loads(model.to_json())["prediction"]
    assert known["largest_misfit"][0] > 15 * NOISE > 2 * known["misfit"][0]
    monitor = gpi.Monitor(model)
    monitor.push(u, y)
    assert monitor.changes == []


@pytest.mark.parametrize(
    ("what", "changed", "size"),
    [
        ("gain", {"gain": 1.01}, 1.0),
        ("gain", {"gain": 0.98}, -2.0),
        ("resonance", {"frequency": 12.12}, 0.12),
        ("hysteresis-width", {"wider": 1.05}, 5.0),
        ("offset", {"added": 0.01}, 0.01),
    ],
)
def test_each_change_is_named_with_its_size_and_time(model, what, changed, size):
    monitor = monitored(model, **changed)
    (change,) = monitor.changes
    assert change["what"] == what
    assert abs(change["size"] - size) < max(5 * change["std"], 0.1 * abs(size)), change
    assert abs(change["since_s"] - 60) <= 10, change
    assert change["confidence"] > 0.95
    assert change["channel"] == ("u" if what == "hysteresis-width" else "y")


def test_two_changes_at_two_times_are_told_apart(model):
    u = drive(3, 240)
    y = stage(u)
    y[6000:] += 0.05
    y[12000:] += 0.02 * (y[12000:])
    monitor = gpi.Monitor(model)
    monitor.push(u, y + noise(4, len(u)))
    found = {change["what"]: change for change in monitor.changes}
    assert set(found) == {"offset", "gain"}
    assert abs(found["offset"]["since_s"] - 60) <= 10 and abs(found["gain"]["since_s"] - 120) <= 10


def test_more_noise_and_a_new_line_are_named(model):
    u = drive(3, 120)
    y, k = stage(u), np.arange(len(u))
    loud = noise(4, len(u)) * np.where(k < 6000, 1.0, 1.5)
    monitor = gpi.Monitor(model)
    monitor.push(u, y + loud)
    (change,) = monitor.changes
    assert change["what"] == "noise" and abs(change["size"] - 50) < 10 and abs(change["since_s"] - 60) <= 8
    hum = 0.02 * np.sin(2 * np.pi * 33.3 * k / RATE) * (k >= 6000)
    monitor = gpi.Monitor(model)
    monitor.push(u, y + hum + noise(4, len(u)))
    (change,) = monitor.changes
    assert change["what"] == "line" and change["unit"] == "um"
    assert abs(change["frequency_hz"] - 33.3) < 0.1 and abs(change["size"] - 0.02) < 0.005


def test_samples_in_parts_give_the_same(model):
    u = drive(3, 60)
    y = stage(u, gain=1.01) + noise(4, len(u))
    whole, parts = gpi.Monitor(model), gpi.Monitor(model)
    whole.push(u, y)
    # the first part tells the range in which the machine has moved
    for first, last in ((0, 1234), (1234, 1235), (1235, 6000)):
        parts.push(u[first:last], y[first:last])
    assert [c["what"] for c in whole.changes] == [c["what"] for c in parts.changes] == ["gain"]
    assert parts.changes[0]["size"] == pytest.approx(whole.changes[0]["size"], rel=0.05)


def test_wrong_and_missing_samples_are_no_change(model):
    u = drive(3, 120)
    y = stage(u) + noise(4, len(u))
    y[7000] = 1e6
    y[8000:8400] = np.nan
    monitor = gpi.Monitor(model)
    monitor.push(u, y)
    assert not monitor.changed, monitor.changes


def test_a_slow_error_that_the_training_record_may_hide_is_no_change(model):
    u = np.r_[drive(3, 60), np.full(12_000, 4.0)]
    y = stage(u) + noise(4, len(u))
    for error in (0.3, 1.0):
        monitor = gpi.Monitor(model)
        monitor.push(u, y + error * NOISE * (np.arange(len(u)) >= 6000))
        assert monitor.changed == (error == 1.0), monitor.changes
    # at rest, other changes cannot be told from an offset
    (change,) = monitor.changes
    assert "offset" in [change["what"], *change["instead"]]


def test_an_unknown_start_is_no_change(model):
    u = np.r_[np.full(500, 10.0), drive(3, 120)]
    y = stage(u) + noise(4, len(u))
    monitor = gpi.Monitor(model)
    monitor.push(u[900:], y[900:])
    assert not monitor.changed, monitor.changes


def test_wrong_calls(model):
    bare = gpi.Model.from_json(
        json.dumps({k: v for k, v in json.loads(model.to_json()).items() if k != "estimates"})
    )
    with pytest.raises(gpi.ParameterError, match="give `noise`"):
        gpi.Monitor(bare)
    assert gpi.Monitor(bare, noise=[0.01]).limits["noise"] == [0.01]
    for wrong in ({"noise": [0.0]}, {"noise": [np.nan]}, {"false_alarms_per_hour": 0.0}):
        with pytest.raises(gpi.ParameterError):
            gpi.Monitor(model, **wrong)
    with pytest.raises(gpi.DataError, match="outputs"):
        gpi.Monitor(model, noise=[0.1, 0.1])
    monitor = gpi.Monitor(model)
    with pytest.raises(gpi.ParameterError, match="row 3"):
        monitor.push([0.0, 0.0, 0.0, np.inf], np.zeros(4))
    with pytest.raises(gpi.DataError):
        monitor.push(np.zeros(4), np.zeros(5))
    monitor.push(np.zeros(4), np.zeros(4))
    with pytest.raises(gpi.DataError, match="covariates"):
        monitor.push(np.zeros(4), np.zeros(4), np.zeros(3))


@pytest.fixture(scope="module")
def files(model, tmp_path_factory):
    folder = tmp_path_factory.mktemp("monitor")
    gpi.save(model, folder / "model.json")
    for name, gain, seed in (("same", 1.0, 11), ("other", 1.02, 12)):
        u = drive(seed, 60)
        y = stage(u, gain=gain) + noise(seed, len(u))
        frame = pl.DataFrame({"t_s": np.arange(len(u)) / RATE, "u_V": u, "y_um": y})
        (folder / name).mkdir()
        frame.write_csv(folder / name / "run.csv")
    return folder


def test_the_command_says_what_has_changed(files, capsys):
    model = str(files / "model.json")
    assert run(["monitor", model, str(files / "same"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    schemas.require(answer)
    assert answer["schema"] == "gpi-monitor/1" and not answer["changed"] and answer["seconds"] == 60
    same, other = (str(files / name / "run.csv") for name in ("same", "other"))
    assert run(["monitor", model, same, other, "--json"]) == 4
    answer = json.loads(capsys.readouterr().out)
    schemas.require(answer)
    (change,) = answer["changes"]
    assert change["what"] == "gain" and abs(change["size"] - 2) < 0.2 and abs(change["since_s"] - 60) < 5
    assert answer["next"]["command"] == f"gpi identify {other} -o model"
    assert run(["monitor", model, same, other]) == 4
    assert "The gain of `y` has changed by +2" in capsys.readouterr().out


def test_lines_on_standard_input(files, capsys, monkeypatch):
    model = str(files / "model.json")
    for name, code in (("same", 0), ("other", 4)):
        monkeypatch.setattr(sys, "stdin", io.StringIO((files / name / "run.csv").read_text()))
        assert run(["monitor", model, "-", "--until-change", "--json"]) == code
        answer = json.loads(capsys.readouterr().out)
        assert answer["changed"] == (code == 4)
    assert answer["seconds"] < 60
    for text, message in (
        ("u_V,y_um\n1,2\n1,x\n", "line 3, column `y_um`: `x` is not a number"),
        ("u_V,y_um\n1,2\n1,2,3\n", "line 3: 3 cells"),
        ("1,2\n3,4\n", "header"),
        ("", "header"),
    ):
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))
        assert run(["monitor", model, "-"]) == 3
        assert message in capsys.readouterr().err


def test_a_folder_is_followed(files, tmp_path, model):
    shutil.copy(files / "same/run.csv", tmp_path / "1.csv")
    found = streams.followed(tmp_path, pytest.fail)
    assert next(found) == tmp_path / "1.csv"
    shutil.copy(files / "other/run.csv", tmp_path / "2.csv")
    (tmp_path / "note.pdf").write_text("no record")
    assert next(found) == tmp_path / "2.csv"


def test_a_followed_folder_ends_with_the_result_of_ctrl_c(files, tmp_path):
    shutil.copy(files / "other/run.csv", tmp_path / "1.csv")
    command = [sys.executable, "-c", "from gpi_hammerstein_launcher import main; main()", "monitor"]
    command += [str(files / "model.json"), str(tmp_path), "--follow", "--until-change"]
    began = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 4 and "gain" in done.stdout and time.monotonic() - began < 50


def test_records_that_do_not_match_are_refused(files, tmp_path, capsys):
    frame = pl.read_csv(files / "same/run.csv")
    frame.rename({"y_um": "y_mm"}).write_csv(tmp_path / "unit.csv")
    frame.gather_every(2).write_csv(tmp_path / "rate.csv")
    for name, message in (("unit.csv", "is in mm"), ("rate.csv", "sampled at"), ("none.csv", "none.csv")):
        assert run(["monitor", str(files / "model.json"), str(tmp_path / name)]) == 3
        assert message in capsys.readouterr().err
    (tmp_path / "empty").mkdir()
    assert run(["monitor", str(files / "model.json"), str(tmp_path / "empty")]) == 2


def test_words():
    change = dict(what="resonance", channel="y", size=-1.5, unit="Hz", std=0.02, since_s=0.0, confidence=0.7)
    change["instead"] = ["gain", "offset"]
    (sentence,) = changes_in_words([change | {"frequency_hz": 120.0}], [])
    assert sentence == (
        "The first resonance of `y` has changed by -1.5 Hz ± 0.02 Hz, from 120 Hz, since the beginning. It "
        "may also be the gain or offset: the probability of the resonance is 70 %."
    )


MAIN = r"""
#include "gpi_monitor.h"
#include <stdio.h>
int main(void)
{
    static gpi_monitor_state state;
    double u, y;
    long k = 0;
    while (scanf("%lf %lf", &u, &y) == 2) {
        gpi_monitor_model_real input[1] = {(gpi_monitor_model_real)u};
        unsigned found;
        if (k++ == 0)
            gpi_monitor_start(&state, input);
        found = gpi_monitor_step(&state, input, (gpi_monitor_model_real)y);
        if (found)
            printf("%ld %u %.6g %.6g\n", k, found, (double)state.offset, (double)state.gain);
    }
    printf("%u\n", state.changed);
    return 0;
}
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_monitor_in_c_says_the_same(tmp_path, precision):
    """A model without width and resonance, so that both test the same quantities."""
    u = drive(1, 60)
    record = gpi.Record(u, 2 * u + 1 + noise(0, len(u)), RATE)
    model = gpi.identify(record, delay=0, half_widths=[0.0], thresholds=0)
    gpi.export_monitor_c(model, tmp_path, precision=precision)
    (tmp_path / "main.c").write_text(MAIN)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1"]
    sources = [tmp_path / name for name in ("main.c", "gpi_monitor.c", "gpi_monitor_model.c")]
    subprocess.run(["cc", *flags, *map(str, sources), "-o", str(tmp_path / "main")], check=True)
    k = np.arange(len(u))
    for name, y, bits in (
        ("nothing", 2 * u + 1, 0),
        ("gain", 2 * u * np.where(k < 3000, 1.0, 1.01) + 1, 2),
        ("offset", 2 * u + 1 + 0.05 * (k >= 3000), 1),
        ("noise", 2 * u + 1 + np.where(k < 3000, 0, 1.2) * noise(9, len(u)), 4),
    ):
        y = y + noise(2, len(u))
        text = "\n".join(f"{a!r} {b!r}" for a, b in zip(u.tolist(), y.tolist(), strict=True))
        done = subprocess.run(
            [str(tmp_path / "main")], input=text, capture_output=True, text=True, check=True
        )
        *alarms, changed = done.stdout.splitlines()
        monitor = gpi.Monitor(model)
        monitor.push(u, y)
        assert int(changed) == bits, (name, done.stdout)
        assert [c["what"] for c in monitor.changes] == ([name] if bits else [])
        if name == "gain":
            assert float(alarms[-1].split()[3]) == pytest.approx(0.01, rel=0.1)
        if name == "offset":
            assert float(alarms[-1].split()[2]) == pytest.approx(0.05, rel=0.1)
