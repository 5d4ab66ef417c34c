"""Linear dynamics: an amplifier pole, then one or more lightly damped modes, held exactly between samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.signal
from numpy.random import Generator

from .excitation import Array

PHASE_PER_STEP = 0.15  # of the resonance, in rad, when a nonlinear spring is integrated


@dataclass(frozen=True)
class Mode:
    """q'' + 2 damping w q' + w^2 (q - a) = 0, w = 2 pi hz; it makes up `participation` of the motion."""

    hz: float
    damping: float
    participation: float = 1.0


@dataclass(frozen=True)
class Spring:
    """A force w^2 strength half_travel (g(e) - g(e_0)), e = (q - centre) / half_travel, on the first mode.

    g(e) = e^3 hardens; softening, g(e) = -e^3 / (1 + e^2), which never outweighs the linear spring. e_0
    is e at q = 0: a stage at rest stays there.
    """

    strength: float
    centre: float
    half_travel: float
    softens: bool

    def force(self, q: float) -> float:
        """Strength half_travel g(e)."""
        e = (q - self.centre) / self.half_travel
        g = -(e**3) / (1.0 + e * e) if self.softens else e**3
        return self.strength * self.half_travel * g


@dataclass(frozen=True)
class Mechanics:
    """a' = 2 pi amplifier_hz (v - a), then modes side by side, whose participations sum to 1."""

    rate: float
    amplifier_hz: float
    modes: tuple[Mode, ...]
    spring: Spring | None = None

    def held(self, mode: Mode, step: float) -> tuple[Array, Array]:
        """The state (a, q, q' / w) after `step` s of a held v: state <- matrix state + gain v."""
        corner, w = 2 * np.pi * self.amplifier_hz, 2 * np.pi * mode.hz
        generator = np.zeros((4, 4))
        generator[0] = [-corner, 0.0, 0.0, corner]
        generator[1, 2] = w
        generator[2] = [w, -w, -2 * mode.damping * w, 0.0]
        exponential = scipy.linalg.expm(step * generator)
        return exponential[:3, :3], exponential[:3, 3]

    def respond(self, v: Array) -> Array:
        """Q at every sample, from rest."""
        q = np.zeros(len(v))
        for number, mode in enumerate(self.modes):
            stiffened = number == 0 and self.spring is not None
            motion = self._nonlinear(mode, v) if stiffened else self._linear(mode, v)
            q += mode.participation * motion
        return q

    def _linear(self, mode: Mode, v: Array) -> Array:
        matrix, gain = self.held(mode, 1 / self.rate)
        numerator, denominator = scipy.signal.ss2tf(
            matrix, gain[:, None], np.array([[0.0, 1.0, 0.0]]), np.zeros((1, 1))
        )
        return np.asarray(scipy.signal.lfilter(numerator[0], denominator, v))

    def _nonlinear(self, mode: Mode, v: Array) -> Array:
        """Kicks by the spring between exact steps of the linear part (leapfrog)."""
        assert self.spring is not None
        w = 2 * np.pi * mode.hz
        substeps = max(1, int(np.ceil(w / self.rate / PHASE_PER_STEP)))
        step = 1 / self.rate / substeps
        matrix, gain = self.held(mode, step)
        (aa, aq, ap), (qa, qq, qp), (pa, pq, pp) = matrix.tolist()
        a_gain, q_gain, p_gain = gain.tolist()
        force, kick = self.spring.force, w * step
        preload = force(0.0)
        a = q = p = 0.0
        motion = []
        for value in v.tolist():
            motion.append(q)
            for _ in range(substeps):
                p -= kick * (force(q) - preload)
                a, q, p = (
                    aa * a + aq * q + ap * p + a_gain * value,
                    qa * a + qq * q + qp * p + q_gain * value,
                    pa * a + pq * q + pp * p + p_gain * value,
                )
        return np.array(motion)


def draw_mechanics(random: Generator, rate: float) -> Mechanics:
    """A resonance at 40 to 500 Hz that 7 to 40 samples a period show."""
    hz = np.exp(random.uniform(np.log(max(40.0, 0.025 * rate)), np.log(min(500.0, 0.14 * rate))))
    damping = np.exp(random.uniform(np.log(0.015), np.log(0.15)))
    amplifier_hz = hz * np.exp(random.uniform(np.log(0.8), np.log(8.0)))
    return Mechanics(rate, float(amplifier_hz), (Mode(float(hz), float(damping)),))
