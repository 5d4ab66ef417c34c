"""The residual over frequency, lag, input and speed, as numbers for the page.

A cloud of points hides most of its points. The residual over the input and over the speed is therefore drawn
as its mean, and the 5 % and 95 % quantiles, in classes of equal width.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gpi_hammerstein.report.packing import Array, packed
from gpi_hammerstein.report.series import Errors
from gpi_hammerstein.uncertain import BAND

# Longest segment of the spectral density, and the sum of the segments of all pairs of experiment and output.
SEGMENT, ALL_SEGMENTS = 8192, 32_768
# Shortest segment.
SHORTEST_SEGMENT = 256
# Classes of the input and of its speed, and the fewest samples of a class that is drawn.
CLASSES, FEWEST = 40, 20
# Lags of the autocorrelation, in samples.
LAGS = 50
# Pairs of experiment and output whose curves are in the page.
MOST_PAIRS = 32
# Range of the speed that is drawn, as a quantile: a few steps of the input do not determine it.
USUAL = 0.999


def curves(errors: Errors) -> list[list[dict[str, Any]]]:
    """Return the curves of each experiment and output, of the first experiments if there are many.

    Parameters
    ----------
    errors
        The errors of both models.

    Returns
    -------
    list of list of dict
        For each experiment and output: ``spectrum``, ``autocorrelation``, and ``over``, a list with the
        classes of each input and of its speed.
    """
    outputs = len(errors.names)
    experiments = min(len(errors.after), max(1, MOST_PAIRS // outputs))
    wanted = ALL_SEGMENTS // (experiments * outputs)
    segment = int(np.clip(2 ** int(np.log2(wanted)), SHORTEST_SEGMENT, SEGMENT))
    u = errors.record.u
    found = []
    for k in range(experiments):
        scored = slice(errors.warmups[k], None)
        speed = np.gradient(u[k], axis=0) * errors.record.rate if len(u[k]) > 1 else np.zeros_like(u[k])
        row = []
        for output in range(outputs):
            both = [errors.before[k][scored, output], errors.after[k][scored, output]]
            row.append(
                {
                    "spectrum": spectrum(both, errors.record.rate, segment),
                    "autocorrelation": autocorrelation(both),
                    "over": [
                        {
                            "input": classes(u[k][scored, index], both),
                            "speed": classes(speed[scored, index], both),
                        }
                        for index in range(u[k].shape[1])
                    ],
                }
            )
        found.append(row)
    return found


def spectrum(both: Sequence[Array], rate: float, segment: int) -> dict[str, Any] | None:
    """Return the decimal logarithm of the amplitude spectral density, by Welch's method."""
    import scipy.signal

    length = min(len(both[0]), segment)
    if length < 4:
        return None
    densities = []
    for error in both:
        _, power = scipy.signal.welch(error, rate, nperseg=length)
        # the logarithm of a zero residual is not finite
        tiny = np.finfo(np.float64).tiny
        densities.append(packed(0.5 * np.log10(np.maximum(power[1:], tiny)), 2))
    return {"spacing": rate / length, "densities": densities}


def autocorrelation(both: Sequence[Array]) -> dict[str, Any] | None:
    """Return ``r(k) = sum e(t) e(t-k) / sum e(t)^2`` without the mean, and the 95 % bound of white noise."""
    samples = len(both[0])
    if samples < 2:
        return None
    rows = []
    for error in both:
        centred = error - error.mean()
        power = max(float(centred @ centred), np.finfo(np.float64).tiny)
        lags = range(1, min(LAGS, samples - 1) + 1)
        rows.append([round(float(centred[k:] @ centred[: samples - k]) / power, 4) for k in lags])
    return {"bound": BAND / float(np.sqrt(samples)), "values": rows}


def classes(x: Array, both: Sequence[Array]) -> dict[str, Any] | None:
    """Return the mean and two quantiles of each error in classes of x.

    Parameters
    ----------
    x
        The input or its speed, shape (samples,).
    both
        The errors before and after, each of shape (samples,).

    Returns
    -------
    dict or None
        ``x``, the middles of the classes, and ``errors``, for each error ``[mean, low, high]``; None if x is
        constant or has too few samples.
    """
    if len(x) < FEWEST:
        return None
    low, high = (float(end) for end in np.quantile(x, [1 - USUAL, USUAL]))
    if not high > low:
        return None
    place = np.floor((x - low) / (high - low) * CLASSES)
    # an input often rests at its largest value, which belongs to the last class
    place[x == high] = CLASSES - 1
    order = np.argsort(place, kind="stable")
    edges = np.searchsorted(place[order], np.arange(CLASSES + 1))
    middles: list[float] = []
    rows: list[list[list[float]]] = [[[], [], []] for _ in both]
    for index, (first, last) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        if last - first < FEWEST:
            continue
        middles.append(short(low + (index + 0.5) * (high - low) / CLASSES))
        members = order[first:last]
        for row, error in zip(rows, both, strict=True):
            own = error[members]
            for line, value in zip(row, (own.mean(), *np.quantile(own, [0.05, 0.95])), strict=True):
                line.append(short(float(value)))
    return {"x": middles, "errors": rows} if len(middles) > 1 else None


def short(value: float) -> float:
    """Return a number with five significant digits, which is shorter as text."""
    return float(f"{value:.5g}")
