"""Effects and verdicts that few devices have.

`explain` has tested each effect against chance already. What the fleet adds is whether the effect belongs to
devices of this kind, or to a single device. No p-value is therefore computed: the share of the devices that
have the effect is compared with `RARE`.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Any

from scipy import special

from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.devices import Fleet
from gpi_hammerstein.fleet.figures import NOISE_LIKE

RARE = 0.1
"""An effect is rare if a smaller share of the devices has it. A defect that one device in twenty has must
stand out, also where by chance twice as many of a small fleet have it. What more devices have is a property
of the type or of a batch."""
RARE_NOISE = 0.01
"""The same for `NOISE_LIKE` effects, which depend on the record more than on the device: they are a reason
only where almost no record has them, and else only add to other reasons."""
FEWEST = 10
"""In a smaller fleet, nothing is rare."""
VERDICTS = ("explained", "partly-explained", "unattributed", "outside-class")
"""From what is best to what is worst."""
CONFIDENCE = 0.95
"""Probability of the intervals of shares."""


@dataclass(frozen=True)
class Share:
    """How many devices have an effect or a verdict.

    Attributes
    ----------
    name
        The effect or the verdict.
    count, all
        Number of devices that have it, and of all devices with a result.
    low, high
        The interval of the share in the population (Clopper and Pearson, 1934, Biometrika 26).
    """

    name: str
    count: int
    all: int
    low: float
    high: float


def shares(counts: Counter[str], every: int) -> list[Share]:
    """Return shares with confidence intervals, the largest first.

    Parameters
    ----------
    counts
        Number of devices for each name.
    every
        Number of all devices.

    Returns
    -------
    list of Share
        The interval contains the true share in at least `CONFIDENCE` of all samples.

    Examples
    --------
    >>> [one] = shares(Counter(creep=5), 10)
    >>> one.count, round(one.low, 3), round(one.high, 3)
    (5, 0.187, 0.813)
    """
    tail = (1 - CONFIDENCE) / 2
    found = []
    for name, count in sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])):
        low = special.betaincinv(count, every - count + 1, tail) if count else 0.0
        high = special.betaincinv(count + 1, every - count, 1 - tail) if count < every else 1.0
        found.append(Share(name, count, every, float(low), float(high)))
    return found


def effect_shares(fleet: Fleet) -> list[Share]:
    """Return how many devices have each effect."""
    own: list[set[Any]] = [set(effects or ()) for effects in fleet.column("effects")]
    return shares(Counter(name for effects in own for name in effects if name), len(own))


def verdict_shares(fleet: Fleet) -> list[Share]:
    """Return how many devices have each verdict."""
    own = fleet.column("verdict")
    return shares(Counter(map(str, own)), len(own))


@dataclass(frozen=True)
class Reasons:
    """Why a device stands out by what it has.

    Attributes
    ----------
    strong
        Sentences, each of which is enough.
    weak
        Sentences that only add to others.
    share
        The smallest share of `strong`; 1 without one.
    """

    strong: list[str]
    weak: list[str]
    share: float = 1.0


def reasons(fleet: Fleet) -> list[Reasons]:
    """Return the rare effects and verdicts of each device that has a result.

    Parameters
    ----------
    fleet
        The devices.

    Returns
    -------
    list of Reasons
        One for each of `fleet.judged`.
    """
    effects = {one.name: one for one in effect_shares(fleet)}
    verdicts = {one.name: one for one in verdict_shares(fleet)}
    usual = next(iter(verdicts), "")
    rows = zip(*(fleet.column(name) for name in ("effects", "verdict", "verdict_reason")), strict=True)
    return [_of_device(own or [], str(verdict), why, effects, verdicts, usual) for own, verdict, why in rows]


def _of_device(
    own: list[str],
    verdict: str,
    why: object,
    effects: dict[str, Share],
    verdicts: dict[str, Share],
    usual: str,
) -> Reasons:
    strong, weak, smallest = [], [], 1.0
    for name in dict.fromkeys(own):
        known = effects.get(name)
        if known is None or known.all < FEWEST or known.count / known.all >= RARE:
            continue
        text = f"has {visible(name)}, which {_others(known)}"
        if name in NOISE_LIKE and known.count / known.all >= RARE_NOISE:
            weak.append(text)
        else:
            strong.append((known.count / known.all, text))
    known = verdicts[verdict]
    if known.all >= FEWEST and known.count / known.all < RARE and _rank(verdict) > _rank(usual):
        because = f" ({visible(str(why))})" if why else ""
        text = f"the verdict is {visible(verdict)}{because}, which {_others(known)}"
        strong.append((known.count / known.all, f"{text}; the fleet's is {visible(usual)}"))
    if strong:
        smallest = min(share for share, _ in strong)
    return Reasons([text for _, text in sorted(strong)], weak, smallest)


def _rank(verdict: str) -> int:
    return VERDICTS.index(verdict) if verdict in VERDICTS else len(VERDICTS)


def _others(known: Share) -> str:
    return (
        f"no other of {known.all:,} devices has"
        if known.count == 1
        else f"{known.count:,} of {known.all:,} devices have"
    )
