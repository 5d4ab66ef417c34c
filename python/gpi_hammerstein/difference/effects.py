"""The quantities of the effects of two models."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpi_hammerstein._native import Model
from gpi_hammerstein.difference.pairs import nearest_pairs
from gpi_hammerstein.difference.row import Difference, tested, untested

# Members of an effect with a `scale` that its quantities refer to. They come from the record.
SCALES = ("middle", "scale", "widest", "widths")
# Relative difference below which two numbers that were not estimated are the same.
SAME = 1e-6

Quantity = Mapping[str, Any]


@dataclass(frozen=True)
class Own:
    """An effect of a model."""

    kind: str
    """Its name, with the channel if there are several."""
    name: str
    members: Mapping[str, Any]
    quantities: Sequence[Quantity]

    @property
    def first(self) -> float:
        """The value that tells it from others of its kind."""
        return float(self.quantities[0]["value"]) if self.quantities else 0.0


def effect_rows(
    a: Model, b: Model, *, is_tested: bool = True
) -> tuple[list[Difference], dict[str, list[str]], list[str]]:
    """Return the rows of all effects of two models.

    Parameters
    ----------
    a, b
        Models with the same channels.
    is_tested
        Whether the standard deviations are those of the truth, so that rows are tested.

    Returns
    -------
    tuple of list, dict and list
        The rows; names of the effects that only ``a`` and only ``b`` have; and notes on what is not compared.
    """
    rows: list[Difference] = []
    only: dict[str, list[str]] = {"a": [], "b": []}
    notes: list[str] = []
    of_time = {*a.functions_of_time, *b.functions_of_time}
    ours, theirs = list(_effects(a)), list(_effects(b))
    for kind in dict.fromkeys(own.kind for own in [*ours, *theirs]):
        mine, other = ([own for own in both if own.kind == kind] for both in (ours, theirs))
        pairs = nearest_pairs([own.first for own in mine], [own.first for own in other])
        for number, (i, j) in enumerate(pairs):
            label = f"{kind}[{number}]" if len(pairs) > 1 else kind
            first, second = None if i is None else mine[i], None if j is None else other[j]
            found = _rows(label, first, second)
            if first is None or second is None:
                only["b" if first is None else "a"].append(label)
            elif first.name in of_time:
                notes.append(
                    f"{label} depends only on time. It is different in every record, so that its quantities "
                    "are not tested."
                )
            elif not _is_same_form(first, second):
                notes.append(
                    f"{label} has another form or another scale in each model, so that its quantities are "
                    "not tested. The simulated outputs show what it changes."
                )
            elif is_tested:
                found = [tested(row) for row in found]
            rows += found
    return rows, only, notes


def _effects(model: Model) -> Iterator[Own]:
    layout = json.loads(model.to_json())
    several = {
        "input": [one["name"] for one in layout["inputs"]],
        "output": [one["name"] for one in layout["outputs"]],
    }
    for row, members in zip(model.effects, layout.get("effects", []), strict=True):
        channels = [
            names[members[end]] for end, names in several.items() if len(names) > 1 and end in members
        ]
        kind = f"{row['name']} of {channels[0]}" if channels else row["name"]
        yield Own(kind, row["name"], members, row["parameters"])


def _rows(label: str, a: Own | None, b: Own | None) -> list[Difference]:
    """Return the rows of an effect, without tests."""
    ours, theirs = ({} if own is None else {row["name"]: row for row in own.quantities} for own in (a, b))
    rows = []
    for name in dict.fromkeys([*ours, *theirs]):
        first, second = ours.get(name, {}), theirs.get(name, {})
        unit = first.get("unit") or second.get("unit") or ""
        values, stds = ((first.get(key), second.get(key)) for key in ("value", "std"))
        rows.append(untested(f"{label}.{name}", "effect", unit, values, stds))
    return rows


def _is_same_form(a: Own, b: Own) -> bool:
    """Return whether quantities of the same name mean the same."""
    ours, theirs = ({row["name"]: row for row in own.quantities} for own in (a, b))
    if set(ours) != set(theirs):
        return False
    fixed = [name for name in ours if ours[name]["std"] == 0 and theirs[name]["std"] == 0]
    # a value at its bound in both models is fixed, too
    pairs = [(ours[name]["value"], theirs[name]["value"]) for name in fixed]
    scales = [list(_scales(own.members)) for own in (a, b)]
    if len(scales[0]) != len(scales[1]):
        return False
    pairs += zip(*scales, strict=True)
    return all(np.isclose(first, second, rtol=SAME, atol=0.0) for first, second in pairs)


def _scales(members: Any) -> Iterator[float]:
    """Yield the members that define a scale, at every depth."""
    if isinstance(members, Mapping):
        if "scale" in members:
            yield from (float(members[name]) for name in SCALES if name in members)
        members = members.values()
    for inner in members:
        if isinstance(inner, Mapping | list):
            yield from _scales(inner)
