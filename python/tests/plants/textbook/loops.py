"""Linear stages of several modes, and a stage whose input a controller computes from its output."""

from __future__ import annotations

import numpy as np
import scipy.signal
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .linear import modal_sum, several_modes
from .run import Run, measured, noise_rms, plays, white


def two_modes(random: Generator, drive: Drive) -> Run:
    """No hysteresis: two modes (`modal_sum`) behind a delay of 1 to 4 samples."""
    delay = int(random.integers(1, 5))
    late = np.concatenate([np.full(delay, drive.unit[0]), drive.unit[:-delay]])
    modes = several_modes(random, drive, 2)
    return measured(random, drive, modal_sum(drive.travel * late, drive.rate, modes))


def flexure(random: Generator, drive: Drive) -> Run:
    """Plays before three or four modes of either sign (`modal_sum`)."""
    modes = several_modes(random, drive, int(random.integers(3, 5)))
    return measured(random, drive, modal_sum(plays(random, drive), drive.rate, modes))


def closed_loop(
    reference: Array, noise: Array, half_widths: Array, weights: Array, mode: tuple[Array, Array], gain: float
) -> tuple[Array, Array]:
    """The input and the measured output of plays before a mode under integral control [1, ch. 13].

    y(k) = x(k) + e(k), u(k) = u(k-1) + gain (r(k) - y(k)): u depends on the noise of the past. `mode` is the
    discrete filter of the mode, whose first numerator coefficient is 0: x(k) depends on v before k alone.

    1. Ljung, System Identification, 2nd ed., Prentice Hall, 1999.
    """
    (_, b1, b2), (_, a1, a2) = (tuple(map(float, part)) for part in mode)
    place = np.zeros(len(half_widths))
    u, y = np.empty_like(reference), np.empty_like(reference)
    value = x1 = x2 = v1 = v2 = 0.0
    for k, wanted in enumerate(reference.tolist()):
        x = b1 * v1 + b2 * v2 - a1 * x1 - a2 * x2
        y[k] = x + noise[k]
        value += gain * (wanted - float(y[k]))
        u[k] = value
        np.minimum(np.maximum(place, value - half_widths), value + half_widths, out=place)
        x1, x2, v1, v2 = x, x1, float(weights @ place), v1
    return u, y


def feedback(random: Generator, drive: Drive) -> Run:
    """A stage with a position controller whose reference is the experiment's signal (`closed_loop`)."""
    damping = random.uniform(0.1, 0.2)
    w = 2 * np.pi * drive.resonance
    top, bottom, _ = scipy.signal.cont2discrete(([w * w], [1.0, 2 * damping * w, w * w]), 1 / drive.rate)
    # integral control of a mode is stable below 2 damping w
    gain = random.uniform(0.25, 0.5) * 2 * damping * w / drive.rate
    count = int(random.integers(4, 9))
    half_widths = np.linspace(0, random.uniform(0.2, 0.4), count)
    weights = np.exp(-half_widths / 0.3)
    weights[0] *= 1.5 * count
    weights /= weights.sum()
    rms = noise_rms(random, drive)
    noise = white(drive, rms / drive.travel)
    u, y = closed_loop(drive.unit, noise, half_widths, weights, (np.ravel(top), bottom), gain)
    return Run(drive.volts * u, drive.travel * y, rms)
