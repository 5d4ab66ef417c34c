"""The range of each input in which two models are compared."""

import numpy as np

from gpi_hammerstein._native import Gpi, Model
from gpi_hammerstein.stage import Range


def common_ranges(a: Model, b: Model) -> list[Range | None]:
    """Return a range of each input that the numbers of both models show.

    `identify` spreads thresholds inside the range of the input, and half-widths evenly over half of it. So
    the thresholds are inside the range, and half of it is about the widest half-width plus its distance from
    the next one.

    Parameters
    ----------
    a, b
        Two models with the same number of inputs.

    Returns
    -------
    list of tuple of float or None
        For each input, the part of the range that both models share, in the input's unit; None if neither
        model shows a range.
    """
    pairs = zip(a.hysteresis, b.hysteresis, strict=True)
    return [_shared([own for own in map(_shown, pair) if own is not None]) for pair in pairs]


def is_linear(hysteresis: Gpi) -> bool:
    """Return whether the hysteresis is a gain, which is the same over every range."""
    envelope, plays = hysteresis.envelope, hysteresis.plays
    is_gain = envelope.reading == "one-sided" and not np.any(envelope.thresholds)
    return is_gain and not np.any(plays.half_widths)


def _shown(hysteresis: Gpi) -> tuple[float | None, float] | None:
    """Return the middle (None if it has no influence) and half the length of the range; None if unknown."""
    envelope = hysteresis.envelope
    # the deadzone of threshold zero is the identity
    places = envelope.thresholds[envelope.thresholds != 0]
    middle = 0.5 * float(places.min() + places.max()) if len(places) else None
    half = 0.5 * float(np.ptp(places)) if len(places) else 0.0
    widths = np.unique(np.append(hysteresis.plays.half_widths, 0.0))
    if len(widths) > 1:
        reach = float(2 * widths[-1] - widths[-2])
        half = max(half, reach / _slope(hysteresis, middle or 0.0, reach))
    return (middle, half) if half > 0 else None


def _slope(hysteresis: Gpi, middle: float, reach: float) -> float:
    """Return the mean slope of the envelope: half-widths have the scale of its output."""
    z = hysteresis.envelope(np.linspace(middle - reach, middle + reach, 101))
    # the first sample has no direction
    slope = abs(float(z[-1] - z[1])) / (2 * reach * 0.99)
    return slope if slope > 0 else 1.0


def _shared(shown: list[tuple[float | None, float]]) -> Range | None:
    if not shown:
        return None
    placed = [(middle - half, middle + half) for middle, half in shown if middle is not None]
    low = max((own[0] for own in placed), default=-np.inf)
    high = min((own[1] for own in placed), default=np.inf)
    if low >= high:
        return None
    half = min(own[1] for own in shown)
    middle = 0.5 * (low + high) if placed else 0.0
    return max(low, middle - half), min(high, middle + half)
