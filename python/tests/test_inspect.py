"""`gpi inspect`: what is said of records whose properties are known."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from data_folder import DATA
from gpi_hammerstein.cli import run
from gpi_hammerstein.inspection.columns import resolution
from gpi_hammerstein.inspection.command import experiment
from gpi_hammerstein.inspection.excitation import excitation
from gpi_hammerstein.inspection.identifiable import Answer
from records import Array, actuator, good_columns, write_csv

RATE = 1000.0


def record(u: Array, y: Array | None = None, rate: float = RATE, **more: object) -> gpi.Record:
    return gpi.Record(u, actuator(u) if y is None else y, rate=rate, **more)


def possible(found: gpi.Inspection) -> dict[str, str]:
    """The answers by the first word of what is asked."""
    return {row["what"].split(",")[0].split(" (")[0]: row["possible"] for row in found.identifiable}


def test_a_sine_determines_little() -> None:
    u = 5.0 * np.sin(2 * np.pi * 2.0 * np.arange(4000) / RATE)
    found = gpi.inspect(record(u))
    assert found.record is not None and found.record["excitation_order"] == 2
    answers = possible(found)
    assert answers["hysteresis"] == "partly" and answers["linear dynamics"] == "partly"
    assert answers["rate dependence"] == "no"
    assert found.inputs[0]["period_s"] == pytest.approx(0.5)
    assert found.inputs[0]["largest_swing"] == pytest.approx(10.0, rel=1e-3)
    assert found.next_experiment is not None and found.next_experiment["command"].startswith("gpi excite ")


@pytest.mark.parametrize("kind", ["triangle", "multisine", "steps"])
def test_the_next_experiment_can_be_typed_as_it_stands(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    u = np.linspace(-2.5, 7.5, 400)
    answer = Answer("hysteresis", "no", "", kind)
    proposed = experiment([answer], excitation([u], RATE), RATE, "V")
    assert proposed is not None
    name, *arguments = shlex.split(proposed["command"])
    assert name == "gpi" and run(arguments) == 0
    made = np.loadtxt("next.csv", delimiter=",", skiprows=1)[:, -1]
    assert made.min() >= -2.5 - 1e-9 and made.max() <= 7.5 + 1e-9


def test_a_rich_record_determines_much() -> None:
    t = np.arange(60_000) / RATE
    triangles = [gpi.decaying_triangle(20_000, RATE, f, (-5.0, 5.0)) for f in (0.5, 2.0, 8.0)]
    hold = np.repeat([4.0, 0.0], 10_000)
    noise = 0.1 * np.random.default_rng(0).standard_normal(80_000)
    u = np.concatenate([*triangles, hold])
    u[:60_000] += noise[:60_000]
    temperature = np.linspace(20.0, 22.0, len(u))
    found = gpi.inspect(record(u, covariates=temperature, covariate_names=["temperature"]))
    assert set(possible(found).values()) == {"yes"}
    assert found.next_experiment is None
    assert "half-widths up to 5." in found.identifiable[0]["why"]
    assert found.inputs[0]["longest_hold_s"] == pytest.approx(10.0, abs=0.01)
    assert len(t) == 60_000


def test_swings_are_counted_on_every_scale() -> None:
    t = np.arange(20_000) / RATE
    u = 5.0 * np.sin(2 * np.pi * 0.5 * t) + 0.5 * np.sin(2 * np.pi * 40 * t)
    found = excitation([u], RATE)
    assert found.largest_swing == pytest.approx(11.0, rel=0.02)  # not that of the ripple
    assert found.swings == 19
    assert found.band_hz == (pytest.approx(0.5, abs=0.06), pytest.approx(40.0, abs=0.1))


def test_speeds_are_those_of_large_swings() -> None:
    one = gpi.decaying_triangle(10_000, RATE, 1.0, (0.0, 10.0))
    fast = gpi.decaying_triangle(10_000, RATE, 5.0, (0.0, 10.0))
    assert excitation([one, fast], RATE).speeds > 3.0
    constant_speed = 10 * np.abs(((np.arange(10_000) / 1000.0) % 2) - 1)
    assert excitation([constant_speed], RATE).speeds == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("step", "expected"), [(0.1, 0.1), (0.25, 0.25), (0.0, None)])
def test_the_resolution_is_that_of_the_converter(step: float, expected: float | None) -> None:
    smooth = np.tile(np.sin(np.arange(500) * 0.0123), 8)  # repeats, so that samples share levels
    signal = smooth if step == 0 else step * np.round(smooth / step)
    found = resolution(signal)
    assert found == (None if expected is None else pytest.approx(expected))


def test_saturation_and_quantisation_are_found() -> None:
    u = 5.0 * np.sin(2 * np.pi * 2.0 * np.arange(4000) / RATE)
    y = np.minimum(0.1 * np.round(actuator(u) / 0.1), 3.0)
    found = gpi.inspect(record(u, y, output_names=["y"], output_units=["um"]))
    text = " ".join(found.findings)
    assert "the sensor saturates" in text and "quantised in steps of 0.1 um" in text
    assert found.outputs[0]["clipped"] > 0.1
    assert gpi.inspect(record(u)).findings == []


def test_feedback_is_found() -> None:
    random = np.random.default_rng(5)
    reference = np.convolve(random.standard_normal(6000), np.ones(50) / 50, "same")
    for gain, expected in ((0.0, False), (2.0, True)):
        u, y = np.zeros(6000), np.zeros(6000)
        for k in range(1, 6000):
            u[k] = reference[k] + gain * (reference[k] - y[k - 1])
            y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1] + 0.02 * random.standard_normal()
        found = gpi.inspect(record(u, y))
        assert found.inputs[0]["fed_back"] == expected
        assert any("under feedback" in sentence for sentence in found.findings) == expected


def test_unrelated_and_constant_signals_are_found() -> None:
    random = np.random.default_rng(1)
    u = random.standard_normal(4000)
    assert any(
        "hardly follows" in text for text in gpi.inspect(record(u, random.standard_normal(4000))).findings
    )
    assert any("is constant" in text for text in gpi.inspect(record(np.ones(4000), u)).findings)
    assert any("is constant" in text for text in gpi.inspect(record(u, np.ones(4000))).findings)
    assert gpi.inspect(record(u[:3], u[:3])).findings[0].startswith("The record has only 3 samples")


def run_json(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    assert run(["inspect", *words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "gpi-inspection/1"
    return dict(found)


def test_the_command_prints_columns_and_what_to_run_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_csv(tmp_path / "my run.csv", good_columns() | {"remark": ["ok"] * 2000})
    assert run(["inspect", str(path)]) == 0
    text = capsys.readouterr().out
    assert "it is named `u`" in text and "hysteresis" in text
    assert f"gpi report '{path}' -o 'my run.html'" in text
    found = run_json(capsys, str(path))
    roles = {row["header"]: row["role"] for row in found["columns"]}  # type: ignore[attr-defined]
    assert roles == {"t_s": "time", "u_V": "input", "y_um": "output", "remark": "unused"}


@pytest.mark.parametrize(
    ("names", "changed", "words"),
    [
        (["t_s", "u_V", "y_um"], "gap", ["--resample", "auto"]),
        (["Kanal", "alpha", "beta"], "", ["--input", "alpha", "--output", "beta", "--time", "Kanal"]),
        (["n_s", "CH1", "CH2"], "", ["--input", "CH1", "--output", "CH2"]),
        (["number", "u_V", "y_um"], "", ["--rate", "HZ"]),
        (["t_s", "u_V", "foo"], "", ["--output", "COLUMN"]),
    ],
)
def test_a_record_that_cannot_be_used_is_described_and_mended(
    names: list[str], changed: str, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t, u, y = (np.asarray(values) for values in good_columns().values())
    if changed == "gap":
        t = t + 5.0 * (t > 1.0)
    path = write_csv(tmp_path / "r.csv", dict(zip(names, (t, u, y), strict=True)))
    found = run_json(capsys, str(path))
    assert found["problem"] and len(found["columns"]) == 3  # type: ignore[arg-type]
    command = found["next"]["command"].split()  # type: ignore[index]
    assert " ".join(words) in " ".join(command)
    # the command works once words in capitals are replaced
    command = ["1000" if word == "HZ" else "foo" if word == "COLUMN" else word for word in command]
    if "report" in command:
        command = ["gpi", "inspect", *command[2 : command.index("-o")]]
    mended = run_json(capsys, *command[2:])
    assert mended["problem"] is None and mended["record"]["samples"] == 2000  # type: ignore[index]


def test_a_file_that_cannot_be_read_is_unusable_data(tmp_path: Path) -> None:
    assert run(["inspect", str(tmp_path / "none.csv")]) == 3


@pytest.mark.skipif(not (DATA / "measured").is_dir(), reason=f"NO MEASURED RECORDS in {DATA}")
def test_measured_records_are_described_as_an_engineer_would() -> None:
    folder = DATA / "measured"
    sine = gpi.inspect(folder / "piezo-p885-dbo" / "model_1hz_fullscale.csv")
    assert possible(sine)["linear dynamics"] == "partly" and sine.inputs[0]["period_s"] == pytest.approx(1.0)
    creep = gpi.inspect(folder / "cavatappi-muscle" / "creep_step_400g_300s.csv")
    assert creep.problem is not None and creep.assumed == "--resample auto"
    assert possible(creep)["slow response"] == "yes" and possible(creep)["hysteresis"] == "no"
    tank = gpi.inspect(folder / "cascaded-tanks" / "estimation.csv.gz")
    assert any("saturates" in sentence for sentence in tank.findings)  # the tank overflows
    emps = gpi.inspect(folder / "emps" / "emps_train.csv.gz")
    assert any("reference looks like a command" in sentence for sentence in emps.findings)
