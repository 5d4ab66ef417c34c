"""Effects that the drive does not cause: they are added to what the sensor shows."""

from __future__ import annotations

import numpy as np
import scipy.signal
from numpy.random import Generator

from .effects import Base, Effect, SlowChange, first_order_lag, log_uniform
from .excitation import Array, Experiment, levels, shaped_noise


class Drift(Effect):
    """y + s g(t), g a `SlowChange`."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.change = SlowChange(random, base.seconds)

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        return y + strength * self.change(experiment.random("drift"), experiment)


class PeriodicDisturbance(Effect):
    """y + s sum_h a_h cos(2 pi h f t + phi_h): mains, 50 or 60 Hz, or a pump, 3 to 30 Hz."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        if random.random() < 0.7:
            self.hz = float(random.choice([50.0, 60.0]) + random.uniform(-0.1, 0.1))
        else:
            self.hz = log_uniform(random, 3.0, 30.0)
        harmonics = int(random.integers(1, 5))
        self.amplitudes = random.uniform(0.5, 1.0, harmonics) / np.arange(1, harmonics + 1) ** 1.5

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        phases = 2 * np.pi * experiment.random("periodic-disturbance").random(len(self.amplitudes))
        lines = zip(self.amplitudes, phases, range(1, 5), strict=False)
        turn = 2 * np.pi * self.hz * experiment.t
        return y + strength * sum((a * np.cos(h * turn + phi) for a, phi, h in lines), start=np.zeros_like(y))


class Covariate(Effect):
    """y + s L[g], x = centre + swing g the measured column; L the identity or a lag of 0.05 to 2 s.

    g is a temperature (a first-order random process, smoothed) or a neighbour axis (stairs and a slow
    multisine). Without leakage the column is there and does not matter.
    """

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.is_temperature = random.random() < 0.5
        self.memory = random.uniform(0.5, 5.0)
        self.lag = log_uniform(random, 0.05, 2.0) if random.random() < 0.5 else None
        self.sign = random.choice([-1.0, 1.0])

    def swing(self, experiment: Experiment) -> Array:
        """G, of mean 0 and rms 1."""
        random = experiment.random("covariate")
        samples, rate = len(experiment.u), self.base.rate
        if self.is_temperature:
            # five memories before the first sample, so that it starts anywhere
            lead = round(5 * self.memory * rate)
            process = first_order_lag(random.standard_normal(lead + samples), self.memory, rate)
            shape = first_order_lag(process, 0.05, rate)[lead:]
        else:
            motion = shaped_noise(random, samples, rate, (0.2, 6.0), 0.5)
            shape = first_order_lag(levels(random, samples, rate, 0.5, 3.0), 0.01, rate) + 0.5 * motion
        return experiment.standardized(shape)

    def column(self, experiment: Experiment) -> Array:
        """X: degrees Celsius, or V on the neighbour axis."""
        centre, size = (22.0, 0.4) if self.is_temperature else (50.0, 18.0)
        return centre + size * self.swing(experiment)

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        leak = self.swing(experiment)
        if self.lag is not None:
            leak = first_order_lag(leak, self.lag, self.base.rate)
        return np.asarray(y + strength * self.sign * leak)


class ColouredNoise(Effect):
    """y + s n, n of rms 1: n(k) = a n(k-1) + w(k); order two, a broad hump; or 1/f^alpha from 1 Hz."""

    usual = (2.0, 6.0)

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.kind = random.choice(["order-one", "order-two", "flicker"])
        self.memory = log_uniform(random, 3.0, 100.0)  # samples
        self.hump = random.uniform(0.01, 0.2) * 2 * np.pi
        self.exponent = random.uniform(0.8, 1.4)

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        white = experiment.random("coloured-noise").standard_normal(len(y))
        radius = np.exp(-1 / self.memory)
        if self.kind == "order-one":
            noise = scipy.signal.lfilter([1.0], [1.0, -radius], white)
        elif self.kind == "order-two":
            noise = scipy.signal.lfilter([1.0], [1.0, -2 * radius * np.cos(self.hump), radius**2], white)
        else:
            f = np.fft.rfftfreq(len(y), 1 / self.base.rate)
            noise = np.fft.irfft(np.fft.rfft(white) * np.maximum(f, 1.0) ** (-self.exponent / 2), len(y))
        return y + strength * experiment.standardized(np.asarray(noise))


class Outliers(Effect):
    """y +- s (0.3 + an exponential variable) at 0.05 to 0.5 % of the samples, never at neighbours."""

    usual = (2.0, 10.0)

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.share = log_uniform(random, 5e-4, 5e-3)

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        random = experiment.random("outliers")
        wrong = np.flatnonzero(random.random(len(y)) < self.share)
        wrong = wrong[np.diff(wrong, prepend=-10) > 3]
        sizes = random.choice([-1.0, 1.0], len(wrong)) * (0.3 + random.exponential(1.0, len(wrong)))
        faulty = y.copy()
        faulty[wrong] += strength * sizes
        return faulty
