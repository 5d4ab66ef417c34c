"""Libraries that only some formats need."""

import importlib
from typing import Any

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.boundary import File


def load(module: str, extra: str, file: File) -> Any:
    """Import a library that is installed with an extra of the package.

    Parameters
    ----------
    module
        The name of its module.
    extra
        The extra that contains it.
    file
        The file that needs it.

    Returns
    -------
    module
        The module.

    Raises
    ------
    DataError
        The library is not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from gpi_hammerstein.io.limits import Allowance
    >>> load("json", "json", File(Path("demo"), b"", Allowance(Path("demo"), 0))).dumps(1)
    '1'
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DataError(
            f"{file.path}: files of this format need the package {module.split('.')[0]}, which is not "
            f"installed; run: pip install 'gpi-hammerstein[{extra}]'"
        ) from error
