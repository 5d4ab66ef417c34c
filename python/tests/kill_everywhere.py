"""Kills a write before every line of the package's writing functions, in several situations at once.

It is a program, which the tests run, because only a process without other threads may be forked.
"""

import os
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

import kill_writes
from gpi_hammerstein.files import exchange, require_folder, write_atomically
from kill_writes import (
    foreign_is_there,
    generations,
    kill_at_every_line,
    leftovers,
    make_foreign,
    write_generation,
)


def situation(name: str, place: Path) -> tuple[Path, Callable[[], None], bool]:
    """Return the folder, the work, and whether the folder is whole at once (else after the next run)."""
    out = place / "deep" / "out"
    if name == "new":
        return out, lambda: write_generation(out, 1), True
    make_foreign(out)
    write_generation(out, 0)
    if name == "renames":
        exchange._exchanged = lambda *_: False
    if name == "current":
        os.chdir(out)
    if name == "link":
        (out / "file1.txt").rename(place / "elsewhere.txt")
        (out / "file1.txt").symlink_to(place / "elsewhere.txt")
    return out, lambda: write_generation(out, 1), name == "exchange"


def folder(name: str, stride: int) -> int:
    """Kill the writing of a folder everywhere, and return the number of kills."""
    with tempfile.TemporaryDirectory() as root:
        place = Path(root).resolve() / "place"
        place.mkdir()
        out, work, at_once = situation(name, place)
        backup = Path(root) / "backup"
        shutil.copytree(place, backup, symlinks=True)
        seen: set[str] = set()

        def check(number: int) -> None:
            if at_once:
                assert len(generations(out)) <= 1, (number, generations(out))
                assert name == "new" or foreign_is_there(out), number
            require_folder(out)
            found = generations(out)
            assert len(found) == 1 or (name == "new" and not found), (number, found)
            assert name == "new" or foreign_is_there(out), number
            assert not leftovers(out), (number, leftovers(out))
            assert name != "link" or (out / "file1.txt").is_symlink()
            seen.update(found or {"none"})
            restore(backup, place)

        kills = kill_at_every_line(work, check, stride)
        # both generations were met, so that the kills were on both sides of the exchange
        assert seen == ({"none", "1"} if name == "new" else {"0", "1"}), seen
        os.chdir("/")
        return kills


def restore(backup: Path, place: Path) -> None:
    """Put the first state back, and keep the folders: a process may work in them."""
    for entry in sorted(place.rglob("*"), reverse=True):
        if entry.is_dir() and not entry.is_symlink():
            if not (backup / entry.relative_to(place)).exists():
                entry.rmdir()
        else:
            entry.unlink()
    shutil.copytree(backup, place, symlinks=True, dirs_exist_ok=True)


def single(stride: int) -> int:
    """Kill the writing of one file everywhere, and return the number of kills."""
    with tempfile.TemporaryDirectory() as root:
        path = Path(root) / "file.txt"
        write_atomically(path, "old" * 10_000)
        seen = set()

        def check(_: int) -> None:
            text = path.read_text()
            assert text in ("old" * 10_000, "new" * 10_000)
            seen.add(text[:3])
            write_atomically(path, "old" * 10_000)
            assert [file.name for file in Path(root).iterdir()] == ["file.txt"]

        kills = kill_at_every_line(lambda: write_atomically(path, "new" * 10_000), check, stride)
        assert seen == {"old", "new"}
        return kills


def main(stride: int, situations: list[str]) -> int:
    """Try all situations at once, each in a process forked from this one, which has imported the package."""
    kill_writes.FILES = 3
    children = []
    for name in situations:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                print(name, single(stride) if name == "single" else folder(name, stride), flush=True)
                code = 0
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(code)
        children.append(child)
    return max(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0 for child in children)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), sys.argv[2:]))
