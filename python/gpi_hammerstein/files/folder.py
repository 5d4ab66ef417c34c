"""Writing of a folder of results."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.files.exchange import replace_folder
from gpi_hammerstein.files.require import require_folder
from gpi_hammerstein.files.signals import deferred
from gpi_hammerstein.files.single import flush_file, flush_folder
from gpi_hammerstein.files.targets import refusal
from gpi_hammerstein.files.temporary import held, note_written, temporary_folder


@contextmanager
def staged(out: str | os.PathLike[str]) -> Iterator[Path]:
    """Collect files in a temporary folder, which then takes the place of `out` in one step.

    Other files in `out` stay. A file that is replaced keeps its permissions, and a link is followed and
    stays. If the process is killed at any moment, `out` has either all old files or all new ones, and the
    next run removes what was temporary. There is one exception: the files are renamed one by one if `out` is
    the current folder of a process, a mount point or a folder of another user, if its parent cannot be
    written, or if it has links among the results, more than 1000 other files, or temporary files of a run
    that still works. If the process is killed during these renames, the next run completes them.

    Parameters
    ----------
    out
        The folder that receives the files. It is created if it does not exist.

    Yields
    ------
    Path
        The temporary folder, for files only. If an exception occurs, it is removed, and `out` is unchanged.

    Raises
    ------
    ParameterError
        `out` is a file, or it cannot be written, or a file would replace something that is not a file.

    Examples
    --------
    >>> import tempfile
    >>> out = Path(tempfile.mkdtemp()) / "result"
    >>> with staged(out) as folder:
    ...     _ = (folder / "a.txt").write_text("a")
    >>> [file.name for file in out.iterdir()]
    ['a.txt']
    """
    target = require_folder(out)
    try:
        home, may_swap = _home(target)
        with temporary_folder(home) as container:
            new = container / "new"
            new.mkdir()
            yield new
            with deferred():
                _take_place(container, target, may_swap, out)
                note_written()
    except OSError as error:
        raise refusal("out", out, error) from error


def _home(target: Path) -> tuple[Path, bool]:
    """Return the folder for temporary files, and whether the target may be swapped."""
    if not target.exists():
        # If folders above are missing too, they are created when everything is written.
        return next(folder for folder in target.parents if folder.exists()), True
    parent, status = target.parent, target.stat()
    may_swap = (
        not os.path.ismount(target)
        and status.st_dev == parent.stat().st_dev
        and os.access(parent, os.W_OK | os.X_OK)
        and (not hasattr(os, "geteuid") or status.st_uid == os.geteuid())
        and not _is_current(target)
    )
    return (parent, True) if may_swap else (target, False)


def _is_current(target: Path) -> bool:
    """Return whether a process of this machine works in the folder: it would then stand in a removed one."""
    processes = [link for link in Path("/proc").glob("[0-9]*/cwd")] if os.path.isdir("/proc") else []
    for link in (Path("."), *processes):
        try:
            if Path(os.path.realpath(link, strict=True)).is_relative_to(target):
                return True
        except OSError:
            continue  # a process of another user, or one that has just ended
    return False


def _take_place(container: Path, target: Path, may_swap: bool, out: str | os.PathLike[str]) -> None:
    new = container / "new"
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        for file in sorted(new.iterdir()):
            flush_file(file)
        flush_folder(new)
        try:
            os.rename(new, target)
        except OSError:
            if not target.is_dir():
                raise  # else another process has created it meanwhile
        else:
            flush_folder(target.parent)
            return
    with held(target):
        for file in new.iterdir():
            place = target / file.name
            if place.exists() and not stat.S_ISREG(place.stat().st_mode):
                raise ParameterError(f"`out` = {os.fspath(out)}: {place} is not a file; give another folder")
        replace_folder(container, target, may_swap)
