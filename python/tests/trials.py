"""The same experiment many times under fresh noise: how far estimates scatter, and what they claim."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import oracle
from records import RATE, model_of

Array = NDArray[np.float64]
Noise = Callable[[int, np.random.Generator], Array]

NOISE_TO_SIGNAL = 0.01  # 40 dB
INTERVAL = 1.96  # standard deviations on either side hold 95 % of a Gaussian
MARKOV = 20
ANGLES = np.geomspace(0.01, 2.5, 25)
POLE = 0.9  # of the coloured noise


def plant() -> oracle.Plant:
    """Four plays, two deadzones besides the identity, a damped resonance."""
    pole = 0.8 * np.exp(0.6j)
    resonance = oracle.Section(
        a=np.real(np.poly([pole, pole.conjugate()]))[1:],
        b=np.array([[0.35], [0.1]]),
        c=np.array([[1.0, 0.0]]),
    )
    hysteresis = oracle.Hysteresis(
        thresholds=np.array([-1.5, 0.0, 1.5]),
        deadzone_weights=np.array([0.4, 1.0, -0.35]),
        half_widths=np.array([0.0, 0.5, 1.1, 2.0]),
        weights=np.array([1.0, 0.6, 0.45, 0.35]),
    )
    return oracle.Plant(
        hysteresis=[hysteresis],
        sections=[resonance],
        feedthrough=np.zeros((1, 1)),
        held=[(0, 1.0)],
        offsets=[np.array([[3.0]])],
        starts=[None],
    )


def excitation() -> Array:
    """From zero, one multisine at four amplitudes: minor loops of all sizes."""
    periods = [size * gpi.multisine(1000, RATE, (1.0, 150.0), (-4.0, 4.0)) for size in (1.0, 0.35, 0.7, 0.9)]
    return np.concatenate([np.zeros(20), *periods])


def white(samples: int, random: np.random.Generator) -> Array:
    """Gaussian noise of variance one."""
    return random.standard_normal(samples)


def coloured(samples: int, random: np.random.Generator) -> Array:
    """e(k) = 0.9 e(k-1) + w(k), stationary, of variance one."""
    innovations = random.standard_normal(samples + 200)
    filtered = scipy.signal.lfilter([np.sqrt(1 - POLE**2)], [1.0, -POLE], innovations)
    return np.asarray(filtered, dtype=float)[200:]


@dataclass
class Scatter:
    """Errors of estimates and the standard deviations that they were given, each (runs, quantities)."""

    errors: Array
    deviations: Array

    def inside(self) -> NDArray[np.bool_]:
        """Whether the truth lies in each 95 % interval."""
        return np.abs(self.errors) <= INTERVAL * self.deviations

    def coverage(self) -> float:
        """The share of all intervals that hold the truth."""
        return float(np.mean(self.inside()))


@dataclass
class Trials:
    """What repeated refinements gave."""

    names: list[str]
    truth: Array  # of each parameter
    cramer_rao: Array  # the least standard deviation of an unbiased estimate under white noise
    parameters: Scatter
    markov: Scatter  # of G
    magnitude: Scatter  # ln |G| at `ANGLES`
    loop: Scatter  # v along a loop
    robust: int  # runs that used Huber's loss

    def efficiency(self) -> Array:
        """Root mean square error of every parameter over the Cramer-Rao bound."""
        scatter: Array = np.sqrt(np.mean(self.parameters.errors**2, axis=0))
        return scatter / self.cramer_rao


def perturbed(truth: oracle.Plant, names: list[str]) -> gpi.Model:
    """Where every refinement starts: weights off by 10 %, the poles by 2 %."""
    factors = {name: 1.1 if number % 2 else 0.9 for number, name in enumerate(names)}
    factors |= {name: 0.98 for name in names if ".a" in name}
    values = {name: factor * truth.value(name) for name, factor in factors.items()}
    return model_of(truth.with_values(values))


def run(runs: int, noise: Noise = white, seed: int = 0, robust: bool | None = None) -> Trials:
    """Refine on `runs` records that differ by their noise alone."""
    truth, u, random = plant(), excitation(), np.random.default_rng(seed)
    clean = truth.simulate(u[:, None])[:, 0]
    sigma = NOISE_TO_SIGNAL * clean.std()
    found = gpi.sensitivities(model_of(truth), gpi.Record(u, clean, rate=RATE))
    names = list(found["names"])
    start = perturbed(truth, names)
    loop = 3.5 * np.sin(np.linspace(0, 3 * np.pi, 150))
    at_truth = {
        "parameters": np.asarray(found["values"]),
        "markov": oracle.markov(*truth.state_space(), MARKOV).ravel(),
        "magnitude": np.log(np.abs(oracle.frequency_response(*truth.state_space(), ANGLES)).ravel()),
        # v(0) = 0 is known
        "loop": truth.intermediate(loop[:, None])[1:, 0],
    }
    errors: dict[str, list[Array]] = {key: [] for key in at_truth}
    deviations: dict[str, list[Array]] = {key: [] for key in at_truth}
    robustly = 0
    for _ in range(runs):
        record = gpi.Record(u, clean + sigma * noise(len(u), random), rate=RATE)
        refined = gpi.refine(start, record, robust=robust)
        how = refined.refinement
        assert how is not None and [p["name"] for p in how.parameters] == names
        robustly += how.robust
        linear = refined.linear
        matrices = (linear.A, linear.B, linear.C, linear.D)
        estimates = {
            "parameters": (
                np.array([p["value"] for p in how.parameters]),
                np.array([p["std"] for p in how.parameters], dtype=float),
            ),
            "markov": (linear.markov(MARKOV).ravel(), how.markov_std(MARKOV).ravel()),
            "magnitude": (
                np.log(np.abs(oracle.frequency_response(*matrices, ANGLES)).ravel()),
                how.response_std(ANGLES)[0].ravel(),
            ),
            "loop": (refined.intermediate(loop)[1:], how.loop_std(loop)[1:]),
        }
        for key, (value, deviation) in estimates.items():
            errors[key].append(value - at_truth[key])
            deviations[key].append(deviation)
    scatter = {key: Scatter(np.array(errors[key]), np.array(deviations[key])) for key in at_truth}
    bound = np.sqrt(np.diag(sigma**2 * np.linalg.inv(found["hessian"])))
    return Trials(names, at_truth["parameters"], bound, **scatter, robust=robustly)
