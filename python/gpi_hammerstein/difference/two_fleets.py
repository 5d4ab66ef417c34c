"""The comparison of two populations of stages: the tables of two batches."""

import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError
from gpi_hammerstein.difference.populations import EffectFrequency, FigureDifference, FleetDifferences
from gpi_hammerstein.difference.significance import holm
from gpi_hammerstein.difference.tables import PLAIN, Device, Fleet, fleet_of

Array = NDArray[np.float64]

# The part of the devices of each table that must be in both, so that pairs of devices are compared.
PAIRED = 0.5
# Fewer values cannot be significant at 5 %: of each table, or pairs.
LEAST, LEAST_PAIRS = 4, 6
# The standard deviation of a normal distribution over its median absolute deviation.
NORMAL = 1.4826


def compare_fleets(
    a: str | os.PathLike[str] | pl.DataFrame, b: str | os.PathLike[str] | pl.DataFrame
) -> FleetDifferences:
    """Return in which figures and effects two populations of stages differ.

    The populations are two tables of `batch`, for example of two production lots, or of the same devices
    before and after a test. A device with several records counts once, with the median of its records.
    Records without a device are devices of their own.

    If at least half of the devices of each table are in both tables, the figures of these devices are
    compared by the signed-rank test of Wilcoxon, and the difference is the median of the pairs' differences
    ``b - a``. Otherwise all devices are compared by the rank-sum test of Mann and Whitney, and the difference
    is that of the medians. How often an effect occurs is compared by Fisher's exact test, which does not use
    pairs. Figures and effects differ if their p-values are small enough by the procedure of Holm over all of
    them: the probability that any is named in two equal populations is at most 5 %.

    Parameters
    ----------
    a, b
        Tables of `batch`, or their files ``fleet.parquet``.

    Returns
    -------
    FleetDifferences
        The figures and the effects. ``print`` shows them as tables.

    Raises
    ------
    DataError
        A file is no table of `batch`, no record has a result, or the outputs have different units.

    Examples
    --------
    >>> import polars as pl
    >>> from gpi_hammerstein.fleet.row import COLUMNS
    >>> random = np.random.default_rng(1)
    >>> def lot(sensitivity):
    ...     values = {"sensitivity": sensitivity + 0.01 * random.normal(size=30), "effects": [["creep"]] * 30}
    ...     return pl.DataFrame([pl.Series(n, values.get(n, [None] * 30), t) for n, t in COLUMNS.items()])
    >>> gpi.compare_fleets(lot(1.5), lot(1.45)).differing
    ['sensitivity']
    """
    first, second = fleet_of(a), fleet_of(b)
    if first.unit and second.unit and first.unit != second.unit:
        raise DataError(
            f"the outputs are in {first.unit} in table A, but in {second.unit} in table B; convert them"
        )
    common = first.named & second.named
    is_paired = len(common) >= max(1.0, PAIRED * max(len(first.effects), len(second.effects)))
    figures = [
        _figure(name, first, second, common if is_paired else None)
        for name in dict.fromkeys([*first.units, *second.units])
        if _is_shown(name, first, second)
    ]
    effects = [_effect(name, first, second) for name in _names(first, second)]
    outcomes = holm([*(row.p_value for row in figures), *(row.p_value for row in effects)])
    names = [
        label if isinstance(own, pl.DataFrame) else os.fspath(own) for own, label in ((a, "A"), (b, "B"))
    ]
    return FleetDifferences(
        names=(names[0], names[1]),
        records=(first.records, second.records),
        failed=(first.failed, second.failed),
        devices=(len(first.effects), len(second.effects)),
        pairs=len(common) if is_paired else None,
        figures=tuple(replace(row, differs=differs) for row, differs in zip(figures, outcomes, strict=False)),
        effects=tuple(
            replace(row, differs=differs)
            for row, differs in zip(effects, outcomes[len(figures) :], strict=True)
        ),
    )


def _is_shown(name: str, a: Fleet, b: Fleet) -> bool:
    """Return whether there are values; of an effect, which many records do not have, enough of them."""
    counts = [len(own.values.get(name, ())) for own in (a, b)]
    return sum(counts) > 0 if name in PLAIN else min(counts) >= LEAST


def _names(a: Fleet, b: Fleet) -> list[str]:
    """Return the effects of both tables, the most frequent first."""
    counts = Counter(name for own in (a, b) for names in own.effects.values() for name in names)
    return sorted(counts, key=lambda name: (-counts[name], name))


def _figure(name: str, a: Fleet, b: Fleet, common: Iterable[Device] | None) -> FigureDifference:
    """Return a figure of both tables; of the devices that are in both, if they are given."""
    ours, theirs = a.values.get(name, {}), b.values.get(name, {})
    unit = a.units.get(name, b.units.get(name, ""))
    if unit != b.units.get(name, unit):
        raise DataError(f"{name} is in {unit} in table A, but in {b.units[name]} in table B; convert it")
    if common is not None:
        known = [device for device in common if device in ours and device in theirs]
        x, y = (np.array([own[device] for device in known]) for own in (ours, theirs))
    else:
        x, y = (np.array(list(own.values())) for own in (ours, theirs))
    row = FigureDifference(name, unit, len(x), len(y), *_middle(x), *_middle(y), None, None, None, None)
    if row.median_a is None or row.median_b is None:
        return row
    if common is not None:
        difference, (test, p_value) = float(np.median(y - x)), _signed_rank(x, y)
    else:
        difference, (test, p_value) = row.median_b - row.median_a, _rank_sum(x, y)
    return replace(row, difference=difference, test=test, p_value=p_value)


def _middle(x: Array) -> tuple[float | None, float | None]:
    """Return the median and the robust standard deviation."""
    if not len(x):
        return None, None
    return float(np.median(x)), float(NORMAL * np.median(np.abs(x - np.median(x))))


Tested = tuple[Literal["mann-whitney", "wilcoxon"] | None, float | None]


def _rank_sum(x: Array, y: Array) -> Tested:
    from scipy import stats  # its import takes longer than most commands

    if min(len(x), len(y)) < LEAST:
        return None, None
    return "mann-whitney", float(stats.mannwhitneyu(x, y).pvalue)


def _signed_rank(x: Array, y: Array) -> Tested:
    from scipy import stats

    if len(x) < LEAST_PAIRS:
        return None, None
    changed = (y - x)[y != x]
    if not len(changed):
        return "wilcoxon", 1.0
    # the exact distribution holds without ties
    has_ties = len(np.unique(np.abs(changed))) < len(changed)
    method = "approx" if has_ties or len(changed) > 50 else "exact"
    return "wilcoxon", float(stats.wilcoxon(changed, method=method).pvalue)


def _effect(name: str, a: Fleet, b: Fleet) -> EffectFrequency:
    from scipy import stats

    counts = [sum(name in own for own in fleet.effects.values()) for fleet in (a, b)]
    totals = [len(fleet.effects) for fleet in (a, b)]
    table: Any = [[count, total - count] for count, total in zip(counts, totals, strict=True)]
    p_value = float(stats.fisher_exact(table).pvalue)
    return EffectFrequency(name, counts[0], totals[0], counts[1], totals[1], p_value, None)
