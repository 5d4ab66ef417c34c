"""Properties of the columns of a table."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein.io.recording import Recording
from gpi_hammerstein.io.tables import Table

Array = NDArray[np.float64]

# Levels are the same if they differ by less than this part of the range, which is rounding of the arithmetic.
SAME = 1e-9
# A signal is called quantised if a sample in this number of samples is not at a level of its own.
REPEATED = 4
# A step is a multiple of the smallest one within this part of it, and this part of the steps must be. By
# hand.
UNEVEN, MOSTLY = 0.05, 0.9


def facts_of_columns(table: Table, recording: Recording | None) -> list[dict[str, Any]]:
    """Return the properties of every column of a table.

    Parameters
    ----------
    table
        The columns.
    recording
        The record that was made of them; None if it could not be made.

    Returns
    -------
    list of dict
        ``header``, ``name``, ``unit``, ``role`` (time, input, output, covariate or unused), ``why``, ``low``,
        ``high``, ``step`` (the resolution; None if it is finer than the samples show), ``missing`` (samples
        that are no numbers), ``constant``, ``text``.

    Examples
    --------
    >>> from gpi_hammerstein.io.columns import parse_header
    >>> [row] = facts_of_columns(Table("demo", {parse_header("u_V"): np.arange(3.0)}, {}), None)
    >>> row["unit"], row["high"], row["role"]
    ('V', 2.0, 'unused')
    """
    roles = {} if recording is None else _roles(recording)
    why = {} if recording is None else recording.why
    rows = []
    for column in table.headers():
        row: dict[str, Any] = {
            "header": column.header,
            "name": column.name,
            "unit": column.unit,
            "role": roles.get(column.header, "unused"),
            "why": why.get(column.header, ""),
            "low": None,
            "high": None,
            "step": None,
            "missing": 0,
            "constant": False,
            "text": table.text.get(column),
        }
        if column in table.columns:
            row |= _range(table.columns[column])
        rows.append(row)
    return rows


def _roles(recording: Recording) -> dict[str, str]:
    """Return the role of each column that has one, by its header."""
    found: dict[str, str] = {}
    for role, columns in (
        ("time", [recording.time] if recording.time else []),
        ("input", recording.inputs),
        ("output", recording.outputs),
        ("covariate", recording.covariates),
    ):
        found |= {column.header: role for column in columns}
    return found


def _range(samples: Array) -> dict[str, Any]:
    finite = samples[np.isfinite(samples)]
    if not finite.size:
        return {"missing": len(samples)}
    low, high = float(finite.min()), float(finite.max())
    return {
        "low": low,
        "high": high,
        "step": resolution(finite),
        "missing": len(samples) - len(finite),
        "constant": low == high,
    }


def resolution(samples: Array) -> float | None:
    """Return the distance of the levels of a quantised signal.

    The distances of neighbouring levels of a quantised signal are multiples of the smallest one. Levels of a
    smooth signal that repeats are not.

    Parameters
    ----------
    samples
        The signal, (samples,).

    Returns
    -------
    float
        The distance; None if nearly every sample has a level of its own, or the levels are no multiples.

    Examples
    --------
    >>> resolution(np.round(np.sin(np.arange(1000)), 1))
    0.1
    """
    levels = np.unique(samples)
    span = float(levels[-1] - levels[0]) if levels.size else 0.0
    if levels.size < 2 or not np.isfinite(span):
        return None
    steps = np.diff(levels)
    steps = steps[steps > SAME * span]
    if not steps.size or (steps.size + 1) * REPEATED > len(samples):
        return None
    multiples = steps / steps.min()
    if np.mean(np.abs(multiples - np.rint(multiples)) < UNEVEN) < MOSTLY:
        return None
    return float(f"{steps.min():.6g}")
