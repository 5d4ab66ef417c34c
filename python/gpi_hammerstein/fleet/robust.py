r"""Robust estimates of location and scatter, which a small part of unusual devices hardly changes.

One figure, x with n values: m = median(x), s0 = median(\|x - m\|). The tau scale s (Yohai and Zamar, 1988,
J. Am. Stat. Assoc. 83, in the form of Maronna and Zamar) is

    s^2 = s0^2 / (b n) sum_i min((x_i - mu)^2 / s0^2, c2^2),

where mu is the mean with the weights (1 - (x_i - m)^2 / (c1 s0)^2)^2, zero beyond c1 s0, and b makes s the
standard deviation of a normal distribution.

Several figures: the orthogonalized Gnanadesikan-Kettenring estimator (Maronna and Zamar, 2002, Technometrics
44). The robust covariance of two columns of unit scale is (s(x + y)^2 - s(x - y)^2) / 4. The matrix of all
pairs need not be positive definite; therefore the data are projected on its eigenvectors, and the scales of
the projections replace its eigenvalues.

Both are the start of :mod:`.scatter`.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import special

Array = NDArray[np.float64]

C1, C2 = 4.5, 3.0
"""Constants of the tau scale; its efficiency is 80 % for a normal distribution (Maronna and Zamar, 2002)."""
PASSES = 2
"""Orthogonalizations; more change nothing (Maronna and Zamar, 2002)."""

_QUARTILE = float(special.ndtri(0.75))
_CUT = C2 * _QUARTILE
_DENSITY = np.exp(-0.5 * _CUT**2) / np.sqrt(2 * np.pi)
_B = float(2 * ((1 - _CUT**2) * special.ndtr(_CUT) - _CUT * _DENSITY + _CUT**2) - 1)


def tau(x: Array) -> tuple[Array, Array]:
    """Return the tau location and the tau scale of each column.

    Parameters
    ----------
    x
        Values, shape (rows, columns), without NaN.

    Returns
    -------
    tuple of ndarray
        Location and scale, each of shape (columns,). The scale is 0 if more than half of the values are the
        same.

    Examples
    --------
    >>> x = np.random.default_rng(0).normal(3.0, 2.0, (10_000, 1))
    >>> [f"{float(one[0]):.1f}" for one in tau(x)]
    ['3.0', '2.0']
    """
    middle = np.median(x, axis=0)
    start = np.median(np.abs(x - middle), axis=0)
    unit = np.where(start > 0, start, 1.0)
    weight = np.maximum(1 - ((x - middle) / (C1 * unit)) ** 2, 0.0) ** 2
    location = (weight * x).sum(axis=0) / weight.sum(axis=0)
    square = np.minimum(((x - location) / unit) ** 2, C2**2).mean(axis=0) * _QUARTILE**2 / _B
    scale = start / _QUARTILE * np.sqrt(square)
    return np.where(start > 0, location, middle), scale


def orthogonalized(x: Array) -> Array:
    """Return the squared distances of the orthogonalized Gnanadesikan-Kettenring estimator.

    Parameters
    ----------
    x
        Values, shape (rows, columns), without NaN; each column has a positive tau scale.

    Returns
    -------
    ndarray
        Shape (rows,).

    Examples
    --------
    >>> x = np.random.default_rng(0).normal(size=(500, 3))
    >>> x[0] = 20.0
    >>> int(np.argmax(orthogonalized(x)))
    0
    """
    y = x
    for _ in range(PASSES):
        y = y / _positive(tau(y)[1])
        columns = y.shape[1]
        pairs = np.eye(columns)
        rows, others = np.triu_indices(columns, 1)
        if len(rows):
            plus = tau(y[:, rows] + y[:, others])[1]
            minus = tau(y[:, rows] - y[:, others])[1]
            pairs[rows, others] = pairs[others, rows] = 0.25 * (plus**2 - minus**2)
        y = y @ np.linalg.eigh(pairs)[1]
    location, scale = tau(y)
    return np.asarray((((y - location) / _positive(scale)) ** 2).sum(axis=1))


def _positive(scale: Array) -> Array:
    return np.where(scale > 0, scale, 1.0)
