"""Writing of one file."""

import os
from pathlib import Path

from gpi_hammerstein.files import temporary
from gpi_hammerstein.files.targets import keep_properties, real_file, refusal
from gpi_hammerstein.files.temporary import HAS_LOCKS, note_written, sweep, temporary_file


def write_atomically(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Write a file under a temporary name in the same folder, then rename it.

    A reader never sees an incomplete file. If the write is interrupted, the old file is unchanged. A new file
    has the permissions of the process (umask), a replaced file keeps its own. A link is followed and stays.

    Parameters
    ----------
    path
        The file to write; an existing file is replaced.
    content
        Bytes, or text, which is encoded as UTF-8.

    Raises
    ------
    ParameterError
        The folder does not exist or cannot be written, or the path leads to a folder, a device, a pipe, a
        socket or a protected file.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "note.txt"
    >>> write_atomically(path, "done")
    >>> path.read_text()
    'done'
    """
    data = content.encode() if isinstance(content, str) else content
    target, old = real_file(path)
    sweep(target.parent)
    try:
        # Secret content is never readable for others, not even for a moment.
        with temporary_file(target.parent, 0o666 if old is None else 0o600) as (file, handle):
            _write(handle, data)
            if old is not None:
                keep_properties(target, file)
            os.fsync(handle)
            if not HAS_LOCKS:
                os.close(handle)  # Windows renames no open file
            os.replace(file, target)
            if not any(folder in temporary.live for folder in target.parents):
                note_written()
            flush_folder(target.parent)
    except OSError as error:
        raise refusal("path", path, error) from error


def _write(handle: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(handle, view) :]


def flush_file(path: Path) -> None:
    """Make the system store a file."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def flush_folder(path: Path) -> None:
    """Make the system store the names in a folder, where it can."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:  # Windows opens no folder
        return
    try:
        os.fsync(handle)
    except OSError:
        # Some file systems refuse this for folders; the names are then stored with the next write.
        pass
    finally:
        os.close(handle)
