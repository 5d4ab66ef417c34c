"""The scoreboard counts what it says."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import score_tables
import scoreboard
from scores import Result


def result(
    wanted: str, found: str, *, strength: float | None = None, after: float = 1.0, is_outside: bool = False
) -> Result:
    """One answer; effects are joined by spaces."""
    names = (tuple(wanted.split()), tuple(found.split()))
    return Result("plant", *names, "explained", 5.0, after, 1.0, 1.0, is_outside, strength)


@pytest.mark.parametrize(
    ("wanted", "found", "kind"),
    [
        ("", "", "right"),
        ("creep drift", "drift creep", "right"),
        ("creep drift", "drift", "partly right"),
        ("creep drift", "", "nothing found"),
        ("creep drift", "creep backlash", "wrong"),
        ("", "creep", "wrong"),
    ],
)
def test_an_answer_is_of_one_kind(wanted: str, found: str, kind: str) -> None:
    assert result(wanted, found).kind() == kind


def test_answers_are_counted_by_the_number_of_effects() -> None:
    results = [
        result("", ""),
        result("creep", "creep"),
        result("creep", "drift"),
        result("creep drift", "drift"),
        result("", "creep", is_outside=True),
    ]
    table = score_tables.by_number(results)
    assert table.heads == ("effects", "right", "partly right", "nothing found", "wrong", "records")
    assert list(table.rows) == [
        ("0", "1", "0", "0", "0", "1"),
        ("1", "1", "0", "0", "1", "2"),
        ("2", "0", "1", "0", "0", "1"),
        ("outside the catalogue", "0", "0", "0", "1", "1"),
    ]


def test_power_is_the_share_found_right_and_false_per_strength() -> None:
    results = [
        result("creep", "", strength=0.5),
        result("creep", "drift", strength=0.5),
        result("creep", "creep", strength=2.0),
        result("creep", "creep drift", strength=2.0),
        result("drift", "drift", strength=2.0),
        result("creep drift", "creep", strength=2.0),
    ]
    table = score_tables.power(results)
    assert table.heads == ("effect", "runs", "0.5", "2")
    assert list(table.rows) == [
        ("creep", "4", "0 / 0 / 50", "100 / 50 / 50"),
        ("drift", "1", "-", "100 / 100 / 0"),
        ("all", "5", "0 / 0 / 50", "100 / 67 / 33"),
    ]


def test_single_effects_and_the_summary() -> None:
    results = [
        result("creep", "creep", after=1.5),
        result("creep", "drift"),
        result("", ""),
        result("", "creep", is_outside=True),
    ]
    assert list(score_tables.singles(results).rows) == [
        ("creep", "1 of 2", "1 x drift"),
        ("none", "1 of 1", ""),
        ("outside the catalogue", "0 of 1", "1 x creep"),
    ]
    figures = {row[0]: row[1] for row in score_tables.summary(results).rows}
    assert figures["right"] == "2 of 4"
    assert figures["false alarms on stages that lack nothing"] == "0 of 1"
    assert figures["false alarms on stages that have an effect outside the catalogue"] == "1 of 1"
    assert figures["held-out error over the noise, where right"] == "median 1.250, worst 1.500"


def test_a_table_as_text_and_as_markdown() -> None:
    table = score_tables.Table("Title", ("a", "long head"), [("cell of a", "1")])
    assert table.text() == "\nTitle\n  a          long head\n  cell of a  1"
    assert table.markdown() == "## Title\n\n| a | long head |\n| --- | --- |\n| cell of a | 1 |\n"


def test_what_was_kept_is_not_done_again(tmp_path: Path) -> None:
    calls = []

    def work(seed: int) -> Result:
        calls.append(seed)
        return result("creep drift", "creep")

    path = tmp_path / "kept.json"
    first = scoreboard.Kept(path)
    first.add((work, (1,)), work(1))
    again = scoreboard.Kept(path)
    assert again.find((work, (1,))) == result("creep drift", "creep")
    assert again.find((work, (2,))) is None
    with ThreadPoolExecutor(1) as pool:
        results = scoreboard.run(pool, [(work, (1,)), (work, (2,))], again)
    assert len(results) == 2
    assert calls == [1, 2]
