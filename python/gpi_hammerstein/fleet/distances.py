r"""How far the figures of each device are from those of the fleet.

One figure: z = (x - m) / sqrt(s^2 + max(0, d^2 - d0^2)), where m is the fleet's median, s its robust standard
deviation (:mod:`.scatter`), d the standard deviation of this value, and d0 its median over the fleet, which s
contains. The p-value is that of Student's distribution. s has a lower limit, because a difference that
has no practical meaning is no reason, however similar the other devices are. Of errors and noise, only large
values count, and s is that of the values above the median, because these figures are skewed.

All figures that describe the device and that most of the fleet has: the squared distance d^2 and its p-value
(:mod:`.scatter`) over the values z.

A device has m figures and one distance: p = min(1, 2 min(p of the distance, m * smallest p of a figure)), the
Bonferroni correction for both ways to stand out. q is that of Benjamini and Hochberg (1995, J. R. Stat. Soc.
B 57) over all devices: among the devices with q <= `FALSE_SHARE`, on average at most this share is usual.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gpi_hammerstein.fleet.devices import Fleet
from gpi_hammerstein.fleet.figures import Figure, Scaled, scaled
from gpi_hammerstein.fleet.robust import Array
from gpi_hammerstein.fleet.scatter import Scatter, tail_of

FALSE_SHARE = 0.01
"""Expected share of usual devices among those that stand out by their figures. Somebody examines each of
them, so that a false one costs time. Holm's correction avoids every single one, but misses more in large
fleets."""
FEWEST = 10
"""A figure that fewer devices have is not judged: what is usual is not known."""
ROWS_PER_FIGURE = 5
"""Smallest number of devices for each figure of the joint distance."""
KNOWN = 0.8
"""A figure takes part in the joint distance if at least this share of the devices has it."""
LEAST_SPREAD = 0.002
"""Smallest standard deviation over the size of a figure: differences below 1 % have no practical meaning."""
LEAST_SPREAD_OF_ERRORS = 0.05
"""The same for errors over noise and for noise, whose estimates on a part of a record differ by percents."""
NOTABLE = 3.0
"""Distance of a figure in robust standard deviations from which on it is named as a reason."""


@dataclass(frozen=True)
class Distances:
    """The distances of the devices that have a result.

    Attributes
    ----------
    figures, scaled, spreads
        The figures that are judged, their values on the scale of comparison, and their robust standard
        deviations there.
    z
        Distances in robust standard deviations, shape (devices, figures); NaN is unknown.
    joint
        The places of the figures of the joint distance.
    distance
        The joint distance, shape (devices,); NaN if there is none.
    contributions
        What the joint squared distance loses without a figure, shape (devices, figures).
    p, q
        Of shape (devices,); NaN for a device without figures.
    """

    figures: list[Figure]
    scaled: list[Scaled]
    spreads: list[float]
    z: Array
    joint: list[int]
    distance: Array
    contributions: Array
    p: Array
    q: Array


def distances(fleet: Fleet) -> Distances:
    """Return how far the figures of each device are from those of the fleet.

    Parameters
    ----------
    fleet
        The devices and their figures.

    Returns
    -------
    Distances
        One row for each device that has a result.
    """
    singles = [one for figure in fleet.figures if figure.judged and (one := _single(fleet, figure))]
    devices = len(fleet.judged)
    z = np.column_stack([np.empty((devices, 0)), *(one.z for one in singles)])
    known = np.isfinite(z)
    both = [place for place, one in enumerate(singles) if not one.figure.upward]
    usual = z[:, both][known[:, both]]
    tail = tail_of(usual**2, 1) if len(usual) else np.inf
    each = np.column_stack([np.empty((devices, 0)), *(one.p_values(tail) for one in singles)])
    smallest = np.nanmin(np.where(known, each, 1.0), axis=1, initial=1.0)
    p = np.minimum(known.sum(axis=1) * smallest, 1.0)
    places = [place for place in both if singles[place].figure.joint and not singles[place].limited]
    places, scatter = _joint(z, places)
    distance, contributions = np.full(devices, np.nan), np.zeros_like(z)
    if scatter is not None:
        own = z[:, places]
        columns = np.isfinite(own).sum(axis=1)
        squared = scatter.squared(own)
        several = columns >= 2
        distance[several] = np.sqrt(squared[several])
        for at, place in enumerate(places):
            without = own.copy()
            without[:, at] = np.nan
            contributions[:, place] = np.where(several, squared - scatter.squared(without), 0.0)
        of_all = scatter.p_values(squared, columns.astype(np.float64))
        p = np.where(several, np.minimum(2 * np.minimum(p, of_all), 1.0), p)
    p = np.where(known.any(axis=1), p, np.nan)
    return Distances(
        [one.figure for one in singles],
        [one.scaled for one in singles],
        [one.spread for one in singles],
        z,
        places,
        distance,
        contributions,
        p,
        false_discovery(p),
    )


@dataclass(frozen=True)
class _Single:
    """One figure, judged alone."""

    figure: Figure
    scaled: Scaled
    scatter: Scatter
    spread: float
    limited: bool
    z: Array

    def p_values(self, tail: float) -> Array:
        """Return p-values, shape (devices,); NaN where the figure is unknown."""
        scatter = Scatter(self.scatter.centre, self.scatter.covariance, self.scatter.rows, tail)
        columns = np.isfinite(self.z).astype(np.float64)
        two_sided = scatter.p_values(np.nan_to_num(self.z) ** 2, columns)
        found = np.where(self.z > 0, two_sided / 2, 1.0) if self.figure.upward else two_sided
        return np.where(columns > 0, found, np.nan)


def _single(fleet: Fleet, figure: Figure) -> _Single | None:
    """Return the distances of one figure; None if it cannot be judged."""
    own = scaled(*fleet.of_devices(figure))
    known = np.isfinite(own.values)
    if known.sum() < FEWEST:
        return None
    off = own.values - np.median(own.values[known])
    usual = off[known]
    if figure.upward:
        above = usual[usual >= 0]
        usual = np.concatenate([above, -above])
    scatter = Scatter.of(usual[:, None], tails=False)
    if figure.upward:
        scatter = Scatter(scatter.centre, scatter.covariance, scatter.rows // 2)
    least = LEAST_SPREAD_OF_ERRORS if figure.upward else LEAST_SPREAD
    least *= 1.0 if own.logarithmic else abs(own.median)
    spread = float(np.sqrt(scatter.covariance[0, 0]))
    if max(spread, least) <= 0:
        return None
    variance = own.std**2 - np.median(own.std[known] ** 2)
    z = off / np.sqrt(max(spread, least) ** 2 + np.maximum(variance, 0.0))
    return _Single(figure, own, scatter, max(spread, least), spread <= least, z)


def _joint(z: Array, places: Sequence[int]) -> tuple[list[int], Scatter | None]:
    """Return the figures of the joint distance, their centre and covariance; None if there are too few."""
    known = np.isfinite(z)
    share = known.mean(axis=0) if len(z) else np.zeros(z.shape[1])
    chosen = sorted((place for place in places if share[place] >= KNOWN), key=lambda place: -share[place])
    while len(chosen) >= 2:
        whole = known[:, chosen].all(axis=1)
        if whole.sum() >= max(ROWS_PER_FIGURE * len(chosen), FEWEST):
            scatter = Scatter.of(z[whole][:, chosen])
            if np.linalg.eigvalsh(scatter.covariance).min() > 1e-9:
                return chosen, scatter
        chosen = chosen[:-1]
    return [], None


def false_discovery(p: Array) -> Array:
    """Return the q-values of Benjamini and Hochberg.

    Parameters
    ----------
    p
        p-values, shape (tests,); NaN for what is not tested.

    Returns
    -------
    ndarray
        The smallest false discovery rate at which each test is significant, shape (tests,).

    Examples
    --------
    >>> false_discovery(np.array([0.01, 0.04, 0.03, np.nan])).round(3).tolist()
    [0.03, 0.04, 0.04, nan]
    """
    q = np.full(len(p), np.nan)
    tested = np.flatnonzero(np.isfinite(p))
    order = tested[np.argsort(p[tested], kind="stable")]
    raw = p[order] * len(order) / np.arange(1, len(order) + 1)
    q[order] = np.minimum.accumulate(raw[::-1])[::-1]
    return q
