"""Columns from named arrays, which NumPy and MATLAB files contain."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpi_hammerstein._native import DataError
from gpi_hammerstein.io.boundary import File
from gpi_hammerstein.io.columns import Column, parse_header
from gpi_hammerstein.io.tables import Array, Table
from gpi_hammerstein.io.vocabulary import score

SIGNAL_ROLES = ("input", "output", "time")
RATES = ("rate", "fs", "fs_hz", "rate_hz", "sampling_rate")
PERIODS = ("ts", "dt", "ts_s", "dt_s")


@dataclass(frozen=True)
class LeftOut:
    """An array or variable that contains no real numbers."""

    what: str
    """What it contains instead."""


# Kinds of NumPy types that are no real numbers.
OTHER_KINDS = {"c": "complex numbers", "M": "dates", "m": "time spans", "V": "structures", "O": "objects"}


def from_arrays(arrays: Mapping[str, Any], file: File) -> list[Table]:
    """Divide named arrays into columns.

    Parameters
    ----------
    arrays
        Names and arrays of the shapes (samples,), (samples, channels), (samples, channels,
        realisations) or (samples, channels, realisations, periods). A scalar ``rate`` or ``fs`` is the
        sampling rate in Hz; a scalar ``dt`` or ``Ts`` is the sampling period in s. Arrays of text are text
        columns. Other arrays without real numbers are left out, and a note says so.
    file
        The file that contains the arrays.

    Returns
    -------
    list of Table
        One table for each realisation. Its periods are joined in time. All periods except the last one are
        warm-up, so that only the steady state is scored.

    Raises
    ------
    DataError
        There is no array of samples, the arrays have different lengths, or an array has more channels than
        samples. There are more columns than the limit.

    Examples
    --------
    >>> from pathlib import Path
    >>> from gpi_hammerstein.io.limits import Allowance
    >>> file = File(Path("demo"), b"", Allowance(Path("demo"), 0))
    >>> [table] = from_arrays({"u": np.zeros((5, 2)), "rate": 100.0}, file)
    >>> [column.name for column in table.headers()], table.rate
    (['u1', 'u2'], 100.0)
    """
    source = str(file.path)
    rate: float | None = None
    signals: dict[str, Array] = {}
    text: dict[Column, str] = {}
    left_out: dict[str, str] = {}
    for name, value in arrays.items():
        if isinstance(value, LeftOut):
            left_out[name] = value.what
            continue
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            if array.dtype.kind not in "US":
                left_out[name] = OTHER_KINDS.get(array.dtype.kind, "no numbers")
            elif array.size > 1:
                text[parse_header(name)] = f"text, first `{array.flat[0]}` in row 0"
            elif name.lower() in (*RATES, *PERIODS):
                left_out[name] = "text"
            continue
        if array.size == 1:
            last = name.rsplit("/", 1)[-1].lower()  # the name of a group may stand before it
            if last in RATES:
                rate = float(array.item())
            elif last in PERIODS:
                rate = 1.0 / float(array.item()) if array.item() else np.inf
            continue
        with np.errstate(over="ignore"):  # an infinite sample is refused later, with its row
            signals[name] = _samples_first(array.astype(np.float64), name, source)
    if not signals:
        others = "".join(f"; `{name}` contains {what}" for name, what in left_out.items())
        raise DataError(f"{source}: no array of samples; a record needs arrays such as `u` and `y`{others}")
    file.allowance.check_columns(sum(array.shape[1] for array in signals.values()))
    _require_one_length(signals, left_out, source)
    return [
        Table(
            f"{source} (realisation {index})" if count > 1 else source,
            columns,
            text,
            rate,
            warmup,
            left_out=left_out,
        )
        for index, (columns, warmup, count) in enumerate(_realisations(signals, source))
    ]


def _require_one_length(signals: dict[str, Array], left_out: dict[str, str], source: str) -> None:
    """Remove arrays of another length from `signals`, unless they are named as a part of the record."""
    lengths = Counter(len(array) for array in signals.values())
    named = [name for name in signals if any(score(parse_header(name), role)[0] for role in SIGNAL_ROLES)]
    first = named[0] if named else max(signals, key=lambda name: lengths[len(signals[name])])
    for name in list(signals):
        if len(signals[name]) == len(signals[first]):
            continue
        if name in named:
            raise DataError(
                f"{source}: `{first}` has {len(signals[first])} samples, but `{name}` has "
                f"{len(signals[name])}; the lengths must be equal"
            )
        left_out[name] = f"{len(signals.pop(name))} values, and `{first}` {len(signals[first])}"


def _samples_first(array: Array, name: str, source: str) -> Array:
    """Reshape an array to (samples, channels, realisations, periods)."""
    if array.ndim == 2 and array.shape[0] == 1:
        array = array.T
    if not 1 <= array.ndim <= 4 or array.size == 0:
        raise DataError(
            f"{source}: array `{name}` has the shape {array.shape}; it must be (samples, channels, "
            "realisations, periods) or the first one, two or three of these, and must not be empty"
        )
    array = array.reshape(*array.shape, *(1 for _ in range(4 - array.ndim)))
    samples, channels = array.shape[:2]
    if channels > samples:
        raise DataError(
            f"{source}: array `{name}` has {samples} samples of {channels} channels; "
            "the first axis must be that of the samples: transpose the array"
        )
    return array


def _realisations(
    signals: Mapping[str, Array], source: str
) -> Sequence[tuple[dict[Column, Array], int, int]]:
    """Return the columns, the warm-up and the number of realisations, for each realisation."""
    samples = len(next(iter(signals.values())))
    count, periods = max(array.shape[2:] for array in signals.values())
    for name, array in signals.items():
        if array.shape[2:] != (count, periods):
            raise DataError(
                f"{source}: `{name}` has {array.shape[2]} realisations of {array.shape[3]} periods, but "
                f"another array has {count} of {periods}; they must be equal"
            )
    result = []
    for index in range(count):
        columns: dict[Column, Array] = {}
        for name, array in signals.items():
            array_column = parse_header(name)
            channels = array.shape[1]
            for channel in range(channels):
                joined = np.ascontiguousarray(array[:, channel, index, :].T.reshape(-1))
                if channels == 1:
                    columns[array_column] = joined
                    continue
                numbered = f"{array_column.name}{channel + 1}"
                columns[Column(numbered, numbered, array_column.unit, array_column.name)] = joined
        result.append((columns, (periods - 1) * samples, count))
    return result
