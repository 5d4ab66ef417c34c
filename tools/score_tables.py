"""Tables of the results of many runs, as text and as Markdown."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from scores import Result

OUTSIDE = "outside the catalogue"
KINDS = ("right", "partly right", "nothing found", "wrong")


@dataclass(frozen=True)
class Table:
    """A title, the headings of the columns, and the cells."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]

    def text(self) -> str:
        """Return the table as text, with columns of equal width."""
        lines = [self.heads, *self.rows]
        widths = [max(len(line[column]) for line in lines) for column in range(len(self.heads))]
        cells = [
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines
        ]
        return "\n".join([f"\n{self.title}", *(f"  {line.rstrip()}" for line in cells)])

    def markdown(self) -> str:
        """Return the table in Markdown, below its title."""
        lines = [self.heads, ["---"] * len(self.heads), *self.rows]
        return "\n".join([f"## {self.title}", "", *(f"| {' | '.join(line)} |" for line in lines), ""])


def singles(results: Iterable[Result]) -> Table:
    """Return how often each single effect was found, and what was found instead.

    Stages that lack nothing are the row ``none``; stages whose effect is outside the catalogue are a row of
    their own, because the right answer for them is also that no effect is named.
    """
    counts: dict[str, Counter[str]] = {}
    for result in results:
        if len(result.wanted) <= 1:
            wanted = OUTSIDE if result.is_outside else result.wanted[0] if result.wanted else "none"
            is_right = result.is_right()
            found = right_of(wanted) if is_right else ", ".join(sorted(result.found)) or "none"
            counts.setdefault(wanted, Counter())[found] += 1
    rows = []
    for wanted, found in sorted(counts.items()):
        right = right_of(wanted)
        others = "; ".join(f"{count} x {name}" for name, count in found.most_common() if name != right)
        rows.append((wanted, f"{found[right]} of {found.total()}", others))
    return Table("Single effects", ("wanted", "right", "found instead"), rows)


def right_of(wanted: str) -> str:
    """Return the right answer of a row: none where the effect is outside the catalogue."""
    return "none" if wanted == OUTSIDE else wanted


def by_number(results: Iterable[Result]) -> Table:
    """Count the kinds of answers, by the number of effects that are present.

    An answer is partly right if it names some of the effects and no wrong one.
    """
    counts: dict[str, Counter[str]] = {}
    for result in results:
        number = OUTSIDE if result.is_outside else str(len(result.wanted))
        counts.setdefault(number, Counter())[result.kind()] += 1
    rows = [
        (number, *(str(found[kind]) for kind in KINDS), str(found.total()))
        for number, found in sorted(counts.items())
    ]
    return Table("By number of effects", ("effects", *KINDS, "records"), rows)


def power(results: Iterable[Result]) -> Table:
    """Return how often a single effect is found, by the ratio of its rms to that of the noise.

    Each cell contains three shares: the effect is named, the answer is right, a false effect is named. The
    column ``runs`` is the number of runs of the row, over all ratios.
    """
    groups: dict[str, dict[float, list[Result]]] = {}
    for result in results:
        if result.strength is not None and len(result.wanted) == 1:
            for name in (result.wanted[0], "all"):
                groups.setdefault(name, {}).setdefault(result.strength, []).append(result)
    strengths = sorted({strength for found in groups.values() for strength in found})
    rows = [
        (
            name,
            str(sum(map(len, groups[name].values()))),
            *(shares(groups[name].get(strength, [])) for strength in strengths),
        )
        for name in sorted(groups, key=lambda name: (name == "all", name))
    ]
    return Table(
        "Power: single effects found / right / false, in % of the runs, by rms over that of the noise",
        ("effect", "runs", *(f"{strength:g}" for strength in strengths)),
        rows,
    )


def shares(results: Sequence[Result]) -> str:
    """Return the shares of answers that name the effect, that are right, and that name a false effect."""
    if not results:
        return "-"
    marks = [(set(r.wanted) <= set(r.found), r.is_right(), r.has_false()) for r in results]
    return " / ".join(f"{100 * share:.0f}" for share in np.mean(marks, axis=0))


def summary(results: Sequence[Result]) -> Table:
    """Return the most important figures."""
    right = [result for result in results if result.is_right()]
    rows = [("right", f"{len(right)} of {len(results)}")]
    for name, is_outside in (("lack nothing", False), ("have an effect outside the catalogue", True)):
        clean = [result for result in results if not result.wanted and result.is_outside == is_outside]
        alarms = sum(result.has_false() for result in clean)
        rows.append((f"false alarms on stages that {name}", f"{alarms} of {len(clean)}"))
    if right:
        ratios = np.array([result.after for result in right])
        rows.append(
            (
                "held-out error over the noise, where right",
                f"median {np.median(ratios):.3f}, worst {ratios.max():.3f}",
            )
        )
    return Table("Summary", ("what", "figure"), rows)


def pieces(results: Sequence[Result]) -> Table:
    """Count the pieces of long records in which a false effect is named, and those with the right answer."""
    false = sum(result.has_false() for result in results)
    every = sum(sorted(result.may or ()) == sorted(result.found) for result in results)
    rows = [("a false effect is named", str(false)), ("every effect is named, and no other", str(every))]
    return Table("Pieces of long records", ("answers", f"of {len(results)}"), rows)


def clean(results: Sequence[Result]) -> Table:
    """Return the errors of stages that lack nothing on another experiment, over the noise, by their kind.

    The drive of the other experiment stays in the range of the training record's, as far as one of 30
    experiments does. Its start is fitted, and the offset of the training record is kept.
    """
    groups: dict[str, list[Result]] = {}
    for result in results:
        groups.setdefault(kind_of_clean(result.name), []).append(result)
    groups["all"] = list(results)
    rows = []
    for kind, found in groups.items():
        errors = np.array([result.again for result in found])
        quantiles = (np.median(errors), np.quantile(errors, 0.9), errors.max())
        named = sum(bool(result.found) for result in found)
        rows.append((kind, str(len(found)), *(f"{value:.3f}" for value in quantiles), str(named)))
    heads = ("stages", "number", "median", "90 %", "worst", "an effect is named")
    return Table("Stages that lack nothing: error on another experiment over the noise", heads, rows)


def kind_of_clean(name: str) -> str:
    """Return the kind of a stage that lacks nothing."""
    if not name.startswith("clean "):
        return "labelled records"
    source = "simulated" if name.startswith("clean plant") else "textbook"
    return f"{source}, start {'in motion' if name.endswith('in motion') else 'at rest'}"
