"""The four answers at the top of the page, and how devices are judged."""

from collections.abc import Sequence
from html import escape

import numpy as np

from gpi_hammerstein.escaping import visible
from gpi_hammerstein.explanation import join
from gpi_hammerstein.fleet import distances, rare
from gpi_hammerstein.fleet.devices import Fleet
from gpi_hammerstein.fleet.distances import Distances
from gpi_hammerstein.fleet.figures import NOISE_LIKE
from gpi_hammerstein.fleet.rare import Share
from gpi_hammerstein.fleet.trends import Trend
from gpi_hammerstein.fleet.unusual import Unusual

USUAL_EFFECT = 0.5
"""An effect that more devices have is usual."""
FEW = 5
"""Names in one sentence."""


def answers(
    fleet: Fleet,
    known: Distances,
    found: Sequence[Unusual],
    verdicts: Sequence[Share],
    effects: Sequence[Share],
    trends: Sequence[Trend],
) -> str:
    """Return the four answers as HTML.

    Parameters
    ----------
    fleet, known, found
        The devices, the distances of their figures, and those that stand out.
    verdicts, effects
        How many devices have each verdict and each effect.
    trends
        All trends.

    Returns
    -------
    str
        Four articles, each with a question, a short answer and sentences.
    """
    parts = [
        ("Which devices stand out?", *outliers(fleet, known, found)),
        ("What is usual?", *usual(fleet, verdicts, effects)),
        ("Which records failed?", *failed(fleet)),
        ("What changes with time?", *changing(fleet, trends)),
    ]
    return "".join(
        f"<article><h2>{escape(question)}</h2><p class='short'>{escape(short)}</p>"
        + "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)
        + "</article>"
        for question, short, sentences in parts
    )


def count(number: int, what: str) -> str:
    """Return a number with its noun.

    Examples
    --------
    >>> count(1, "device"), count(1000, "device")
    ('1 device', '1,000 devices')
    """
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def outliers(fleet: Fleet, known: Distances, found: Sequence[Unusual]) -> tuple[str, list[str]]:
    """Return how many devices stand out, and by what."""
    judged = len(fleet.judged)
    far = sum(bool(known.q[one.place] <= distances.FALSE_SHARE) for one in found)
    short = f"{len(found):,} of {count(judged, 'device')}" if judged else "No device has a result"
    sentences = []
    if far:
        sentences.append(f"{count(far, 'device')} by the size of {'its' if far == 1 else 'their'} figures.")
    if len(found) > far:
        other = len(found) - far
        sentences.append(f"{count(other, 'device')} only by an effect or a verdict that few devices have.")
    if judged < distances.FEWEST:
        sentences.append(
            f"Fewer than {distances.FEWEST} devices do not show what is usual: none can stand out."
        )
    elif len(found) >= rare.RARE * judged:
        sentences.append(
            "These are many: the table may contain several kinds of devices. Make a page for each kind."
        )
    return short, sentences


def usual(fleet: Fleet, verdicts: Sequence[Share], effects: Sequence[Share]) -> tuple[str, list[str]]:
    """Return the verdict and the effects of most devices."""
    if not verdicts:
        return "-", []
    first = verdicts[0]
    names = [visible(one.name) for one in effects if one.count > USUAL_EFFECT * one.all]
    sentences = [
        f"{100 * first.count / first.all:.3g} % of the devices have the verdict {visible(first.name)}.",
        f"Most devices have {join(names[:FEW])}." if names else "No effect occurs in most devices.",
    ]
    after = next((one for one in fleet.figures if one.key == "rms_after_over_noise"), None)
    if after is not None:
        values = fleet.of_devices(after)[0]
        if np.isfinite(values).any():
            sentences.append(f"The median of the error over noise is {np.nanmedian(values):.3g}.")
    return visible(first.name).capitalize(), sentences


def failed(fleet: Fleet) -> tuple[str, list[str]]:
    """Return how many records have no result."""
    errors, records = int(fleet.table["error"].is_not_null().sum()), len(fleet.table)
    without = len(fleet.names) - len(fleet.judged)
    if not errors and not without:
        return "None", [f"All {count(records, 'record')} have a result."]
    sentences = [f"{count(without, 'device')} without any result."] if without else []
    return f"{errors:,} of {count(records, 'record')}", sentences


def changing(fleet: Fleet, trends: Sequence[Trend]) -> tuple[str, list[str]]:
    """Return which figures change with time."""
    if not np.isfinite(fleet.days).any():
        return "Not known", ["The records have no dates. A manifest of the batch can contain them."]
    of_fleet = list(dict.fromkeys(one.figure.label for one in trends if one.device < 0 and one.significant))
    of_devices = len({one.device for one in trends if one.device >= 0 and one.significant})
    sentences = []
    if of_fleet:
        sentences.append(
            f"The fleet's {join(of_fleet[:FEW])} change{'s' if len(of_fleet) == 1 else ''} with the date."
        )
    if of_devices:
        sentences.append(
            f"{count(of_devices, 'device')} with a trend of {'its' if of_devices == 1 else 'their'} own."
        )
    if not trends:
        return "Not known", ["There are too few dates for a trend."]
    return (count(len(of_fleet), "figure") if of_fleet or of_devices else "Nothing"), sentences


def method() -> list[str]:
    """Return how devices are judged, as sentences with all constants."""
    noise_like = " and ".join(NOISE_LIKE)
    false, few, noise = (100 * one for one in (distances.FALSE_SHARE, rare.RARE, rare.RARE_NOISE))
    return [
        "A device is judged by its latest record that has a result.",
        "The distance of a figure is its difference from the fleet's median over the fleet's robust standard "
        "deviation. Positive figures are compared on a logarithmic scale. Of errors and noise, only large "
        "values count.",
        "The joint distance covers the figures that describe the device. It counts that figures depend on "
        "each other: if two figures usually rise together, a device in which one rises and the other falls "
        "is unusual.",
        f"A device with a q of at most {distances.FALSE_SHARE:g} stands out. On average, at most {false:g} % "
        "of these devices are usual ones (Benjamini and Hochberg).",
        f"An effect that less than {few:g} % of the devices have makes a device stand out, and so does a "
        f"verdict that is as rare and worse than the fleet's. The effects {noise_like} depend on the record "
        f"more than on the device: they are a reason only if less than {noise:g} % of the devices have them.",
        "Slopes are the medians of the slopes of all pairs of records (Theil and Sen). Their test is that of "
        "Mann and Kendall, and their q is corrected for the number of trends. Between devices, each device "
        "counts once. Within devices, only records of the same device are compared.",
    ]
