"""HTML tables of a report."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from gpi_hammerstein._native import Explanation, Model, effect_names
from gpi_hammerstein.comparison import rival_rows
from gpi_hammerstein.held_out import rule_of
from gpi_hammerstein.report.components import Component
from gpi_hammerstein.stage import natural
from gpi_hammerstein.uncertain import NOT_DETERMINED, OF_SIZE, p_value_in_words, spread

Row = Sequence[str]


def table(head: Row, rows: Iterable[Row], numbers: Sequence[int] = ()) -> str:
    """Return a table. The columns `numbers` are aligned to the right."""

    def cells(tag: str, row: Row) -> str:
        kinds = [' class="number"' if place in numbers else "" for place in range(len(row))]
        return "".join(f"<{tag}{kind}>{escape(cell)}</{tag}>" for kind, cell in zip(kinds, row, strict=True))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{cells("th", head)}</tr>{body}</table></div>'


def errors(found: Explanation, unit: str) -> str:
    """Return the errors before and after, on fitted and on held-out data."""
    label = f" [{unit}]" if unit else ""
    head = ["", f"rms{label}", "rms / span", "fit", f"largest{label}", "rms / noise"]
    noise = float(np.sqrt(np.mean(np.square(found.noise_floor["rms"]))))
    rows = []
    for when, figures in (("before", found.before), ("after", found.after)):
        for part, name in (("train", "fitted"), ("holdout", "held out")):
            own = figures[part]
            over = f"{own['rms'] / noise:.3g}" if noise > 0 else "-"
            rows.append(
                [
                    f"{when}, {name}",
                    f"{own['rms']:.4g}",
                    f"{100 * own['nrmse']:.3g} %",
                    f"{own['fit_percent']:.2f} %",
                    f"{own['max']:.4g}",
                    over,
                ]
            )
    return table(head, rows, range(1, 6)) + f"<p>Held out: {escape(rule_of(found))}.</p>"


def rivals(found: Explanation, unit: str) -> str:
    """Return the errors of simple models on the same data."""
    label = f" [{unit}]" if unit else ""
    head = ["simple model", "what was chosen", f"rms, fitted{label}", f"rms, held out{label}"]
    return table(head, rival_rows(found.rivals), (2, 3))


def effects(found: Explanation) -> str:
    """Return the parameters of every effect, with their uncertainties and units."""
    names, shown = effect_names(), set[str]()
    rows = []
    for step in found.steps:
        if step["effect"] is None:
            continue
        name = step["effect"]
        first = [name, "one more" if name in shown else names[name]]
        shown.add(name)
        for row in step["parameters"]:
            known = [f"{row['value']:.5g}", spread(row)] if row["determined"] else [NOT_DETERMINED, ""]
            rows.append([*first, row["name"], *known, row["unit"]])
            first = ["", ""]
    if not rows:
        return "<p>No effect was added.</p>"
    head = ["effect", "what it is", "parameter", "value", "95 %", "unit"]
    return table(head, rows, (3, 4))


def rejected(found: Explanation, unit: str) -> str:
    """Return the effects that were tried and not added."""
    label = f" [{unit}]" if unit else ""
    rows = [
        [
            other["effect"],
            other["why"],
            ", ".join(other["confounded_with"]),
            "-" if other["holdout_rms"] is None else f"{other['holdout_rms']:.4g}",
        ]
        for other in found.rejected
    ]
    if not rows:
        return "<p>No other effect was tried.</p>"
    head = ["effect", "why it was not added", "not distinguished from", f"rms with it, held out{label}"]
    return table(head, rows, (3,))


def contributions(found: Explanation, own: Sequence[Component], unit: str) -> str:
    """Return what each effect contributes, and what is left."""
    if not own:
        return "<p>No effect was added.</p>"
    label = f" [{unit}]" if unit else ""
    names, shown = effect_names(), set[str]()
    head = [
        "effect",
        "what it is",
        "share of the squared residual",
        "size, rms" + (label if len(found.record.output_names) == 1 else ""),
        f"rms without it, held out{label}",
        f"rms with it{label}",
        "gain",
        "evidence",
    ]
    rows = []
    for one in own:
        gain = 1 - one.holdout_after / one.holdout_before if one.holdout_before > 0 else 0.0
        rows.append(
            [
                one.effect,
                "one more" if one.effect in shown else names[one.effect],
                f"{100 * one.share:.3g} %",
                sizes(found, one),
                f"{one.holdout_before:.4g}",
                f"{one.holdout_after:.4g}",
                f"{100 * gain:.3g} %",
                f"{one.evidence:.3g} ×",
            ]
        )
        shown.add(one.effect)
    before, after = found.before["train"]["rms"], found.after["train"]["rms"]
    share = (after / before) ** 2 if before > 0 else 0.0
    rows.append(
        [
            "residual",
            "what the final model does not explain",
            f"{100 * share:.3g} %",
            f"{after:.4g}{label and f' {unit}'}",
            *[""] * 4,
        ]
    )
    return table(head, rows, range(2, 8)) + (
        "<p>The share is the part of the squares of the declared model's residual that the effect removed "
        "when it was added, on the training data. The size is the rms change of the simulated output. The "
        "evidence is the deviance over its significance threshold; above 1 it is significant. All parts were "
        "refined jointly after the last effect, so that the shares do not add up exactly.</p>"
    )


def sizes(found: Explanation, one: Component) -> str:
    """Return the size of a component in the unit of each output."""
    record = found.record
    if len(one.size) == 1:
        return f"{one.size[0]:.4g}"
    each = zip(record.output_names, one.size, record.output_units, strict=True)
    return ", ".join(f"{name}: {size:.3g} {unit}".rstrip() for name, size, unit in each)


def parameters(model: Model) -> str:
    """Return all parameters of the model with their uncertainties; closed if there are many."""
    if model.refinement is None:
        return "<p>The model was not refined; the uncertainties of its parameters are not known.</p>"
    rows = []
    for row in model.refinement.parameters:
        known = [f"{row['value']:.5g}", spread(row)] if row["determined"] else [NOT_DETERMINED, ""]
        rows.append([row["name"], *known, row["unit"]])
    own = table(["parameter", "value", "95 %", "unit"], rows, (1, 2))
    return f"<details><summary>All {len(rows)} parameters with their uncertainties</summary>{own}</details>"


def tests(found: Explanation) -> str:
    """Return the tests of the residual."""
    rows = [
        [
            test["output"],
            test["name"],
            f"{test['statistic']:.3g}",
            f"{test['threshold']:.3g}",
            p_value_in_words(test),
            "yes" if test["passed"] else "no",
            "" if test["passed"] else test["points_to"],
        ]
        for test in found.tests
    ]
    head = ["output", "test", "statistic", "threshold", "p-value", "passed", "points to"]
    note = f"<p>{escape(OF_SIZE)}</p>" if any(test["p_value"] is None for test in found.tests) else ""
    return table(head, rows, (2, 3, 4)) + note


def poles(model: Model) -> str:
    """Return the poles as frequencies with damping ratios, or as time constants."""
    rows = list(pole_rows(model))
    if not rows:
        return "<p>There are no poles except those of the dead time.</p>"
    return table(["pole", "frequency [Hz]", "damping", "time constant [s]"], rows, (1, 2, 3))


def pole_rows(model: Model) -> Iterator[list[str]]:
    """Yield a row for each real pole and each pair of poles, without the poles of a dead time."""
    for pole in model.linear.poles:
        if is_late(pole) or pole.imag < 0:
            continue
        frequency, damping = natural(pole, model.rate)
        decay = 2 * np.pi * frequency * damping
        time = f"{1 / decay:.4g}" if decay > 0 else "-"
        text = f"{pole.real:.6f}" + (f" ± {pole.imag:.6f} i" if pole.imag else "")
        if pole.imag or pole.real < 0:
            yield [text, f"{frequency:.5g}", f"{damping:.3g}", time]
        else:
            yield [text, "-", "-", time]


def pairs(rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of names and texts, without headings."""
    return table(["", ""], rows).replace("<tr><th></th><th></th></tr>", "")


def structure(model: Model) -> Mapping[str, Any]:
    """Return the structure of a model as text."""
    words = {}
    for name, gpi in zip(model.input_names, model.hysteresis, strict=True):
        plays, zones = len(gpi.plays.weights), len(gpi.envelope.weights)
        words[f"hysteresis of {name}"] = f"{plays} plays, {zones} deadzones"
    late = sum(is_late(pole) for pole in model.linear.poles)
    parts = [f"order {model.linear.order - late}"] if model.linear.order > late else ["a gain"]
    if late:
        parts.append(f"dead time {late} samples")
    words["linear part"] = ", ".join(parts)
    return words


def is_late(pole: complex) -> bool:
    """Return whether a pole belongs to a dead time. Rounding errors separate multiple poles at zero."""
    return abs(pole) < 1e-3
