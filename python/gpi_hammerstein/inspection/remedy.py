"""What to do with a record that cannot be used as it is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpi_hammerstein._native import DataError, ParameterError
from gpi_hammerstein.io.columns import Column
from gpi_hammerstein.io.experiments import recording_of
from gpi_hammerstein.io.nameless import is_clock
from gpi_hammerstein.io.recording import Recording
from gpi_hammerstein.io.sources import Source
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.vocabulary import score


@dataclass(frozen=True)
class Remedy:
    """A problem, and how to go on."""

    problem: str
    options: dict[str, Any]
    """The options that the next command has in addition; a value in capitals has to be replaced."""
    recording: Recording | None = None
    """The record as it is with these options; None if they are only a template."""
    assumed: str | None = None
    """The options in words."""


def remedy(sources: Sequence[Source], options: dict[str, Any], problem: str) -> Remedy:
    """Find options with which a record can be read.

    Stamps that are not uniform are resampled; if the rate is missing, it has to be given; if the input is
    missing, the first two columns that move are proposed.

    Parameters
    ----------
    sources
        The content of the files.
    options
        The options with which they cannot be read.
    problem
        Why not.

    Returns
    -------
    Remedy
        The options to add.

    Examples
    --------
    >>> remedy([], {}, "no input column")  # doctest: +SKIP
    """
    if not options.get("resample") and options.get("rate") is None:
        recording = _tried(sources, {**options, "resample": True})
        if recording is not None:
            return Remedy(problem, {"resample": True}, recording, "--resample auto")
        if _tried(sources, {**options, "rate": 1.0}) is not None:
            return Remedy(problem, {"rate": _stated_rate(problem)})
    return Remedy(problem, _columns_to_name(sources[0].tables[0], options))


def _tried(sources: Sequence[Source], options: dict[str, Any]) -> Recording | None:
    """Return the record, or None if it cannot be read with these options."""
    try:
        return recording_of(sources, **options)
    except (DataError, ParameterError):
        return None


def _stated_rate(problem: str) -> str:
    """Return the rate that a message proposes, or a word that has to be replaced."""
    _, found, rest = problem.partition("on average it is ")
    return rest.split(" ")[0] if found else "HZ"


def _columns_to_name(table: Table, options: dict[str, Any]) -> dict[str, Any]:
    """Propose columns for the roles that nothing speaks for: those that move, in their order."""
    named: dict[str, Any] = {}
    if options.get("input") is None:
        moving = [column for column in table.columns if _moves(table, column)]
        clocks = [column for column in moving if score(column, "time")[0]]
        if not clocks and options.get("time") is None and options.get("rate") is None:
            clocks = [column for column in moving if is_clock(table.columns[column])][:1]
            named["time"] = clocks[0].header if clocks else None
        signals = [column for column in moving if column not in clocks]
        # a word such as "velocity" speaks against both roles, and a measured motion can be imposed
        known = [c for c in signals if score(c, "input")[0] or score(c, "output")[0]]
        signals = known if len(known) > 1 else signals
        for role, column in zip(("input", "output"), signals, strict=False):
            named[role] = column.header
        if not clocks and options.get("rate") is None and table.rate is None:
            named["rate"] = "HZ"
    return named


def _moves(table: Table, column: Column) -> bool:
    samples = table.columns[column]
    return bool(np.isfinite(samples).all() and np.ptp(samples) > 0)
