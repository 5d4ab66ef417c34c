r"""The centre and the covariance of the usual devices, and how improbable a distance from them is.

The distances of :mod:`.robust` are a start. The rows whose squared distance does not exceed the quantile
`KEPT` of a normal distribution give an ordinary mean and covariance. The covariance is enlarged by the factor
that the removal of the other rows requires (Cerioli, 2010, J. Am. Stat. Assoc. 105). For a normal population,
the squared distance over p figures then has approximately the distribution

    d^2 ~ (w + 1) / w * p (v - 1) / (v - p) * F(p, v - p),   v = EFFICIENCY * w,

where w rows gave the covariance. This is the form of Hardin and Rocke (2005, J. Comput. Graph. Stat. 14),
which counts that the covariance of few rows is uncertain.

Populations often have longer tails than a normal distribution. If the figures have the multivariate
t distribution with nu degrees of freedom, d^2 / p has the distribution F(p, nu). nu is found from two
quantiles of the squared distances, which up to `DEFECTS` of unusual devices do not enlarge, and only as far
as the ratio of these quantiles exceeds that of a normal distribution by more than its own uncertainty.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from gpi_hammerstein.fleet.robust import Array, orthogonalized

KEPT = 0.975
"""Quantile of the squared distances up to which rows take part in the covariance, as in Cerioli (2010)."""
EFFICIENCY = 0.6
"""Information that the covariance of the kept rows has, over that of as many rows of which none was removed.
Simulated normal populations of 20 to 1,000 rows and 1 to 8 figures have at most the stated rates with it."""
DEFECTS = 0.05
"""Share of unusual devices that may be in the population without an effect on the estimate of its tails."""
UPPER = 0.85
"""The upper one of the two quantiles that give the length of the tails; the lower one is the median."""
LONGEST_TAIL = 3.0
"""Smallest degrees of freedom: distributions with longer tails have no variance that could be estimated."""
# The logarithm of the ratio of both quantiles is uncertain by this, over the root of columns times rows.
_UNCERTAIN = 2.3


@dataclass(frozen=True)
class Scatter:
    """The centre and the covariance of the usual rows.

    Attributes
    ----------
    centre, covariance
        Of shape (columns,) and (columns, columns).
    rows
        Number of rows that took part.
    tail
        Degrees of freedom of the population's tails; infinite for a normal one.
    """

    centre: Array
    covariance: Array
    rows: int
    tail: float = np.inf

    @classmethod
    def of(cls, x: Array, *, tails: bool = True) -> "Scatter":
        """Estimate centre and covariance robustly.

        Parameters
        ----------
        x
            Values, shape (rows, columns), without NaN; many more rows than columns.
        tails
            Whether the tails may be longer than those of a normal distribution.

        Returns
        -------
        Scatter
            The estimates.

        Examples
        --------
        >>> x = np.random.default_rng(0).normal(size=(1000, 2))
        >>> x[:50] += 30.0
        >>> bool(np.abs(Scatter.of(x).covariance - np.eye(2)).max() < 0.15)
        True
        """
        columns = x.shape[1]
        cut = special.chdtri(columns, 1 - KEPT)
        squared = orthogonalized(x)
        # the median of few rows differs from that of the distribution
        middle = float(np.median(squared))
        kept = x[squared * special.chdtri(columns, 0.5) <= cut * middle]
        covariance = np.atleast_2d(np.cov(kept, rowvar=False)) * KEPT / special.chdtr(columns + 2, cut)
        normal = cls(kept.mean(axis=0), covariance, len(kept))
        if not tails:
            return normal
        own = normal.squared(x)
        tail = tail_of(own, columns)
        if np.isinf(tail):
            return normal
        level = 0.5 * (1 - DEFECTS)
        unit = np.quantile(own, level) / (columns * special.fdtri(columns, tail, level))
        return cls(normal.centre, covariance * unit, len(kept), tail)

    def squared(self, x: Array) -> Array:
        """Return squared distances over the known figures of each row.

        Parameters
        ----------
        x
            Values, shape (rows, columns); NaN is unknown.

        Returns
        -------
        ndarray
            Shape (rows,); 0 for a row without known figures.

        Examples
        --------
        >>> scatter = Scatter(np.zeros(2), np.eye(2), 100)
        >>> scatter.squared(np.array([[3.0, 4.0], [3.0, np.nan]])).tolist()
        [25.0, 9.0]
        """
        known = np.isfinite(x)
        found = np.zeros(len(x))
        for pattern in np.unique(known, axis=0):
            if pattern.any():
                own = (known == pattern).all(axis=1)
                off = (x[own] - self.centre)[:, pattern]
                inner = self.covariance[np.ix_(pattern, pattern)]
                found[own] = (off * np.linalg.solve(inner, off.T).T).sum(axis=1)
        return found

    def p_values(self, squared: Array, columns: Array) -> Array:
        """Return how probable squared distances at least as large are.

        Parameters
        ----------
        squared
            Squared distances, shape (rows,).
        columns
            Number of known figures of each row, shape (rows,).

        Returns
        -------
        ndarray
            Shape (rows,); 1 for a row without known figures.

        Examples
        --------
        >>> scatter = Scatter(np.zeros(1), np.eye(1), 10_000)
        >>> scatter.p_values(np.array([3.84]), np.array([1.0])).round(3).tolist()
        [0.05]
        """
        known = np.maximum(columns, 1)
        information = np.maximum(EFFICIENCY * self.rows, known + 1.0)
        rest = information - known
        ratio = squared * self.rows / (self.rows + 1) * rest / (known * (information - 1))
        degrees = 1 / (1 / rest + 1 / self.tail)
        return np.where(columns > 0, special.fdtrc(known, degrees, ratio), 1.0)


def tail_of(squared: Array, columns: int) -> float:
    """Return the degrees of freedom of the tails of a population.

    Parameters
    ----------
    squared
        Squared distances of the whole population, shape (rows,); their unit does not matter.
    columns
        Number of figures.

    Returns
    -------
    float
        At least `LONGEST_TAIL`; infinite if the tails are not longer than those of a normal distribution.

    Examples
    --------
    >>> random = np.random.default_rng(0)
    >>> normal = random.chisquare(4, 1000)
    >>> tail_of(normal, 4), tail_of(normal / random.chisquare(3, 1000), 4) < 10
    (inf, True)
    """
    low, high = np.quantile(squared, [0.5 * (1 - DEFECTS), UPPER * (1 - DEFECTS)])
    if low <= 0:
        return np.inf
    degrees, ratios = _ratios(columns)
    ratio = np.log(high / low) - _UNCERTAIN / np.sqrt(columns * len(squared))
    return float(np.interp(ratio, ratios, degrees)) if ratio > ratios[0] else np.inf


@lru_cache
def _ratios(columns: int) -> tuple[Array, Array]:
    """Return degrees of freedom, and the logarithm of the ratio of both quantiles for them; rising."""
    degrees = np.geomspace(500.0, LONGEST_TAIL, 40)
    high, low = (special.fdtri(columns, degrees, level) for level in (UPPER, 0.5))
    return degrees, np.log(high / low)
