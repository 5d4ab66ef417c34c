"""Comparisons as text."""

from collections.abc import Iterator, Sequence

from gpi_hammerstein.difference.models import ModelDifferences
from gpi_hammerstein.difference.populations import FleetDifferences
from gpi_hammerstein.difference.row import Difference
from gpi_hammerstein.difference.significance import LEVEL

TITLES = {"figure": "Figures of the stage", "effect": "Effects", "parameter": "Parameters"}
SHARE = f"{100 * LEVEL:g} %"


def models_in_words(found: ModelDifferences) -> Iterator[str]:
    """Yield the lines of the comparison of two models.

    Parameters
    ----------
    found
        The comparison.

    Yields
    ------
    str
        Tables, then sentences.
    """
    if found.names != ("A", "B"):
        yield from (f"{label}: {name}" for label, name in zip("AB", found.names, strict=True))
    width = max([24, *(len(_label(row)) for row in found.rows)])
    for group, title in TITLES.items():
        # what only one model has is listed below
        rows = [row for row in found.rows if row.group == group and None not in (row.a, row.b)]
        if rows:
            yield ""
            yield f"{title:<{width}}{'A':>12}{'B':>12}{'B - A':>12}{'std':>10}{'z':>8}{'p':>10}"
            yield "-" * (width + 78)
            yield from (_line(row, width) for row in rows)
    yield ""
    yield from _sentences(found)


def _label(row: Difference) -> str:
    return f"{row.name} [{row.unit}]" if row.unit else row.name


def _line(row: Difference, width: int) -> str:
    cells = [
        shown(row.a, 12, 5),
        shown(row.b, 12, 5),
        shown(row.difference, 12, 3),
        shown(row.std, 10, 2),
        shown(row.z, 8, 3),
        shown(row.p_value, 10, 2),
    ]
    return f"{_label(row):<{width}}{''.join(cells)}  {verdict(row.differs)}"


def shown(value: float | None, width: int, digits: int) -> str:
    """Return a number in a column; a dash if it is not known."""
    return f"{'-' if value is None else format(value, f'.{digits}g'):>{width}}"


def verdict(differs: bool | None) -> str:
    """Return the decision on a row in words."""
    return {True: "differs", False: "", None: "not tested"}[differs]


def conclusion(differing: Sequence[str], tests: int, what: str) -> str:
    """Return the result of all tests as a sentence."""
    if not tests:
        return f"None of the {what} could be tested."
    if not differing:
        return f"None of the {tests} tested {what} differs beyond its uncertainty."
    verb = "differs" if len(differing) == 1 else "differ"
    return (
        f"{len(differing)} of the {tests} tested {what} {verb} beyond the uncertainty: "
        f"{', '.join(differing)}. "
        f"If all were equal, any would be named with a probability of at most {SHARE} (procedure of Holm)."
    )


def _sentences(found: ModelDifferences) -> Iterator[str]:
    yield conclusion(found.differing, sum(row.differs is not None for row in found.rows), "values")
    for name, own in (("A", found.only_a), ("B", found.only_b)):
        if own:
            yield f"Only {name} has: {', '.join(own)}."
    if found.other_structure:
        reasons = "; ".join(found.other_structure)
        yield f"The parameters were not compared, because the structures differ: {reasons}."
    for name, own_range in found.ranges:
        if own_range is not None:
            low, high = own_range
            ends = f"{low:.4g} and {high:.4g}"
            yield f"Sensitivity and hysteresis are those of slow motion of {name} between {ends}."
    yield from _simulated(found)
    yield from found.notes


def _simulated(found: ModelDifferences) -> Iterator[str]:
    own = found.simulation
    if own is None:
        return
    space = f" {own.unit}" if own.unit else ""
    if own.error_a is not None and own.error_b is not None:
        yield (
            f"On the record, the error of A is {own.error_a['rms']:.4g}{space} rms, and that of B "
            f"{own.error_b['rms']:.4g}{space} rms ({own.rule})."
        )
    where = "on the record" if own.drive == "record" else "for a decaying triangle over this range"
    movement = 100 * own.rms / own.movement if own.movement else 0.0
    yield (
        f"The simulated outputs differ by {own.rms:.4g}{space} rms {where}, {movement:.2g} % of their "
        "movement. "
        + (
            "How much of it the uncertainty of the models explains is not known."
            if own.explained is None
            else f"The uncertainty of both models explains {own.expected_rms:.4g}{space} rms."
        )
    )


def fleets_in_words(found: FleetDifferences) -> Iterator[str]:
    """Yield the lines of the comparison of two populations.

    Parameters
    ----------
    found
        The comparison.

    Yields
    ------
    str
        Tables, then sentences.
    """
    each = zip("AB", found.names, found.devices, found.records, found.failed, strict=True)
    for label, name, devices, records, failed in each:
        of_file = "" if name == label else f" ({name})"
        yield f"{label}{of_file}: {devices} devices, {records} records, {failed} of them without a result"
    labels = [f"{row.name} [{row.unit}]" if row.unit else row.name for row in found.figures]
    width = max([24, *map(len, labels)])
    yield ""
    heads = f"{'median A':>12}{'spread':>10}{'median B':>12}{'spread':>10}{'B - A':>12}{'p':>10}"
    yield f"{'Figures':<{width}}{'number':>12}{heads}"
    yield "-" * (width + 92)
    for label, row in zip(labels, found.figures, strict=True):
        counts = f"{row.count_a}" if row.count_a == row.count_b else f"{row.count_a}, {row.count_b}"
        cells = [
            shown(row.median_a, 12, 5),
            shown(row.spread_a, 10, 2),
            shown(row.median_b, 12, 5),
            shown(row.spread_b, 10, 2),
            shown(row.difference, 12, 3),
            shown(row.p_value, 10, 2),
        ]
        yield f"{label:<{width}}{counts:>12}{''.join(cells)}  {verdict(row.differs)}"
    if found.effects:
        yield ""
        yield f"{'Devices with the effect':<{width}}{'A':>12}{'B':>12}{'p':>10}"
        yield "-" * (width + 48)
        for one in found.effects:
            counts = f"{one.count_a} of {one.total_a}"
            others = f"{one.count_b} of {one.total_b}"
            line = f"{one.effect:<{width}}{counts:>12}{others:>12}{shown(one.p_value, 10, 2)}"
            yield f"{line}  {verdict(one.differs)}"
    yield ""
    every = [*(row.differs for row in found.figures), *(row.differs for row in found.effects)]
    yield conclusion(found.differing, sum(own is not None for own in every), "figures and effects")
    yield (
        "All devices were compared by the rank-sum test of Mann and Whitney."
        if found.pairs is None
        else f"{found.pairs} devices are in both tables: they were compared by Wilcoxon's signed-rank test."
    )
    yield "The spread is a robust standard deviation: 1.4826 times the median absolute deviation."
