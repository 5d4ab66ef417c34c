"""Where a page comes from: its date, the hash of its samples, versions, and commands that go on from it."""

import datetime
import hashlib
import os
import platform
import shlex
from collections.abc import Iterator

import numpy as np

from gpi_hammerstein._native import Model, Record, __version__

# The version of the library in `vendor`; a test compares it with the file.
UPLOT = "1.6.32"


def date() -> str:
    """Return the date and time in UTC.

    The environment variable SOURCE_DATE_EPOCH, in seconds since 1970, replaces the clock, so that a page can
    be reproduced (https://reproducible-builds.org/specs/source-date-epoch/).
    """
    wanted = os.environ.get("SOURCE_DATE_EPOCH", "")
    now = datetime.datetime.now(datetime.UTC)
    if wanted.isdecimal():
        now = datetime.datetime.fromtimestamp(int(wanted), datetime.UTC)
    return f"{now:%Y-%m-%d %H:%M} UTC"


def data_hash(record: Record) -> str:
    """Return the SHA-256 of the samples of a record, in hexadecimal digits.

    It is that of the bytes of all experiments, one after the other: the inputs, the outputs and the
    covariates, each as little-endian 64 bit floating point numbers of shape (samples, channels), row by row.
    Names, units and the sampling rate are no part of it.

    Parameters
    ----------
    record
        The record.

    Returns
    -------
    str
        64 digits.

    Examples
    --------
    >>> data_hash(gpi.Record([1.0, 2.0], [3.0, 4.0], 10.0))[:8]
    '6bab56d2'
    """
    digest = hashlib.sha256()
    channels = [record.u, record.y, *([record.covariates] if record.covariate_names else [])]
    for one in zip(*channels, strict=True):
        for samples in one:
            digest.update(np.ascontiguousarray(samples, dtype="<f8").tobytes())
    return digest.hexdigest()


def versions() -> str:
    """Return the versions of the programs that made the page."""
    python = f"Python {platform.python_version()}, NumPy {np.__version__}"
    return f"gpi-hammerstein {__version__}, {python}, uPlot {UPLOT}"


def commands(model: Model, file: str | None) -> Iterator[tuple[str, str]]:
    """Yield what can be done next, and the command.

    Parameters
    ----------
    model
        The model with all effects.
    file
        The model file beside the page; None if there is none.

    Yields
    ------
    tuple of str
        A sentence, and a command of the terminal or of Python.

    Examples
    --------
    >>> dict(commands(model, None))  # doctest: +SKIP
    {'Save the model. The other commands read it.': 'found.model.save("model.json")', ...
    """
    name = shlex.quote(file or "model.json")
    if file is None:
        yield (
            "Save the model, in Python. The commands below read this file.",
            'found.model.save("model.json")',
        )
    yield (
        "Test the model on another record of the same actuator.",
        f"gpi validate {name} OTHER.csv -o validated",
    )
    yield "Simulate the output for an input.", f"gpi simulate {name} INPUT.csv -o simulated"
    yield (
        "Compute the drive that makes the output follow a reference.",
        (f"gpi compensate {name} REFERENCE.csv -o compensated"),
    )
    if len(model.input_names) == len(model.output_names) == 1:
        yield "Write the compensator as C99 for a microcontroller.", f"gpi export {name} --c compensator"
