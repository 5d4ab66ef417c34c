"""Whether the input and the output of a record look as if they were swapped.

An actuator follows its input: by hysteresis, creep and dynamics, its output lags. With y the output without
its mean, du the central difference of the input and du, dy without trend, the correlation

    c = sum(y du) / sqrt(sum(y^2) sum(du^2)) * sign(sum(y u))

is negative for an output that lags and positive for one that leads: for u = cos(wt) and y = cos(wt - phi), it
is -sin(phi). A damper (displacement to force) and a differentiating sensor lead too. The record is therefore
called suspicious only if a second sign agrees: the "input" has sensor noise and the "output" has none, or the
units are those of a sensor and of a drive.
"""

from collections.abc import Sequence
from math import comb

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein.io.recording import Run
from gpi_hammerstein.io.roles import Roles
from gpi_hammerstein.io.vocabulary import UNITS_OF

Array = NDArray[np.float64]

# Correlation from which an output is said to lead. By hand: measured hysteresis gives -0.02 to -0.3.
LEADS = 0.01
# Blocks of time, of which this part must agree. By hand.
BLOCKS, AGREE = 10, 0.8
# A signal is rougher than another one if the part of its power in third differences is this many times
# larger.
ROUGHER = 10.0
# The roughness in fourth differences over that in third ones: 1 for white noise, the square of the phase step
# for a smooth signal.
NOISY, SMOOTH = 0.3, 0.1


def lead(u: Array, y: Array) -> tuple[float, float]:
    """Return how much an output leads its input, and in which part of ten blocks of time it does.

    Parameters
    ----------
    u, y
        Samples of one input and one output, (samples,).

    Returns
    -------
    float
        The correlation c of the module's description, between -1 (lags) and 1 (leads).
    float
        The part of the blocks with the same sign.

    Examples
    --------
    >>> t = np.linspace(0, 20 * np.pi, 5000)
    >>> c, agree = lead(np.sin(t), np.sin(t - 0.1))
    >>> round(c, 2), agree
    (-0.1, 1.0)
    """
    u, y = centred(u), centred(y)
    du = np.gradient(u)
    power = float(np.sqrt((y @ y) * (du @ du)))
    if power == 0:
        return 0.0, 0.0
    sign = float(np.sign(y @ u))
    parts = [
        sign * float((a - a.mean()) @ (b - b.mean()))
        for a, b in zip(np.array_split(y, BLOCKS), np.array_split(du, BLOCKS), strict=True)
        if len(a)
    ]
    correlation = sign * float(y @ du) / power
    return correlation, float(np.mean(np.sign(parts) == np.sign(correlation)))


def centred(x: Array) -> Array:
    """Return a signal without its mean, scaled so that no power overflows."""
    largest = float(np.abs(x).max())
    scaled: Array = x / largest if largest > 0 else x
    result: Array = scaled - scaled.mean()
    return result


def roughness(x: Array, order: int = 3) -> float:
    """Return the part of the power of a signal that its differences of an order have: 1 for white noise.

    Parameters
    ----------
    x
        The samples, (samples,).
    order
        The order of the differences.

    Examples
    --------
    >>> roughness(np.sin(np.linspace(0, 6, 1000))) < 1e-9
    True
    """
    x = centred(x)
    power = float(x @ x)
    # The squares of the binomial coefficients, which white noise is multiplied by, have this sum.
    return float(np.sum(np.diff(x, order) ** 2)) / comb(2 * order, order) / power if power > 0 else 0.0


def flatness(x: Array) -> float:
    """Return the roughness in fourth differences over that in third ones.

    Parameters
    ----------
    x
        The samples, (samples,).

    Examples
    --------
    >>> flatness(np.sin(np.linspace(0, 6, 1000))) < 0.01
    True
    """
    third = roughness(x)
    return roughness(x, 4) / third if third > 0 else 0.0


def signs_of_swapping(u: Array, y: Array, units: tuple[str, str]) -> list[str]:
    """Return what speaks for an input and an output that were swapped.

    Parameters
    ----------
    u, y
        Samples of the input and the output, (samples,).
    units
        The units of the input and of the output.

    Returns
    -------
    list of str
        Clauses; two or more of them make a record suspicious.

    Examples
    --------
    >>> t = np.linspace(0, 20 * np.pi, 5000)
    >>> signs_of_swapping(np.sin(t), np.sin(t - 0.1), ("V", "um"))
    []
    """
    found = []
    correlation, agree = lead(u, y)
    if correlation > LEADS and agree >= AGREE:
        found.append("the output leads the input, but an actuator lags")
    if flatness(u) > NOISY and flatness(y) < SMOOTH and roughness(u) > ROUGHER * roughness(y):
        found.append("the input contains noise, and the output is as smooth as a command")
    if units[0] in UNITS_OF["output"] and units[1] in UNITS_OF["input"]:
        found.append(f"the input is in {units[0]} and the output in {units[1]}")
    return found


def swapped_note(runs: Sequence[Run], roles: Roles) -> list[str]:
    """Return a note if the only input and the only output look swapped.

    Parameters
    ----------
    runs
        The experiments.
    roles
        The columns.

    Returns
    -------
    list of str
        One note or none.

    Examples
    --------
    >>> swapped_note([], Roles())
    []
    """
    if len(roles.inputs) != 1 or len(roles.outputs) != 1 or not runs:
        return []
    longest = max(runs, key=lambda run: len(run.u))
    if len(longest.u) < 4 * BLOCKS:
        return []
    [u], [y] = roles.inputs, roles.outputs
    found = signs_of_swapping(longest.u[:, 0], longest.y[:, 0], (u.unit, y.unit))
    if len(found) < 2:
        return []
    return [
        f"input and output look swapped: {'; '.join(found)}; if so, use --input {y.header} "
        f"--output {u.header}"
    ]
