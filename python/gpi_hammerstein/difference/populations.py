"""The result of the comparison of two populations of stages."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

from gpi_hammerstein.difference.significance import LEVEL
from gpi_hammerstein.difference.words import conclusion, shown, verdict
from gpi_hammerstein.json_values import plain


@dataclass(frozen=True)
class FigureDifference:
    """One figure of two populations of stages.

    Parameters
    ----------
    name
        A column of the table, ``rms_after / noise_floor``, or the quantity of an effect.
    unit
        Its unit; empty for a pure number or if it is not known.
    count_a, count_b
        The number of values.
    median_a, median_b
        The medians, in ``unit``; None without values.
    spread_a, spread_b
        The robust standard deviations, 1.4826 times the median absolute deviation, in ``unit``; None without
        values.
    difference
        The median of the differences ``b - a`` of pairs, or the difference of the medians, in ``unit``; None
        without values.
    test
        ``mann-whitney``, ``wilcoxon`` for pairs, or None if there are too few values.
    p_value
        The p-value of the test, a pure number; None without a test.
    differs
        Whether the populations differ, with Holm's correction over all figures and effects; None without a
        test.

    Examples
    --------
    >>> gpi.compare_fleets("lot1.parquet", "lot2.parquet").figures[0]  # doctest: +SKIP
    """

    name: str
    unit: str
    count_a: int
    count_b: int
    median_a: float | None
    spread_a: float | None
    median_b: float | None
    spread_b: float | None
    difference: float | None
    test: Literal["mann-whitney", "wilcoxon"] | None
    p_value: float | None
    differs: bool | None


@dataclass(frozen=True)
class EffectFrequency:
    """How often an effect occurs in two populations of stages.

    Parameters
    ----------
    effect
        The name of the effect.
    count_a, total_a, count_b, total_b
        The number of devices with the effect, and the number of all devices.
    p_value
        The p-value of Fisher's exact test, a pure number.
    differs
        Whether the populations differ, with Holm's correction over all figures and effects.

    Examples
    --------
    >>> gpi.compare_fleets("lot1.parquet", "lot2.parquet").effects[0]  # doctest: +SKIP
    """

    effect: str
    count_a: int
    total_a: int
    count_b: int
    total_b: int
    p_value: float
    differs: bool | None


@dataclass(frozen=True)
class FleetDifferences:
    """In which figures and effects two populations of stages differ; the result of `compare_fleets`.

    Parameters
    ----------
    names
        Names of the tables: their files, or A and B.
    records, failed, devices
        For each table the number of rows, of rows without a result, and of devices.
    pairs
        The number of devices in both tables, if pairs were compared; else None.
    figures
        The compared figures.
    effects
        How often each effect occurs.

    Examples
    --------
    >>> gpi.compare_fleets("lot1.parquet", "lot2.parquet").differing  # doctest: +SKIP
    ['sensitivity']
    """

    names: tuple[str, str]
    records: tuple[int, int]
    failed: tuple[int, int]
    devices: tuple[int, int]
    pairs: int | None
    figures: tuple[FigureDifference, ...]
    effects: tuple[EffectFrequency, ...]

    @property
    def differing(self) -> list[str]:
        """Names of the figures and effects that differ."""
        figures = [row.name for row in self.figures if row.differs]
        return figures + [row.effect for row in self.effects if row.differs]

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as the JSON object `gpi-comparison/1`.

        Returns
        -------
        dict
            All parts, with numbers in the units of the rows.
        """
        found: dict[str, Any] = plain(
            {
                "schema": "gpi-comparison/1",
                "kind": "fleets",
                "a": self.names[0],
                "b": self.names[1],
                "level": LEVEL,
                "records": self.records,
                "failed": self.failed,
                "devices": self.devices,
                "pairs": self.pairs,
                "figures": [asdict(row) for row in self.figures],
                "effects": [asdict(row) for row in self.effects],
                "differing": self.differing,
            }
        )
        return found

    def __repr__(self) -> str:
        """Return tables of the figures and the effects, and what follows from them."""
        return "\n".join(fleets_in_words(self))


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
