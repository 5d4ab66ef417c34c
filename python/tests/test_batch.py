"""Many records: finding them, one row for each, failures, resuming, and workers that die."""

import json
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import gpi_hammerstein as gpi
import schemas
from gpi_hammerstein.cli import run
from gpi_hammerstein.fleet import engine, jobs, row, work
from gpi_hammerstein.fleet.jobs import Job

QUICK = {"half_widths": 2, "thresholds": 0, "order": 1, "effects": []}


def write_record(path: Path, seed: int, samples: int = 1500) -> Path:
    """Write a stage with a play, a lag and a little noise."""
    random = np.random.default_rng(seed)
    t = np.arange(samples) / 1000
    u = (
        5
        + (3 + 0.2 * seed) * np.sin(2 * np.pi * 3 * t) * np.exp(-t)
        + 0.02 * random.normal(size=samples).cumsum()
    )
    v = u + 0.5 * np.asarray(gpi.PlayBank([0.0, 0.5], [0.0, 1.0])(u))
    y = np.convolve(v, 0.3 * 0.7 ** np.arange(40))[:samples] + 0.01 * random.normal(size=samples)
    path.parent.mkdir(parents=True, exist_ok=True)
    pl.DataFrame({"t": t, "u_V": u, "y_um": y}).write_csv(path)
    return path


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with six records, one of them a copy, and one that cannot be read."""
    folder = tmp_path_factory.mktemp("records")
    for number in range(4):
        write_record(folder / f"a/run{number}.csv", number)
    write_record(folder / "b/run0.csv", 9)
    (folder / "b/copy.csv").write_bytes((folder / "a/run1.csv").read_bytes())
    (folder / "b/broken.csv").write_text("u,y\n1,hello\n")
    return folder


@pytest.fixture(scope="module")
def finished(records: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, pl.DataFrame]:
    """Return the folder of a batch, and its table."""
    out = tmp_path_factory.mktemp("fleet")
    return out, gpi.batch(records, out=out, workers=2, **QUICK)


def test_every_record_has_one_row_in_order(records: Path, finished: tuple[Path, pl.DataFrame]) -> None:
    out, table = finished
    assert table["file"].to_list() == [str(file) for file in sorted(records.rglob("*.csv"))]
    assert dict(table.schema) == row.COLUMNS
    written = pl.read_parquet(out / "fleet.parquet")
    assert written.equals(table)
    assert pl.read_parquet_metadata(out / "fleet.parquet")["schema"] == "gpi-fleet/1"


def test_a_row_says_what_explain_says(records: Path, finished: tuple[Path, pl.DataFrame]) -> None:
    out, table = finished
    known = table.row(by_predicate=pl.col("file") == str(records / "a/run2.csv"), named=True)
    found = gpi.explain(gpi.read_record(records / "a/run2.csv"), **QUICK)
    assert (known["verdict"], known["effects"]) == (found.verdict, found.effects)
    assert known["rms_after"] == pytest.approx(found.after["holdout"]["rms"], rel=1e-9)
    assert known["samples"] == 1500
    assert known["rate_hz"] == pytest.approx(1000)
    folder = out / "records" / known["name"]
    assert sorted(file.name for file in folder.iterdir()) == ["explanation.json", "model.json", "row.parquet"]
    explanation = json.loads((folder / "explanation.json").read_text())
    schemas.require(explanation, "gpi-explanation/1")
    assert explanation["record"]["files"] == [str(records / "a/run2.csv")]
    assert explanation["record"]["experiments"] == 1
    assert gpi.load(folder / "model.json").rate == pytest.approx(1000)


def test_notes_of_the_reading_are_kept(tmp_path: Path) -> None:
    path = write_record(tmp_path / "run.csv", 1)
    table = pl.read_csv(path).rename({"u_V": "voltage_V", "y_um": "position_um"})
    table.write_csv(path)
    gpi.batch(path, out=tmp_path / "fleet", workers=1, report=True, **QUICK)
    folder = tmp_path / "fleet/records/run"
    notes = json.loads((folder / "explanation.json").read_text())["record"]["notes"]
    assert any("voltage_V" in note for note in notes)
    assert "voltage_V" in (folder / "report.html").read_text()


def test_a_record_that_cannot_be_read_is_a_row(records: Path, finished: tuple[Path, pl.DataFrame]) -> None:
    table = finished[1]
    failed = table.filter(pl.col("error").is_not_null())
    assert failed["file"].to_list() == [str(records / "b/broken.csv")]
    assert "broken.csv" in failed["error"][0]
    assert failed["verdict"].to_list() == [None]


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of POSIX")
def test_every_file_of_a_known_ending_is_a_row(tmp_path: Path) -> None:
    np.save(tmp_path / "u.npy", np.zeros(100))
    (tmp_path / "notes.md").write_text("no record")
    with ThreadPoolExecutor(1) as executor:
        table = gpi.batch(tmp_path, out=tmp_path / "fleet", executor=executor)
    assert table["name"].to_list() == ["u"]
    assert "--rate" in table["error"][0]


def test_a_pipe_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    table = gpi.batch(tmp_path / "pipe.csv", out=tmp_path / "fleet", workers=1, **QUICK)
    assert "is not a regular file" in table["error"][0]


def test_the_same_data_share_a_result(records: Path, finished: tuple[Path, pl.DataFrame]) -> None:
    table = finished[1]
    shared = table.filter(pl.col("file").is_in([str(records / "a/run1.csv"), str(records / "b/copy.csv")]))
    assert shared["key"].n_unique() == 1
    assert shared["name"].n_unique() == 1


def test_nothing_is_done_twice(records: Path, finished: tuple[Path, pl.DataFrame]) -> None:
    out, table = finished
    before = {file: file.stat().st_mtime_ns for file in (out / "records").glob("*/*")}
    again = gpi.batch(records, out=out, workers=1, **QUICK)
    assert again.equals(table)
    assert {file: file.stat().st_mtime_ns for file in (out / "records").glob("*/*")} == before


def test_other_options_are_another_result(records: Path, tmp_path: Path) -> None:
    one = [records / "a/run0.csv"]
    first = gpi.batch(one, out=tmp_path, workers=1, **QUICK)
    second = gpi.batch(one, out=tmp_path, workers=1, **{**QUICK, "half_widths": 3})
    assert first["key"][0] != second["key"][0]
    assert first["name"][0] != second["name"][0]
    assert len(list((tmp_path / "records").iterdir())) == 2


def test_a_manifest_gives_devices_and_options(records: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(records, tmp_path / "lab"))
    manifest = folder / "devices.csv"
    manifest.write_text(
        "file,device,date,half_widths,effects\n"
        "a/run0.csv,A-17,2026-03-02,2,none\n"
        'b/run0.csv,A-18,,"0,0.4,0.8",none\n'
        "gone.csv,A-19,,,\n"
    )
    given = {"thresholds": 0, "order": 1}
    table = gpi.batch(manifest=manifest, out=tmp_path / "fleet", workers=1, **given)
    assert table["device"].to_list() == ["A-17", "A-18", "A-19"]
    assert table["date"].to_list() == ["2026-03-02", None, None]
    assert "gone.csv" in table["error"][2]
    assert table["name"].to_list() == ["a-run0", "b-run0", "gone"]
    model = gpi.load(tmp_path / "fleet/records/b-run0/model.json")
    # a play that does not help has no weight, and is not in the model
    assert set(model.hysteresis[0].plays.half_widths) <= {0.0, 0.4, 0.8}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("name\nx.csv\n", "no column `file`"),
        ("file,colour\nx.csv,red\n", "column `colour` is no option"),
        ("file,order\nx.csv,two\n", "row 0, column `order`: `two` is no number"),
        ("file,device\n,A\n", "row 0, column `file` is empty"),
        ("file\n", "contains no record"),
    ],
)
def test_a_wrong_manifest_is_refused(text: str, problem: str, tmp_path: Path) -> None:
    (tmp_path / "manifest.csv").write_text(text)
    with pytest.raises((gpi.DataError, gpi.ParameterError), match=problem.replace("(", r"\(")):
        gpi.batch(manifest=tmp_path / "manifest.csv", out=tmp_path / "fleet")


def test_wrong_calls_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for problem, call in {
        "no record file is there": lambda: gpi.batch(tmp_path / "empty", out=tmp_path / "o"),
        "give record files or a manifest": lambda: gpi.batch(out=tmp_path / "o"),
        "no option of read_record or explain": lambda: gpi.batch("x.csv", out=tmp_path / "o", colour=1),
        "at least one process": lambda: gpi.batch("x.csv", out=tmp_path / "o", workers=0),
        "must be an executor": lambda: gpi.batch("x.csv", out=tmp_path / "o", executor=3),
    }.items():
        with pytest.raises(gpi.ParameterError, match=problem):
            call()


def test_results_are_no_records(records: Path, tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    shutil.copytree(records / "b", folder)
    for _ in range(2):
        table = gpi.batch(folder, out=folder / "fleet", workers=1, **QUICK)
        assert len(table) == 3


def test_paths_may_be_relative(records: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(records / "a")

    class Elsewhere(ThreadPoolExecutor):
        """A worker with another current folder."""

        def submit(self, *arguments: Any, **named: Any) -> Any:
            monkeypatch.chdir(tmp_path)
            return super().submit(*arguments, **named)

    with Elsewhere(1) as executor:
        table = gpi.batch("run0.csv", out=tmp_path / "fleet", executor=executor, **QUICK)
    assert table.select("file", "error").rows() == [("run0.csv", None)]


def test_names_differ() -> None:
    found = jobs.names([Job(Path(name)) for name in ("a/x.csv", "b/x.csv", "b/y.csv.gz", "b/x.mat", "/c/z")])
    assert found == ["a-x", "b-x", "y", "b-x-2", "z"]


def test_a_worker_that_is_killed_loses_nothing(records: Path, tmp_path: Path) -> None:
    killed: list[int] = []

    def kill(done: int, _every: int) -> None:
        # the first result is there, so the workers are in the middle of others
        if done == 2 and not killed:
            children = [p for p in multiprocessing.active_children() if p.pid is not None]
            killed.append(int(children[0].pid or 0))
            os.kill(killed[0], signal.SIGKILL)

    table = gpi.batch(records, out=tmp_path, workers=2, progress=kill, **QUICK)
    assert killed
    assert len(table) == 7
    assert table["error"].is_not_null().sum() == 1  # the record that cannot be read
    assert not [p for p in multiprocessing.active_children() if p.pid in killed]


class Deadly(work.Task):
    """A task that kills the worker that looks at it."""

    def __getattribute__(self, name: str) -> object:
        if name == "folder" and multiprocessing.parent_process() is not None:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().__getattribute__(name)


def test_a_record_that_kills_its_worker_is_a_row(records: Path, tmp_path: Path) -> None:
    files = [records / f"a/run{number}.csv" for number in range(3)]
    tasks = [work.Task(Job(file, choices=QUICK), file.stem, tmp_path / file.stem) for file in files]
    tasks[1] = Deadly(tasks[1].job, "deadly", tmp_path / "deadly")
    found = {task.key: known for task, known in engine.in_processes(tasks, engine.Processes(2))}
    assert set(found) == {"run0", "deadly", "run2"}
    assert "died 2 times" in found["deadly"]["error"]
    assert found["run0"]["error"] is None
    assert found["run2"]["error"] is None
    # such a failure is not kept: the next run tries it again
    assert not (tmp_path / "deadly").exists()


class PanicError(BaseException):
    """A panic of a library."""


@pytest.mark.parametrize("problem", [gpi.DataError("no memory"), PanicError("broken"), OSError("disk full")])
def test_a_failure_of_the_machine_is_not_kept(
    records: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, problem: BaseException
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise problem from MemoryError()

    task = work.Task(Job(records / "a/run0.csv", choices=QUICK), "key", tmp_path / "run0")
    with monkeypatch.context() as patch:
        patch.setattr(work, "read_recording", fail)
        assert str(problem) in work.work(task)["error"]
    assert not task.folder.exists()
    assert work.work(task)["error"] is None
    # and a result is not made twice
    before = (task.folder / work.ROW).stat().st_mtime_ns
    assert work.work(task)["verdict"] == "explained"
    assert (task.folder / work.ROW).stat().st_mtime_ns == before


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_keeps_what_is_done(records: Path, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-c",
        "import sys; from gpi_hammerstein.cli import run; sys.exit(run(sys.argv[1:]))",
    ]
    words = ["--half-widths", "2", "--thresholds", "0", "--order", "1", "--effects", "none", "--workers", "1"]
    running = subprocess.Popen(
        [*command, "batch", str(records), "-o", str(tmp_path), *words],
        start_new_session=True,
        stderr=subprocess.PIPE,
    )
    while not list((tmp_path / "records").glob("*/row.parquet")):
        assert running.poll() is None
        time.sleep(0.02)
    # to the whole group, as a terminal does it
    os.killpg(running.pid, signal.SIGINT)
    _, complaint = running.communicate(timeout=20)
    assert running.returncode == 130
    assert b"Traceback" not in complaint
    assert len(pl.read_parquet(tmp_path / "fleet.parquet")) < 7


def test_a_batch_that_is_stopped_goes_on(records: Path, tmp_path: Path) -> None:
    class StoppedError(Exception):
        pass

    def stop(done: int, _every: int) -> None:
        if done == 3:
            raise StoppedError

    with pytest.raises(StoppedError):
        gpi.batch(records, out=tmp_path, workers=2, progress=stop, **QUICK)
    partial = pl.read_parquet(tmp_path / "fleet.parquet")
    assert 1 <= len(partial) < 7
    known = set(work.done(tmp_path / "records"))
    table = gpi.batch(records, out=tmp_path, workers=2, **QUICK)
    assert len(table) == 7
    assert known <= set(table["key"])


def test_the_command_prints_a_summary(
    records: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ["--half-widths", "2", "--thresholds", "0", "--order", "1", "--effects", "none"]
    assert (
        run(
            [
                "batch",
                str(records / "a"),
                str(records / "b/broken.csv"),
                "-o",
                str(tmp_path),
                *words,
                "--json",
            ]
        )
        == 0
    )
    known = json.loads(capfd.readouterr().out)
    assert (known["schema"], known["records"], known["failed"]) == ("gpi-batch/1", 5, 1)
    assert run(["batch", str(records / "a"), str(records / "b/broken.csv"), "-o", str(tmp_path), *words]) == 0
    shown = capfd.readouterr().out
    assert "5 records, 1 of them without a result" in shown
    assert "broken.csv" in shown


def test_a_script_without_guard_is_told_so(records: Path, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        f"import gpi_hammerstein as gpi\ngpi.batch({str(records)!r}, out={str(tmp_path / 'fleet')!r})\n"
    )
    found = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False
    )
    assert found.returncode != 0
    assert "ParameterError: `workers`: no process can start" in found.stderr
    assert "__main__" in found.stderr


CLUSTER = """
import os, signal, sys
import gpi_hammerstein as gpi
from distributed import Client, LocalCluster

if __name__ == "__main__":
    records, out = sys.argv[1:]
    with LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            killed = []
            def kill(done, every):
                if done == 2 and not killed:
                    killed.append(next(iter(cluster.workers.values())).pid)
                    os.kill(killed[0], signal.SIGKILL)
            table = gpi.batch(
                records, out=out, executor=client, progress=kill,
                half_widths=2, thresholds=0, order=1, effects=[],
            )
    assert killed
    print(len(table), table["error"].is_not_null().sum(), len(os.listdir(out + "/records")))
"""


@pytest.mark.slow
def test_a_cluster_whose_worker_is_killed_loses_nothing(records: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    found = subprocess.run(
        [sys.executable, str(script), str(records), str(tmp_path / "fleet")],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert found.returncode == 0, found.stderr
    # seven rows, one of a file that cannot be read; six results, because two files have the same data
    assert found.stdout.split() == ["7", "1", "6"]
