"""Tables of the answers on stages of other textbooks: right, false and missed, by stage and in all."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from score_tables import Table
from scores import Result


def by_stage(results: Iterable[Result]) -> Table:
    """Count right answers, answers with a false name and answers that miss a name, and list the false names.

    An answer misses a name where the label asks for it and the error is above the noise. The last column is
    the median of the held-out error over the noise.
    """
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(result.stage or "", []).append(result)
    rows = []
    for stage, found in groups.items():
        false = Counter(name for result in found for name in result.false_names())
        rows.append(
            (
                stage,
                wanted(found[0]),
                f"{sum(result.is_right() for result in found)} of {len(found)}",
                str(sum(result.has_false() for result in found)),
                str(sum(result.is_missed() for result in found)),
                "; ".join(f"{count} x {name}" for name, count in false.most_common()),
                f"{np.median([result.after for result in found]):.2f}",
            )
        )
    heads = ("stage", "wanted", "right", "false", "missed", "false names", "held out")
    return Table("Stages of other textbooks", heads, rows)


def totals(results: Sequence[Result]) -> Table:
    """Return the shares of answers without a false name and of right answers, by the start of the record."""
    parts = {
        "all": results,
        "start at rest": [result for result in results if "motion" not in result.name],
        "start in motion": [result for result in results if "motion" in result.name],
    }
    rows = [
        (
            name,
            share(sum(not result.has_false() for result in found), len(found)),
            share(sum(result.is_right() for result in found), len(found)),
            str(len(found)),
        )
        for name, found in parts.items()
    ]
    return Table(
        "Stages of other textbooks: totals", ("records", "without a false name", "right", "number"), rows
    )


def mistakes(results: Iterable[Result], command: Callable[[Result], str]) -> Table:
    """List all answers that are not right, with the command that explains the record again."""
    rows = [
        (
            result.name,
            wanted(result),
            ", ".join(result.found) or "none",
            ", ".join(result.false_names()) or "none",
            result.verdict,
            f"{result.before:.2f}",
            f"{result.after:.2f}",
            f"`{command(result)}`",
        )
        for result in results
        if not result.is_right()
    ]
    heads = ("record", "wanted", "found", "false", "verdict", "before", "after", "again by")
    return Table("Stages of other textbooks: answers that are not right", heads, rows)


def wanted(result: Result) -> str:
    """Return the names that the label asks for."""
    return ", ".join([*result.wanted, *([" or ".join(result.one_of)] if result.one_of else [])]) or "none"


def share(count: int, total: int) -> str:
    """Return a count with its share in per cent."""
    return f"{count} ({100 * count / total:.0f} %)" if total else "0"
