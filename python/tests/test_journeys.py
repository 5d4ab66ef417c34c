"""Two journeys of a new user: mistakes in a terminal that the message alone mends, and a notebook."""

import json
import re
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run
from records import RATE, actuator, drive, good_columns, write_csv


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with records as laboratories write them, and a model."""
    folder = tmp_path_factory.mktemp("lab")
    columns = good_columns(1500)
    t, u, y = (np.array(columns[name]) for name in ("t_s", "u_V", "y_um"))
    write_csv(folder / "run.csv", columns)
    write_csv(folder / "names.csv", {"t_s": t, "alpha": u, "beta": y})
    write_csv(folder / "bare.csv", {"u_V": u, "y_um": y})
    write_csv(folder / "pause.csv", {"t_s": t + 0.5 * (np.arange(1500) > 700), "u_V": u, "y_um": y})
    write_csv(folder / "slow.csv", {"t_s": 2 * t, "u_V": u, "y_um": y})
    record = gpi.read_record(folder / "run.csv")
    gpi.identify(record, half_widths=[0.0, 0.8], thresholds=0, order=1).save(folder / "model.json")
    return folder


# A wrong call; what the message says; the call that a reader of this message tries next.
MISTAKES = {
    "a command with a typing error": (
        "identfy run.csv",
        r"'?identify'?",
        "identify run.csv --half-widths 0,0.8 --thresholds 0 --order 1",
    ),
    "an option with a typing error": (
        "simulate model.json run.csv --warmupp 10",
        r"--warmup\b",
        "simulate model.json run.csv --warmup 10",
    ),
    "names of columns that nobody knows": (
        "simulate model.json names.csv",
        r"--input.*--output.*t_s, alpha, beta",
        "simulate model.json names.csv --input alpha --output beta",
    ),
    "a column that does not exist": (
        "simulate model.json run.csv --input voltage",
        r"no column `voltage`.*the columns are: t_s, u_V, y_um",
        "simulate model.json run.csv --input u_V",
    ),
    "no time column": (
        "simulate model.json bare.csv",
        r"--rate",
        "simulate model.json bare.csv --rate 1000",
    ),
    "a pause in the record": (
        "simulate model.json pause.csv",
        r"--resample auto",
        "simulate model.json pause.csv --resample auto",
    ),
    "another rate than the model": (
        "validate model.json slow.csv",
        r"--resample 1000",
        "validate model.json slow.csv --resample 1000",
    ),
    "an effect by another word": (
        "explain run.csv --effects mains",
        r"did you mean `(?P<name>[\w-]+)` \(" + re.escape(gpi.effect_names()["periodic-disturbance"]),
        "explain run.csv --half-widths 0,0.8 --thresholds 0 --order 1 --effects {name}",
    ),
    "a range with a space": (
        "excite steps --rate 100 --duration 1 --range 5 95 -o next.csv",
        r"`5` must be two numbers that are separated by a comma",
        "excite steps --rate 100 --duration 1 --range 5,95 -o next.csv",
    ),
    "nothing to export": (
        "export model.json",
        r"--c compensator\b",
        "export model.json --c compensator",
    ),
    "files in the wrong order": (
        "validate run.csv model.json",
        r"MODEL RECORD",
        "validate model.json run.csv",
    ),
    "a page without a folder": (
        "explain run.csv --effects none --report",
        r"-o DIR",
        "explain run.csv --half-widths 0,0.8 --thresholds 0 --order 1 --effects none --report -o DIR",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_message_alone_mends_a_mistake(
    mistake: str, lab: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(lab)
    # wide, so that no word of a message is divided
    monkeypatch.setenv("COLUMNS", "300")
    wrong, says, right = MISTAKES[mistake]
    capsys.readouterr()
    assert run(wrong.split()) in (2, 3)
    printed = capsys.readouterr()
    assert printed.out == "" and "Traceback" not in printed.err
    found = re.search(says, printed.err, re.DOTALL)
    assert found, printed.err
    assert run(right.format(**found.groupdict()).split()) == 0, capsys.readouterr().err
    capsys.readouterr()


def test_what_a_search_proposes_can_be_typed(
    lab: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(lab)
    columns = good_columns(1500)
    t, u, y = (np.array(columns[name]) for name in ("t_s", "u_V", "y_um"))
    # a structure that no effect may explain, and a range of 0.1 + 0.2 and the like
    write_csv(lab / "curved.csv", {"t_s": t, "u_V": u + 0.1 + 0.2, "y_um": y + 0.1 * y**2})
    grid = ["--half-widths", "0,0.8", "--thresholds", "0", "--order", "1", "--effects", "none"]
    assert run(["explain", "curved.csv", *grid, "--json"]) == 0
    proposed = json.loads(capsys.readouterr().out)["next_experiment"]["command"]
    numbers = re.findall(r"\d[\d.]*", proposed.split("--range ")[1])
    assert len(numbers) == 2 and all(len(one.replace(".", "").strip("0")) <= 4 for one in numbers), proposed
    assert run(proposed.split()[1:]) == 0
    assert (lab / "next.csv").stat().st_size > 0


NOTEBOOK = """
record = gpi.read_record("run.csv")
record
---
len(record), record.time[0][-1], record.u[0].shape
---
frame = record.to_pandas()
list(frame.columns)
---
train, test = record[:1200], record.between(1.2, 1.5)
train, test
---
steps = []
model = gpi.identify(train, half_widths=[0.0, 0.8], thresholds=0, order=1, progress=steps.append)
steps[-1]
---
model.summary()
---
{one.name: (one.value, one.std, one.unit) for one in model.parameters if one.unit}
---
found = model.compare(test)
found
---
found.plot()
---
simulated = model.simulate(test)
float(np.abs(simulated[0] - test.y[0]).max())
---
explained = gpi.explain(record, effects="creep", half_widths=[0.0, 0.8], thresholds=0, order=1)
explained
---
explained.model.save("notebook.json")
gpi.load("notebook.json").summary()
"""


def cell(code: str, names: dict[str, Any]) -> Any:
    """Run the lines of a cell, and return the value of the last one, as a notebook does."""
    *lines, last = textwrap.dedent(code).strip().split("\n")
    exec("\n".join(lines), names)
    if re.match(r"\w+ = |\w+, \w+ = ", last):
        exec(last, names)
        return None
    return eval(last, names)


def test_a_notebook_from_the_file_to_the_saved_model(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(lab)
    names: dict[str, Any] = {"gpi": gpi, "np": np}
    shown = [cell(code, names) for code in NOTEBOOK.split("---")]
    assert repr(shown[0]) == "Record(1500 samples at 1000 Hz, u [V] -> y [um])"
    assert shown[1] == (1500, pytest.approx(1.499), (1500, 1))
    assert shown[2] == ["t [s]", "u [V]", "y [um]"]
    train, test = shown[3]
    assert (len(train), len(test)) == (1200, 300)
    assert (shown[4].stage, shown[4].done) == ("done", 1.0)
    assert "poles of G" in repr(shown[5]) and "u.weights[0]" in repr(shown[5])
    assert {"u.weights[0]", "u.weights[1]"} <= set(shown[6])
    assert shown[7].fit_percent["y"] > 99 and "fit 99" in repr(shown[7])
    assert shown[8].get_ylabel()
    # the past of the test data is unknown to a simulation from rest: the play remembers it
    assert shown[9] < 1.0
    assert shown[10].effects == []
    # what a file keeps of the uncertainty is what was there
    assert "std" in repr(shown[11])
    rows = {one.name: one for one in gpi.load(lab / "notebook.json").parameters}
    for one in names["explained"].model.parameters:
        assert rows[one.name] == one


def test_a_notebook_says_what_is_wrong_with_a_call(lab: Path) -> None:
    u = drive(500)
    y = actuator(u)
    right = gpi.Record(u, y, rate=RATE)
    for wrong, words in [
        (lambda: gpi.identify(u, y, rate=RATE), r"gpi\.identify\(gpi\.Record\(u, y, rate=1000\.0\)\)"),
        (lambda: gpi.explain(u, y), r"gpi\.explain\(gpi\.Record\(u, y, rate=1000\.0\)\)"),
        (
            lambda: gpi.identify("run.csv", rate=9.0),
            r"gpi\.identify\(gpi\.read_record\('run\.csv', rate=\.\.\.\)\)",
        ),
        (lambda: gpi.explain(right, effects=7), "`effects` is of type int.*gpi.effect_names"),
        (lambda: gpi.explain(right, y), "`holdout` is an array"),
    ]:
        with pytest.raises(gpi.ParameterError, match=words):
            wrong()
    with pytest.raises(TypeError, match="did you mean `half_widths`"):
        gpi.identify(right, halfwidths=3)  # type: ignore[call-overload]
