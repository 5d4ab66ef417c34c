"""What an input excites: band, turning points, speeds, holds and periods.

A swing is the part of the input between two turning points; a turning point counts if the input moves back by
more than a part of its span. Small and fast swings can ride on large and slow ones, so that swings are
counted with several such parts, as in rainflow counting. A play of half-width r opens only if a swing is
longer than 2 r: the largest swing limits the half-widths, and swings of several lengths determine nested
loops.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Parts of the span by which an input must return before a turning point counts. By hand: noise of a measured
# drive is below the first one.
TURNS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.7)
# Lengths of swings are the same within this part of the span.
LEVEL = 0.05
# The part of the span with which the swings are found that are counted and whose speeds are compared: one of
# the above.
LONG = 0.2
# Part of the power that may lie beyond the band that is reported.
OUTSIDE = 0.01
# An input rests where it changes by less than this part of its span.
STILL = 1e-3
# Correlation of an input with itself, one period later, from which it is called periodic; noise of a measured
# drive takes about 1e-3.
PERIODIC = 0.995
# Samples that the search for turning points looks at; a longer input is divided into blocks, whose extremes
# stay.
MOST = 200_000


@dataclass(frozen=True)
class Excitation:
    """The excitation by one input, over all experiments."""

    low: float
    high: float
    band_hz: tuple[float, float]
    """Frequencies between which nearly all of the power lies, without the mean."""
    swings: int
    """Swings between turning points after which the input moves back by more than a fifth of its span."""
    largest_swing: float
    lengths: int
    """Different lengths of swings."""
    speeds: float
    """Ratio of the fast to the slow long swings (90th to 10th percentile); 1 for one speed."""
    longest_hold_s: float
    """Longest time without a change."""
    period_s: float | None
    """Period of an input that repeats; None if it does not."""

    def span(self) -> float:
        """Return the difference of the largest and the smallest value."""
        return self.high - self.low


def excitation(experiments: Sequence[Array], rate: float) -> Excitation:
    """Describe the excitation by one input.

    Parameters
    ----------
    experiments
        The samples of each experiment, (samples,).
    rate
        Sampling rate in Hz.

    Returns
    -------
    Excitation
        Its properties.

    Examples
    --------
    >>> t = np.arange(4000) / 1000.0
    >>> found = excitation([np.sin(2 * np.pi * t)], 1000.0)
    >>> found.swings, found.lengths, round(found.speeds, 1)
    (7, 1, 1.0)
    """
    low, high = min(float(u.min()) for u in experiments), max(float(u.max()) for u in experiments)
    span = high - low
    if not span > 0:
        return Excitation(low, high, (0.0, 0.0), 0, 0.0, 0, 1.0, 0.0, None)
    lengths, speeds, count = [], [], 0
    for u in experiments:
        for part in TURNS:
            places = turning_points(u, part * span)
            # what comes before the first turning point and after the last one is no whole swing
            found = np.abs(np.diff(u[places]))
            lengths += found.tolist()
            if part == LONG:
                count += len(found)
                speeds += (found * rate / np.diff(places)).tolist()
    swings = np.asarray(lengths)
    slow, quick = np.percentile(speeds, [10, 90]) if len(speeds) > 1 else (1.0, 1.0)
    longest = max(experiments, key=len)
    return Excitation(
        low,
        high,
        band(longest, rate),
        count,
        float(swings.max()) if swings.size else span,
        clusters(swings, LEVEL * span),
        float(quick / slow) if slow > 0 else 1.0,
        max(longest_hold(u, STILL * span) for u in experiments) / rate,
        period(longest, rate),
    )


def turning_points(u: Array, margin: float) -> NDArray[np.intp]:
    """Return the samples at which a signal turns, and moves back by more than `margin`.

    Parameters
    ----------
    u
        The signal, (samples,).
    margin
        The least movement between two turning points.

    Returns
    -------
    numpy.ndarray
        Their indices.

    Examples
    --------
    >>> turning_points(np.array([0.0, 2.0, 1.9, 3.0, 0.0, 2.0]), 0.5)
    array([3, 4])
    """
    places = _extremes(u)
    found: list[int] = []
    lowest = highest = int(places[0])
    direction = 0
    for place in map(int, places):
        value = u[place]
        if value > u[highest]:
            highest = place
        if value < u[lowest]:
            lowest = place
        if direction >= 0 and u[highest] - value > margin:
            if direction > 0:
                found.append(highest)
            direction, lowest = -1, place
        elif direction <= 0 and value - u[lowest] > margin:
            if direction < 0:
                found.append(lowest)
            direction, highest = 1, place
    return np.asarray(found, dtype=np.intp)


def _extremes(u: Array) -> NDArray[np.intp]:
    """Return the local extremes; of a long signal, the extremes of blocks."""
    if len(u) > MOST:
        size = -(-2 * len(u) // MOST)
        count = len(u) // size
        blocks = u[: count * size].reshape(count, size)
        start = size * np.arange(count)
        pairs = np.stack([start + blocks.argmin(axis=1), start + blocks.argmax(axis=1)], axis=1)
        return np.asarray(np.unique(pairs), dtype=np.intp)
    slopes = np.sign(np.diff(u))
    moving = np.flatnonzero(slopes)
    if not moving.size:
        return np.zeros(1, dtype=np.intp)
    turns = moving[1:][np.diff(slopes[moving]) != 0]
    return np.concatenate([[0], turns, [len(u) - 1]]).astype(np.intp)


def clusters(values: Array, width: float) -> int:
    """Return the number of groups of values that are more than `width` apart.

    Parameters
    ----------
    values
        The values.
    width
        The least distance of two groups; a group that is wider counts once for each width.

    Examples
    --------
    >>> clusters(np.array([1.0, 1.01, 2.0, 2.02]), 0.1)
    2
    """
    count, start = 0, -np.inf
    for value in np.sort(values):
        if value - start > width:
            count, start = count + 1, float(value)
    return count


def band(u: Array, rate: float) -> tuple[float, float]:
    """Return the frequencies between which nearly all of the power of a signal lies.

    Parameters
    ----------
    u
        The signal, (samples,); its mean is removed.
    rate
        Sampling rate in Hz.

    Examples
    --------
    >>> low, high = band(np.sin(2 * np.pi * 5 * np.arange(1000) / 1000.0), 1000.0)
    >>> low, high
    (5.0, 5.0)
    """
    power = np.abs(np.fft.rfft(u - u.mean())) ** 2
    total = np.cumsum(power)
    if not total[-1] > 0:
        return 0.0, 0.0
    edges = np.searchsorted(total, np.array([0.5 * OUTSIDE, 1 - 0.5 * OUTSIDE]) * total[-1])
    frequency = np.fft.rfftfreq(len(u), 1 / rate)
    low, high = (float(frequency[min(int(edge), len(frequency) - 1)]) for edge in edges)
    return low, high


def longest_hold(u: Array, margin: float) -> int:
    """Return the number of samples of the longest stretch whose changes from its first sample are small.

    Parameters
    ----------
    u
        The signal, (samples,).
    margin
        The largest change from one sample to the next that counts as none.

    Examples
    --------
    >>> longest_hold(np.array([0.0, 1.0, 1.0, 1.0, 2.0]), 0.1)
    3
    """
    moves = np.flatnonzero(np.abs(np.diff(u)) > margin)
    edges = np.concatenate([[-1], moves, [len(u) - 1]])
    best = 0
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        # a slow movement has small steps too: it must also stay within ten margins
        if end - begin > best and np.ptp(u[begin + 1 : end + 1]) <= 10 * margin:
            best = int(end - begin)
    return best


def period(u: Array, rate: float) -> float | None:
    """Return the period of a signal that repeats at least twice.

    Parameters
    ----------
    u
        The signal, (samples,).
    rate
        Sampling rate in Hz.

    Examples
    --------
    >>> period(np.tile(np.sin(np.arange(100.0) ** 1.5), 3), 100.0)
    1.0
    """
    x = u - u.mean()
    n = len(x)
    spectrum = np.fft.rfft(x, 2 * n)
    products = np.fft.irfft(np.abs(spectrum) ** 2)[: n // 2 + 1]
    # powers of the two parts that are compared
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    lags = np.arange(len(products))
    powers = np.sqrt(squares[n - lags] * (squares[n] - squares[lags]))
    with np.errstate(divide="ignore", invalid="ignore"):
        similar = np.where(powers > 0, products / powers, 0.0)
    below = np.flatnonzero(similar < 0.9)  # a smooth signal resembles itself at short lags
    if not below.size:
        return None
    later = similar[below[0] :]
    place = int(np.argmax(later > PERIODIC))
    if later[place] <= PERIODIC:
        return None
    # the largest value of the peak that begins here
    end = (
        place + int(np.argmax(later[place:] <= PERIODIC)) if (later[place:] <= PERIODIC).any() else len(later)
    )
    return float(below[0] + place + int(np.argmax(later[place:end]))) / rate
