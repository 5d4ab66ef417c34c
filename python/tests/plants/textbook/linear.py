"""Linear parts, exact for a signal that is held between samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive


@dataclass(frozen=True)
class Mode:
    """q'' + 2 damping w q' + w^2 (q - part v) = 0, w = 2 pi hertz."""

    hertz: float
    damping: float
    part: float = 1.0


def held(numerator: list[float], denominator: list[float], rate: float, signal: Array) -> Array:
    """The response from rest of numerator(s) / denominator(s)."""
    top, bottom, _ = scipy.signal.cont2discrete((numerator, denominator), 1 / rate)
    return np.asarray(scipy.signal.lfilter(np.ravel(top), bottom, signal))


def modal_sum(signal: Array, rate: float, modes: list[Mode]) -> Array:
    """Modes side by side: G(s) = sum_k part_k w_k^2 / (s^2 + 2 damping_k w_k s + w_k^2) [1, ch. 2].

    1. Preumont, Vibration Control of Active Structures, 2nd ed., Kluwer, 2002.
    """
    total = np.zeros_like(signal)
    for mode in modes:
        w = 2 * np.pi * mode.hertz
        total += held([mode.part * w * w], [1.0, 2 * mode.damping * w, w * w], rate, signal)
    return total


def lag(signal: Array, rate: float, seconds: float) -> Array:
    """The first-order lag ``seconds x' = signal - x``, from x = signal(0)."""
    return np.asarray(signal[0] + held([1.0], [seconds, 1.0], rate, signal - signal[0]))


def first_mode(random: Generator, drive: Drive) -> Mode:
    """The mode that the experiment was made for."""
    return Mode(drive.resonance, float(np.exp(random.uniform(np.log(0.03), np.log(0.15)))))


def several_modes(random: Generator, drive: Drive, count: int) -> list[Mode]:
    """The first mode, and higher ones of either sign whose parts sum to 1 with it."""
    first = first_mode(random, drive)
    hertz, modes = first.hertz, []
    for _ in range(count - 1):
        hertz *= random.uniform(1.35, 1.7)
        part = float(random.choice([-1, 1]) * random.uniform(0.1, 0.3))
        modes.append(Mode(hertz, random.uniform(0.01, 0.06), part))
    rest = 1 - sum(mode.part for mode in modes)
    return [Mode(first.hertz, first.damping, rest), *modes]
