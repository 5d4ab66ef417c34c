"""The step in which a new generation of results takes the place of the old one, and its recovery.

A temporary folder contains:

    new/       the files of this run
    whole/     the complete next generation: links to `new` and to the other files of the target
    journal    what is about to be done; `undo` if it failed and is taken back
    old/       the old generation, or copies of its files

In a swap, `whole` and the target exchange their names in one step of the file system (`renameat2` with
`RENAME_EXCHANGE`, Linux). Where there is no such step, the target is renamed to `old`, then `whole` to the
target; a process that is killed between the two leaves no target, and the next run puts the old one back.

Some targets must stay the same folder: the current folder of a process, a mount point, a folder of somebody
else or with links among the results. Their files are renamed one by one, which takes well below a
millisecond. If the process is killed within this time, the journal remains, and the next run renames the
rest.
"""

import ctypes
import errno
import json
import os
import shutil
import stat
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.files.single import flush_file, flush_folder, write_atomically
from gpi_hammerstein.files.targets import keep_properties
from gpi_hammerstein.files.temporary import KEEP, PATTERN

# A target with more other files than this is not linked into a new folder: its files are renamed one by one.
MOST_LINKS = 1000
AT_FDCWD, RENAME_EXCHANGE = -100, 2


class CannotSwapError(Exception):
    """The target must stay the same folder."""


def replace_folder(container: Path, target: Path, may_swap: bool) -> None:
    """Let the files in ``container/new`` take their place in the existing folder `target`.

    Raises
    ------
    OSError
        A step failed. The target has its old content.
    """
    new = container / "new"
    names = sorted(os.listdir(new))
    for name in names:
        flush_file(new / name)
    replaced = target.stat().st_ino
    try:
        if not may_swap:
            raise CannotSwapError
        whole = _assemble(container, target, names)
        _write_journal(container, target, replaced)
        swap(whole, target, container / "old")
    except (OSError, CannotSwapError):
        if not target.is_dir():
            raise  # neither could be renamed
        shutil.rmtree(container / "whole", ignore_errors=True)
        _replace_files(container, target, names)
    else:
        with suppress(OSError):
            _rescue(container, target, replaced)


def _assemble(container: Path, target: Path, names: list[str]) -> Path:
    """Build the complete next generation of the target from links."""
    new, whole = container / "new", container / "whole"
    whole.mkdir()
    links = 0

    def link(source: str | os.PathLike[str], to: str | os.PathLike[str]) -> None:
        nonlocal links
        links += 1
        if links > MOST_LINKS:
            raise CannotSwapError
        os.link(source, to, follow_symlinks=False)

    with os.scandir(target) as entries:
        for entry in entries:
            place = whole / entry.name
            is_plain = entry.is_file(follow_symlinks=False)
            if PATTERN.fullmatch(entry.name) or (entry.name in names and not is_plain):
                # Another run works in this folder, or a result is a link to somewhere else.
                raise CannotSwapError
            if entry.name in names:
                keep_properties(Path(entry.path), new / entry.name)
            elif entry.is_dir(follow_symlinks=False):
                shutil.copytree(entry.path, place, symlinks=True, copy_function=link)
            else:
                link(entry.path, place)
    for name in names:
        os.link(new / name, whole / name)
    keep_properties(target, whole)
    flush_folder(whole)
    return whole


def swap(whole: Path, target: Path, old: Path) -> None:
    """Exchange the names of two folders in one step, or rename both where this is not possible."""
    if not _exchanged(whole, target):
        # If even the way back fails, the old results stay in the temporary folder for the next run.
        keep = old.parent / KEEP
        keep.touch()
        os.rename(target, old)
        try:
            os.rename(whole, target)
        except OSError:
            os.rename(old, target)
            keep.unlink()
            raise
        keep.unlink()
    flush_folder(target.parent)


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange two names by the system call of Linux; return False if there is none."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):  # a C library without it
        return False
    if call(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    # The file system or the kernel has no such step.
    if number in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
        return False
    raise OSError(number, os.strerror(number), str(other))


def _replace_files(container: Path, target: Path, names: list[str]) -> None:
    """Rename the new files over the old ones, and put the old ones back if one of the renames fails."""
    new, old = container / "new", container / "old"
    old.mkdir()
    for name in names:
        if (target / name).exists() and not (target / name).is_symlink():
            _copy(target / name, old / name)
    fresh = [name for name in names if not (target / name).exists()]
    _write_journal(container, target, None, fresh)
    try:
        for name in names:
            _replace_file(new / name, target / name)
    except BaseException:
        # If even the way back fails, the next run goes it.
        (container / KEEP).touch()
        os.rename(container / "journal", container / "undo")
        _undo(container, target, fresh)
        (container / KEEP).unlink()
        raise
    flush_folder(target)


def _undo(container: Path, target: Path, fresh: list[str]) -> None:
    """Put the old files back, and remove the new ones that replaced none."""
    for file in sorted((container / "old").iterdir()):
        os.replace(file, target / file.name)
    for name in fresh:
        if not (container / "new" / name).exists():
            (target / name).unlink(missing_ok=True)


def _copy(file: Path, copy: Path) -> None:
    """Give a file a second name, or copy it where a file can have only one."""
    try:
        os.link(file, copy)
    except OSError:
        shutil.copy2(file, copy)


def _replace_file(new: Path, place: Path) -> None:
    if place.is_symlink():
        try:
            write_atomically(place, new.read_bytes())
        except ParameterError as error:
            raise OSError(errno.EINVAL, str(error)) from error
        new.unlink()
        return
    if place.exists():
        keep_properties(place, new)
    os.replace(new, place)


def _write_journal(container: Path, target: Path, replaces: int | None, fresh: Sequence[str] = ()) -> None:
    """Note what is about to be done: a swap of the folder with this inode, or renames of files (None)."""
    # A relative path stays right if somebody renames the folder above.
    content = {"target": os.path.relpath(target, container), "replaces": replaces, "fresh": list(fresh)}
    (container / "journal.part").write_text(json.dumps(content))
    flush_file(container / "journal.part")
    os.rename(container / "journal.part", container / "journal")
    flush_folder(container)


def recover(container: Path) -> None:
    """Complete or undo what a killed process had begun in its temporary folder, which can then be removed."""
    try:
        undone = (container / "undo").exists()
        journal: dict[str, Any] = json.loads((container / ("undo" if undone else "journal")).read_text())
    except (FileNotFoundError, ValueError):
        return  # nothing had begun
    target = Path(os.path.normpath(container / journal["target"]))
    if journal["replaces"] is None:
        if not target.exists():
            return  # somebody has removed it since
        if undone:
            _undo(container, target, journal["fresh"])
            return
        for file in sorted((container / "new").iterdir()):
            _replace_file(file, target / file.name)
        return
    if not target.exists() and (container / "old").exists():
        os.rename(container / "old", target)
    else:
        _rescue(container, target, journal["replaces"])


def _rescue(container: Path, target: Path, replaced: int) -> None:
    """Move entries of the old generation that are not in the new one, because they were added meanwhile."""
    for folder in (container / "whole", container / "old"):
        with suppress(FileNotFoundError):
            status = folder.stat()
            if not stat.S_ISDIR(status.st_mode) or status.st_ino != replaced:
                continue
            for entry in sorted(folder.iterdir()):
                if not os.path.lexists(target / entry.name):
                    os.rename(entry, target / entry.name)
