"""One compared value of two models."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gpi_hammerstein.difference.significance import holm, two_sided

Group = Literal["figure", "effect", "parameter"]

# A standard deviation below this part of the value is the rounding of a number that is not uncertain.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Difference:
    """One value of two models, and whether it differs beyond its uncertainty.

    Parameters
    ----------
    name
        Such as ``sensitivity[u -> y]``, ``creep.gain[0]`` or ``u.weights[1]``.
    group
        ``figure`` of the stage, quantity of an ``effect``, or ``parameter`` of models with the same
        structure.
    unit
        The unit of the values; empty for a pure number or if it is not known.
    a, b
        The value in each model, in ``unit``; None if the model does not have it.
    std_a, std_b
        The standard deviation in each model, in ``unit``; None if it is not known, 0 if it was not estimated.
    difference
        ``b - a``, in ``unit``; None if one of them is missing.
    std
        The standard deviation of the difference, ``sqrt(std_a^2 + std_b^2)``, in ``unit``; None if it is not
        known.
    z
        ``difference / std``, a pure number; None if it is not known.
    p_value
        The probability of a larger ``|z|`` if the values are equal, a pure number; None if it is not known.
    differs
        Whether the values differ, with Holm's correction over all rows; None if it is not known.

    Examples
    --------
    >>> bank = lambda gain: gpi.PlayBank([0.0, 1.0], [gain, 0.5])
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> noise = 0.01 * np.random.default_rng(1).normal(size=(2, 2000))
    >>> records = [gpi.Record(u, bank(gain)(u) + noise[i], 1000.0) for i, gain in enumerate([1.0, 1.1])]
    >>> a, b = (gpi.identify(own, delay=0, half_widths=[0.0, 1.0], thresholds=0) for own in records)
    >>> row = gpi.compare(a, b)["sensitivity[u -> y]"]
    >>> row.differs, round(row.difference, 2)
    (True, 0.1)
    """

    name: str
    group: Group
    unit: str
    a: float | None
    b: float | None
    std_a: float | None
    std_b: float | None
    difference: float | None
    std: float | None
    z: float | None
    p_value: float | None
    differs: bool | None


def untested(
    name: str,
    group: Group,
    unit: str,
    values: tuple[float | None, float | None],
    stds: tuple[float | None, float | None],
) -> Difference:
    """Return a row with the difference of two values, without a test.

    Parameters
    ----------
    name, group, unit
        As in `Difference`.
    values, stds
        Values and standard deviations of both models.

    Returns
    -------
    Difference
        The row.
    """
    a, b = values
    difference = None if a is None or b is None else b - a
    return Difference(name, group, unit, a, b, *stds, difference, None, None, None, None)


def tested(row: Difference) -> Difference:
    """Return a row with a test, if both values and standard deviations are known.

    Parameters
    ----------
    row
        Values and standard deviations. The standard deviation 0 of a figure is exact, as the width of a model
        without plays. That of a parameter says that it was not estimated, or that it is at its bound.

    Returns
    -------
    Difference
        The row.
    """
    if row.a is None or row.b is None or row.std_a is None or row.std_b is None:
        return row
    is_estimated = row.std_a > 0 and row.std_b > 0
    std = float(np.hypot(row.std_a, row.std_b))
    is_rounding = std <= ROUNDING * max(abs(row.a), abs(row.b))
    if is_rounding or not (is_estimated or row.group == "figure"):
        return row
    z = (row.b - row.a) / std
    return replace(row, std=std, z=z, p_value=two_sided(z))


def decided(rows: list[Difference]) -> list[Difference]:
    """Return tested rows with the decision of each.

    Parameters
    ----------
    rows
        All rows of a comparison.

    Returns
    -------
    list of Difference
        The rows, in their order.
    """
    outcomes = holm([row.p_value for row in rows])
    return [replace(row, differs=differs) for row, differs in zip(rows, outcomes, strict=True)]
