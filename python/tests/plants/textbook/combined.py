"""Forces inside the mechanics beside creep, heat or the mains: one record lacks two effects.

Each stage is a mass on a spring and one element (`sprung`). The actuator that drives it may creep, its frame
may warm up, and its sensor may pick up the mains.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from numpy.random import Generator

from .drives import Drive
from .mechanics import bouc_wen_spring, dahl, duffing
from .run import Run
from .slow import heat, log_creep, mains

Simulate = Callable[[Generator, Drive], Run]

#: The element, and its names in the catalogue.
FORCES: dict[str, tuple[Simulate, frozenset[str]]] = {
    "duffing": (duffing, frozenset({"stiffness"})),
    "bouc-wen-spring": (bouc_wen_spring, frozenset({"hysteretic-stiffness", "friction"})),
    # Dahl's friction is the differential element of hysteretic-stiffness with gamma = 0
    "dahl": (dahl, frozenset({"friction", "hysteretic-stiffness"})),
}


def creeping(simulate: Simulate) -> Simulate:
    """The actuator creeps (`log_creep`) by 0.5 to 3 % in a decade before it moves the mass."""

    def simulated(random: Generator, drive: Drive) -> Run:
        per_decade, first = random.uniform(0.005, 0.03), random.uniform(0.02, 0.2)
        found = simulate(random, replace(drive, u=log_creep(drive.u, drive.rate, per_decade, first)))
        return replace(found, u=drive.u)

    return simulated


def warming(simulate: Simulate) -> Simulate:
    """The frame warms up (`heat`), 8 to 25 times the noise."""

    def simulated(random: Generator, drive: Drive) -> Run:
        size = random.uniform(8, 25)
        found = simulate(random, drive)
        return replace(found, y=found.y + size * found.noise * heat(drive.random("heat"), drive))

    return simulated


def humming(simulate: Simulate) -> Simulate:
    """The sensor picks up the mains (`mains`)."""

    def simulated(random: Generator, drive: Drive) -> Run:
        found = simulate(random, drive)
        return replace(found, y=found.y + mains(random, drive, found.noise))

    return simulated


def alone(simulate: Simulate) -> Simulate:
    """The stage as it is."""
    return simulate


#: What stands beside the element, and the names of its effect.
BESIDE: dict[str, tuple[Callable[[Simulate], Simulate], tuple[str, ...]]] = {
    "nothing": (alone, ()),
    "creep": (creeping, ("creep",)),
    "heat": (warming, ("drift",)),
    "mains": (humming, ("periodic-disturbance",)),
}
