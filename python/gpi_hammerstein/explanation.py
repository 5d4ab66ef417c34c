"""An explanation as the JSON object `gpi-explanation/1` and as text."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gpi_hammerstein._native import Explanation, effect_names
from gpi_hammerstein.comparison import compared_in_words
from gpi_hammerstein.stage import stage, stage_in_words
from gpi_hammerstein.uncertain import NOT_DETERMINED, spread

# Largest number of parameters of an effect in one sentence.
SHOWN = 6
# Largest number of wrong samples in one sentence.
FEW = 4
# Smallest probability of another effect that is mentioned.
PROBABLE = 0.05

__all__ = ["failed_in_words", "in_words", "to_dict"]


def to_dict(found: Explanation) -> dict[str, Any]:
    """Return an explanation as the JSON object `gpi-explanation/1`.

    Parameters
    ----------
    found
        The result of `explain`.

    Returns
    -------
    dict
        ``schema``, ``record``, ``noise_floor``, ``effects``, ``steps``, ``moved_resonance``, ``stage``,
        ``rejected``, ``error`` (before and after, each for train and holdout), ``residual`` (whether it is
        structured, and its tests), ``rivals``, ``verdict``, ``verdict_reason``, ``notes``,
        ``next_experiment``, ``wrong_samples``, ``interrupted``.

    Examples
    --------
    >>> to_dict(gpi.explain(record))["verdict"]  # doctest: +SKIP
    'explained'
    """
    record, floor = found.record, found.noise_floor
    noise = float(np.sqrt(np.mean(np.square(floor["rms"]))))
    keys = ("name", "output", "statistic", "threshold", "p_value", "level", "passed", "points_to")
    return {
        "schema": "gpi-explanation/1",
        "record": {
            "samples": record.samples,
            "rate_hz": record.rate,
            "inputs": record.input_names,
            "outputs": record.output_names,
            "covariates": record.covariate_names,
        },
        "noise_floor": {**floor, "rms": noise, "per_output": floor["rms"]},
        "effects": found.effects,
        "steps": [
            {
                **step,
                "parameters": {
                    row["name"]: {key: row[key] for key in ("value", "std", "unit", "determined")}
                    for row in step["parameters"]
                },
            }
            for step in found.steps
        ],
        "moved_resonance": found.moved_resonance,
        "stage": stage(found.model, record),
        "rejected": found.rejected,
        "error": {"before": found.before, "after": found.after},
        "residual": {
            "structured": found.verdict != "explained",
            "tests": [{key: test[key] for key in keys} for test in found.tests],
        },
        "rivals": found.rivals,
        "verdict": found.verdict,
        "verdict_reason": found.verdict_reason,
        "notes": found.notes,
        "next_experiment": found.next_experiment,
        "wrong_samples": found.wrong_samples,
        "interrupted": found.interrupted,
    }


def in_words(result: Mapping[str, Any], unit: str = "", *, numbers: bool = True) -> Iterator[str]:
    """Yield the result of an explanation as sentences.

    Parameters
    ----------
    result
        The result of `to_dict`.
    unit
        The unit of the outputs.
    numbers
        Whether the sentences contain the parameters of each effect and the statistics of each failed test.

    Yields
    ------
    str
        One item at a time: the missing effects, their uncertainty, the residual, the next experiment.

    Examples
    --------
    >>> for sentence in in_words(to_dict(found), "um"):  # doctest: +SKIP
    ...     print(sentence)
    """
    space = f" {unit}" if unit else ""
    before, after = (result["error"][when]["holdout"]["rms"] for when in ("before", "after"))
    names = effect_names()
    if result["interrupted"]:
        yield "The search was stopped before it was complete. This is the result so far."
    if not result["effects"]:
        if result["verdict"] == "explained":
            yield "The model lacks no effect: the residual has no structure beyond noise."
        else:
            yield "No effect of the catalogue explains the residual."
    elif after >= before:
        yield (
            f"The model lacked {join(result['effects'])}. On the held-out record the error changes from "
            f"{before:.4g}{space} to {after:.4g}{space} rms. Effects that the input does not drive are "
            "different in that record and are left out of its error."
        )
    else:
        yield (
            f"The model lacked {join(result['effects'])}. On held-out data, which were not used for the fit, "
            f"the error decreases from {before:.4g}{space} to {after:.4g}{space} rms "
            f"(by a factor of {before / max(after, 1e-300):.3g})."
        )
    shown: set[str] = set()
    for step in result["steps"] if numbers else []:
        name = step["effect"]
        if name is None or not step["parameters"]:
            continue
        values = [number(label, row) for label, row in step["parameters"].items()]
        if len(values) > SHOWN:
            values[SHOWN:] = [f"{len(values) - SHOWN} more"]
        yield f"{name} ({'one more' if name in shown else names[name]}): {', '.join(values)}."
        shown.add(name)
    if result["wrong_samples"]:
        yield wrong_in_words(result["wrong_samples"])
    if result["moved_resonance"]:
        small, large = result["moved_resonance"]
        yield (
            "The frequency of a resonance depends on the amplitude of the outputs: it is "
            f"{frequency(small)} at {small['swing']:.3g}{space} rms and {frequency(large)} at "
            f"{large['swing']:.3g}{space} rms. An effect that acts only on the input, such as hysteresis, "
            "cannot move a resonance. It is therefore not the only cause."
        )
    for step in result["steps"]:
        yield from alternatives_in_words(step)
    for other in result["rejected"]:
        if other["confounded_with"]:
            yield f"{other['effect']} {other['why']}: this record cannot distinguish them."
    yield from stage_in_words(result["stage"])
    floor = result["noise_floor"]["rms"]
    left = result["error"]["after"]["train"]["rms"]
    yield (
        f"On the training data, the residual is {left:.4g}{space} rms; the noise floor is "
        f"{floor:.4g}{space} rms."
    )
    tests = result["residual"]["tests"]
    failed = list(dict.fromkeys(test["name"] for test in tests if not test["passed"]))
    if numbers:
        yield from failed_in_words(tests)
    elif failed:
        yield f"The residual fails the test{'s' if len(failed) > 1 else ''} {join(failed)}."
    yield from compared_in_words(result["rivals"], after, unit)
    yield from result["notes"]
    yield {
        "explained": "Verdict: explained. The residual has no structure beyond noise.",
        "partly-explained": "Verdict: partly explained. The residual still has structure.",
        "unattributed": "Verdict: unattributed. The residual has structure that no effect explains.",
        "outside-class": "Verdict: outside the class of this model. Its structure is wrong for this record.",
    }[result["verdict"]]
    if result["verdict_reason"]:
        yield f"Reason: {result['verdict_reason']}."
    if result["next_experiment"]:
        yield f"Next experiment: {result['next_experiment']['why']}."


def alternatives_in_words(step: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence with the probabilities of an effect and of others that would be accepted."""
    own = step["evidence"].get("probability")
    others = step["evidence"].get("alternatives") or {}
    probable = {name: value for name, value in others.items() if value >= PROBABLE}
    if own is None or not probable:
        return
    ranked = sorted(probable.items(), key=lambda pair: -pair[1])
    listed = ", ".join(f"{name} {100 * value:.0f} %" for name, value in [(step["effect"], own), *ranked])
    yield (
        "When it was added, other effects would also have been accepted. By the held-out blocks, the "
        f"probabilities are: {listed}."
    )


def wrong_in_words(wrong: Sequence[Mapping[str, Any]]) -> str:
    """Return a sentence that lists the samples that are not scored."""
    several = wrong[-1]["experiment"] > 0
    where = [
        f"row {one['row']} of {one['output']}" + (f" in experiment {one['experiment']}" if several else "")
        for one in wrong[:FEW]
    ]
    if len(wrong) > FEW:
        where.append(f"{len(wrong) - FEW} more")
    verb = (
        "sample differs strongly from its neighbours and is"
        if len(wrong) == 1
        else "samples differ strongly from their neighbours and are"
    )
    return f"{len(wrong)} {verb} not scored: {join(where)} (counted from 0)."


def failed_in_words(tests: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a sentence for every failed test, with the name of its picture if there is one."""
    for test in tests:
        if not test["passed"]:
            picture = f" (see {test['picture']})" if test.get("picture") else ""
            yield (
                f"The residual of {test['output']} fails the test {test['name']} "
                f"(statistic {test['statistic']:.3g}, threshold {test['threshold']:.3g}). This points to "
                f"{test['points_to']}{picture}."
            )


def frequency(resonance: Mapping[str, float]) -> str:
    """Return a resonance's frequency with its uncertainty."""
    return f"{resonance['frequency']:.6g} ± {1.96 * resonance['std']:.2g} Hz"


def number(label: str, row: Mapping[str, Any]) -> str:
    """Return a parameter with its uncertainty and unit; without a value if the data do not determine it."""
    if not row["determined"]:
        return f"{label} {NOT_DETERMINED}"
    width = spread(row)
    unit = f" {row['unit']}" if row["unit"] else ""
    return f"{label} {row['value']:.4g}" + (f" {width}" if width else "") + unit


def join(names: list[str]) -> str:
    """Return names as a list in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
