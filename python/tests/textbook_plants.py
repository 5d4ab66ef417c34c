"""Stages of other textbooks than `plants`: they lack no effect, or only the one that is named here."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATE = 500.0
SECONDS = 20.0


@dataclass(frozen=True)
class Run:
    """A record, with the measured columns beside it if there are any, and the noise's standard deviation."""

    u: Array
    y: Array
    noise: float
    covariates: Array | None = None


def drive(random: Generator) -> Array:
    """Triangles of falling size, then filtered noise, then stairs, between 0 and 10 V, from rest."""
    part = int(SECONDS * RATE / 3)
    time = np.arange(part) / part
    sizes = 1.0 - 0.85 * np.floor(6 * time) / 6
    triangles = 5 + 5 * sizes * scipy.signal.sawtooth(2 * np.pi * 6 * time + 0.5 * np.pi, 0.5)
    low_pass = scipy.signal.butter(2, 15.0, fs=RATE, output="sos")
    fast = scipy.signal.sosfilt(low_pass, random.standard_normal(part))
    stairs = np.repeat(random.uniform(0, 10, 25), int(np.ceil(part / 25)))[:part]
    u = np.concatenate([triangles, np.clip(5 + 2 * fast / fast.std(), 0, 10), stairs])
    rest = np.linspace(0, 1, 100)
    u[:100] *= rest
    smooth = scipy.signal.butter(2, 80.0, fs=RATE, output="sos")
    return np.asarray(scipy.signal.sosfilt(smooth, u))


def mode(signal: Array, hertz: float = 60.0, damping: float = 0.05) -> Array:
    """A resonance of unit gain."""
    w = 2 * np.pi * hertz
    system = scipy.signal.cont2discrete(([w * w], [1, 2 * damping * w, w * w]), 1 / RATE)
    return np.asarray(scipy.signal.lfilter(np.ravel(system[0]), system[1], signal))


def plays(u: Array) -> Array:
    """A bank of five plays."""
    half_widths, weights = np.array([0.0, 0.4, 1.0, 2.0, 3.5]), np.array([1.0, 0.15, 0.12, 0.1, 0.08])
    place, v = np.zeros(5), np.empty_like(u)
    for k, value in enumerate(u):
        place = np.clip(place, value - half_widths, value + half_widths)
        v[k] = weights @ place
    return v


def pink(random: Generator, samples: int) -> Array:
    """Noise of power 1/f and unit variance."""
    spectrum = np.fft.rfft(random.standard_normal(samples))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0
    signal = np.fft.irfft(spectrum, samples)
    return np.asarray(signal / signal.std())


def white(random: Generator, y: Array, part: float) -> tuple[Array, float]:
    """Add white noise, a part of the output's standard deviation."""
    noise = part * float(y.std())
    return y + noise * random.standard_normal(len(y)), noise


def clean(random: Generator) -> Run:
    """Plays before a mode, and white noise."""
    u = drive(random)
    return Run(u, *white(random, mode(plays(u)), 2e-3))


def flicker(random: Generator) -> Run:
    """Plays before a mode, and 1/f noise."""
    u = drive(random)
    y = mode(plays(u))
    noise = 5e-3 * float(y.std())
    return Run(u, y + noise * pink(random, len(y)), noise)


def integrating(random: Generator) -> Run:
    """A motor with Coulomb friction whose position is measured: ``m x'' = u - d x' - f sign(x')``."""
    u = drive(random)
    force = u - u.mean()
    steps, x, speed, y = 10, 0.0, 0.0, np.empty_like(u)
    for k, value in enumerate(force):
        for _ in range(steps):
            speed += (value - 0.8 * speed - 0.5 * np.tanh(speed / 0.01)) / (0.02 * RATE * steps)
            x += speed / (RATE * steps)
        y[k] = x
    return Run(u, *white(random, y, 1e-3))


def relays(random: Generator) -> Run:
    """Thirty relays of random thresholds before a mode."""
    u = drive(random)
    centre, half = random.uniform(2, 8, 30), random.uniform(0.3, 3.0, 30)
    weights, state, v = random.uniform(0.5, 1.5, 30), np.full(30, -1.0), np.empty_like(u)
    for k, value in enumerate(u):
        state = np.where(value > centre + half, 1.0, np.where(value < centre - half, -1.0, state))
        v[k] = weights @ state
    return Run(u, *white(random, mode(v), 2e-3))


def bouc_wen(random: Generator) -> Run:
    """The displacement of a Bouc-Wen hysteresis, ``z' = A u' - b |u'| z - g u' |z|``, before a mode."""
    u = drive(random)
    z, v = 0.0, np.empty_like(u)
    before = u[0]
    for k, value in enumerate(u):
        step = value - before
        z += 0.6 * step - 0.5 * abs(step) * z - 0.2 * step * abs(z)
        v[k], before = 0.7 * value - z, value
    return Run(u, *white(random, mode(v), 2e-3))


def leaking(random: Generator) -> Run:
    """Two slow random columns are measured, and one of them leaks into the output."""
    u = drive(random)
    low_pass = scipy.signal.butter(2, 0.3, fs=RATE, output="sos")
    columns = scipy.signal.sosfilt(low_pass, random.standard_normal((2, len(u))), axis=1).T
    columns /= columns.std(axis=0)
    y, noise = white(random, mode(plays(u)), 2e-3)
    return Run(u, y + 20 * noise * columns[:, 0], noise, columns)


# What an answer must name, and what it may name besides: any other name is false.
STAGES: dict[str, tuple[Callable[[Generator], Run], set[str], set[str]]] = {
    "clean": (clean, set(), set()),
    "flicker": (flicker, set(), {"coloured-noise"}),
    "integrating": (integrating, set(), set()),
    "relays": (relays, set(), {"hysteresis-shape"}),
    "bouc-wen": (bouc_wen, set(), {"hysteresis-shape"}),
    "leaking": (leaking, {"covariate"}, set()),
}
