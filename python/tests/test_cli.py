"""The command line's contract: exit codes, messages, one JSON object, nothing half written."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import EXAMPLES, run
from gpi_hammerstein.reproduce.catalogue import BENCHMARKS
from records import RATE, good_columns, write_csv

FIGURES = {"rms", "nrmse", "fit_percent", "max"}


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_csv(tmp_path_factory.mktemp("good") / "good.csv", good_columns())


@pytest.fixture(scope="module")
def identified(good: Path) -> Path:
    folder = good.parent / "identified"
    assert run(["identify", str(good), "-o", str(folder)]) == 0
    return folder


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    """Run a command with --json and return the one object it prints."""
    capsys.readouterr()
    code = run([*map(str, arguments), "--json"])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    assert printed.out.count("\n") == 1 and printed.err == ""
    result = json.loads(printed.out)
    assert isinstance(result, dict)
    return result


def refuse(
    capsys: pytest.CaptureFixture[str], code: int, *arguments: object, words: tuple[str, ...], out: Path
) -> None:
    """Run a command that must fail, say why in one line, and write nothing."""
    capsys.readouterr()
    before = sorted(out.parent.iterdir())
    assert run([*map(str, arguments), "-o", str(out), "--json"]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "Traceback" not in printed.err
    for word in words:
        assert word in printed.err, f"`{word}` is not in `{printed.err}`"
    assert sorted(out.parent.iterdir()) == before


def test_identify_prints_and_writes_what_the_contract_says(
    good: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = call(capsys, "identify", good, "-o", out)
    assert result["schema"] == "gpi-identification/1"
    assert result["record"]["rate_hz"] == RATE and result["record"]["samples"] == 2000
    assert set(result["error"]["train"]) == set(result["error"]["holdout"]) == FIGURES
    assert result["error"]["holdout"]["fit_percent"] > 95
    assert len(result["poles"]) == result["order"]
    for name in ("half_widths", "weights", "thresholds", "deadzone_weights"):
        assert len(result[name]) == 1
    assert len(result["half_widths"][0]) == len(result["weights"][0])
    assert "last 20 %" in result["holdout"]
    assert sorted(file.name for file in out.iterdir()) == result["files"]
    assert {"model.json", "identification.json", "fit.png", "loop.png", "bode.png", "residual.png"} <= set(
        result["files"]
    )
    assert json.loads((out / "identification.json").read_text()) == result
    assert json.loads((out / "model.json").read_text())["schema"] == "gpi-model/1"


def test_what_is_held_out_can_be_chosen(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = write_csv(tmp_path / "other.csv", good_columns(seed=5))
    assert "other.csv" in call(capsys, "identify", good, "--holdout-record", other)["holdout"]
    assert call(capsys, "identify", good, "--holdout", "0")["error"]["holdout"] is None
    half = call(capsys, "identify", good, other, "--holdout-experiments", "1", "--half-widths", "0,0.8")
    assert half["holdout"] == "experiments 1 of the record"
    assert half["half_widths"] == [[0.0, 0.8]]


def test_simulate_repeats_the_error_and_writes_the_output(
    good: Path, identified: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = identified / "model.json"
    result = call(capsys, "simulate", model, good, "-o", out)
    assert result["schema"] == "gpi-simulation/1" and set(result["error"]) == FIGURES
    table = pl.read_csv(out / "simulated.csv")
    assert table.columns == ["t", "y"]
    record = gpi.read_record(good)
    error = table["y"].to_numpy() - record.y[0][:, 0]
    np.testing.assert_allclose(np.sqrt(np.mean(error**2)), result["error"]["rms"], rtol=1e-9)
    np.testing.assert_allclose(table["t"].to_numpy(), np.arange(2000) / RATE, atol=1e-12)
    skipped = call(capsys, "simulate", model, good, "--skip", "0.5", "--remove-mean")
    later = error[500:] - error[500:].mean()
    np.testing.assert_allclose(np.sqrt(np.mean(later**2)), skipped["error"]["rms"], rtol=1e-9)


def test_simulate_needs_no_output_column(
    identified: Path, tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = good_columns(500)
    path = write_csv(tmp_path / "u.csv", {"t_s": columns["t_s"], "u_V": columns["u_V"]})
    assert call(capsys, "simulate", identified / "model.json", path, "-o", out)["error"] is None
    assert pl.read_csv(out / "simulated.csv").height == 500


def test_simulate_refuses_what_the_model_was_not_made_for(
    identified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, columns = identified / "model.json", good_columns(500)
    where = tmp_path / "out"
    slow = write_csv(tmp_path / "slow.csv", columns | {"t_s": 2 * np.asarray(columns["t_s"])})
    refuse(capsys, 3, "simulate", model, slow, words=("1000 Hz", "500 Hz", "--resample"), out=where)
    two = write_csv(tmp_path / "two.csv", {"u2_V": columns["u_V"], **columns})
    both = ("--input", "u_V,u2_V")
    refuse(capsys, 3, "simulate", model, two, *both, words=("1 inputs", "has 2"), out=where)
    milli = write_csv(tmp_path / "milli.csv", {"t_s": columns["t_s"], "u_mV": columns["u_V"]})
    refuse(capsys, 3, "simulate", model, milli, words=("`u_mV`", "in V"), out=where)


def test_validate_prints_and_writes_what_the_contract_says(
    good: Path, identified: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = call(capsys, "validate", identified / "model.json", good, "-o", out)
    assert result["schema"] == "gpi-validation/1" and set(result["error"]) == FIGURES
    assert set(result["residual"]) == {"structured", "tests"}
    assert sorted(file.name for file in out.iterdir()) == result["files"]
    [figures] = result["figures"]
    # The record's own noise is white, 1e-3 um.
    assert figures["noise_rms"] == pytest.approx(1e-3, rel=0.15)


@pytest.mark.parametrize(
    ("arguments", "kind"),
    [
        (["multisine", "--band", "1,100", "--odd", "--seed", "3"], "multisine"),
        (["multisine", "--band", "1,100", "--detection"], "multisine"),
        (["prbs", "--clock", "100"], "prbs"),
        (["triangle", "--frequency", "2", "--slew", "100"], "triangle"),
        (["steps", "--slew", "100"], "steps"),
    ],
)
def test_excite_keeps_to_rate_range_and_slew(
    arguments: list[str], kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "u.csv"
    common = ["--rate", "1000", "--duration", "2", "--range", "-1,9", "-o", path]
    result = call(capsys, "excite", *arguments, *common)
    assert result["kind"] == kind and result["samples"] == 2000
    table = pl.read_csv(path)
    assert table.columns == ["t_s", "u_V"]
    u = table["u_V"].to_numpy()
    assert u.min() >= -1 and u.max() <= 9 and np.ptp(u) > 5
    assert result["crest_factor"] == pytest.approx(np.abs(u - u.mean()).max() / u.std())
    if "--slew" in arguments:
        assert np.abs(np.diff(u)).max() * 1000 <= 100 * (1 + 1e-9)
    if "--odd" in arguments:
        lines = np.abs(np.fft.rfft(u - u.mean()))
        assert lines[2:200:2].max() < 1e-6 * lines[3:200:2].min()


def test_excite_refuses_parameters_out_of_range(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = tmp_path / "u.csv"
    common = ["--rate", "1000", "--range", "0,1"]
    band = ["--band", "1,900"]
    refuse(capsys, 2, "excite", "multisine", *common, *band, "--duration", "1", words=("900",), out=where)
    refuse(
        capsys,
        2,
        "excite",
        "prbs",
        *common,
        "--clock",
        "9",
        "--duration",
        "0",
        words=("`duration` = 0",),
        out=where,
    )
    lost = tmp_path / "u"
    lost.write_text("a file, not a folder")
    triangle = ("excite", "triangle", *common, "--frequency", "5", "--duration", "1", "--json")
    assert run([*triangle, "-o", str(lost / "u.csv")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def bad_record(kind: str, folder: Path) -> Path:
    columns: dict[str, Any] = good_columns(600)
    t, u, y = (np.array(columns[name], dtype=object) for name in ("t_s", "u_V", "y_um"))
    path = folder / f"{kind}.csv"
    match kind:
        case "nan":
            y[7] = y[19] = "nan"
        case "infinite":
            u[11] = "inf"
        case "backwards":
            t[300:] = t[300:] - 0.1
        case "gap":
            t[300:] = t[300:] + 0.5
        case "jitter":
            t = t + 4e-4 * (np.arange(len(t)) % 2)
        case "constant":
            u[:] = 2.5
        case "text":
            y[5] = "broken"
        case "empty":
            path.write_text("")
            return path
        case "lengths":
            path = path.with_suffix(".npz")
            np.savez(path, u=np.zeros(50), y=np.zeros(49), rate=1.0)
            return path
        case "short":
            t, u, y = t[:8], u[:8], y[:8]
        case "sine":
            u = np.sin(2 * np.pi * 5.0 * t.astype(float))
            y = 2 * u
    return write_csv(path, {"t_s": t, "u_V": u, "y_um": y})


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("nan", [], ("`y_um`", "2 NaN", "7, 19")),
        ("infinite", [], ("`u_V`", "11")),
        ("backwards", [], ("row 299", "--resample")),
        ("gap", [], ("row 299", "gap", "--resample")),
        ("jitter", [], ("not uniform", "--resample")),
        ("constant", [], ("u", "constant", "2.5")),
        ("text", [], ("`y_um`", "`broken`", "row 5")),
        ("empty", [], ("empty",)),
        ("lengths", [], ("`u` has 50", "`y` has 49")),
        ("short", [], ("6 usable samples", "35 are needed")),
        ("sine", ["--taps", "31"], ("31 taps", "persistently exciting")),
    ],
)
def test_unusable_data_are_refused_and_nothing_is_written(
    kind: str, options: list[str], words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = bad_record(kind, tmp_path)
    refuse(capsys, 3, "identify", path, *options, words=words, out=tmp_path / "out")


def test_a_sine_is_identified_with_what_it_excites(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = call(capsys, "identify", bad_record("sine", tmp_path))
    assert result["excited"] < 31
    assert result["notes"]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('{"schema": "gpi-model/99"}', "gpi-model/99"),
        ("{}", "model"),
        ("not json", "model"),
        ("", "model"),
    ],
)
def test_model_files_of_another_kind_are_refused(
    text: str, word: str, good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.json"
    path.write_text(text)
    for command in ("simulate", "validate"):
        refuse(capsys, 3, command, path, good, words=("model.json", word), out=tmp_path / "out")


def test_missing_files_are_unusable_data(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "missing"
    refuse(capsys, 3, "identify", missing.with_suffix(".csv"), words=("no such file",), out=tmp_path / "out")
    refuse(capsys, 3, "simulate", missing, good, words=("cannot be read",), out=tmp_path / "out")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--taps", "many"], ("--taps",)),
        (["--nonsense"], ("--nonsense",)),
        (["--taps", "0"], ("taps",)),
        (["--delay", "-1"], ("delay",)),
        (["--warmup", "-1"], ("warmup",)),
        (["--half-widths", "a,b"], ("`half_widths` = a,b",)),
        (["--half-widths", "-1,2"], ("half",)),
        (["--holdout", "1.5"], ("`holdout` = 1.5",)),
        (["--holdout", "0.5", "--holdout-experiments", "0"], ("exclude each other",)),
        (["--holdout-experiments", "0"], ("all 1 experiments",)),
        (["--experiments", "3"], ("number 3", "has 1")),
        (["--resample", "soon"], ("`resample` = soon",)),
        (["--rate", "-2"], ("`rate` = -2",)),
    ],
)
def test_wrong_calls_are_told_from_bad_data(
    options: list[str], words: tuple[str, ...], good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    refuse(capsys, 2, "identify", good, *options, words=words, out=tmp_path / "out")


def test_out_must_be_a_folder(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine")
    refuse(capsys, 2, "identify", good, words=("is a file",), out=taken)
    assert taken.read_text() == "mine"


def test_surprises_are_one_line_with_code_1(
    good: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def surprise(*_: object, **__: object) -> None:
        raise RuntimeError("surprise")

    monkeypatch.setattr("gpi_hammerstein.cli.options.read_for_model", surprise)
    assert run(["identify", str(good)]) == 1
    assert "RuntimeError: surprise (GPI_DEBUG=1" in capsys.readouterr().err
    monkeypatch.setenv("GPI_DEBUG", "1")
    with pytest.raises(RuntimeError):
        run(["identify", str(good)])


def test_a_failure_while_writing_leaves_the_folder_as_it_was(
    good: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out.mkdir()
    (out / "model.json").write_text("old")

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("disk")

    monkeypatch.setattr("gpi_hammerstein.files.save_model", fail)
    assert run(["identify", str(good), "-o", str(out)]) == 1
    assert [file.name for file in out.iterdir()] == ["model.json"]
    assert (out / "model.json").read_text() == "old"
    assert [entry.name for entry in out.parent.iterdir()] == [out.name]


def test_summaries_are_printed_without_json(
    good: Path, identified: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["identify", str(good)]) == 0
    printed = capsys.readouterr()
    assert "held out" in printed.out and "um" in printed.out and printed.err == ""
    assert run(["simulate", str(identified / "model.json"), str(good)]) == 0
    assert "rms" in capsys.readouterr().out
    assert run(["validate", str(identified / "model.json"), str(good)]) == 0
    assert "points to" in capsys.readouterr().out


def test_the_process_leaves_with_the_code() -> None:
    command = [sys.executable, "-c", "from gpi_hammerstein_launcher import main; main()"]
    help_ = subprocess.run([*command, "--help"], capture_output=True, text=True)
    assert help_.returncode == 0
    for name in ("demo", "identify", "simulate", "validate", "excite", "reproduce"):
        assert name in help_.stdout
    missing = subprocess.run([*command, "identify", "none.csv"], capture_output=True, text=True)
    assert missing.returncode == 3 and missing.stdout == ""


@pytest.mark.parametrize(("command", "example"), [(c.__name__, e) for c, e in EXAMPLES.items()])
def test_help_ends_with_an_example_of_options_that_there_are(command, example, capsys):
    assert run([command, "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"Example: {example}" in said
    options = [word.split("=")[0] for word in example.split() if word.startswith("-")]
    assert all(re.search(rf"\s{option}\b", said) for option in options)


COMMANDS = [
    [],
    *([command.__name__] for command in EXAMPLES),
    *(["excite", kind] for kind in ("multisine", "prbs", "triangle", "steps")),
    *(["datasets", one] for one in ("list", "fetch")),
    *(["reproduce", one] for one in ("paper", "fsm", *BENCHMARKS)),
]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_flag_has_no_type_in_the_help(command, capsys):
    assert run([*command, "--help"]) == 0
    said = capsys.readouterr().out
    assert "--help" in said and "bool" not in said.lower()


def test_every_list_is_one_word_with_commas(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")
    common = ["--rate", "100", "--duration", "1", "-o", str(tmp_path / "u.csv")]
    for wrong in (["--range", "5", "95"], ["--range", "5;95"], ["--range", "5,9,95"]):
        assert run(["excite", "steps", *common, *wrong]) == 2
        assert "must be two numbers that are separated by a comma, such as -10,150" in capsys.readouterr().err
    assert run(["excite", "steps", *common, "--range", "-5,95"]) == 0
    assert pl.read_csv(tmp_path / "u.csv")["u_V"].min() == -5.0


def test_the_names_of_a_model_are_looked_for_in_a_record(
    identified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = good_columns()
    own = {"t_s": columns["t_s"], "ao_V": columns["u_V"], "ai_um": columns["y_um"]}
    other = own | {"u_V": 0 * np.asarray(columns["u_V"]), "y_um": 0 * np.asarray(columns["y_um"])}
    record = gpi.read_record(write_csv(tmp_path / "own.csv", own), input="ao", output="ai")
    path = tmp_path / "own.json"
    gpi.identify(record, half_widths=[0.0, 0.8], thresholds=0, order=1).save(path)
    # the usual names are there too, and are those of other channels
    result = call(capsys, "validate", path, write_csv(tmp_path / "more.csv", other))
    assert (result["record"]["inputs"], result["record"]["outputs"]) == (["ao_V"], ["ai_um"])
    assert result["error"]["fit_percent"] > 95
    # options go before the names of the model, and the usual names come last
    swapped = call(capsys, "validate", path, tmp_path / "more.csv", "-u", "u", "-y", "ai")
    assert (swapped["record"]["inputs"], swapped["record"]["outputs"]) == (["u_V"], ["ai_um"])
    usual = call(capsys, "validate", path, write_csv(tmp_path / "usual.csv", columns))
    assert (usual["record"]["inputs"], usual["record"]["outputs"]) == (["u_V"], ["y_um"])
    drive_only = write_csv(tmp_path / "u.csv", {"t_s": own["t_s"], "u_V": other["u_V"], "ao_V": own["ao_V"]})
    simulated = call(capsys, "simulate", path, drive_only)
    assert simulated["record"]["inputs"] == ["ao_V"] and simulated["error"] is None


def test_without_words_it_says_how_to_begin(capsys):
    run([])
    assert "To start, run `gpi demo`" in capsys.readouterr().out
