"""Ordinary stages with faults of the data acquisition: clocks, converters, amplifiers, loose sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.interpolate
import scipy.signal
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .linear import first_mode, modal_sum
from .run import Run, measured, noise_rms, ordinary, plays, white


def sampled(x: Array, places: Array) -> Array:
    """The motion at places between its samples, by a cubic spline."""
    return np.asarray(scipy.interpolate.CubicSpline(np.arange(len(x)), x)(np.clip(places, 0, len(x) - 1)))


def clocks(random: Generator, drive: Drive) -> Run:
    """Output and drive have clocks of their own, 50 to 400 ppm apart: the output is later and later [1].

    1. IEEE Std 1588-2019, Precision Clock Synchronization Protocol for Networked Measurement and Control
       Systems.
    """
    x = ordinary(random, drive)
    apart = random.choice([-1, 1]) * random.uniform(5e-5, 4e-4)
    return measured(random, drive, sampled(x, np.arange(len(x)) * (1 + apart)))


def jitter(random: Generator, drive: Drive) -> Run:
    """The converter samples at random times about the right ones: an error of slope times jitter [1].

    1. Shinagawa, Akazawa, Wakimoto, Jitter analysis of high-speed sampling systems, IEEE J. Solid-State
       Circuits 25, 1990.
    """
    x = ordinary(random, drive)
    late = random.uniform(0.02, 0.1) * drive.random("jitter").standard_normal(len(x))
    return measured(random, drive, sampled(x, np.arange(len(x)) + late))


def repeated(random: Generator, drive: Drive) -> Run:
    """The logger misses single samples, and writes the one before again."""
    run = measured(random, drive, ordinary(random, drive))
    missed = np.flatnonzero(drive.random("misses").random(len(run.y)) < random.uniform(5e-4, 5e-3))
    y = run.y.copy()
    y[missed[missed > 0]] = run.y[missed[missed > 0] - 1]
    return Run(run.u, y, run.noise)


def interpolation(random: Generator, drive: Drive) -> Run:
    """An interferometer or encoder that errs with each period of its scale: x + a sin(2 pi x / p) [1].

    1. Heydemann, Determination and correction of quadrature fringe measurement errors in interferometers,
       Applied Optics 20, 1981.
    """
    x = ordinary(random, drive)
    period = drive.travel / random.uniform(20, 200)
    return measured(random, drive, x + random.uniform(0.01, 0.05) * period * np.sin(2 * np.pi * x / period))


def converter(random: Generator, drive: Drive) -> Run:
    """The drive is put out by a converter of 8 to 10 bits, and its command is what is recorded.

    The error is white and uniform where the drive passes many steps [1, ch. 5], and the mode colours it.

    1. Widrow, Kollar, Quantization Noise, Cambridge University Press, 2008.
    """
    step = drive.volts / 2 ** int(random.integers(8, 11))
    coarse = replace(drive, u=step * np.round(drive.u / step))
    run = measured(random, drive, ordinary(random, coarse))
    return Run(drive.u, run.y, run.noise)


def coupled(random: Generator, drive: Drive) -> Run:
    """An amplifier that passes only changes: a high pass of 0.02 to 0.2 Hz before the stage."""
    corner = random.uniform(0.02, 0.2)
    passed = scipy.signal.butter(1, corner, "highpass", fs=drive.rate, output="sos")
    behind = replace(drive, u=np.asarray(scipy.signal.sosfilt(passed, drive.u)))
    run = measured(random, drive, ordinary(random, behind))
    return Run(drive.u, run.y, run.noise)


def wandering_hum(random: Generator, drive: Drive) -> Run:
    """The mains, whose frequency wanders by some tenths of a Hz and whose size swings by a half."""
    x = ordinary(random, drive)
    rms, t = noise_rms(random, drive), drive.t
    swing = 1 + 0.5 * np.sin(2 * np.pi * random.uniform(0.05, 0.2) * t)
    phase = random.uniform(0, 4) * np.sin(2 * np.pi * random.uniform(0.05, 0.15) * t)
    hum = random.uniform(3, 10) * rms * swing * np.sin(2 * np.pi * 50 * t + phase)
    return Run(drive.u, x + hum + white(drive, rms), rms)


def slips(random: Generator, drive: Drive) -> Run:
    """The sensor's mount slips once or twice, by 0.2 to 1 % of the travel."""
    x = ordinary(random, drive)
    places = random.uniform(0.1, 0.9, int(random.integers(1, 3)))
    sizes = random.choice([-1, 1], len(places)) * random.uniform(0.002, 0.01, len(places)) * drive.travel
    after = np.arange(len(x)) >= drive.history + places[:, None] * (len(x) - drive.history)
    return measured(random, drive, x + sizes @ after)


def squared(random: Generator, drive: Drive) -> Run:
    """A force that grows with the square of its field (electrostriction): plays, a square, one mode [1].

    1. Newnham et al., Electrostriction: nonlinear electromechanical coupling in solid dielectrics, J.
       Physical Chemistry B 101, 1997.
    """
    v = plays(random, drive)
    return measured(random, drive, modal_sum(v * v / drive.travel, drive.rate, [first_mode(random, drive)]))
