"""An inspection in words."""

from collections.abc import Mapping, Sequence
from typing import Any

MARKS = {"yes": "yes   ", "partly": "partly", "no": "no    "}


def text_of(found: Mapping[str, Any]) -> str:
    """Return an inspection as text.

    Parameters
    ----------
    found
        The fields of an inspection.

    Returns
    -------
    str
        Lines that end with the next command.

    Examples
    --------
    >>> found = {"files": ["run.csv"], "columns": [], "next": {"why": "", "command": "gpi report run.csv"}}
    >>> print(text_of(found))
    run.csv
    <BLANKLINE>
    Next
      gpi report run.csv
    """
    lines = list(found["files"])
    if found.get("problem"):
        lines += ["", "Problem", f"  {found['problem']}"]
    lines += _section("Columns", _columns(found["columns"]))
    record = found.get("record")
    if record:
        assumed = f" (read with {found['assumed']})" if found.get("assumed") else ""
        lines += _section(f"Record{assumed}", [*_record(record, found), *_signals(found)])
    lines += _section("Notes", [f"- {note}" for note in found.get("notes", [])])
    lines += _section("Look at this", [f"- {sentence}" for sentence in found.get("findings", [])])
    rows = found.get("identifiable", [])
    width = max((len(row["what"]) for row in rows), default=0)
    lines += _section(
        "What a model of this record can determine",
        [f"{MARKS[row['possible']]}  {row['what']:<{width}}  {row['why']}" for row in rows],
    )
    following = found.get("next_experiment")
    if following:
        lines += _section(f"Another experiment, {following['why']}", [following["command"]])
    if found.get("next"):
        why = f": {found['next']['why']}" if found["next"]["why"] not in ("", "mend") else ""
        lines += _section(f"Next{why}", [found["next"]["command"]])
    return "\n".join(lines)


def _section(title: str, rows: Sequence[str]) -> list[str]:
    return ["", title, *(f"  {row}" for row in rows)] if rows else []


def _columns(columns: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the rows of the table of columns."""
    cells = []
    for row in columns:
        if row["text"] is not None:
            content = row["text"]
        elif row["low"] is None:
            content = "no numbers"
        elif row["constant"]:
            content = f"constant, {row['low']:.5g}"
        else:
            content = f"{row['low']:.5g} to {row['high']:.5g}"
        if row["step"]:
            content += f", steps of {row['step']:.4g}"
        if row["missing"] and row["low"] is not None:
            content += f", {row['missing']} missing"
        cells.append((row["header"], row["unit"] or "-", row["role"], content, row["why"]))
    if not cells:
        return []
    widths = [max(len(cell[place]) for cell in cells) for place in range(4)]
    return [
        "  ".join(f"{a:<{w}}" for a, w in zip(cell, [*widths, 0], strict=True)).rstrip() for cell in cells
    ]


def _record(record: Mapping[str, Any], found: Mapping[str, Any]) -> list[str]:
    parts = f" in {record['experiments']} experiments" if record["experiments"] > 1 else ""
    lines = [
        f"{record['samples']} samples at {record['rate_hz']:.6g} Hz, {record['duration_s']:.4g} s{parts}"
    ]
    clock = found.get("clock")
    if clock and "median_step_s" in clock:
        spread = max(
            clock["largest_step_s"] - clock["median_step_s"],
            clock["median_step_s"] - clock["smallest_step_s"],
        )
        jitter = spread / clock["median_step_s"]
        if clock["gaps"] or clock["backward"] or clock["repeated"]:
            lines.append(
                f"clock: {_count(clock['gaps'], 'gap')}, {_count(clock['backward'], 'jump')} back, "
                f"{_count(clock['repeated'], 'repeated stamp')}"
            )
        elif jitter > 0.01:
            lines.append(f"clock: steps differ from the median step by up to {100 * jitter:.2g} %")
        else:
            lines.append("clock: uniform, no gaps")
    return lines


def _signals(found: Mapping[str, Any]) -> list[str]:
    lines = []
    for one in found["inputs"]:
        low, high = one["band_hz"]
        text = (
            f"input {one['name']}: {one['low']:.4g} to {one['high']:.4g} {one['unit']}".rstrip()
            + f", {low:.3g} to {high:.3g} Hz, {_count(one['swings'], 'large stroke')} of "
            f"{_count(one['lengths'], 'different length')}"
        )
        if one["longest_hold_s"] * found["record"]["rate_hz"] > 10:
            text += f", constant for up to {one['longest_hold_s']:.3g} s"
        if one["period_s"]:
            text += f", repeats every {one['period_s']:.4g} s"
        lines.append(text)
    order = found["record"]["excitation_order"]
    lines.append(
        "persistently exciting of any order" if order is None else f"order of persistent excitation: {order}"
    )
    for one in found["outputs"]:
        unit = f" {one['unit']}".rstrip()
        text = f"output {one['name']}: {one['low']:.4g} to {one['high']:.4g}{unit}"
        if one["noise_at_most"] is not None:
            text += f", white noise of at most {one['noise_at_most']:.2g}{unit} rms"
        lines.append(text)
    return lines


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")
