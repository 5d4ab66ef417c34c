"""Which of several differences are significant: tests with Holm's correction."""

import math
from collections.abc import Sequence

# The family-wise error rate: the probability that a comparison of two equal stages names any difference.
LEVEL = 0.05


def two_sided(z: float) -> float:
    """Return the probability that a standard normal variable is farther from zero than z.

    Parameters
    ----------
    z
        A difference over its standard deviation.

    Returns
    -------
    float
        The p-value.

    Examples
    --------
    >>> round(two_sided(1.96), 3)
    0.05
    """
    return math.erfc(abs(z) / math.sqrt(2))


def holm(p_values: Sequence[float | None], level: float = LEVEL) -> list[bool | None]:
    """Return which hypotheses are rejected, by the procedure of Holm (1979).

    The m known p-values are sorted. The i-th smallest is compared with ``level / (m - i + 1)``; the first
    that is larger ends the procedure. The probability that any true hypothesis is rejected is at most
    `level`, however the p-values depend on each other.

    Parameters
    ----------
    p_values
        One p-value for each hypothesis; None where it is not known.
    level
        The family-wise error rate.

    Returns
    -------
    list of bool or None
        Whether each hypothesis is rejected; None where the p-value is not known.

    Examples
    --------
    >>> holm([0.01, None, 0.04, 0.03])
    [True, None, False, False]
    """
    known = sorted((p, place) for place, p in enumerate(p_values) if p is not None)
    rejected: list[bool | None] = [None if p is None else False for p in p_values]
    for done, (p, place) in enumerate(known):
        if p > level / (len(known) - done):
            break
        rejected[place] = True
    return rejected
