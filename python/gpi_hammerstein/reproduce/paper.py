"""The numerical example of the source paper, computed from the numbers in the paper.

K. F. Aljanaideh, M. Al Janaideh, M. Rakotondrabe and D. Kundur, *Identification of Piezomicropositioning
Hammerstein Systems with Generalized Prandtl-Ishlinskii Hysteresis Nonlinearities*: section "Numerical
Example", figures 3 to 6. Equation numbers are the paper's.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gpi_hammerstein._native import Deadzones, Gpi, PlayBank, Record, StateSpace, era, fir, identify

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PERIOD = 1e-2
SAMPLES = 100_001
TAPS = 31
ORDERS = (2, 3)
INVERSE_TAPS = 40
# The joint refinement does not need more samples.
REFINED_SAMPLES = 20_001

NUMERATOR = (3.391e10,)
DENOMINATOR = (1.0, 3759.0, 2.063e7, 7.514e10)
HALF_WIDTHS = tuple(0.0769 * i for i in range(1, 9))
PLAY_WEIGHTS = (3.6590, 2.8098, 2.1577, 1.6569, 1.2724, 0.9771, 0.7503, 0.5762)
THRESHOLDS = tuple(0.8 * j for j in range(-8, 9))
DEADZONE_WEIGHTS = (
    *(-0.198, -0.057, -0.1669, -0.13, -0.15, -0.037, 0.02, 0.23, 0.0),
    *(-0.249, -0.004, -0.2176, -0.0734, 0.0568, -0.058, -0.13, -2.479),
)

ERRATA = (
    "The paper has several printing errors. (49) is (48) with a zero-order hold and a sampling period of "
    "1e-2 s, not 1e-5 s as the text states. At 1e-5 s, the order of persistent excitation is {rank} for "
    "31 taps (singular values above 1e-6 of the largest). At 1e-2 s it is 31, so that 1e-2 s is used "
    "here. The paper describes the envelope as memoryless, with positive weights and thresholds. However, "
    "(3) depends on the sign of u(k) - u(k-1), most weights are negative, and the thresholds are between "
    "-6.4 and 6.4. There are therefore two deadzone conventions: `one-sided` (memoryless, the usual "
    "deadzone) and `directional` ((3) as printed). The estimate is closest to the truth with a third "
    "convention, `symmetric`, in which every threshold acts with both signs. The caption of figure 6 "
    "states sin(Ts k), the text states 10 sin(Ts k). Only the latter reaches the thresholds. (10) writes "
    "Gamma_r instead of F_r. Finally, the estimate of G has a bias that does not decrease with the length "
    "of the record. A play has memory, so that the term that (42) to (44) neglect is itself a weak "
    "filter."
)


@dataclass(frozen=True)
class Realisation:
    """The results for one order of ERA."""

    order: int
    system: StateSpace
    system_error: float
    """Relative error of G(e^jw) after scaling, over 1000 frequencies from 0 to pi."""
    truncation: float
    """Truncation error of the noncausal inverse."""
    v_hat: Array
    """Estimate of the intermediate signal for the sine, by the noncausal inverse, scaled to v, (6000,)."""
    v_error: float
    """rms of v_hat - v over samples 200 to 5799 as a fraction of the span of v."""
    v_hat_multisine: Array
    """The same for the first 6000 samples of the record, scaled to v."""


@dataclass(frozen=True)
class RefinedResult:
    """The result of the joint refinement, with the true order, half-widths and thresholds."""

    system: StateSpace
    system_error: float
    """Relative error of G(e^jw) after scaling, over 1000 frequencies from 0 to pi."""
    weights_error: float
    """Largest error of a play weight over the largest weight, after scaling to the true sum; NaN if the
    record does not determine the weights."""
    deadzone_weights_error: float
    """The same for the deadzone weights, after scaling."""
    undetermined: int
    """Number of unidentifiable combinations of parameters."""
    status: str


@dataclass(frozen=True)
class ReadingResult:
    """The results for one deadzone convention of equation (3)."""

    name: str
    condition: float
    markov: Array
    """Estimated Markov parameters after scaling, (31,)."""
    markov_error: float
    """Their relative error."""
    sine: Array
    """u = 10 sin(0.01 k), (6000,)."""
    v: Array
    """The true intermediate signal for the sine, (6000,)."""
    v_multisine: Array
    """The true intermediate signal of the record, first 6000 samples."""
    realisations: list[Realisation]
    hysteresis: Gpi
    """The true hysteresis."""
    linear: StateSpace
    """The true G."""
    u: Array
    """Input of the record, (100001,)."""
    y: Array
    """Its output without noise, (100001,)."""

    @cached_property
    def refined(self) -> RefinedResult:
        """The joint refinement on the first 20001 samples, computed when it is first asked for."""
        part = slice(REFINED_SAMPLES)
        return refine_reading(self.hysteresis, self.u[part], self.y[part], self.linear)


@dataclass(frozen=True)
class Paper:
    """The numbers of figures 3 to 6."""

    system: StateSpace
    """G, (49): the zero-order hold of (48) at 1e-2 s."""
    markov: Array
    """True Markov parameters, (31,)."""
    readings: list[ReadingResult]
    printed_rank: int
    """Order of persistent excitation (31 taps) at the sampling period that the paper prints, 1e-5 s."""

    @property
    def errata(self) -> str:
        """The printing errors of the paper, in one paragraph."""
        return ERRATA.format(rank=self.printed_rank)


def envelope(reading: str) -> Deadzones:
    """Return the envelope D of the example.

    Parameters
    ----------
    reading
        The deadzone convention: ``"one-sided"``, ``"directional"``, or ``"symmetric"``. In the last one,
        every threshold acts with both signs.

    Returns
    -------
    Deadzones
        The 17 weighted deadzones; one-sided ones with both signs for the symmetric convention.

    Examples
    --------
    >>> envelope("symmetric").reading  # doctest: +SKIP
    'one-sided'
    """
    if reading != "symmetric":
        printed = reading == "directional"
        return Deadzones(THRESHOLDS, DEADZONE_WEIGHTS, reading="directional" if printed else "one-sided")
    size = np.abs(THRESHOLDS)
    weights = np.array(DEADZONE_WEIGHTS)
    # A threshold of zero passes u completely, and must not be counted twice.
    mirrored = size > 0
    return Deadzones(np.concatenate([size, -size[mirrored]]), np.concatenate([weights, weights[mirrored]]))


def excitation(period: float = PERIOD) -> Array:
    """Return u(k) = sum over i = 1..1000 of 5 sin(i Ts k) in closed form; Ts in seconds."""
    x = period * np.arange(SAMPLES)
    half = np.sin(x / 2)
    at_zero = half == 0
    return np.where(at_zero, 0.0, 5 * np.sin(500 * x) * np.sin(500.5 * x) / np.where(at_zero, 1.0, half))


def scale_to(estimate: ArrayLike, truth: ArrayLike) -> float:
    """Return the factor that brings `estimate` closest to `truth` in the least-squares sense."""
    a, b = np.ravel(estimate), np.ravel(truth)
    return float(np.real(np.vdot(a, b)) / np.real(np.vdot(a, a)))


def relative_error(estimate: ArrayLike, truth: ArrayLike) -> float:
    """Return the relative error of an estimate after division by its projection on the truth."""
    a, b = np.ravel(estimate), np.ravel(truth)
    factor = np.real(np.vdot(b, a)) / np.real(np.vdot(b, b))
    return float(np.linalg.norm(a / factor - b) / np.linalg.norm(b))


def response(system: StateSpace, angles: Array) -> ComplexArray:
    """Return G(e^jw) of a single-channel system at angles in rad per sample."""
    return np.ravel(system.frequency_response(angles))


def paper() -> Paper:
    """Run the example for both deadzone conventions of (3) and for the symmetric variant.

    Returns
    -------
    Paper
        True and estimated Markov parameters, systems and intermediate signals.

    Examples
    --------
    >>> [round(reading.markov_error, 3) for reading in paper().readings]  # doctest: +SKIP
    [0.341, 0.041, 0.012]
    """
    system = StateSpace.from_transfer_function(NUMERATOR, DENOMINATOR).zero_order_hold(PERIOD)
    readings = [run_reading(name, system) for name in ("one-sided", "directional", "symmetric")]
    printed = excitation(1e-5)
    return Paper(system, np.ravel(system.markov(TAPS)), readings, fir(printed, printed, TAPS).rank)


def run_reading(name: str, system: StateSpace) -> ReadingResult:
    """Run FIR, ERA and noncausal inverse for one deadzone convention.

    Parameters
    ----------
    name
        As in :func:`envelope`.
    system
        The true G.

    Returns
    -------
    ReadingResult
        The estimates and the true values.

    Examples
    --------
    >>> run_reading("directional", system).condition  # doctest: +SKIP
    1.16
    """
    hysteresis = Gpi(envelope(name), PlayBank(HALF_WIDTHS, PLAY_WEIGHTS))
    u = excitation()
    v = hysteresis(u)
    y = np.ravel(system.simulate(v))
    estimate = fir(u, y, TAPS)
    truth = np.ravel(system.markov(TAPS))
    markov = np.ravel(estimate.markov)

    sine = 10 * np.sin(PERIOD * np.arange(6000))
    v_sine = hysteresis(sine)
    y_sine = np.ravel(system.simulate(v_sine))
    angles = np.linspace(0.0, np.pi, 1000)
    realisations = []
    for order in ORDERS:
        realised = era(estimate.markov, order=order)
        inverse = realised.noncausal_inverse(r=INVERSE_TAPS, d=INVERSE_TAPS)
        v_hat = np.ravel(inverse(y_sine).values)
        v_hat = v_hat * scale_to(v_hat, v_sine)
        seen = np.ravel(inverse(y[: len(sine)]).values)
        inner = slice(200, 5800)
        realisations.append(
            Realisation(
                order=order,
                system=realised,
                system_error=relative_error(response(realised, angles), response(system, angles)),
                truncation=inverse.error,
                v_hat=v_hat,
                v_error=float(np.sqrt(np.mean((v_hat - v_sine)[inner] ** 2)) / np.ptp(v_sine)),
                v_hat_multisine=seen * scale_to(seen, v[: len(sine)]),
            )
        )
    return ReadingResult(
        name=name,
        condition=estimate.condition,
        markov=markov * scale_to(markov, truth),
        markov_error=relative_error(markov, truth),
        sine=sine,
        v=v_sine,
        v_multisine=v[: len(sine)],
        realisations=realisations,
        hysteresis=hysteresis,
        linear=system,
        u=u,
        y=y,
    )


def refine_reading(hysteresis: Gpi, u: Array, y: Array, system: StateSpace) -> RefinedResult:
    """Identify and refine the example with the true order, thresholds, half-widths and convention.

    Parameters
    ----------
    hysteresis
        The true hysteresis.
    u, y
        Input and output without noise, (samples,).
    system
        The true G.

    Returns
    -------
    RefinedResult
        The estimates and the true values.

    Examples
    --------
    >>> refine_reading(hysteresis, u, y, system).system_error < 1e-6  # doctest: +SKIP
    True
    """
    truth_envelope, truth_plays = hysteresis.envelope, hysteresis.plays
    model = identify(
        Record(u, y, rate=1 / PERIOD),
        half_widths=truth_plays.half_widths,
        thresholds=truth_envelope.thresholds,
        order=ORDERS[-1],
        reading=truth_envelope.reading,
        robust=False,
    )
    refinement = model.refinement
    assert refinement is not None, "identify refines"
    angles = np.linspace(0.0, np.pi, 1000)
    plays, envelope = model.hysteresis[0].plays, model.hysteresis[0].envelope
    found = np.interp(truth_plays.half_widths, plays.half_widths, plays.weights, left=0.0, right=0.0)
    found[~np.isin(truth_plays.half_widths, plays.half_widths)] = 0.0
    found *= truth_plays.weights.sum() / found.sum()
    # Deadzones of equal thresholds are combined.
    thresholds = np.unique(truth_envelope.thresholds)
    of = [truth_envelope.thresholds == eta for eta in thresholds]
    truth_slope = np.array([truth_envelope.weights[own].sum() for own in of])
    slopes = dict(zip(envelope.thresholds, envelope.weights, strict=True))
    slope = np.array([slopes.get(eta, 0.0) for eta in thresholds])
    # G and z may both have the opposite sign. If all plays slide all the time, the scale of z is arbitrary.
    slope *= scale_to(slope, truth_slope)
    known = [p["std"] is not None for p in refinement.parameters if p["name"].startswith("u.weights")]
    worst = float(np.abs(found - truth_plays.weights).max() / truth_plays.weights.max())
    worst_slope = float(np.abs(slope - truth_slope).max() / np.abs(truth_slope).max())
    return RefinedResult(
        system=model.linear,
        system_error=relative_error(response(model.linear, angles), response(system, angles)),
        weights_error=worst if all(known) else float("nan"),
        deadzone_weights_error=worst_slope,
        undetermined=len(refinement.undetermined),
        status=refinement.status,
    )
