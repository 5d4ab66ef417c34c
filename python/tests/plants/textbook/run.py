"""What a stage gives in an experiment, and the ordinary stage that other parts are put beside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ..excitation import Array
from ..hysteresis import play_bank
from .drives import Drive
from .linear import first_mode, modal_sum


@dataclass(frozen=True, eq=False)
class Run:
    """The input, the measured output, the noise's rms, and columns (samples, columns) measured besides."""

    u: Array
    y: Array
    noise: float
    columns: Array | None = None


def noise_rms(random: Generator, drive: Drive, low: float = 6e-5, high: float = 8e-4) -> float:
    """A noise level, `low` to `high` of the travel: the same in every experiment on the stage."""
    return drive.travel * float(np.exp(random.uniform(np.log(low), np.log(high))))


def white(drive: Drive, rms: float) -> Array:
    """White noise that differs from experiment to experiment."""
    return np.asarray(rms * drive.random("white noise").standard_normal(len(drive.u)))


def measured(random: Generator, drive: Drive, x: Array) -> Run:
    """The motion with white noise."""
    rms = noise_rms(random, drive)
    return Run(drive.u, x + white(drive, rms), rms)


def plays(random: Generator, drive: Drive) -> Array:
    """A straight or bent drive, then plays: v = sum_k p_k F_k[u], p_k falling with the half-width [1].

    1. Brokate, Sprekels, Hysteresis and Phase Transitions, Springer, 1996, ch. 2.
    """
    count = int(random.integers(4, 13))
    half_widths = np.linspace(0, random.uniform(0.2, 0.45), count + 1)
    weights = np.exp(-half_widths / random.uniform(0.1, 0.4))
    weights[0] *= random.uniform(1.0, 2.5) * count
    bend = random.uniform(-0.15, 0.25)
    z = drive.unit + bend * drive.unit**2
    return np.asarray(drive.travel * play_bank(z, half_widths) @ weights / weights.sum())


def ordinary(random: Generator, drive: Drive) -> Array:
    """Plays before one mode: the stage that the declared model is made for."""
    return modal_sum(plays(random, drive), drive.rate, [first_mode(random, drive)])
