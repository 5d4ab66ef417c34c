"""The tables of files and data frames, without a decision what their columns mean."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpi_hammerstein._native import ParameterError
from gpi_hammerstein.io.formats import output_files, read_tables
from gpi_hammerstein.io.frames import Frame, is_frame, read_frame
from gpi_hammerstein.io.npy import read_npy_pair
from gpi_hammerstein.io.tables import Table

PathLike = str | os.PathLike[str]
Names = str | Sequence[str]


@dataclass(frozen=True)
class Source:
    """A file or data frame, and its content."""

    name: str
    tables: list[Table]
    outputs: list[str] | None
    """The names that the user gives for the outputs; None where they are to be recognised."""


def read_sources(path: PathLike | Frame | Sequence[PathLike | Frame], output: Names | None) -> list[Source]:
    """Read the tables of files and data frames, without a decision what the columns mean.

    Parameters
    ----------
    path, output
        As in :func:`~gpi_hammerstein.io.read.read_record`.

    Returns
    -------
    list of Source
        The content of each file.

    Raises
    ------
    ParameterError, DataError
        As in :func:`~gpi_hammerstein.io.read.read_record`.

    Examples
    --------
    >>> read_sources("run.csv", None)[0].tables[0].headers()  # doctest: +SKIP
    """
    given: list[Any] = [path] if is_frame(path) or isinstance(path, str | os.PathLike) else [*path]
    sources = [one if is_frame(one) else Path(one) for one in given]
    if not sources:
        raise ParameterError("`path`: no file is given; give at least one record")
    files = output_files([one for one in sources if isinstance(one, Path)], name_list(output))
    found = []
    for one in sources:
        name = str(one) if isinstance(one, Path) else "the data frame"
        if is_frame(one):
            found.append(Source(name, [read_frame(one)], name_list(output)))
        elif files:
            found.append(Source(name, read_npy_pair(one, files.get(one)), None))
        else:
            found.append(Source(name, read_tables(one), name_list(output)))
    return found


def name_list(names: Names | None) -> list[str] | None:
    """Return one name or several names as a list.

    Parameters
    ----------
    names
        The names; None is kept.

    Examples
    --------
    >>> name_list("u")
    ['u']
    """
    return None if names is None else [names] if isinstance(names, str) else list(names)
