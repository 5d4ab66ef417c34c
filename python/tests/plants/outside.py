"""Effects that no catalogue has: what they do to a record is structured, and has no name."""

from __future__ import annotations

import numpy as np
import scipy.interpolate
from numpy.random import Generator

from .effects import Base, Effect, first_order_lag, log_uniform
from .excitation import Array, Experiment, levels


class StickSlip(Effect):
    """v + s c(t): the mount slips to a level of 0.5 to 1.5 when u exceeds a threshold, back below another.

    The thresholds, 0.55 to 0.95 and 0.05 to 0.45 of the range, wander in stairs, and no two slips are of
    a size: c is not a function of the history of u.
    """

    def relaxation(self, v: Array, strength: float, experiment: Experiment) -> Array:
        random = experiment.random("stick-slip")
        upper, lower = (
            centre + 0.2 * levels(random, len(v), self.base.rate, 0.2, 1.0) for centre in (0.75, 0.25)
        )
        drive = experiment.u / self.base.hysteresis.volts
        level, slipped = 0.0, False
        slips = []
        for w, up, down in zip(drive.tolist(), upper.tolist(), lower.tolist(), strict=True):
            if not slipped and w > up:
                slipped, level = True, random.uniform(0.5, 1.5)
            elif slipped and w < down:
                slipped, level = False, random.uniform(-0.3, 0.3)
            slips.append(level)
        return v + strength * np.array(slips)


class PeakMemory(Effect):
    """v (1 + s m), m(k) = max(|2 u / volts - 1|, m(k-1) exp(-1 / (rate tau))): past peaks set the gain."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.forgetting = float(np.exp(-1 / (base.rate * log_uniform(random, 0.2, 3.0))))

    def relaxation(self, v: Array, strength: float, experiment: Experiment) -> Array:
        m = 0.0
        memory = []
        for excursion in np.abs(2 * experiment.u / self.base.hysteresis.volts - 1).tolist():
            m = max(excursion, m * self.forgetting)
            memory.append(m)
        return v * (1 + strength * np.array(memory))


class Chaos(Effect):
    """y + s x(t), x of the Lorenz system (sigma, rho, beta) = (10, 28, 8/3) at about 5 turns a second."""

    turn = 0.75  # of the Lorenz system's own time
    step = 0.01

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.speed = self.turn * random.uniform(4.0, 6.0)

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        def slope(p: Array) -> Array:
            return np.array([10 * (p[1] - p[0]), p[0] * (28 - p[2]) - p[1], p[0] * p[1] - 8 / 3 * p[2]])

        times = self.speed * (experiment.t - experiment.t[0])
        knots = np.arange(0.0, times[-1] + 2 * self.step, self.step)
        point = np.array([1.0, 1.0, 25.0]) + experiment.random("chaos").standard_normal(3)
        path = np.empty(len(knots))
        for k in range(len(knots)):
            path[k] = point[0]
            first = slope(point)
            second = slope(point + self.step / 2 * first)
            third = slope(point + self.step / 2 * second)
            point = point + self.step / 6 * (first + 2 * (second + third) + slope(point + self.step * third))
        x = scipy.interpolate.CubicSpline(knots, path)(times)
        return y + strength * experiment.standardized(np.asarray(x))


class Quantisation(Effect):
    """s round(y / s): the converter's step, coarser than the noise."""

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        return np.asarray(strength * np.round(y / strength)) if strength > 0 else y


class SpeedNoise(Effect):
    """y + s |du/dt| w over its rms, w white: the faster the drive, the louder."""

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        speed = first_order_lag(np.abs(np.diff(experiment.u, prepend=experiment.u[0])), 5e-3, self.base.rate)
        loudness = speed / np.sqrt(np.mean(experiment.recorded(speed) ** 2))
        return np.asarray(y + strength * loudness * experiment.random("speed-noise").standard_normal(len(y)))
