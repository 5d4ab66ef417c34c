"""The progress of long work: one fraction that never falls, the best error, lines, a bar, and Ctrl-C."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run
from records import RATE, actuator, drive, good_columns, write_csv

GPI = [sys.executable, "-c", "from gpi_hammerstein_launcher import main; main()"]


@pytest.fixture(scope="module")
def record() -> gpi.Record:
    u = drive(3000)
    t = np.arange(3000) / RATE
    y = actuator(u) + 0.02 * np.sin(2 * np.pi * 50.0 * t)
    return gpi.Record(u, y, RATE)


@pytest.mark.parametrize(
    "work",
    [
        lambda record, tell: gpi.identify(record, progress=tell),
        lambda record, tell: gpi.explain(record, effects=["creep", "periodic-disturbance"], progress=tell),
    ],
    ids=["identify", "explain"],
)
def test_the_fraction_never_falls_and_ends_at_one(record, work):
    seen: list[gpi.Progress] = []
    work(record, seen.append)
    done = np.array([now.done for now in seen])
    assert np.all(np.diff(done) >= 0) and done[0] < 0.2 and done[-1] == 1.0
    assert np.all(done[:-1] < 1.0)
    # it is in proportion to the time, as far as the work is not over earlier than expected
    elapsed = np.array([now.elapsed for now in seen])
    half = done[np.searchsorted(elapsed, elapsed[-1] / 2)]
    assert 0.1 < half < 0.95
    errors = [now.error for now in seen if now.error is not None]
    assert errors and np.all(np.diff(errors) <= 0)
    assert seen[-1].error == errors[-1] < 0.1
    assert np.all(np.diff(elapsed) >= 0) and seen[-1].remaining == 0.0
    assert {"structures", "uncertainty"} <= {now.stage for now in seen}
    assert any(re.fullmatch(r"order \d+(, delay \d+)?, \d+ plays, \d+ deadzones", now.trial) for now in seen)


def test_the_trials_of_a_search_are_named(record):
    seen = []
    found = gpi.explain(
        record,
        effects=["creep", "periodic-disturbance"],
        progress=lambda now: seen.append((now.stage, now.trial)),
    )
    assert found.effects == ["periodic-disturbance"]
    assert ("trials", "periodic-disturbance") in seen
    assert ("examination", "periodic-disturbance") in seen
    assert ("score test", "") in seen


def test_a_line_says_all(record):
    lines = []
    gpi.identify(
        record, half_widths=[0.0, 0.8], thresholds=0, order=1, progress=lambda now: lines.append(str(now))
    )
    assert re.fullmatch(r"100 % done, best error \d\.\d+e-\d+, \d+ s", lines[-1]), lines[-1]
    assert any(re.match(r" *\d+ % structures \(order 1, 2 plays, 0 deadzones\)", line) for line in lines)


@pytest.mark.parametrize("colour", [False, True])
def test_without_a_terminal_the_log_has_lines(
    colour: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # the kernels of notebooks set FORCE_COLOR; a pipe is no terminal, with or without colours
    if colour:
        monkeypatch.setenv("FORCE_COLOR", "1")
    path = write_csv(tmp_path / "run.csv", good_columns(1500))
    grid = ["--half-widths", "0,0.8", "--thresholds", "0", "--order", "1"]
    assert run(["identify", str(path), *grid, "--json"]) == 0
    assert capsys.readouterr().err == ""
    assert run(["identify", str(path), *grid, "--json", "--log"]) == 0
    printed = capsys.readouterr()
    assert printed.out.count("\n") == 1
    lines = printed.err.splitlines()
    pattern = r"\d\d:\d\d:\d\d +\d+ % .*, \d+:\d\d elapsed(, about \d+:\d\d left)?"
    assert len(lines) >= 2 and all(re.fullmatch(pattern, line) for line in lines), lines
    assert re.search(r"100 % done, best error 0\.00\d+, ", lines[-1])


def in_a_terminal(
    arguments: list[str], stop_after: str | None = None, width: int = 140
) -> tuple[int, str, float]:
    """Run a command in a terminal; return its exit code, what the terminal got, and seconds after Ctrl-C."""
    leader, follower = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": str(width), "LINES": "30"}
    process = subprocess.Popen(
        [*GPI, *arguments], stdin=follower, stdout=subprocess.DEVNULL, stderr=follower, env=environment
    )
    os.close(follower)
    text, stopped = "", 0.0
    while True:
        try:
            got = os.read(leader, 65536)
        except OSError:
            break
        if not got:
            break
        text += got.decode(errors="replace")
        if stop_after is not None and not stopped and re.search(stop_after, text):
            stopped = time.monotonic()
            process.send_signal(signal.SIGINT)
    code = process.wait(timeout=60)
    os.close(leader)
    return code, text, time.monotonic() - stopped if stopped else 0.0


@pytest.mark.parametrize("width", [80, 140])
def test_a_terminal_gets_one_bar_that_never_falls(width: int, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "run.csv", good_columns())
    code, text, _ = in_a_terminal(["identify", str(path)], width=width)
    assert code == 0
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)
    done = [int(one) for one in re.findall(r"(\d+)%", shown)]
    assert len(set(done)) > 5 and done == sorted(done)
    assert "structures (order" in shown and "best error 0.0" in shown
    assert re.search(r"\d:\d\d:\d\d", shown) and re.search(r"\d+:\d\d left", shown)


@pytest.mark.parametrize("command", ["identify", "explain"])
def test_ctrl_c_stops_within_a_second(command: str, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "run.csv", good_columns(6000))
    code, text, seconds = in_a_terminal([command, str(path)], stop_after=r"structures")
    assert code == 130, text[-500:]
    assert 0.0 < seconds < 2.0  # a second, and one for a machine with other work


def test_ctrl_c_in_the_search_for_effects_keeps_what_is_found(tmp_path: Path) -> None:
    code, text, _ = in_a_terminal(["demo", "-o", str(tmp_path / "out")], stop_after=r"score test")
    assert code == 130, text[-500:]
    assert json.loads((tmp_path / "out" / "demo.json").read_text())["explanation"]["interrupted"]
