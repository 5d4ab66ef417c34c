"""Tables of many scores, as text and as Markdown."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from scores import Result

KINDS = ("right", "partly right", "nothing found", "wrong")


@dataclass(frozen=True)
class Table:
    """A title, the heads of the columns, and cells."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]

    def text(self) -> str:
        """Return columns of equal width."""
        lines = [self.heads, *self.rows]
        widths = [max(len(line[column]) for line in lines) for column in range(len(self.heads))]
        cells = [
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines
        ]
        return "\n".join([f"\n{self.title}", *(f"  {line.rstrip()}" for line in cells)])

    def markdown(self) -> str:
        """Return a table of Markdown below its title."""
        lines = [self.heads, ["---"] * len(self.heads), *self.rows]
        return "\n".join([f"## {self.title}", "", *(f"| {' | '.join(line)} |" for line in lines), ""])


def singles(results: Iterable[Result]) -> Table:
    """How often each single effect was found, and what was found instead."""
    counts: dict[str, Counter[str]] = {}
    for result in results:
        if len(result.wanted) <= 1:
            wanted = result.wanted[0] if result.wanted else "none"
            counts.setdefault(wanted, Counter())[", ".join(sorted(result.found)) or "none"] += 1
    rows = []
    for wanted, found in sorted(counts.items()):
        others = "; ".join(f"{count} x {name}" for name, count in found.most_common() if name != wanted)
        rows.append((wanted, f"{found[wanted]} of {found.total()}", others))
    return Table("Single effects", ("wanted", "right", "found instead"), rows)


def by_number(results: Iterable[Result]) -> Table:
    """How right the answers are, by the number of effects that are there.

    Partly right: some of the effects and no other one.
    """
    counts: dict[str, Counter[str]] = {}
    for result in results:
        number = "outside the catalogue" if result.is_outside else str(len(result.wanted))
        counts.setdefault(number, Counter())[result.kind()] += 1
    rows = [
        (number, *(str(found[kind]) for kind in KINDS), str(found.total()))
        for number, found in sorted(counts.items())
    ]
    return Table("By number of effects", ("effects", *KINDS, "records"), rows)


def power(results: Iterable[Result]) -> Table:
    """How often a single effect is named, alone, and with false ones, by its rms over that of the noise."""
    groups: dict[str, dict[float, list[Result]]] = {}
    for result in results:
        if result.strength is not None and len(result.wanted) == 1:
            for name in (result.wanted[0], "all"):
                groups.setdefault(name, {}).setdefault(result.strength, []).append(result)
    strengths = sorted({strength for found in groups.values() for strength in found})
    rows = [
        (name, *(shares(groups[name].get(strength, [])) for strength in strengths))
        for name in sorted(groups, key=lambda name: (name == "all", name))
    ]
    return Table(
        "Power: single effects found / right / false, in %, by rms over that of the noise",
        ("effect", *(f"{strength:g}" for strength in strengths)),
        rows,
    )


def shares(results: Sequence[Result]) -> str:
    """Return in how many answers the effect is named, is the only one, and in how many is another one."""
    if not results:
        return "-"
    marks = [(set(r.wanted) <= set(r.found), r.is_right(), r.has_false()) for r in results]
    return " / ".join(f"{100 * share:.0f}" for share in np.mean(marks, axis=0))


def summary(results: Sequence[Result]) -> Table:
    """The figures that count."""
    right = [result for result in results if result.is_right()]
    clean = [result for result in results if not result.wanted]
    rows = [
        ("right", f"{len(right)} of {len(results)}"),
        (
            "false alarms where nothing is to be found",
            f"{sum(bool(result.found) for result in clean)} of {len(clean)}",
        ),
    ]
    if right:
        ratios = np.array([result.after for result in right])
        rows.append(
            (
                "held-out error over the noise, where right",
                f"median {np.median(ratios):.3f}, worst {ratios.max():.3f}",
            )
        )
    return Table("Summary", ("what", "figure"), rows)
