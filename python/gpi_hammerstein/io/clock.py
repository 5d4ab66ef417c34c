"""From time stamps to a sampling rate, by cutting and resampling where that is asked for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError, ParameterError, time_axis

Array = NDArray[np.float64]

# A pause longer than this many usual steps is a cut, not a stretch to interpolate over.
GAP_STEPS = 10.0
# A finer grid is a slip of the unit, and would fill the memory.
MOST_REFINED = 100.0

HINT = (
    "; --resample auto (resample=True) does that: it cuts where the clock pauses or jumps back and "
    "interpolates linearly in between"
)


@dataclass(frozen=True)
class Resampled:
    """Pieces of one record on uniform grids."""

    pieces: list[Array]
    """The columns of every piece, (samples, columns)."""
    rate: float
    """Sampling rate in Hz."""
    note: str
    """What was done, in one sentence."""


def uniform_rate(stamps: Array, source: str) -> float:
    """Read the sampling rate from uniform time stamps.

    Parameters
    ----------
    stamps
        Time of every sample in s.
    source
        The file, for messages.

    Returns
    -------
    float
        The rate in Hz. Stamps are rounded numbers: a rate within one part in a million of a whole
        number of hertz is that number.

    Raises
    ------
    DataError
        The stamps run backwards, have gaps, or are not uniform; the message names the row.

    Examples
    --------
    >>> uniform_rate(np.arange(5) * 0.005, "demo")  # doctest: +SKIP
    200.0
    """
    try:
        rate, _ = time_axis(stamps)
    except DataError as error:
        hint = HINT if len(stamps) > 2 else ""
        raise DataError(f"{source}: {error}{hint}") from error
    whole = float(round(rate))
    return whole if whole and abs(rate - whole) <= 1e-6 * rate else rate


def resample(stamps: Array, columns: Array, rate: float | None, source: str) -> Resampled:
    """Put samples on a uniform grid.

    The record is cut where the clock jumps back and where it pauses for more than ten usual (median)
    steps; every piece becomes an experiment of its own, on a grid that starts at its first stamp.
    Within a piece, values are interpolated linearly; of samples with equal stamps the first is kept.
    Nothing is filtered: a rate far below the record's own folds fast signals over.

    Parameters
    ----------
    stamps
        Time of every sample in s.
    columns
        The samples, (samples, columns).
    rate
        Rate of the grid in Hz; None takes one over the median step.
    source
        The file, for messages.

    Returns
    -------
    Resampled
        The pieces, the rate and a note of what was done.

    Raises
    ------
    ParameterError
        The rate is not positive, or more than a hundred times the record's own.
    DataError
        No two stamps increase.

    Examples
    --------
    >>> found = resample(np.array([0.0, 1, 2, 4]), np.array([[0.0], [1], [2], [4]]), None, "demo")
    >>> found.pieces[0][:, 0]
    array([0., 1., 2., 3., 4.])
    """
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise ParameterError(f"`resample` = {rate}: the rate in Hz must be positive, or `auto`")
    forward = np.diff(stamps)
    forward = forward[forward > 0]
    if forward.size == 0:
        raise DataError(f"{source}: no two of the {len(stamps)} time stamps increase; give the rate (--rate)")
    usual = float(np.median(forward))
    rate = 1.0 / usual if rate is None else float(rate)
    if rate * usual > MOST_REFINED:
        raise ParameterError(
            f"`resample` = {rate:g} Hz is more than {MOST_REFINED:g} times the record's own rate, "
            f"{1 / usual:g} Hz; interpolation adds no information: ask for less"
        )
    whole = float(round(rate))
    rate = whole if whole and abs(rate - whole) <= 1e-3 * rate else rate

    fresh = np.concatenate([[True], np.diff(stamps) != 0])
    repeated = int(np.count_nonzero(~fresh))
    stamps, columns = stamps[fresh], columns[fresh]
    steps = np.diff(stamps)
    backward, gaps = steps < 0, steps > GAP_STEPS * usual
    edges = [0, *(np.flatnonzero(backward | gaps) + 1), len(stamps)]
    pieces, short = [], 0
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        # Half a millionth of a step forgives the rounding of the last stamp.
        count = int(np.floor((stamps[end - 1] - stamps[begin]) * rate + 1 + 5e-7))
        if count < 2:
            short += int(end - begin)
            continue
        grid = stamps[begin] + np.arange(count) / rate
        pieces.append(
            np.column_stack([np.interp(grid, stamps[begin:end], column[begin:end]) for column in columns.T])
        )
    if not pieces:
        raise DataError(f"{source}: no piece of the record is longer than 1/{rate:g} s; give a higher rate")
    note = f"{source}: interpolated linearly to {rate:g} Hz"
    if len(pieces) > 1 or short:
        note += (
            f"; cut into {len(pieces)} experiments at {np.count_nonzero(gaps)} gaps and "
            f"{np.count_nonzero(backward)} backward jumps of the clock"
        )
    if repeated:
        note += f"; {repeated} rows with a repeated time stamp left out"
    if short:
        note += f"; {short} rows between two cuts left out"
    return Resampled(pieces, rate, note)
