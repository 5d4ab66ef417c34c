"""What a file of results may replace, and the properties that the new file keeps."""

import os
import shutil
import stat
from contextlib import suppress
from pathlib import Path

from gpi_hammerstein._native import ParameterError

KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISFIFO, "a pipe (FIFO)"),
    (stat.S_ISSOCK, "a socket"),
)


def refusal(name: str, path: str | os.PathLike[str], error: OSError | ValueError) -> ParameterError:
    """Return the error for a path that the system refuses."""
    reason = getattr(error, "strerror", None) or str(error)
    return ParameterError(f"`{name}` = {os.fspath(path)}: cannot be written ({reason})")


def status_of(path: Path) -> os.stat_result | None:
    """Return the status of what a path leads to, or None if there is nothing."""
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def real_file(path: str | os.PathLike[str], name: str = "path") -> tuple[Path, os.stat_result | None]:
    """Return the file that is behind a path and its links, and its status; None if it does not exist yet.

    Raises
    ------
    ParameterError
        It is a folder, a device, a pipe or a socket, or a file that is protected against writing.
    """
    try:
        # The system, not the path's text, says where a loop of links or a name that is too long is.
        status = status_of(Path(path))
        real = Path(os.path.realpath(path))
    except (OSError, ValueError) as error:
        raise refusal(name, path, error) from error
    if status is None:
        return real, None
    if not stat.S_ISREG(status.st_mode):
        kind = next((kind for test, kind in KINDS if test(status.st_mode)), "not a regular file")
        raise ParameterError(f"`{name}` = {os.fspath(path)}: is {kind}; give the name of a file")
    if not os.access(real, os.W_OK):
        raise ParameterError(f"`{name}` = {os.fspath(path)}: the file is protected against writing")
    return real, status


def keep_properties(old: Path, new: Path) -> None:
    """Give a new file or folder the owner, permissions and extended attributes of the old one.

    What this user may not set stays as it is: the permissions are set last, and never exceed the old ones.
    """
    status = old.stat()
    with suppress(OSError, AttributeError):
        os.chown(new, status.st_uid, status.st_gid)
    with suppress(OSError):
        shutil.copystat(old, new)
        os.utime(new)
    os.chmod(new, stat.S_IMODE(status.st_mode))
