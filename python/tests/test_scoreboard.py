"""The scoreboard counts what it says."""

import argparse
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gpi_hammerstein as gpi
import plants
import score_tables
import scoreboard
import scores
import textbook_tables
from plants import textbook
from scores import REFUSED, Result


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


def of_stage(stage: str, seed: int, wanted: str, found: str, after: float, may: str = "") -> Result:
    """One answer on a stage of another textbook."""
    name = f"{stage} {seed}{', in motion' if seed % 2 else ''}"
    names = (tuple(wanted.split()), tuple(found.split()))
    verdict = REFUSED if found == "refused" else "explained"
    names = names if found != "refused" else (names[0], ())
    return Result(name, *names, verdict, 5.0, after, 1.0, 1.0, may=tuple(may.split()), stage=stage)


TEXTBOOK = [
    of_stage("relays", 2, "", "", 9.0, "hysteresis-shape"),
    of_stage("relays", 3, "", "hysteresis-shape", 2.0, "hysteresis-shape"),
    of_stage("relays", 4, "", "hysteresis-shape creep", 3.0, "hysteresis-shape"),
    of_stage("relays", 5, "", "refused", float("nan"), "hysteresis-shape"),
    of_stage("leak", 2, "covariate", "", 1.04),
    of_stage("leak", 3, "covariate", "", 1.06),
    of_stage("leak", 4, "covariate", "drift", 1.0),
]


def test_a_copy_differs_by_a_part_of_1e_9_and_is_kept_apart() -> None:
    random = np.random.default_rng(1)
    record = gpi.Record(random.random(50), random.random(50), 10.0, covariates=random.random(50), warmup=3)
    seen: list[gpi.Record] = []

    def stage(number: int) -> Result:
        seen.append(scores.copied(record))
        return result("", "")

    jobs = list(scoreboard.copies([(stage, (4,))], 7))
    assert scoreboard.Kept.name(jobs[0]) == "of_copy 7 stage 4"
    assert list(scoreboard.copies([(stage, (4,))], None)) == [(stage, (4,))]
    for function, values in (*jobs, (stage, (4,))):
        function(*values)
    change = seen[0].y[0] / record.y[0] - 1.0
    assert 1e-11 < np.abs(change).max() < 1e-8
    assert np.array_equal(seen[0].covariates[0], record.covariates[0]) and seen[0].warmup == record.warmup
    assert seen[1] is record


def test_textbook_answers_are_right_false_or_missed() -> None:
    assert list(textbook_tables.by_stage(TEXTBOOK[:3] + TEXTBOOK[4:]).rows) == [
        ("relays", "none", "2 of 3", "1", "0", "1 x creep", "3.00"),
        ("leak", "covariate", "1 of 3", "1", "1", "1 x drift", "1.04"),
    ]
    assert list(textbook_tables.totals(TEXTBOOK).rows) == [
        ("all", "5 (71 %)", "3 (43 %)", "7"),
        ("start at rest", "2 (50 %)", "2 (50 %)", "4"),
        ("start in motion", "3 (100 %)", "1 (33 %)", "3"),
    ]


def test_what_is_not_right_is_listed_with_the_command_that_repeats_it() -> None:
    rows = textbook_tables.mistakes(TEXTBOOK, scoreboard.reproduced).rows
    assert [row[0] for row in rows] == ["relays 4", "relays 5, in motion", "leak 3, in motion", "leak 4"]
    assert rows[0][1:4] == ("none", "hysteresis-shape, creep", "creep")
    assert rows[-1][-1] == (
        "`python tools/scoreboard.py --no-records --plants 0 --textbook 1 --seed 4 --only leak`"
    )


def test_the_work_on_textbook_stages() -> None:
    def names(only: str | None, stages: int, mechanics: int) -> list[tuple[object, ...]]:
        asked = argparse.Namespace(only=only, textbook=stages, mechanics=mechanics, seed=10)
        return [values for _, values in scoreboard.textbook_work(asked)]

    every = names(None, 2, 1)
    assert len(every) == 2 * len(textbook.ORDINARY) + len(textbook.MECHANICS)
    assert every[:2] == [("clean", 10), ("clean", 11)]
    # a whole name means this stage alone, although it is also a part of another name
    assert names("leak", 1, 0) == [("leak", 10)]
    assert names("dahl+creep", 0, 1) == [("dahl+creep", 10)]


def test_one_of_several_names_is_enough() -> None:
    def answer(found: str, after: float = 9.0) -> Result:
        known = of_stage("dahl+creep", 2, "creep", found, after)
        return replace(known, one_of=("friction", "hysteretic-stiffness"))

    assert answer("friction creep").is_right() and answer("creep hysteretic-stiffness").is_right()
    assert answer("creep").is_missed() and answer("friction").is_missed()
    assert not answer("friction creep drift").is_right()
    assert answer("", 1.0).is_right()
    table = textbook_tables.by_stage([answer("friction creep"), answer("creep")])
    assert list(table.rows)[0][1:5] == ("creep, friction or hysteretic-stiffness", "1 of 2", "0", "1")


def test_effects_that_a_piece_may_show_are_not_false() -> None:
    def answer(found: str) -> Result:
        return replace(result("", found), may=("creep", "backlash"))

    answers = [answer("creep backlash"), answer("creep"), answer(""), answer("creep drift")]
    assert list(score_tables.pieces(answers).rows) == [
        ("a false effect is named", "1"),
        ("every effect is named, and no other", "1"),
    ]


def test_a_piece_has_the_samples_of_all_columns() -> None:
    run = plants.draw(3, ("covariate",), None, 2.0, 1000.0).record(0)
    piece = scores.cut(run, 500, 800)
    assert run.x is not None and piece.x is not None
    for whole, part in ((run.t, piece.t), (run.u, piece.u), (run.y, piece.y), (run.x, piece.x)):
        assert np.array_equal(part, whole[500:800])
