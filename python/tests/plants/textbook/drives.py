"""Experiments on a textbook's stage: chirps, steps, noise, multisines and triangles in random order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.random import Generator

from ..excitation import Array, Experiment, levels, shaped_noise, stream

KINDS = ("chirp", "steps", "noise", "multisine", "triangles")
BROADBAND = ("chirp", "noise", "multisine", "steps")  # without one of them nothing shows the resonance
FADE = 0.06  # s in which a piece of the drive comes and goes
LARGEST = 0.97  # of the drive's range


@dataclass(frozen=True, eq=False)
class Drive(Experiment):
    """An experiment between 0 and `volts`, or between -`volts` and `volts`.

    The stage moves by about `travel` um and has a mode at `resonance` Hz.
    """

    volts: float
    travel: float
    resonance: float
    kinds: tuple[str, ...]

    @property
    def unit(self) -> Array:
        """The drive over its largest value."""
        return np.asarray(self.u / self.volts)


def piece(random: Generator, kind: str, samples: int, rate: float, resonance: float) -> Array:
    """One kind of excitation, between -1 and 1."""
    t = np.arange(samples) / rate
    top = min(random.uniform(1.2, 2.0) * resonance, 0.35 * rate)
    if kind == "chirp":
        phase = scipy.signal.chirp(t, 0.7, t[-1], top, "logarithmic", phi=-90)
        now = 0.7 * (top / 0.7) ** (t / t[-1])
        # at full size a sweep would break a stage at its resonance
        return np.asarray(random.uniform(0.7, 1.0) * phase / (1 + now / (0.2 * resonance)))
    if kind == "steps":
        return levels(random, samples, rate, 0.05, 0.6)
    if kind == "noise":
        low_pass = scipy.signal.butter(2, random.uniform(0.2, 0.8) * resonance, fs=rate, output="sos")
        signal = scipy.signal.sosfilt(low_pass, random.standard_normal(samples))
        return np.asarray(np.clip(random.uniform(0.25, 0.4) * signal / signal.std(), -1, 1))
    if kind == "multisine":
        signal = shaped_noise(random, samples, rate, (0.5, top), random.uniform(0.4, 1.0))
        return np.asarray(random.uniform(0.7, 1.0) * signal / np.abs(signal).max())
    periods = int(random.integers(4, 9))
    size = 1 - random.uniform(0.6, 0.9) * np.floor(periods * t / (t[-1] + 1 / rate)) / periods
    return np.asarray(size * scipy.signal.sawtooth(2 * np.pi * periods * t / t[-1] + 0.5 * np.pi, 0.5))


def faded(signal: Array, rate: float) -> Array:
    """The piece, which comes from 0 and goes to 0, so that the drive does not jump between pieces."""
    fade = min(round(FADE * rate), len(signal) // 2)
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade) / fade)
    window = np.concatenate([rise, np.ones(len(signal) - 2 * fade), rise[::-1]])
    return np.asarray(window * signal)


def drive(
    seeds: tuple[int, int],
    rate: float,
    samples: int,
    sizes: tuple[float, float, float],
    *,
    is_bipolar: bool,
    in_motion: bool,
) -> Drive:
    """Draw an experiment of `samples` samples on a stage of `sizes`: volts, travel and resonance.

    At rest it begins with the stage at 0 V; `in_motion`, what is recorded begins inside a piece, and the
    experiment has fewer kinds of excitation.
    """
    random, (volts, travel, resonance) = stream("textbook excitation", *seeds), sizes
    kinds = [str(kind) for kind in random.permutation(KINDS)][
        : int(random.integers(2, 4) if in_motion else 4)
    ]
    if not set(kinds[1:] if in_motion else kinds) & set(BROADBAND):
        kinds[-1] = str(random.choice(BROADBAND))
    rest = 0 if in_motion else round(rate * random.uniform(0.2, 0.5))
    shares = random.uniform(0.7, 1.3, len(kinds))
    counts = np.floor((samples - rest) * shares / shares.sum()).astype(int)
    counts[-1] += samples - rest - counts.sum()
    history = round(rate * random.uniform(1.5, 3.0)) if in_motion else 0
    # the first piece is longer by what is not recorded
    counts[0] += history
    pieces = [
        faded(piece(random, kind, int(count), rate, resonance), rate)
        for kind, count in zip(kinds, counts, strict=True)
    ]
    signal = LARGEST * np.concatenate([np.zeros(rest), *pieces])
    if not is_bipolar:
        # from 0 V to the middle of the range once the rest is over
        rise = np.clip((np.arange(len(signal)) - rest) / (0.15 * rate), 0, 1)
        signal = 0.5 * (0.5 - 0.5 * np.cos(np.pi * rise)) * (1 + signal)
    edge = int(random.integers(1, 4))  # samples that the generator takes over a step
    smooth = scipy.signal.lfilter(np.full(edge, 1 / edge), [1.0], signal)
    return Drive(np.asarray(volts * smooth), rate, history, seeds, volts, travel, resonance, tuple(kinds))
