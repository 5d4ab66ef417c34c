"""Atomic writing of files, and model files."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gpi_hammerstein._native import DataError, Model, ParameterError

__all__ = ["load_model", "save_model", "staged", "write_atomically"]


def write_atomically(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Write a file under a temporary name in the same folder, then rename it.

    A reader never sees an incomplete file. If the write is interrupted, the old file is unchanged.

    Parameters
    ----------
    path
        The file to write; an existing file is replaced.
    content
        Bytes, or text, which is encoded as UTF-8.

    Raises
    ------
    ParameterError
        The folder does not exist or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "note.txt"
    >>> write_atomically(path, "done")
    >>> path.read_text()
    'done'
    """
    target = Path(path)
    data = content.encode() if isinstance(content, str) else content
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise ParameterError(f"`path` = {target}: cannot be written ({error.strerror})") from error


def save_model(model: Model, path: str | os.PathLike[str]) -> None:
    """Write a model as a `gpi-model/1` JSON file.

    Parameters
    ----------
    model
        The model.
    path
        The file, for example ``model.json``.

    Raises
    ------
    ParameterError
        The folder does not exist or cannot be written.

    Examples
    --------
    >>> gpi.save(model, "model.json")  # doctest: +SKIP
    """
    write_atomically(path, model.to_json())


def load_model(path: str | os.PathLike[str]) -> Model:
    """Read a model file that :meth:`Model.save` or ``gpi identify`` has written.

    Parameters
    ----------
    path
        A `gpi-model/1` JSON file.

    Returns
    -------
    Model
        The model. Its `identification` is not stored in the file and is None. Its `refinement` has only the
        parameters with their standard deviations, the noise floor and the status; it is None if the file has
        none.

    Raises
    ------
    DataError
        The file is missing, is not a model file, or has an unknown version.

    Examples
    --------
    >>> model = gpi.load("model.json")  # doctest: +SKIP
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); give a model file") from error
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: not a model file, because it is not text; give a model.json") from error
    try:
        return Model.from_json(text)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


@contextmanager
def staged(out: str | os.PathLike[str]) -> Iterator[Path]:
    """Collect files in a temporary folder, and move them to `out` when all of them are written.

    Parameters
    ----------
    out
        The folder that receives the files. It is created if it does not exist.

    Yields
    ------
    Path
        The temporary folder. If an exception occurs, it is removed, and `out` is unchanged.

    Raises
    ------
    ParameterError
        `out` is a file, or its parent folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> out = Path(tempfile.mkdtemp()) / "result"
    >>> with staged(out) as folder:
    ...     _ = (folder / "a.txt").write_text("a")
    >>> [file.name for file in out.iterdir()]
    ['a.txt']
    """
    target = Path(out).absolute()
    base = next(folder for folder in (target, *target.parents) if folder.exists())
    if not base.is_dir():
        raise ParameterError(f"`out` = {out}: {base} is a file; give a folder")
    # In the same parent folder, so that every move is a rename within one file system.
    beside = target.parent if target.parent.exists() else base
    try:
        folder = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=beside))
    except OSError as error:
        raise ParameterError(f"`out` = {out}: {beside} cannot be written ({error.strerror})") from error
    try:
        yield folder
        target.mkdir(parents=True, exist_ok=True)
        for file in sorted(folder.iterdir()):
            os.replace(file, target / file.name)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
