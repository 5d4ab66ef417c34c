"""The changes of a machine in words."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

__all__ = ["changes_in_words", "duration"]

NAMES = {
    "offset": "The offset",
    "gain": "The gain",
    "resonance": "The first resonance",
    "hysteresis-width": "The width of the hysteresis",
    "noise": "The noise",
}


def changes_in_words(changes: Sequence[Mapping[str, Any]], tested: Sequence[str]) -> Iterator[str]:
    """Yield one sentence for each change.

    Parameters
    ----------
    changes
        `Monitor.changes`.
    tested
        `Monitor.watched`.

    Yields
    ------
    str
        The sentence; one that states what was tested if there is no change.

    Examples
    --------
    >>> change = {"what": "gain", "channel": "y", "size": -1.25, "unit": "%", "std": 0.05, "since_s": 75.0,
    ...           "confidence": 1.0, "instead": [], "frequency_hz": None}
    >>> list(changes_in_words([change], ["gain"]))
    ['The gain of `y` has changed by -1.25 % ± 0.05 %, since 1 min 15 s.']
    """
    if not changes:
        yield f"No change was noticed. Tested: {', '.join(tested)}."
    for change in changes:
        unit = f" {change['unit']}" if change["unit"] else ""
        since = f"since {duration(change['since_s'])}" if change["since_s"] > 0 else "since the beginning"
        if change["what"] == "line":
            yield (
                f"A sine of {change['frequency_hz']:.4g} Hz with the amplitude {change['size']:.3g}{unit} is "
                f"new in `{change['channel']}`, {since}."
            )
            continue
        spread = "" if change["std"] is None else f" ± {change['std']:.2g}{unit}"
        where = f", from {change['frequency_hz']:.4g} Hz" if change["what"] == "resonance" else ""
        sentence = (
            f"{NAMES[change['what']]} of `{change['channel']}` has changed by {change['size']:+.3g}{unit}"
            f"{spread}{where}, {since}."
        )
        if change["instead"]:
            others = " or ".join(change["instead"])
            sentence += (
                f" It may also be the {others}: the probability of the {change['what']} is "
                f"{100 * change['confidence']:.0f} %."
            )
        yield sentence


def duration(seconds: float) -> str:
    """Return a duration in hours, minutes and seconds.

    Parameters
    ----------
    seconds
        The duration.

    Returns
    -------
    str
        The two largest units that are not zero.

    Examples
    --------
    >>> duration(3.5), duration(75.0), duration(7320.0)
    ('3.5 s', '1 min 15 s', '2 h 2 min')
    """
    if seconds < 60:
        return f"{seconds:.3g} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
