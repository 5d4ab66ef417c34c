"""What an effect is, and the effects that the drive goes through: input, plays, dynamics, output curve."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy.integrate
import scipy.interpolate
import scipy.signal
from numpy.random import Generator

from .excitation import Array, Experiment
from .hysteresis import Hysteresis, play_bank
from .mechanics import Mechanics, Mode, Spring


@dataclass(frozen=True, eq=False)
class Base:
    """The plant without effects."""

    rate: float
    seconds: float
    hysteresis: Hysteresis
    mechanics: Mechanics
    offset: float


class Effect:
    """A block of the chain with parameters of its own: `strength` s scales it, at s = 0 it is not there.

    An effect overrides the one method that is its place; everywhere else it lets the signal through.
    """

    usual: ClassVar[tuple[float, float]] = (3.0, 25.0)  # rms over the noise
    strongest: ClassVar[float] = math.inf  # beyond it the block makes no sense
    scalable: ClassVar[bool] = True

    def __init__(self, random: Generator, base: Base) -> None:
        self.base = base

    def drive(self, u: Array, strength: float, experiment: Experiment) -> Array:
        """Before the hysteresis, V."""
        return u

    def hysteresis(self, hysteresis: Hysteresis, strength: float) -> Hysteresis:
        """In the plays."""
        return hysteresis

    def relaxation(self, v: Array, strength: float, experiment: Experiment) -> Array:
        """Between hysteresis and dynamics, um."""
        return v

    def mechanics(self, mechanics: Mechanics, strength: float) -> Mechanics:
        """In the linear dynamics."""
        return mechanics

    def output(self, y: Array, strength: float, experiment: Experiment) -> Array:
        """After the dynamics, um."""
        return y

    def measured(self, y: Array, strength: float, experiment: Experiment) -> Array:
        """On what the sensor shows, after the white noise, um."""
        return y


def log_uniform(random: Generator, low: float, high: float) -> float:
    """Each decade is as likely as the next."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def first_order_lag(signal: Array, time_constant: float, rate: float) -> Array:
    """Of unit DC gain, settled at the first sample."""
    pole = np.exp(-1 / (rate * time_constant))
    lagged, _ = scipy.signal.lfilter([1 - pole], [1.0, -pole], signal, zi=[pole * signal[0]])
    return np.asarray(lagged)


class SlowChange:
    """Of mean 0 and rms 1: warming up, 1 - exp(-t / tau); a walk through random knots; or a slow sine."""

    def __init__(self, random: Generator, seconds: float) -> None:
        self.kind = random.choice(["warm-up", "walk", "sine"])
        self.sign = random.choice([-1.0, 1.0])
        self.tau = seconds * random.uniform(0.15, 1.0)
        self.knots = int(random.integers(8, 25))
        self.period = seconds * random.uniform(0.5, 2.0)

    def __call__(self, random: Generator, experiment: Experiment) -> Array:
        t = experiment.t
        if self.kind == "warm-up":
            shape = -self.sign * np.exp(-(t - t[0]) / self.tau)
        elif self.kind == "sine":
            shape = np.sin(2 * np.pi * (t / self.period + random.random()))
        else:
            times = np.linspace(t[0], t[-1], self.knots)
            walk = np.cumsum(random.standard_normal(self.knots))
            shape = scipy.interpolate.CubicSpline(times, walk)(t)
        return experiment.standardized(np.asarray(shape))


class Delay(Effect):
    """u(k - d) at s = 1, d of 3 to 12 samples; its size is what it is."""

    scalable = False

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.samples = int(random.integers(3, 13))

    def drive(self, u: Array, strength: float, experiment: Experiment) -> Array:
        late = round(strength * self.samples)
        return np.concatenate([np.full(late, u[0]), u[: len(u) - late]])


class AmplifierSlew(Effect):
    """a(k) = a(k-1) + clamp(u(k) - a(k-1), -limit, limit), limit = 100 / s of the range per second."""

    def drive(self, u: Array, strength: float, experiment: Experiment) -> Array:
        reference = 100.0 * self.base.hysteresis.volts / self.base.rate
        limit = reference / strength if strength > 0 else np.inf
        a = float(u[0])
        voltages = []
        for wanted in u.tolist():
            a = min(max(wanted, a - limit), a + limit)
            voltages.append(a)
        return np.array(voltages)


class RateDependence(Effect):
    """r_k (1 + s g(x)) or r_k + s r_mean g(x); x is the lagged |du/dt| over a reference.

    g(x) = ln(1 + x), x^epsilon or x / (1 + x).
    """

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.law = random.choice(["logarithm", "power", "saturation"])
        self.additive = random.random() < 0.5
        self.exponent = random.uniform(0.3, 0.6)
        self.reference = base.hysteresis.volts * log_uniform(random, 2.0, 20.0)
        self.lag = log_uniform(random, 1e-3, 5e-3)

    def grown(self, half_widths: Array, u: Array, strength: float) -> Array:
        """Half-widths at every sample, (samples, plays); the linear term stays linear."""
        rate = self.base.rate
        speed = first_order_lag(np.abs(np.diff(u, prepend=u[0])) * rate, self.lag, rate) / self.reference
        laws = {
            "logarithm": np.log1p(speed),
            "power": speed**self.exponent,
            "saturation": speed / (1 + speed),
        }
        growth = strength * laws[str(self.law)][:, None]
        widening = half_widths.mean() * (half_widths > 0) if self.additive else half_widths
        return np.asarray(half_widths + growth * widening)

    def hysteresis(self, hysteresis: Hysteresis, strength: float) -> Hysteresis:
        return replace(hysteresis, growth=lambda u: self.grown(hysteresis.half_widths, u, strength))


class HysteresisShape(Effect):
    """A Preisach operator v = sum_k p_k R_k(F_k), R_k(F) = int_0^F (1 + s m(x, r_k)) dx.

    Its density at mean x and half-width r > 0 is p(r) (1 + s m(x, r)), |m| <= 1: clusters of domains,
    +- sech^2((x - c - tilt r) / width) exp(-((r - rho) / sigma)^2). They take from some places what they
    give to others, sum_k p_k m(x, r_k) = 0 and int m(x, r) dx = 0, else they would be an envelope or weights.
    """

    strongest = 1.0  # a density is not negative

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        r, weights = base.hysteresis.half_widths[1:], base.hysteresis.weights[1:]
        self.x = np.linspace(-0.5, 1.0, 301)
        inside = (self.x[:, None] >= 0) & (self.x[:, None] <= 1 - r)
        density = np.zeros((len(self.x), len(r)))
        clusters = int(random.integers(2, 5))
        for rho in r[-1] * (np.arange(clusters) + random.random(clusters)) / clusters:
            c = random.uniform(0.1, 0.9) + random.uniform(-1.0, 1.0) * r
            near = random.choice([-1.0, 1.0]) * np.exp(-(((r - rho) / (0.35 * r[-1])) ** 2))
            density += near / np.cosh((self.x[:, None] - c) / random.uniform(0.1, 0.3)) ** 2
        for _ in range(20):
            density -= density @ weights[:, None] / weights.sum()
            density = np.where(inside, density - (density * inside).sum(axis=0) / inside.sum(axis=0), 0.0)
        density /= np.abs(density).max()
        area = scipy.integrate.cumulative_trapezoid(density, self.x, axis=0, initial=0.0)
        self.areas = [area[:, k] - np.interp(0.0, self.x, area[:, k]) for k in range(len(r))]

    def readings(self, plays: Array, strength: float) -> Array:
        """R_k(F_k), (samples, plays); the linear term stays linear."""
        read = plays.copy()
        for k, area in enumerate(self.areas, start=1):
            read[:, k] += strength * np.interp(plays[:, k], self.x, area)
        return read

    def hysteresis(self, hysteresis: Hysteresis, strength: float) -> Hysteresis:
        return replace(hysteresis, readout=lambda plays: self.readings(plays, strength))


class Creep(Effect):
    """v + s (c * dv/dt): relaxation c(t) = sum_i w_i (1 - exp(-t / tau_i)), or log10(1 + t / t_0)."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.logarithmic = random.random() < 0.5
        self.onset = log_uniform(random, 0.03, 0.3)
        lags = int(random.integers(2, 6))
        longest = max(1.0, base.seconds * random.uniform(0.3, 3.0))
        self.time_constants = np.geomspace(random.uniform(0.05, 0.3), longest, lags)
        self.weights = random.uniform(0.5, 1.5, lags) / lags

    def relaxation(self, v: Array, strength: float, experiment: Experiment) -> Array:
        t = np.arange(len(v)) / self.base.rate
        if self.logarithmic:
            c = np.log10(1 + t / self.onset)
        else:
            c = (1 - np.exp(-t[:, None] / self.time_constants)) @ self.weights
        increments = np.diff(v, prepend=0.0)
        return np.asarray(v + strength * scipy.signal.fftconvolve(increments, c)[: len(v)])


class LinearDynamics(Effect):
    """(1 - s) G + s G_2 with a mode of its own at 1.3 to 3 times the resonance, or below it."""

    strongest = 0.4  # the weaker of the two

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        first = base.mechanics.modes[0].hz
        ratio = random.uniform(1.3, 3.0) if random.random() < 0.7 else random.uniform(0.3, 0.75)
        self.hz = min(ratio * first, 0.35 * base.rate)
        self.damping = log_uniform(random, 0.01, 0.1)

    def mechanics(self, mechanics: Mechanics, strength: float) -> Mechanics:
        modes = tuple(replace(mode, participation=1 - strength) for mode in mechanics.modes)
        return replace(mechanics, modes=(*modes, Mode(self.hz, self.damping, strength)))


class Stiffness(Effect):
    """A cubic force in the resonance's own equation; see `Spring`."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.half_travel = base.hysteresis.travel / 2
        self.centre = base.hysteresis.travel * random.uniform(0.3, 0.7)
        self.softens = bool(random.random() < 0.4)

    def mechanics(self, mechanics: Mechanics, strength: float) -> Mechanics:
        return replace(mechanics, spring=Spring(strength, self.centre, self.half_travel, self.softens))


class OutputNonlinearity(Effect):
    """y + s h g(e), e = (y - centre) / h, h half the travel; g(e) = +-e^2, +-e^3 or tanh(2 e) / 2 - e."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.kind = random.choice(["quadratic", "cubic", "saturating"])
        self.sign = random.choice([-1.0, 1.0])
        self.half_travel = base.hysteresis.travel / 2
        self.centre = base.hysteresis.travel * random.uniform(0.4, 0.6)

    def output(self, y: Array, strength: float, experiment: Experiment) -> Array:
        e = (y - self.centre) / self.half_travel
        curves = {
            "quadratic": self.sign * e**2,
            "cubic": self.sign * e**3,
            "saturating": np.tanh(2 * e) / 2 - e,
        }
        return np.asarray(y + strength * self.half_travel * curves[str(self.kind)])


class GainDrift(Effect):
    """y(t) (1 + s g(t)), g a `SlowChange`."""

    def __init__(self, random: Generator, base: Base) -> None:
        super().__init__(random, base)
        self.change = SlowChange(random, base.seconds)

    def output(self, y: Array, strength: float, experiment: Experiment) -> Array:
        return y * (1 + strength * self.change(experiment.random("gain-drift"), experiment))


class Backlash(Effect):
    """A play of half-width s, in um, behind the dynamics."""

    def output(self, y: Array, strength: float, experiment: Experiment) -> Array:
        return play_bank(y, np.array([strength]))[:, 0]
