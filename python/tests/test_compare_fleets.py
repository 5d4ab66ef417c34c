"""In which figures and effects two populations of stages differ."""

from typing import Any

import numpy as np
import polars as pl
import pytest

import gpi_hammerstein as gpi
from gpi_hammerstein.fleet.row import COLUMNS


def fleet(number: int, seed: int, **given: Any) -> pl.DataFrame:
    """A table of devices that scatter much, each measured with little noise."""
    own, noise = np.random.default_rng(0), np.random.default_rng(seed)
    values: dict[str, Any] = {
        "unit": ["um"] * number,
        "effects": [["creep"]] * number,
        "sensitivity": 1.5 + 0.1 * own.normal(size=number) + 0.002 * noise.normal(size=number),
        "resonance_hz": 800 + 20 * own.normal(size=number) + noise.normal(size=number),
        "rms_after": 0.01 * (1 + 0.1 * noise.random(number)),
        "noise_floor": [0.01] * number,
        "sizes": [[gain(value)] for value in 0.1 + 0.01 * noise.normal(size=number)],
    }
    values |= given
    columns = [pl.Series(name, values.get(name, [None] * number), kind) for name, kind in COLUMNS.items()]
    return pl.DataFrame(columns)


def gain(value: float, std: float | None = 0.01, unit: str = "") -> dict[str, Any]:
    return {
        "effect": "creep",
        "name": "gain[0]",
        "value": value,
        "std": std,
        "unit": unit,
        "determined": std is not None,
    }


NAMES = [f"A-{number}" for number in range(30)]


def test_two_lots_without_a_shift_do_not_differ() -> None:
    found = gpi.compare_fleets(fleet(30, 1), fleet(40, 2))
    assert found.differing == [] and found.pairs is None
    rows = {row.name: row for row in found.figures}
    assert set(rows) == {"rms_after / noise_floor", "sensitivity", "resonance_hz", "creep.gain[0]"}
    assert {row.test for row in found.figures} == {"mann-whitney"}
    assert (rows["sensitivity"].count_a, rows["sensitivity"].count_b) == (30, 40)
    assert rows["sensitivity"].spread_a == pytest.approx(0.1, rel=0.5)
    [effect] = found.effects
    assert (effect.count_a, effect.total_a, effect.total_b, effect.p_value) == (30, 30, 40, 1.0)


def test_a_shift_of_a_lot_is_named() -> None:
    moved = fleet(40, 2)
    moved = moved.with_columns(pl.col("resonance_hz") + 30.0)
    found = gpi.compare_fleets(fleet(30, 1), moved)
    assert found.differing == ["resonance_hz"]
    [row] = [row for row in found.figures if row.name == "resonance_hz"]
    assert row.unit == "Hz" and row.difference == pytest.approx(30.0, abs=15.0)


def test_the_same_devices_are_compared_in_pairs() -> None:
    first = fleet(30, 1, device=NAMES)
    second = fleet(30, 2, device=NAMES).with_columns(pl.col("sensitivity") * 0.995)
    # the shift is a twentieth of the scatter of the devices
    assert gpi.compare_fleets(first.with_columns(device=None), second).differing == []
    found = gpi.compare_fleets(first, second.reverse())
    assert (found.differing, found.pairs) == (["sensitivity"], 30)
    [row] = [row for row in found.figures if row.name == "sensitivity"]
    assert row.test == "wilcoxon" and row.difference == pytest.approx(-0.0075, rel=0.2)
    assert "signed-rank" in repr(found)
    # a few common devices do not make pairs
    others = second.with_columns(pl.Series("device", [*NAMES[:5], *(f"B-{k}" for k in range(25))]))
    assert gpi.compare_fleets(first, others).pairs is None


def test_equal_tables_do_not_differ() -> None:
    own = fleet(30, 1, device=NAMES)
    found = gpi.compare_fleets(own, own)
    assert found.differing == [] and {row.p_value for row in found.figures} == {1.0}


def test_a_device_counts_once() -> None:
    often = fleet(30, 1, device=["A-0"] * 10 + NAMES[10:])
    found = gpi.compare_fleets(often, fleet(30, 2))
    assert found.devices == (21, 30) and found.records == (30, 30)
    assert {row.count_a for row in found.figures} == {21}


def test_how_often_effects_occur_is_compared() -> None:
    some = [["creep", "backlash"]] * 15 + [["creep"]] * 15
    found = gpi.compare_fleets(fleet(30, 1), fleet(30, 2, effects=some))
    assert found.differing == ["backlash"]
    assert [row.effect for row in found.effects] == ["creep", "backlash"]
    assert (found.effects[1].count_a, found.effects[1].count_b) == (0, 15)


def test_ties_and_few_values_are_no_problem() -> None:
    rounded = [fleet(30, seed, device=NAMES, damping=[0.01, 0.02, 0.02] * 10) for seed in (1, 2)]
    rounded[1] = rounded[1].with_columns(damping=pl.Series([0.02, 0.03, 0.02] * 10))
    found = gpi.compare_fleets(*rounded)
    assert found.differing == ["damping"]
    few = gpi.compare_fleets(fleet(3, 1), fleet(3, 2))
    assert few.differing == [] and {row.test for row in few.figures} == {None}
    pairs = gpi.compare_fleets(*(fleet(5, seed, device=NAMES[:5]) for seed in (1, 2)))
    assert pairs.pairs == 5 and {row.p_value for row in pairs.figures} == {None}


def test_sizes_that_are_not_determined_are_left_out() -> None:
    sizes = [[gain(0.1)]] * 26 + [[gain(9.0, std=None)]] * 4
    twice = [[gain(0.1), gain(0.2)]] * 30
    found = gpi.compare_fleets(fleet(30, 1, sizes=sizes), fleet(30, 2, sizes=twice))
    rows = {row.name: row for row in found.figures}
    assert (rows["creep.gain[0]"].count_a, rows["creep.gain[0]"].median_a) == (26, 0.1)
    # the first table has no second one
    assert "creep[1].gain[0]" not in rows


def test_records_without_a_result_are_left_out() -> None:
    failed = fleet(30, 1, error=["no"] * 5 + [None] * 25)
    found = gpi.compare_fleets(failed, fleet(30, 2))
    assert found.failed == (5, 0) and found.devices == (25, 30)


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        (pl.DataFrame({"device": ["A"]}), "no table of `gpi batch`; it has no column effects, sizes"),
        (fleet(4, 1, error=["no"] * 4), "no record has a result"),
        (fleet(4, 1, unit=["um", "um", "nm", "nm"]), "in nm and um; compare the rows of one unit"),
        (fleet(4, 1, unit=["nm"] * 4), "in nm in table A, but in um in table B"),
        (fleet(4, 1, sizes=[[gain(1.0, unit="s")]] * 4), "gain.0. is in s in table A, but in  in table B"),
    ],
)
def test_tables_that_cannot_be_compared_are_refused(table: pl.DataFrame, problem: str) -> None:
    with pytest.raises(gpi.DataError, match=problem):
        gpi.compare_fleets(table, fleet(30, 2))
