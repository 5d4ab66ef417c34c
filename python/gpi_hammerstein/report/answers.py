"""The four answers at the top of the page: what was missing, how sure, how much better, and what next."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from gpi_hammerstein._native import Explanation, effect_names
from gpi_hammerstein.explanation import join
from gpi_hammerstein.report.components import Component

VERDICTS = {
    "explained": "Explained: the residual has no structure beyond noise.",
    "partly-explained": "Partly explained: the residual still has structure.",
    "unattributed": "Unattributed: no effect of the catalogue explains the residual.",
    "outside-class": "Outside the class of this model: its structure is wrong for this record.",
}


def answers(found: Explanation, components: Sequence[Component], unit: str) -> str:
    """Return the four answers as HTML.

    Parameters
    ----------
    found
        The result of `explain`.
    components
        What each step contributes.
    unit
        The unit of the outputs, empty if they have several.

    Returns
    -------
    str
        Four articles, each with a question, a short answer and sentences.
    """
    parts = [
        ("What did the model lack?", *lacked(found)),
        ("How sure is it?", *sure(found, components)),
        ("How much better is it?", *better(found, unit)),
        ("What next?", *following(found)),
    ]
    return "".join(
        f"<article><h2>{escape(question)}</h2><p class='short'>{escape(short)}</p>{body}</article>"
        for question, short, body in parts
    )


def paragraphs(sentences: Iterator[str] | Sequence[str]) -> str:
    """Return sentences as paragraphs."""
    return "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)


def lacked(found: Explanation) -> tuple[str, str]:
    """Return the names of the effects, and what they are."""
    names = effect_names()
    if not found.effects:
        explained = found.verdict == "explained"
        return "No effect", paragraphs(
            ["The declared model is enough." if explained else "The residual has structure, see the tests."]
        )
    items = "".join(f"<li>{escape(name)}: {escape(names[name])}</li>" for name in found.effects)
    return join(list(dict.fromkeys(found.effects))), f"<ul>{items}</ul>"


def sure(found: Explanation, components: Sequence[Component]) -> tuple[str, str]:
    """Return the verdict in short, the tests that passed, and the evidence of the effects."""
    short, _, rest = VERDICTS[found.verdict].partition(":")
    passed = sum(test["passed"] for test in found.tests)
    sentences = [
        rest.strip().capitalize(),
        f"The residual passes {passed} of {len(found.tests)} tests.",
    ]
    if components:
        weakest = min(components, key=lambda one: one.evidence)
        sentences.append(
            f"The evidence is at least {weakest.evidence:.3g} times the significance threshold "
            f"({weakest.effect})."
        )
    confused = sorted(
        {name for other in found.rejected for name in (other["effect"],) if other["confounded_with"]}
    )
    if confused:
        sentences.append(f"This record cannot rule out {join(confused)}.")
    if found.interrupted:
        sentences.append("The search was stopped before it was complete.")
    return short, paragraphs(sentences)


def better(found: Explanation, unit: str) -> tuple[str, str]:
    """Return the factor of the held-out error, and the errors beside the noise and the best simple model."""
    space = f" {unit}" if unit else ""
    before, after = found.before["holdout"]["rms"], found.after["holdout"]["rms"]
    noise = float(np.sqrt(np.mean(np.square(found.noise_floor["rms"]))))
    if not found.effects:
        short = "Nothing was added"
    elif after < before:
        short = f"{before / max(after, 1e-300):.3g} times smaller error"
    else:
        short = "Not better on held-out data"
    sentences = [f"Held-out error: {before:.4g}{space} → {after:.4g}{space} rms."]
    if noise > 0:
        sentences.append(f"Noise floor: {noise:.3g}{space}; error over noise: {after / noise:.3g}.")
    scored: list[Mapping[str, Any]] = [row for row in found.rivals if row["holdout_rms"] is not None]
    if scored:
        best = min(scored, key=lambda row: row["holdout_rms"])
        sentences.append(f"The best simple model, {best['name']}, has {best['holdout_rms']:.4g}{space}.")
    return short, paragraphs(sentences)


def following(found: Explanation) -> tuple[str, str]:
    """Return the next experiment, or the next use of the model."""
    if not found.next_experiment:
        link = '<p><a href="#commands">Commands for the next steps</a></p>'
        return "Use the model", "<p>No further experiment is needed for the verdict.</p>" + link
    why, command = found.next_experiment["why"], found.next_experiment["command"]
    line = '<p><a href="#next">The command</a></p>' if command else ""
    return "Measure again", f"<p>{escape(why[:1].upper() + why[1:])}.</p>{line}"
