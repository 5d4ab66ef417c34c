"""Model files."""

import os
from pathlib import Path

from gpi_hammerstein._native import DataError, Model
from gpi_hammerstein.files.single import write_atomically


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
