"""Experiments on a stage: a rest, then a multisine, decaying triangles, stairs and a sine in random order."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.random import Generator
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("multisine", "triangles", "stairs", "sine")
BROADBAND = ("multisine", "stairs")  # without one of them nothing shows the resonance
HIGHEST = 0.98  # of the drive's range


def stream(name: str, *seeds: int) -> Generator:
    """Random numbers of their own for every use, so that no use moves another one's."""
    return np.random.default_rng([*seeds, zlib.crc32(name.encode())])


@dataclass(frozen=True)
class Limits:
    """What the stage may be driven with: volts from 0, and the resonance, in Hz."""

    rate: float
    volts: float
    resonance: float


@dataclass(frozen=True, eq=False)
class Experiment:
    """The drive u, in V, the first `history` samples of which are not recorded."""

    u: Array
    rate: float
    history: int
    seeds: tuple[int, int]

    @property
    def t(self) -> Array:
        """Time in s, 0 at the first recorded sample."""
        return (np.arange(len(self.u)) - self.history) / self.rate

    def random(self, name: str) -> Generator:
        """What differs from experiment to experiment: phases, noise, thermal history."""
        return stream(name, *self.seeds)

    def recorded(self, signal: Array) -> Array:
        """Without the history."""
        return signal[self.history :]

    def standardized(self, shape: Array) -> Array:
        """`shape` with mean 0 and rms 1 over the recorded samples."""
        seen = self.recorded(shape)
        return np.asarray((shape - seen.mean()) / seen.std())


def shaped_noise(
    random: Generator, samples: int, rate: float, band: tuple[float, float], slope: float
) -> Array:
    """Lines of random phase and amplitude f^-slope inside `band`, in Hz; rms 1."""
    f = np.fft.rfftfreq(samples, 1 / rate)
    inside = (f >= band[0]) & (f <= band[1]) & (f > 0)
    lines = np.zeros(len(f), dtype=complex)
    lines[inside] = f[inside] ** -slope * np.exp(2j * np.pi * random.random(int(inside.sum())))
    signal = np.fft.irfft(lines, samples)
    return np.asarray(signal / signal.std())


def levels(random: Generator, samples: int, rate: float, shortest: float, longest: float) -> Array:
    """Stairs between -1 and 1, each held between `shortest` and `longest` s."""
    stairs = np.empty(samples)
    start = 0
    while start < samples:
        stop = start + max(1, round(rate * random.uniform(shortest, longest)))
        stairs[start:stop] = random.uniform(-1, 1)
        start = stop
    return stairs


def piece(random: Generator, kind: str, samples: int, limits: Limits) -> Array:
    """One kind of excitation, between -1 and 1."""
    t = np.arange(samples) / limits.rate
    if kind == "multisine":
        top = min(random.uniform(1.5, 3.0) * limits.resonance, 0.4 * limits.rate)
        signal = shaped_noise(random, samples, limits.rate, (0.5, top), random.uniform(0.0, 0.8))
        return np.asarray(random.uniform(0.7, 1.0) * signal / np.abs(signal).max())
    if kind == "triangles":
        left = 1 - t / t[-1] if random.random() < 0.5 else np.exp(-random.uniform(2, 4) * t / t[-1])
        phase = 2 * np.pi * random.uniform(0.8, 3.0) * t
        return np.asarray(left * scipy.signal.sawtooth(phase + np.pi / 2, 0.5))
    if kind == "stairs":
        return levels(random, samples, limits.rate, 0.3, 1.5)
    fastest = min(40.0, 0.6 * limits.resonance)
    frequency = np.exp(random.uniform(np.log(0.7), np.log(fastest)))
    return np.asarray(random.uniform(0.5, 1.0) * np.sin(2 * np.pi * frequency * t))


def plan(random: Generator, seconds: float, in_motion: bool) -> list[tuple[str, float]]:
    """Kinds of excitation, and how long each of them lasts, in s."""
    kinds = list(random.permutation(KINDS))
    if in_motion:
        kinds = kinds[: int(random.integers(2, 4))]
        if not set(kinds) & set(BROADBAND):
            kinds[0] = str(random.choice(BROADBAND))
    rest = 0.0 if in_motion else random.uniform(0.3, 0.8)
    shares = random.uniform(0.6, 1.4, len(kinds))
    lengths = (seconds - rest) * shares / shares.sum()
    return [("rest", rest), *zip(kinds, lengths.tolist(), strict=True)]


def experiment(seeds: tuple[int, int], limits: Limits, seconds: float, in_motion: bool) -> Experiment:
    """Draw an experiment; `in_motion`: the stage was driven before the first recorded sample."""
    random = stream("excitation", *seeds)
    pieces = plan(random, seconds, in_motion)
    ends = np.round(limits.rate * np.cumsum([length for _, length in pieces])).astype(int)
    samples = np.diff(ends, prepend=0).tolist()
    steps = [(kind, count) for (kind, _), count in zip(pieces, samples, strict=True)]
    if in_motion:
        # longer than a piece would be: the record may begin anywhere inside of it
        steps.insert(0, (str(random.choice(KINDS)), round(limits.rate * random.uniform(2.0, 4.0))))
    u = np.concatenate(
        [
            np.zeros(count) if kind == "rest" else 0.5 + 0.5 * HIGHEST * piece(random, kind, count, limits)
            for kind, count in steps
            if count
        ]
    )
    edge = int(random.integers(1, 5))  # samples that the generator takes over a step
    smooth = scipy.signal.lfilter(np.full(edge, 1 / edge), [1.0], u)
    history = steps[0][1] if in_motion else 0
    return Experiment(np.asarray(limits.volts * smooth), limits.rate, history, seeds)
