"""Refusal of targets that cannot be written, before the work begins."""

import os
from pathlib import Path

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.files.exchange import recover
from gpi_hammerstein.files.targets import real_file, refusal, status_of
from gpi_hammerstein.files.temporary import sweep, temporary_file


def require_file(path: str | os.PathLike[str], name: str = "path") -> None:
    """Refuse a file that cannot be written, before the work that its content needs.

    A temporary file is created in its folder and removed again: this also finds a full or read-only file
    system.

    Parameters
    ----------
    path
        The file.
    name
        The parameter that the error names.

    Raises
    ------
    ParameterError
        The path leads to a folder, a device, a pipe, a socket, or a protected file, or its folder does not
        exist or cannot be written.

    Examples
    --------
    >>> require_file("/dev/null")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    gpi_hammerstein.ParameterError: `path` = /dev/null: is a device; give the name of a file
    """
    real, _ = real_file(path, name)
    _probe(real.parent, path, name)


def require_folder(out: str | os.PathLike[str], name: str = "out") -> Path:
    """Refuse a folder of results that cannot be written, before the work that the results need.

    A temporary file is created and removed again. What a killed process left behind is removed.

    Parameters
    ----------
    out
        The folder. It need not exist; a link to a folder is followed.
    name
        The parameter that the error names.

    Returns
    -------
    Path
        The absolute path without links.

    Raises
    ------
    ParameterError
        The path, or the part of it that exists, is not a folder or cannot be written.

    Examples
    --------
    >>> require_folder("/dev/null")
    Traceback (most recent call last):
    ...
    gpi_hammerstein.ParameterError: `out` = /dev/null: /dev/null is a file; give a folder
    """
    try:
        status_of(Path(out))
        target = Path(os.path.realpath(out))
        sweep(target.parent, recover)
        base = next(folder for folder in (target, *target.parents) if status_of(folder) is not None)
    except NotADirectoryError:
        base = next(file for file in Path(os.path.abspath(out)).parents if file.exists())
    except (OSError, ValueError) as error:
        raise refusal(name, out, error) from error
    if not base.is_dir():
        raise ParameterError(f"`{name}` = {os.fspath(out)}: {base} is a file; give a folder")
    _probe(base, out, name)
    return target


def _probe(folder: Path, path: str | os.PathLike[str], name: str) -> None:
    sweep(folder, recover)
    try:
        with temporary_file(folder):
            pass
    except OSError as error:
        raise refusal(name, path, error) from error
