"""Ordinary stages with something beside them: creep, heat, columns that leak or do not, the mains."""

from __future__ import annotations

import numpy as np
import scipy.signal
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .linear import first_mode, lag, modal_sum
from .run import Run, measured, noise_rms, ordinary, plays, white


def log_creep(v: Array, rate: float, per_decade: float, first: float) -> Array:
    """v + per_decade times the sum over the steps dv of dv log10(1 + age / first) [1].

    After a step of v the position creeps by `per_decade` of it in every decade of time after `first` s.

    1. Vieira, The behavior and calibration of some piezoelectric ceramics used in the STM, IBM J. Research
       and Development 30, 1986.
    """
    age = np.arange(len(v)) / rate
    steps = np.diff(v, prepend=0.0)
    return np.asarray(v + per_decade * scipy.signal.fftconvolve(steps, np.log10(1 + age / first))[: len(v)])


def heat(random: Generator, drive: Drive) -> Array:
    """A smooth function of time: bodies of lumped capacity in a room whose temperature swings [1, ch. 5].

    theta(t) = sum_i a_i exp(-t / tau_i) + b sin(2 pi t / T), tau_i and T at least 0.4 of the record; it is
    scaled to mean 0 and rms 1 over the record.

    1. Incropera, DeWitt, Fundamentals of Heat and Mass Transfer, 5th ed., Wiley, 2002.
    """
    seconds = (len(drive.u) - drive.history) / drive.rate
    t = drive.t
    taus, sizes = random.uniform(0.4, 2.0, 2) * seconds, random.uniform(-1, 1, 2)
    period, phase = random.uniform(0.5, 1.5) * seconds, random.uniform(0, 2 * np.pi)
    theta = sizes @ np.exp(-t / taus[:, None]) + random.uniform(0.1, 0.4) * np.sin(
        2 * np.pi * t / period + phase
    )
    return drive.standardized(theta)


def slow_columns(random: Generator, drive: Drive, count: int) -> Array:
    """White noise below 0.1 to 0.5 Hz, (samples, count), of mean 0 and rms 1 over the record."""
    # it begins before the experiment, so that the lags have settled
    lead = round(15 * drive.rate)
    columns = []
    for _ in range(count):
        low_pass = scipy.signal.butter(2, random.uniform(0.1, 0.5), fs=drive.rate, output="sos")
        noise = random.standard_normal(lead + len(drive.u))
        columns.append(drive.standardized(scipy.signal.sosfilt(low_pass, noise)[lead:]))
    return np.stack(columns, axis=1)


def sensed(drive: Drive, columns: Array) -> Array:
    """The columns as their own sensors show them, with 0.2 % of white noise."""
    noise = drive.random("columns' noise").standard_normal(columns.shape)
    return np.asarray(columns + 2e-3 * noise)


def creep(random: Generator, drive: Drive) -> Run:
    """Plays, then logarithmic creep of 0.5 to 3 % in a decade (`log_creep`), then a mode."""
    v = log_creep(plays(random, drive), drive.rate, random.uniform(0.005, 0.03), random.uniform(0.02, 0.2))
    return measured(random, drive, modal_sum(v, drive.rate, [first_mode(random, drive)]))


def thermal(random: Generator, drive: Drive) -> Run:
    """An ordinary stage whose frame warms up (`heat`), 8 to 25 times the noise."""
    x = ordinary(random, drive)
    rms = noise_rms(random, drive)
    drift = rms * random.uniform(8, 25) * heat(drive.random("heat"), drive)
    return Run(drive.u, x + drift + white(drive, rms), rms)


def gain(random: Generator, drive: Drive) -> Run:
    """An ordinary stage whose gain follows the temperature (`heat`): y = (1 + g theta(t)) x."""
    x = ordinary(random, drive)
    rms = noise_rms(random, drive, 6e-5, 4e-4)
    theta = heat(drive.random("heat"), drive)
    # x is about half the travel
    size = random.uniform(16, 50) * rms / drive.travel
    return Run(drive.u, (1 + size * theta) * x + white(drive, rms), rms)


def self_heating(random: Generator, drive: Drive) -> Run:
    """An ordinary stage that the losses of its own drive warm, which changes its gain [1].

    Every cycle of the drive loses energy, and the stage has a heat capacity: tau theta' = |dq/dt| - theta, q
    the drive over its range, tau 0.4 to 2 s; y = (1 + g theta) x, g theta x 8 to 25 times the noise.

    1. Zheng, Takahashi, Yoshikawa, Uchino, de Vries, Heat generation in multilayer piezoelectric actuators,
       J. American Ceramic Society 79, 1996.
    """
    x = ordinary(random, drive)
    rms = noise_rms(random, drive, 6e-5, 4e-4)
    losses = np.abs(np.diff(drive.unit, prepend=drive.unit[0])) * drive.rate
    theta = lag(losses, drive.rate, random.uniform(0.4, 2.0))
    # x is about half the travel
    size = random.uniform(16, 50) * rms / drive.travel
    return Run(drive.u, (1 + size * drive.standardized(theta)) * x + white(drive, rms), rms)


def leak(random: Generator, drive: Drive) -> Run:
    """Two slow columns are measured; the first leaks into the output, 6 to 25 times the noise."""
    x = ordinary(random, drive)
    rms = noise_rms(random, drive)
    columns = slow_columns(drive.random("columns"), drive, 2)
    y = x + rms * random.uniform(6, 25) * columns[:, 0] + white(drive, rms)
    return Run(drive.u, y, rms, sensed(drive, columns))


def lagged_leak(random: Generator, drive: Drive) -> Run:
    """A measured temperature T moves the frame through its own heat capacity: tau theta' = T - theta.

    The lag (`lag`) is 0.1 to 0.6 s, the leak 6 to 25 times the noise.
    """
    x = ordinary(random, drive)
    rms = noise_rms(random, drive)
    columns = slow_columns(drive.random("columns"), drive, 1)
    theta = lag(columns[:, 0], drive.rate, random.uniform(0.1, 0.6))
    y = x + rms * random.uniform(6, 25) * theta + white(drive, rms)
    return Run(drive.u, y, rms, sensed(drive, columns))


def idle_columns(random: Generator, drive: Drive) -> Run:
    """An ordinary stage, and two slow random columns that have nothing to do with it."""
    found = measured(random, drive, ordinary(random, drive))
    columns = slow_columns(drive.random("columns"), drive, 2)
    return Run(found.u, found.y, found.noise, sensed(drive, columns))


def mains(random: Generator, drive: Drive, noise: float) -> Array:
    """Lines at f, 3 f, 5 f, f within 0.1 Hz of 50 or 60 Hz, the first 3 to 10 times the noise [1].

    1. Horowitz, Hill, The Art of Electronics, 3rd ed., Cambridge University Press, 2015, ch. 8.
    """
    hertz = float(random.choice([50.0, 60.0])) + random.uniform(-0.1, 0.1)
    size = random.uniform(3, 10) * np.sqrt(2) * noise
    phases = drive.random("mains").uniform(0, 2 * np.pi, 3)
    lines = np.zeros(len(drive.u))
    for number, part, phase in zip(
        (1, 3, 5), (1.0, random.uniform(0, 0.4), random.uniform(0, 0.2)), phases, strict=True
    ):
        lines += size * part * np.sin(2 * np.pi * number * hertz * drive.t + phase)
    return lines


def hum(random: Generator, drive: Drive) -> Run:
    """An ordinary stage beside the mains (`mains`)."""
    x = ordinary(random, drive)
    rms = noise_rms(random, drive)
    return Run(drive.u, x + mains(random, drive, rms) + white(drive, rms), rms)
