"""An explanation as the JSON object `gpi-explanation/1`, and in words."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gpi_hammerstein._native import Explanation, effect_names
from gpi_hammerstein.stage import stage, stage_in_words

# Parameters of an effect that a sentence can hold.
SHOWN = 6
# Wrong samples that a sentence can hold.
FEW = 4

__all__ = ["failed_in_words", "in_words", "to_dict"]


def to_dict(found: Explanation) -> dict[str, Any]:
    """Return an explanation as the JSON object `gpi-explanation/1`.

    Parameters
    ----------
    found
        What `explain` returned.

    Returns
    -------
    dict
        ``schema``, ``record``, ``noise_floor``, ``effects``, ``steps``, ``moved_resonance``, ``stage``,
        ``rejected``, ``error`` (before and after, each train and holdout), ``residual`` (whether it is
        structured, and its tests), ``verdict``, ``next_experiment``, ``wrong_samples``, ``interrupted``.

    Examples
    --------
    >>> to_dict(gpi.explain(record))["verdict"]  # doctest: +SKIP
    'explained'
    """
    record, floor = found.record, found.noise_floor
    noise = float(np.sqrt(np.mean(np.square(floor["rms"]))))
    keys = ("name", "output", "statistic", "threshold", "p_value", "passed", "points_to")
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
                    row["name"]: {key: row[key] for key in ("value", "std", "unit")}
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
        "verdict": found.verdict,
        "next_experiment": found.next_experiment,
        "wrong_samples": found.wrong_samples,
        "interrupted": found.interrupted,
    }


def in_words(result: Mapping[str, Any], unit: str = "", *, numbers: bool = True) -> Iterator[str]:
    """Yield sentences that say what an explanation found.

    Parameters
    ----------
    result
        What `to_dict` returned.
    unit
        The unit of the outputs.
    numbers
        Whether sentences name the parameters of each effect and the figures of each test that fails.

    Yields
    ------
    str
        One sentence at a time: what was missing, how sure, what is left, what to measure next.

    Examples
    --------
    >>> for sentence in in_words(to_dict(found), "um"):  # doctest: +SKIP
    ...     print(sentence)
    """
    space = f" {unit}" if unit else ""
    before, after = (result["error"][when]["holdout"]["rms"] for when in ("before", "after"))
    names = effect_names()
    if result["interrupted"]:
        yield "Stopped before the search had finished: this is what was found so far."
    if not result["effects"]:
        if result["verdict"] == "explained":
            yield "The model lacks nothing: what is left is noise."
        else:
            yield "No effect of the catalogue explains what is left."
    elif after >= before:
        yield (
            f"The model lacked {join(result['effects'])}. On the held-out record the error goes from "
            f"{before:.4g}{space} to {after:.4g}{space} rms: effects that the input does not drive are "
            "others there and are left out."
        )
    else:
        yield (
            f"The model lacked {join(result['effects'])}: on data that took no part in the fit the error "
            f"falls from {before:.4g}{space} to {after:.4g}{space} rms "
            f"({before / max(after, 1e-300):.3g} times)."
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
            f"A resonance at {frequency(small)} where the outputs swing {small['swing']:.3g}{space} rms "
            f"is at {frequency(large)} where they swing {large['swing']:.3g}{space}. Hysteresis, or "
            "whatever else acts on the input alone, cannot move a resonance: it is ruled out as the only "
            "cause."
        )
    for other in result["rejected"]:
        if other["confounded_with"]:
            yield f"{other['effect']} {other['why']}: this record cannot tell them apart."
    yield from stage_in_words(result["stage"])
    floor = result["noise_floor"]["rms"]
    left = result["error"]["after"]["train"]["rms"]
    yield f"What is left is {left:.4g}{space} rms; the noise floor is {floor:.4g}{space}."
    tests = result["residual"]["tests"]
    failed = list(dict.fromkeys(test["name"] for test in tests if not test["passed"]))
    if numbers:
        yield from failed_in_words(tests)
    elif failed:
        yield f"It fails the test{'s' if len(failed) > 1 else ''} {join(failed)}."
    yield {
        "explained": "Verdict: explained; the residual shows no more than noise.",
        "partly-explained": "Verdict: partly explained; structure is left in the residual.",
        "unattributed": "Verdict: unattributed; the residual has structure that no effect explains.",
    }[result["verdict"]]
    if result["next_experiment"]:
        yield f"Next: {result['next_experiment']['why']}."


def wrong_in_words(wrong: Sequence[Mapping[str, Any]]) -> str:
    """Return a sentence that says which samples were left out."""
    several = wrong[-1]["experiment"] > 0
    where = [
        f"row {one['row']} of {one['output']}" + (f" in experiment {one['experiment']}" if several else "")
        for one in wrong[:FEW]
    ]
    if len(wrong) > FEW:
        where.append(f"{len(wrong) - FEW} more")
    verb = (
        "sample stands apart from its neighbours and is"
        if len(wrong) == 1
        else "samples stand apart from their neighbours and are"
    )
    return f"{len(wrong)} {verb} not scored: {join(where)} (counted from 0)."


def failed_in_words(tests: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a sentence for every test that fails, with its picture where there is one."""
    for test in tests:
        if not test["passed"]:
            picture = f" (see {test['picture']})" if test.get("picture") else ""
            yield (
                f"The residual of {test['output']} fails the test {test['name']} "
                f"({test['statistic']:.3g} over {test['threshold']:.3g}), which points to "
                f"{test['points_to']}{picture}."
            )


def frequency(resonance: Mapping[str, float]) -> str:
    """Return a resonance's frequency with its uncertainty."""
    return f"{resonance['frequency']:.6g} ± {1.96 * resonance['std']:.2g} Hz"


def number(label: str, row: Mapping[str, Any]) -> str:
    """Return a parameter with its uncertainty and unit."""
    spread = f" ± {1.96 * row['std']:.2g}" if row["std"] else ""
    return f"{label} {row['value']:.4g}{spread}" + (f" {row['unit']}" if row["unit"] else "")


def join(names: list[str]) -> str:
    """Return names as a list in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
