"""Results appear whole or not at all, whatever happens to the process, the disk, or the folder."""

import errno
import multiprocessing
import os
import random
import resource
import shutil
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.cli import run
from gpi_hammerstein.files import exchange, require_file, require_folder, staged, write_atomically
from gpi_hammerstein.files import temporary as own

TESTS = Path(__file__).parent
LAUNCH = "from gpi_hammerstein_launcher import main; main()"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and links of Unix")


SITUATIONS = ["single", "new", "exchange", "renames", "current", "link"]


def kill_everywhere(stride: int) -> dict[str, int]:
    """Return the number of kills in each situation."""
    paths = [str(TESTS), str(TESTS.parents[1] / "tools"), *sys.path]
    done = subprocess.run(
        [sys.executable, str(TESTS / "kill_everywhere.py"), str(stride), *SITUATIONS],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    kills = {name: int(count) for name, count in (line.split() for line in done.stdout.splitlines())}
    assert sorted(kills) == sorted(SITUATIONS)
    return kills


def test_a_kill_leaves_one_generation() -> None:
    assert min(kill_everywhere(47).values()) >= 2


@pytest.mark.slow
def test_a_kill_before_any_line_leaves_one_generation() -> None:
    assert min(kill_everywhere(1).values()) > 50


FAULTS = ["os.rename", "os.replace", "os.link", "os.fsync", "os.mkdir", "os.chmod"]


@pytest.mark.parametrize("how", ["exchange", "renames", "in place"])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_call_that_fails_leaves_one_generation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str, how: str
) -> None:
    """The n-th call fails, for every n: once, or from then on as on a full disk."""
    if how == "renames":
        monkeypatch.setattr(exchange, "_exchanged", lambda *_: False)
    if how == "in place":
        monkeypatch.setattr("gpi_hammerstein.files.folder._is_current", lambda _: True)
    original = getattr(os, fault.removeprefix("os."))
    failed = 0
    for number in range(1, 40):
        for for_ever in (False, True):
            out = tmp_path / f"{number}{for_ever}" / "out"
            with staged(out) as folder:
                (folder / "a").write_text("old")
                (folder / "b").write_text("old")
            (out / "mine").write_text("mine")
            calls = 0

            def call(
                *given: object, for_ever: bool = for_ever, number: int = number, **named: object
            ) -> object:
                nonlocal calls
                calls += 1
                if calls == number or (for_ever and calls > number):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                return original(*given, **named)

            with monkeypatch.context() as broken:
                broken.setattr(fault, call)
                try:
                    with staged(out) as folder:
                        (folder / "a").write_text("new")
                        (folder / "b").write_text("new")
                except gpi.ParameterError as error:
                    assert "No space left" in str(error)
                    failed += 1
            # the next run also recovers what could not be put back
            require_folder(out)
            assert {(out / name).read_text() for name in "ab"} in ({"old"}, {"new"})
            assert sorted(os.listdir(out)) == ["a", "b", "mine"]
            assert os.listdir(out.parent) == ["out"]
        if calls < number:
            break
    assert calls < number
    # a swap that is not possible becomes renames of files; links and permissions are not needed for these
    assert failed > 0 or fault in ("os.link", "os.chmod") or (fault == "os.replace" and how != "in place")


def test_a_full_disk_is_a_typed_error(tmp_path: Path) -> None:
    """The kernel refuses a file that is longer than a limit, like a full disk."""
    write_atomically(tmp_path / "file", "old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
    try:
        with pytest.raises(gpi.ParameterError, match="File too large"):
            write_atomically(tmp_path / "file", "new" * 10_000)
        with pytest.raises(gpi.ParameterError, match="File too large"), staged(tmp_path / "out") as folder:
            (folder / "a").write_text("new" * 10_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert os.listdir(tmp_path) == ["file"] and (tmp_path / "file").read_text() == "old"


def test_a_folder_that_vanishes_is_a_typed_error(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    out.mkdir(parents=True)
    with pytest.raises(gpi.ParameterError, match="No such file"), staged(out) as folder:
        (folder / "a").write_text("a")
        shutil.rmtree(tmp_path / "deep")
        (folder / "b").write_text("b")
    with pytest.raises(gpi.ParameterError, match="No such file"):
        write_atomically(tmp_path / "deep" / "file", "a")


def make_special(kind: str, path: Path) -> None:
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as end:
            end.bind(str(path))
    elif kind == "folder":
        path.mkdir()
    elif kind == "device":
        path.symlink_to("/dev/null")
    else:
        path.symlink_to(path)


@pytest.mark.parametrize("kind", ["fifo", "socket", "folder", "device", "loop"])
def test_what_is_not_a_file_is_refused_and_stays(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    path = Path("target")
    make_special(kind, path)
    before = path.lstat()
    for refuse in (require_file, lambda path: write_atomically(path, "x")):
        with pytest.raises(gpi.ParameterError, match="`path` = target"):
            refuse(path)
    if kind != "folder":
        with pytest.raises(gpi.ParameterError, match="`out` = target"), staged(path):
            pytest.fail("the work has begun")
    with pytest.raises(gpi.ParameterError, match="target"), staged(tmp_path) as folder:
        (folder / "target").write_text("x")
    assert path.lstat().st_ino == before.st_ino and path.lstat().st_mode == before.st_mode
    assert os.listdir(tmp_path) == ["target"]


def test_commands_refuse_their_target_before_they_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    none = str(tmp_path / "none.csv")
    for words in (
        ["explain", none, "-o", "/dev/null"],
        ["identify", none, "-o", "/dev/null"],
        ["report", none, "-o", "/dev/null"],
        ["report", none, "-o", str(tmp_path)],
        ["report", none, "-o", str(tmp_path / "missing" / "page.html")],
        ["export", none, "--rust", "/dev/null"],
        ["export", none, "--c", "/dev/null"],
        ["demo", "-o", "/dev/null"],
    ):
        assert run(words) == 2
        assert words[-1] in capsys.readouterr().err


@pytest.mark.parametrize("write", ["file", "folder"])
def test_permissions_and_links_stay(tmp_path: Path, write: str) -> None:
    out = tmp_path / "out"
    out.mkdir(mode=0o750)
    (out / "secret").write_text("old")
    (out / "secret").chmod(0o600)
    (tmp_path / "real").write_text("old")
    (out / "link").symlink_to(tmp_path / "real")
    (out / "dangling").symlink_to(tmp_path / "later")
    (tmp_path / "way").symlink_to(out)

    def put(*names: str) -> None:
        if write == "file":
            for name in names:
                write_atomically(out / name, "new")
            return
        with staged(tmp_path / "way") as folder:
            for name in names:
                (folder / name).write_text("new")

    before = os.umask(0o027)
    try:
        put("secret", "fresh")
        put("link", "dangling")
    finally:
        os.umask(before)
    assert stat.S_IMODE((out / "secret").stat().st_mode) == 0o600
    assert stat.S_IMODE((out / "fresh").stat().st_mode) == 0o640
    assert stat.S_IMODE(out.stat().st_mode) == 0o750
    assert (out / "link").is_symlink() and (out / "dangling").is_symlink() and (tmp_path / "way").is_symlink()
    read: Callable[[Path], str] = Path.read_text
    assert {read(out / name) for name in ("secret", "fresh", "link", "dangling")} == {"new"}
    assert (tmp_path / "real").read_text() == (tmp_path / "later").read_text() == "new"
    assert sorted(os.listdir(tmp_path)) == ["later", "out", "real", "way"]


def test_only_what_nobody_holds_is_swept(tmp_path: Path) -> None:
    stale = own.new_path(tmp_path)
    stale.write_text("left by a killed process")
    (tmp_path / ".gpi-notes.tmp").write_text("of the user")
    with own.temporary_file(tmp_path) as (path, _), own.temporary_folder(tmp_path) as folder:
        require_folder(tmp_path)
        assert path.exists() and folder.exists() and not stale.exists()
    assert os.listdir(tmp_path) == [".gpi-notes.tmp"]


def test_the_current_folder_stays_the_same_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    before = Path(".").stat().st_ino
    with staged(".") as folder:
        (folder / "a").write_text("a")
    assert Path(".").stat().st_ino == before and os.listdir(".") == ["a"]


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_signals_end_the_command_without_a_traceback(tmp_path: Path, name: str, code: int) -> None:
    import signal

    # The launcher says when it is there: before it, the interpreter itself starts.
    launch = "import os; import gpi_hammerstein_launcher as a\n"
    launch += f"a.signal.signal(a.signal.{name}, a.leave)\n"
    launch += f"os.write(1, b'.'); {LAUNCH}"
    chance = random.Random(name)
    codes = set()
    for _ in range(5):
        out = tmp_path / "out"
        child = subprocess.Popen(
            [sys.executable, "-c", launch, "demo", "-o", str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert child.stdout is not None and child.stdout.read(1) == b"."
        try:
            child.wait(chance.uniform(0.0, 1.5))
        except subprocess.TimeoutExpired:
            child.send_signal(getattr(signal, name))
        _, errors = child.communicate()
        codes.add(child.returncode)
        assert b"Traceback" not in errors and b"Exception ignored" not in errors, errors
        assert not list(tmp_path.glob(".*"))
    assert codes == {code}


def read_in_child(path: str) -> str:
    try:
        return str(gpi.read_record(path).samples)
    except gpi.ParameterError as error:
        return str(error)


@pytest.mark.parametrize("used_before", [False, True])
def test_reading_after_fork_names_spawn_instead_of_waiting(tmp_path: Path, used_before: bool) -> None:
    u = np.arange(100.0)
    table = np.column_stack([u / 100, u, u])
    path = tmp_path / "record.csv"
    np.savetxt(path, table, delimiter=",", header="t_s,u_V,y_um", comments="")
    script = (
        "import multiprocessing, sys\n"
        "import gpi_hammerstein as gpi\n"
        "from test_transaction import read_in_child\n"
        f"if {used_before}: gpi.read_record(sys.argv[1])\n"
        "pool = multiprocessing.get_context('fork').Pool(2)\n"
        "print(pool.map(read_in_child, [sys.argv[1]]))\n"
        "pool.terminate()"
    )
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork")
    paths = os.pathsep.join([str(TESTS), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ("spawn" if used_before else "100") in done.stdout, done.stderr
