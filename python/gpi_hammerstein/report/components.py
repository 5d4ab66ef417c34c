"""The table of components: what each effect contributes, and how sure it is."""

from dataclasses import dataclass

import numpy as np

from gpi_hammerstein._native import Explanation
from gpi_hammerstein.report.packing import Array
from gpi_hammerstein.report.series import Errors


@dataclass(frozen=True)
class Component:
    """What one step of the search contributes.

    Parameters
    ----------
    effect
        The name of the effect.
    share
        The part of the squares of the declared model's residual that the step removes from the training data,
        ``(rms(k-1)^2 - rms(k)^2) / rms(0)^2``.
    size
        For each output, the rms of the change of the simulated output when the effect was added, in its unit.
    holdout_before, holdout_after
        Rms errors on held-out data without and with the effect, in the unit of the output.
    evidence
        The deviance over its significance threshold.
    """

    effect: str
    share: float
    size: tuple[float, ...]
    holdout_before: float
    holdout_after: float
    evidence: float


def components(found: Explanation, errors: Errors) -> list[Component]:
    """Return the contribution of each step, in the order in which the effects were added.

    Parameters
    ----------
    found
        The result of `explain`.
    errors
        The errors of both models.

    Returns
    -------
    list of Component
        Without the declared model. The refinement of all parts after the last step is not part of it.

    Examples
    --------
    >>> [one.effect for one in components(found, Errors(found))]  # doctest: +SKIP
    ['creep', 'periodic-disturbance']
    """
    steps = found.steps
    all_squares = steps[0]["train_rms"] ** 2 if steps else 0.0
    rows = []
    earlier: list[Array] | None = None
    for index, (step, model) in enumerate(zip(steps, found.models, strict=True)):
        # the measured output cancels in the difference of two residuals
        own = model.residual(found.record, fit_start=True) if len(steps) > 1 else []
        if earlier is not None:
            last = steps[index - 1]
            change = [a - b for a, b in zip(earlier, own, strict=True)]
            scored = np.concatenate([e[w:] for e, w in zip(change, errors.warmups, strict=True)])
            gain = last["train_rms"] ** 2 - step["train_rms"] ** 2
            evidence = step["evidence"]
            rows.append(
                Component(
                    step["effect"],
                    gain / all_squares if all_squares > 0 else 0.0,
                    tuple(np.sqrt(np.mean(scored**2, axis=0)).tolist()),
                    last["holdout_rms"],
                    step["holdout_rms"],
                    evidence["deviance"] / evidence["chance"] if evidence["chance"] > 0 else 0.0,
                )
            )
        earlier = own
    return rows
