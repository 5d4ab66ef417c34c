"""Pairs of things that two models have: the same resonance, the same effect."""

from collections.abc import Sequence

import numpy as np


def nearest_pairs(a: Sequence[float], b: Sequence[float]) -> list[tuple[int | None, int | None]]:
    """Return the places of the values that belong together.

    As many values as possible are paired, so that the sum of ``|a - b| / (|a| + |b|)`` is smallest.

    Parameters
    ----------
    a, b
        The values, such as frequencies in Hz.

    Returns
    -------
    list of tuple
        Places in `a` and in `b`, None where there is no partner; in the order of the values.

    Examples
    --------
    >>> nearest_pairs([150.0], [50.0, 151.0])
    [(None, 0), (0, 1)]
    """
    pairs: list[tuple[int | None, int | None]] = []
    if len(a) and len(b):
        from scipy.optimize import linear_sum_assignment  # its import takes longer than most commands

        first, second = np.meshgrid(a, b, indexing="ij")
        size = np.abs(first) + np.abs(second)
        rows, columns = linear_sum_assignment(np.abs(first - second) / np.where(size > 0, size, 1.0))
        pairs = [(int(row), int(column)) for row, column in zip(rows, columns, strict=True)]
    pairs += [(place, None) for place in range(len(a)) if place not in [pair[0] for pair in pairs]]
    pairs += [(None, place) for place in range(len(b)) if place not in [pair[1] for pair in pairs]]

    def value(pair: tuple[int | None, int | None]) -> float:
        known = [own[place] for own, place in zip((a, b), pair, strict=True) if place is not None]
        return sum(known) / len(known)

    return sorted(pairs, key=value)
