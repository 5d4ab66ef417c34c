"""The inspection of the files that were dropped, and their first pictures."""

from typing import Any

from gpi_hammerstein._native import GpiError
from gpi_hammerstein.app.choices import Choices
from gpi_hammerstein.app.signals import Signals, signals_of
from gpi_hammerstein.app.uploads import Uploads
from gpi_hammerstein.inspection import inspect
from gpi_hammerstein.inspection.text import text_of
from gpi_hammerstein.io import read_recording


def look(uploads: Uploads, choices: Choices) -> tuple[dict[str, Any], Signals | None]:
    """Inspect files.

    Parameters
    ----------
    uploads
        The files that are kept.
    choices
        Which of them, and how they are read.

    Returns
    -------
    dict
        What `gpi inspect --json` prints, with the names that the user knows, and its ``text``.
    Signals
        What is drawn; None if the record cannot be read.

    Raises
    ------
    ParameterError, DataError
        The files cannot be read at all.

    Examples
    --------
    >>> look(uploads, Choices(files=["0f3a"]))[0]["record"]["samples"]  # doctest: +SKIP
    2000
    """
    paths = [upload.path for upload in uploads.find(choices.files)]
    found = inspect(paths, **choices.columns())
    facts: dict[str, Any] = renamed(found.to_dict(), uploads)
    facts["text"] = text_of(facts)
    reading = choices.columns()
    if found.assumed is not None:
        # the only record that is read in spite of a problem: with a clock that is not uniform
        reading |= {"resample": True, "rate": None}
    try:
        recording = read_recording(paths, **reading)
    except GpiError:
        return facts, None
    return facts, signals_of(recording)


def renamed(value: Any, uploads: Uploads, *, quoted: bool = False) -> Any:
    """Return a result in which files have the names that the user knows.

    Parameters
    ----------
    value
        Values that JSON can represent.
    uploads
        The files.
    quoted
        Whether the text is a command for a shell.

    Examples
    --------
    >>> from pathlib import Path
    >>> renamed({"samples": 3}, Uploads(Path("private")))
    {'samples': 3}
    """
    if isinstance(value, dict):
        return {key: renamed(one, uploads, quoted=quoted or key == "command") for key, one in value.items()}
    if isinstance(value, list):
        return [renamed(one, uploads, quoted=quoted) for one in value]
    return uploads.shown(value, quoted=quoted) if isinstance(value, str) else value
