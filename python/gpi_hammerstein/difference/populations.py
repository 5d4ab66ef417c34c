"""The result of the comparison of two populations of stages."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

from gpi_hammerstein.difference.significance import LEVEL
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
        from gpi_hammerstein.difference.words import fleets_in_words

        return "\n".join(fleets_in_words(self))
