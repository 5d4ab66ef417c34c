"""Temporary files and folders: their names, their locks, and their removal after a process was killed.

A name has 128 random bits, and is created only if it does not exist (`O_EXCL`). The process that creates it
holds an exclusive lock (`flock`) on it as long as it needs it. The kernel releases the lock when the process
ends, in whatever way. So a temporary file that can be locked is one that nobody needs any more, and the next
process removes it (:func:`sweep`). Where there are no such locks (Windows, some network file systems),
nothing is swept.
"""

import errno
import os
import re
import secrets
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

PATTERN = re.compile(r"\.gpi-[0-9a-f]{32}\.tmp")
# A temporary folder with this file is not removed by the process that created it, but by the next sweep.
KEEP = "keep"
# Whether temporary files are locked, and may be renamed while they are open.
HAS_LOCKS = fcntl is not None
# How long a process waits for another one that exchanges the same folder. An exchange takes milliseconds.
PATIENCE_SECONDS = 5.0
PAUSE_SECONDS = 0.01

# The temporary files and folders of this process, which `abandon` removes.
live: set[Path] = set()
_written: list[bool] = []


def new_path(folder: Path) -> Path:
    """Return a path that does not exist, in `folder`."""
    return folder / f".gpi-{secrets.token_hex(16)}.tmp"


def lock(handle: int) -> bool:
    """Lock an open file or folder for this process; return False if another one has it.

    Raises
    ------
    OSError
        There are no locks here.
    """
    if fcntl is None:
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP))
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def is_at(path: Path, handle: int) -> bool:
    """Return whether an open file or folder still has this path."""
    try:
        return os.path.samestat(os.lstat(path), os.fstat(handle))
    except OSError:
        return False


@contextmanager
def temporary_file(folder: Path, mode: int = 0o666) -> Iterator[tuple[Path, int]]:
    """Create a file, and remove it at the end unless it was renamed.

    Parameters
    ----------
    folder
        The folder of the file.
    mode
        Its permissions, from which the process's umask is taken.

    Yields
    ------
    tuple[Path, int]
        The path, and a descriptor that is open for writing.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    while True:
        path = new_path(folder)
        live.add(path)
        handle = -1
        try:
            handle = os.open(path, flags, mode)
            with suppress(OSError):
                lock(handle)
            # Another process may have swept the file between its creation and its lock.
            if not is_at(path, handle):
                continue
            yield path, handle
            return
        finally:
            if handle >= 0:
                with suppress(OSError):
                    os.close(handle)
            with suppress(OSError):
                path.unlink(missing_ok=True)
            live.discard(path)


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """Create a folder that only this user can enter, and remove it at the end.

    Parameters
    ----------
    folder
        The folder in which it is created.

    Yields
    ------
    Path
        The path.
    """
    while True:
        path = new_path(folder)
        live.add(path)
        handle = -1
        try:
            path.mkdir(mode=0o700)
            if fcntl is not None:
                handle = os.open(path, os.O_RDONLY)
                with suppress(OSError):
                    lock(handle)
                if not is_at(path, handle):
                    continue
            yield path
            return
        finally:
            # Removed before it is unlocked: no other process must find it.
            if not (path / KEEP).exists():
                shutil.rmtree(path, ignore_errors=True)
            if handle >= 0:
                os.close(handle)
            live.discard(path)


def is_untouched() -> bool:
    """Return whether this process has written no results yet."""
    return not _written


def note_written() -> None:
    """Note that results have taken their place."""
    _written.append(True)


def abandon() -> None:
    """Remove the temporary files and folders of this process, which ends now."""
    for path in tuple(live):
        with suppress(OSError):
            path.unlink()
        shutil.rmtree(path, ignore_errors=True)


def sweep(folder: Path, recover: Callable[[Path], None] | None = None) -> None:
    """Remove what killed processes of this user left in a folder.

    Parameters
    ----------
    folder
        The folder. Nothing happens if it does not exist or cannot be read.
    recover
        Is called with each temporary folder before it is removed, to complete what was half done. Without it,
        only files are removed.
    """
    if fcntl is None:
        return
    with suppress(OSError), os.scandir(folder) as entries:
        left = [Path(entry.path) for entry in entries if PATTERN.fullmatch(entry.name)]
        for path in left:
            with suppress(OSError):
                _sweep_one(path, recover)


def _sweep_one(path: Path, recover: Callable[[Path], None] | None) -> None:
    # Neither a link nor a FIFO that somebody has put there is followed or waited for.
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        status = os.fstat(handle)
        if status.st_uid != os.geteuid() or not lock(handle) or not is_at(path, handle):
            return
        if stat.S_ISDIR(status.st_mode) and recover is not None:
            recover(path)
            shutil.rmtree(path, ignore_errors=True)
        elif stat.S_ISREG(status.st_mode):
            path.unlink(missing_ok=True)
    finally:
        os.close(handle)


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Lock an existing folder, so that two processes do not exchange it at the same time.

    If another process does not release it for some seconds, or there are no locks, the block runs without:
    every step of it is safe by itself, and only a file that the other process adds in these milliseconds
    could be lost.

    Parameters
    ----------
    folder
        The folder. If it does not exist, nothing is locked.
    """
    handle, end = -1, time.monotonic() + PATIENCE_SECONDS
    try:
        while fcntl is not None and time.monotonic() < end:
            try:
                handle = os.open(folder, os.O_RDONLY)
                if lock(handle) and is_at(folder, handle):
                    break
            except OSError:
                break  # nothing is there, or there are no locks
            # Another process has it, or has just put another folder in its place.
            os.close(handle)
            handle = -1
            time.sleep(PAUSE_SECONDS)
        yield
    finally:
        if handle >= 0:
            os.close(handle)
