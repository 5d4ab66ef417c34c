"""Ordinary stages whose measurement is special: noise with memory, quantisation, clipping, a bent sensor."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .run import Run, measured, noise_rms, ordinary, white


def clean(random: Generator, drive: Drive) -> Run:
    """Plays before one mode, and white noise: the declared model lacks nothing."""
    return measured(random, drive, ordinary(random, drive))


def power_law(random: Generator, samples: int, slope: float) -> Array:
    """Gaussian noise of power f^-slope and unit variance: Gaussian amplitudes for every line [1].

    1. Timmer, Konig, On generating power law noise, Astronomy and Astrophysics 300, 1995.
    """
    # a power of two that is twice as long: the ends do not meet
    length = 1 << (2 * samples - 1).bit_length()
    lines = random.standard_normal((2, length // 2 + 1))
    spectrum = lines[0] + 1j * lines[1]
    spectrum[0] = 0
    spectrum[1:] *= np.arange(1, len(spectrum)) ** (-0.5 * slope)
    signal = np.fft.irfft(spectrum, length)[:samples]
    return np.asarray((signal - signal.mean()) / signal.std())


def telegraph(random: Generator, samples: int, rate: float, up: float, down: float) -> Array:
    """A random telegraph signal, 1 for `up` s and -1 for `down` s in the mean [1].

    Its spectrum is 4 p (1 - p) 4 T / (1 + (2 pi f T)^2) (one-sided), 1 / T = 1 / up + 1 / down,
    p = up / (up + down).

    1. Machlup, Noise in semiconductors: spectrum of a two-parameter random signal, J. Applied Physics 25,
       1954.
    """
    leave = {1: -np.expm1(-1 / (rate * up)), -1: -np.expm1(-1 / (rate * down))}
    state = 1 if random.random() < up / (up + down) else -1
    signal = np.empty(samples)
    start = 0
    while start < samples:
        stop = start + int(random.geometric(leave[state]))
        signal[start:stop] = state
        start, state = stop, -state
    return signal


def one_over_f(random: Generator, drive: Drive) -> Run:
    """An ordinary stage with 1/f noise (`power_law`) from its electronics."""
    x = ordinary(random, drive)
    rms, slope = noise_rms(random, drive, 2e-4, 1.2e-3), random.uniform(0.8, 1.2)
    noise = drive.standardized(power_law(drive.random("flicker"), len(x), slope))
    return Run(drive.u, x + rms * noise, rms)


def burst(random: Generator, drive: Drive) -> Run:
    """An ordinary stage with burst noise (`telegraph`), a defect that traps a charge, beside white noise."""
    x = ordinary(random, drive)
    rms, height = noise_rms(random, drive), random.uniform(0.7, 2.5)
    up, down = np.exp(random.uniform(np.log(0.02), np.log(0.5), 2))
    jumps = telegraph(drive.random("bursts"), len(x), drive.rate, up, down)
    total = rms * float(np.hypot(1, height * 2 * np.sqrt(up * down) / (up + down)))
    return Run(drive.u, x + white(drive, rms) + rms * height * jumps, total)


def quantise(x: Array, step: float) -> Array:
    """The nearest multiple of `step`: an error of step / sqrt(12) where x moves over many steps [1].

    1. Widrow, Kollar, Quantization Noise, Cambridge University Press, 2008.
    """
    return np.asarray(step * np.round(x / step))


def quantised(random: Generator, drive: Drive) -> Run:
    """An ordinary stage before a converter of 9 to 12 bits (`quantise`), with 0.2 to 0.6 steps of noise."""
    x = ordinary(random, drive)
    step = drive.travel / 2 ** int(random.integers(9, 13))
    rms = random.uniform(0.2, 0.6) * step
    y = quantise(x + white(drive, rms), step)
    return Run(drive.u, y, float(np.hypot(rms, step / np.sqrt(12))))


def clipped(random: Generator, drive: Drive) -> Run:
    """An ordinary stage that leaves its sensor's range: y = clip(x + noise, low, high)."""
    x = ordinary(random, drive)
    rms = noise_rms(random, drive)
    low, high = random.choice([0.0, 0.15]), random.uniform(0.7, 0.8)
    return Run(drive.u, np.clip(x + white(drive, rms), low * drive.travel, high * drive.travel), rms)


def bent(random: Generator, drive: Drive) -> Run:
    """An ordinary stage and a sensor of nonlinearity 1 to 4 %: y = x + a s (e^2 - 1 / 3) + b s e^3.

    s is half the travel, e = (x - s) / s [1].

    1. Fraden, Handbook of Modern Sensors, 4th ed., Springer, 2010, ch. 2.
    """
    x = ordinary(random, drive)
    half = 0.5 * drive.travel
    e = (x - half) / half
    a, b = random.choice([-1, 1], 2) * random.uniform(0.01, 0.04, 2)
    return measured(random, drive, x + half * (a * (e**2 - 1 / 3) + b * e**3))
