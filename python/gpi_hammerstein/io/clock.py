"""Sampling rates from time stamps, and resampling."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError, ParameterError, time_axis

Array = NDArray[np.float64]

# A pause longer than this number of median steps is a cut; shorter pauses are interpolated.
GAP_STEPS = 10.0
# A finer grid is most likely a wrong unit, and would need too much memory.
MOST_REFINED = 100.0

# A larger part of rows with the stamp of the row above comes from rounded stamps, not from single repeated
# rows.
ROUNDED = 0.05
# A larger part of rows that go back in time is no clock that was set back.
BACKWARD = 0.1


@dataclass(frozen=True)
class Resampled:
    """Parts of one record on uniform grids."""

    pieces: list[Array]
    """The columns of every part, (samples, columns)."""
    rate: float
    """Sampling rate in Hz."""
    note: str
    """A description of the changes, in one sentence."""


def uniform_rate(stamps: Array, source: str) -> float:
    """Return the sampling rate of uniform time stamps.

    Parameters
    ----------
    stamps
        Time of every sample in s.
    source
        Name of the file, for messages.

    Returns
    -------
    float
        The rate in Hz. Time stamps are rounded numbers. A rate that differs from an integer by less than one
        part in a million is therefore rounded to this integer.

    Raises
    ------
    DataError
        The time stamps run backwards, have gaps, or are not uniform. The message states the row.

    Examples
    --------
    >>> uniform_rate(np.arange(5) * 0.005, "demo")  # doctest: +SKIP
    200.0
    """
    try:
        rate, _ = time_axis(stamps)
    except DataError as error:
        raise DataError(f"{source}: {error}{_advice(stamps)}") from error
    if not np.isfinite(rate):
        raise DataError(
            f"{source}: the time stamps are too close together to compute a sampling rate; correct their unit"
        )
    whole = float(round(rate))
    return whole if whole and abs(rate - whole) <= 1e-6 * rate else rate


def _advice(stamps: Array) -> str:
    """Return what helps with stamps that are not uniform."""
    steps = np.diff(stamps)
    if steps.size < 2 or not np.isfinite(steps).all():
        return ""
    backward = int(np.count_nonzero(steps < 0))
    if backward > max(2, BACKWARD * steps.size) or not (steps > 0).any():
        return "; this column is no clock: name another one with --time, or give the rate in Hz with --rate"
    repeated = float(np.mean(steps == 0))
    if repeated > ROUNDED and not (steps < 0).any():
        mean = steps.size / (stamps[-1] - stamps[0])
        return (
            f"; {100 * repeated:.3g} % of the rows have the stamp of the row above, because the stamps are "
            f"rounded: give the rate with --rate, on average it is {mean:.6g} Hz"
        )
    return (
        "; use --resample auto (resample=True): it cuts the record where the clock pauses or jumps back, and "
        "interpolates linearly between the cuts"
    )


def resample(stamps: Array, columns: Array, rate: float | None, source: str) -> Resampled:
    """Interpolate samples to a uniform grid.

    The record is cut where the clock jumps back and where it pauses for more than ten median steps. Every
    part becomes a separate experiment, on a grid that starts at its first time stamp. Within a part, values
    are interpolated linearly. Of samples with equal time stamps, the first one is kept. The samples are not
    filtered: if the new rate is far below the original rate, fast signals are aliased.

    Parameters
    ----------
    stamps
        Time of every sample in s.
    columns
        The samples, (samples, columns).
    rate
        Rate of the grid in Hz; None takes the inverse of the median step.
    source
        Name of the file, for messages.

    Returns
    -------
    Resampled
        The parts, the rate, and a note that describes the changes.

    Raises
    ------
    ParameterError
        The rate is not positive, or is more than a hundred times the original rate.
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
        raise DataError(f"{source}: the {len(stamps)} time stamps do not increase; give the rate (--rate)")
    usual = float(np.median(forward))
    rate = 1.0 / usual if rate is None else float(rate)
    if not np.isfinite(rate * usual) or not np.isfinite(1.0 / usual):
        raise DataError(f"{source}: the median step of the time stamps is {usual:g} s; correct their unit")
    if rate * usual > MOST_REFINED:
        raise ParameterError(
            f"`resample` = {rate:g} Hz is more than {MOST_REFINED:g} times the original rate, "
            f"{1 / usual:g} Hz; interpolation adds no information: choose a lower rate"
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
        # Half a millionth of a step is the tolerance for the rounding of the last time stamp.
        count = int(np.floor((stamps[end - 1] - stamps[begin]) * rate + 1 + 5e-7))
        if count < 2:
            short += int(end - begin)
            continue
        grid = stamps[begin] + np.arange(count) / rate
        pieces.append(
            np.column_stack([np.interp(grid, stamps[begin:end], column[begin:end]) for column in columns.T])
        )
    if not pieces:
        raise DataError(f"{source}: no part of the record is longer than 1/{rate:g} s; give a higher rate")
    note = f"{source}: interpolated linearly to {rate:g} Hz"
    if len(pieces) > 1 or short:
        note += (
            f"; cut into {len(pieces)} experiments at {np.count_nonzero(gaps)} gaps and "
            f"{np.count_nonzero(backward)} backward jumps of the clock"
        )
    if repeated:
        note += f"; {repeated} rows with a repeated time stamp were removed"
    if short:
        note += f"; {short} rows between two cuts were removed"
    return Resampled(pieces, rate, note)
