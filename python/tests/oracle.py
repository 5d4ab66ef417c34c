"""Slow, obvious NumPy from the definitions: what the compiled core is held against.

Nothing here imports the package. Signals are (samples, channels), Markov parameters
(outputs, inputs, taps); equation numbers are those of the source paper.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
import scipy.optimize

EXCITATION_TOLERANCE = 1e-13

StateMatrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

# --- operators -----------------------------------------------------------------------------------


def play(z, half_width, start=0.0):
    """F_r[z], equation (7); `start` is F(-1)."""
    output = np.empty(len(z))
    previous = start
    for k, value in enumerate(z):
        previous = max(value - half_width, min(value + half_width, previous))
        output[k] = previous
    return output


def plays(z, half_widths, start=None):
    """The outputs of several plays, (samples, plays)."""
    start = np.zeros(len(half_widths)) if start is None else start
    columns = [play(z, r, f) for r, f in zip(half_widths, start, strict=True)]
    return np.stack(columns, axis=1) if columns else np.zeros((len(z), 0))


def play_bank(z, half_widths, weights, start=None):
    """P[z], equation (11), and the state after the last sample."""
    start = np.zeros(len(half_widths)) if start is None else np.asarray(start, dtype=float)
    outputs = plays(z, half_widths, start)
    v = np.zeros(len(z))
    for column, p in enumerate(weights):
        v = v + p * outputs[:, column]
    return v, outputs[-1].copy() if len(z) else start


def one_sided(u, threshold):
    """The usual deadzone: memoryless, on the side of zero where its threshold lies."""
    u = np.asarray(u, dtype=float)
    if threshold > 0:
        return np.maximum(u - threshold, 0.0)
    if threshold < 0:
        return np.minimum(u - threshold, 0.0)
    return u.copy()


def directional(u, threshold, previous=0.0):
    """Equation (3) as printed; `previous` is u(-1)."""
    output = np.zeros(len(u))
    for k, value in enumerate(u):
        if value > previous and value > threshold:
            output[k] = value - threshold
        elif value < previous and value < -threshold:
            output[k] = value + threshold
        previous = value
    return output


def deadzones(u, thresholds, weights, reading="one-sided", previous=0.0):
    """D[u], equation (2)."""
    z = np.zeros(len(u))
    for threshold, g in zip(thresholds, weights, strict=True):
        zone = one_sided(u, threshold) if reading == "one-sided" else directional(u, threshold, previous)
        z = z + g * zone
    return z


def gpi(u, thresholds, deadzone_weights, half_widths, weights, reading="one-sided", previous=0.0, start=None):
    """P[D[u]], equation (1), and the plays' state after the last sample."""
    z = deadzones(u, thresholds, deadzone_weights, reading, previous)
    return play_bank(z, half_widths, weights, start)


def inverse_gpi(v, thresholds, deadzone_weights, half_widths, weights, start=None, limits=(-1e3, 1e3)):
    """The drive u that makes `gpi` give v, sample by sample, or the nearer limit."""
    start = np.zeros(len(half_widths)) if start is None else start
    u = np.empty(len(v))
    for k, wanted in enumerate(v):

        def missing(value, start=start, wanted=wanted):
            v, _ = gpi([value], thresholds, deadzone_weights, half_widths, weights, start=start)
            return v[0] - wanted

        if missing(limits[0]) > 0:
            u[k] = limits[0]
        elif missing(limits[1]) < 0:
            u[k] = limits[1]
        else:
            u[k] = scipy.optimize.brentq(missing, *limits, xtol=1e-14, rtol=1e-15)
        _, start = gpi([u[k]], thresholds, deadzone_weights, half_widths, weights, start=start)
    return u


def loop_area(u, v):
    """The area that the closed polygon (u, v) encloses, by the shoelace formula."""
    return 0.5 * abs(np.sum(u * np.roll(v, -1) - np.roll(u, -1) * v))


# --- finite impulse response ---------------------------------------------------------------------


@dataclass
class Fir:
    """What `fir` returns."""

    markov: np.ndarray
    offsets: np.ndarray
    singular_values: np.ndarray
    rank: int
    residual_rms: np.ndarray
    samples: int


def regressor(u, taps, first):
    """Rows [u_1(k) .. u_1(k-taps+1), u_2(k) ..] for k = first .. end."""
    rows = []
    for k in range(first, len(u)):
        rows.append(np.concatenate([u[k - taps + 1 : k + 1, i][::-1] for i in range(u.shape[1])]))
    return np.array(rows).reshape(len(rows), taps * u.shape[1])


def fir(experiments, taps, ridge=0.0):
    """Least squares (25) with one offset per experiment; `experiments` are (u, y, warmup).

    `ridge`, relative to the mean eigenvalue of the centred Gram matrix, is the penalty of three
    passes of iterated ridge regression; offsets are never penalized.
    """
    inputs, outputs = experiments[0][0].shape[1], experiments[0][1].shape[1]
    regressors, targets = [], []
    for u, y, warmup in experiments:
        first = max(warmup, taps - 1)
        regressors.append(regressor(u, taps, first))
        targets.append(y[first:])
    stacked, target = np.vstack(regressors), np.vstack(targets)
    members = np.repeat(np.arange(len(experiments)), [len(block) for block in regressors])
    indicator = (members[:, None] == np.arange(len(experiments))).astype(float)
    centring = np.vstack([block - block.mean(axis=0) for block in regressors])
    singular_values = np.linalg.svd(centring, compute_uv=False)
    rank = int(np.sum(singular_values > EXCITATION_TOLERANCE * singular_values[0]))
    if ridge > 0:
        centred_target = np.vstack([block - block.mean(axis=0) for block in targets])
        gram, rhs = centring.T @ centring, centring.T @ centred_target
        penalized = gram + ridge * np.trace(gram) / len(gram) * np.eye(len(gram))
        x = np.zeros_like(rhs)
        for _ in range(3):
            x = x + np.linalg.solve(penalized, rhs - gram @ x)
        offsets = np.linalg.lstsq(indicator, target - stacked @ x, rcond=None)[0]
    elif rank == len(singular_values):
        solution = np.linalg.lstsq(np.hstack([stacked, indicator]), target, rcond=None)[0]
        x, offsets = solution[: taps * inputs], solution[taps * inputs :]
    else:
        # the minimum-norm taps, with offsets that are free
        x = np.linalg.lstsq(centring, target, rcond=EXCITATION_TOLERANCE)[0]
        offsets = np.linalg.lstsq(indicator, target - stacked @ x, rcond=None)[0]
    residual = target - stacked @ x - indicator @ offsets
    return Fir(
        markov=x.reshape(inputs, taps, outputs).transpose(2, 0, 1),
        offsets=offsets,
        singular_values=singular_values,
        rank=rank,
        residual_rms=np.sqrt(np.mean(residual**2, axis=0)),
        samples=len(target),
    )


def convolve(markov, u):
    """y(k) = sum_j H_j u(k-j) from rest, equation (19)."""
    y = np.zeros((len(u), markov.shape[0]))
    for k in range(len(u)):
        for lag in range(min(k + 1, markov.shape[2])):
            y[k] += markov[:, :, lag] @ u[k - lag]
    return y


# --- realization ---------------------------------------------------------------------------------


def hankel(markov, blocks, shift):
    """The block Hankel matrix [H_{i+j+shift}]."""
    return np.block([[markov[:, :, i + j + shift] for j in range(blocks)] for i in range(blocks)])


def era_blocks(markov, largest=300):
    """Block rows that are taken when none are given: half of the taps, `largest` rows or columns."""
    outputs, inputs, taps = markov.shape
    return int(np.clip((taps - 1) // 2 - 1, 1, max(largest // max(outputs, inputs), 1)))


def choose_order(s):
    """The order at a fall by a factor of 20, else where the rest holds 1e-4 of the energy."""
    for n in range(1, len(s) + 1):
        if s[n - 1] < 0.01 * s[0]:
            break
        if n == len(s) or s[n - 1] >= 20 * s[n]:
            return n
    total = np.sum(s**2)
    for n in range(1, len(s) + 1):
        if np.sum(s[n:] ** 2) <= 1e-4 * total:
            return n
    return len(s)


def era(markov, order=None, blocks=None):
    """(A, B, C, D) balanced by the square roots of the singular values, and all of these."""
    outputs, inputs, _ = markov.shape
    blocks = era_blocks(markov) if blocks is None else blocks
    left, s, right = np.linalg.svd(hankel(markov, blocks, 1))
    rank = int(np.sum(s > 1e-14 * s[0])) if s[0] > 0 else 0
    order = choose_order(s[:rank]) if order is None else order
    root = np.sqrt(s[:order])
    left, right = left[:, :order], right[:order].T
    a = (left / root).T @ hankel(markov, blocks, 2) @ (right / root)
    b = (right * root).T[:, :inputs]
    c = (left * root)[:outputs]
    return (a, b, c, markov[:, :, 0]), s


def reflect(a, margin=1e-6):
    """Poles at or outside the circle moved to 1 / conj(pole), and how many there were."""
    poles, vectors = np.linalg.eig(a)
    outside = np.abs(poles) > 1 - margin
    modulus = np.where(outside, np.minimum(1 / np.abs(poles), 1 - margin), np.abs(poles))
    moved = modulus * np.exp(1j * np.angle(poles))
    return np.real(vectors @ np.diag(moved) @ np.linalg.inv(vectors)), int(outside.sum())


# --- state space ---------------------------------------------------------------------------------


def simulate(a, b, c, d, v, state=None):
    """The outputs of x(k+1) = A x + B v, y = C x + D v, and the state after the last sample."""
    x = np.zeros(len(a)) if state is None else np.asarray(state, dtype=float)
    y = np.zeros((len(v), len(c)))
    for k in range(len(v)):
        y[k] = c @ x + d @ v[k]
        x = a @ x + b @ v[k]
    return y, x


def markov(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, count: int) -> np.ndarray:
    """H_0 = D, H_j = C A^(j-1) B."""
    taps = np.zeros((*d.shape, count))
    for j in range(count):
        taps[:, :, j] = d if j == 0 else c @ np.linalg.matrix_power(a, j - 1) @ b
    return taps


def poles(a):
    """The eigenvalues of A."""
    return np.linalg.eigvals(a) if len(a) else np.zeros(0, dtype=complex)


def zeros(a, b, c, d):
    """The finite eigenvalues of the pencil [A B; C D] - z [I 0; 0 0]."""
    order = len(a)
    pencil = np.block([[a, b], [c, d]])
    selector = np.zeros_like(pencil)
    selector[:order, :order] = np.eye(order)
    numerator, denominator = scipy.linalg.eigvals(pencil, selector, homogeneous_eigvals=True)
    finite = np.abs(denominator) > 1e-6 * np.abs(numerator)
    return numerator[finite] / denominator[finite]


def evaluate(a, b, c, d, point):
    """C (z I - A)^-1 B + D at one complex point."""
    return c @ np.linalg.solve(point * np.eye(len(a)) - a, b.astype(complex)) + d


def frequency_response(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, frequencies: np.ndarray
) -> np.ndarray:
    """G(e^jw), (frequencies, outputs, inputs)."""
    points = np.exp(1j * np.asarray(frequencies))[:, None, None]
    return c @ np.linalg.solve(points * np.eye(len(a)) - a, b.astype(complex)) + d


def dc_gain(a, b, c, d):
    """G(1)."""
    return np.real(evaluate(a, b, c, d, 1.0))


def from_transfer_function(numerator, denominator):
    """The controllable canonical form of a proper n(z) / d(z), highest power first."""
    denominator = np.asarray(denominator, dtype=float)
    padded = np.zeros(len(denominator))
    padded[len(denominator) - len(numerator) :] = numerator
    n, m = padded / denominator[0], denominator / denominator[0]
    order = len(m) - 1
    a = np.zeros((order, order))
    b = np.zeros((order, 1))
    if order:
        a[0] = -m[1:]
        a[1:, :-1] = np.eye(order - 1)
        b[0] = 1.0
    return a, b, (n[1:] - n[0] * m[1:])[None, :], np.array([[n[0]]])


def to_transfer_function(a, b, c, d):
    """Numerator (outputs, inputs, order + 1) and denominator; n = d * (H_0, H_1, ..)."""
    denominator = np.real(np.poly(poles(a))) if len(a) else np.ones(1)
    taps = markov(a, b, c, d, len(denominator))
    numerator = np.zeros_like(taps)
    for power in range(len(denominator)):
        for j in range(power + 1):
            numerator[:, :, power] += denominator[j] * taps[:, :, power - j]
    return numerator, denominator


def zero_order_hold(a, b, c, d, period):
    """dx/dt = A x + B v sampled every `period` with v held in between."""
    order, inputs = b.shape
    augmented = np.zeros((order + inputs, order + inputs))
    augmented[:order, :order], augmented[:order, order:] = a, b
    exponential = scipy.linalg.expm(augmented * period)
    return exponential[:order, :order], exponential[:order, order:], c, d


# --- the whole model, by the names of its parameters ------------------------------------------------


@dataclass
class Hysteresis:
    """One input's deadzones, thresholds ascending, and plays."""

    thresholds: np.ndarray
    deadzone_weights: np.ndarray
    half_widths: np.ndarray
    weights: np.ndarray
    reading: str = "one-sided"


@dataclass
class Section:
    """x1+ = -a1 x1 + x2 + b1 v, x2+ = -a2 x1 + b2 v, y = C x; or x+ = -a1 x + b1 v."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray

    def matrix(self) -> np.ndarray:
        shifted = np.eye(len(self.a), k=1)
        shifted[:, 0] -= self.a
        return shifted


@dataclass
class Start:
    """F_i(-1) = z(0) + sides_i r_i of each input, and how far the sections are from standing still.

    Without `sides` the plays come from rest.
    """

    sides: list[np.ndarray] | None
    state: np.ndarray


@dataclass
class Plant:
    """y = z^-delay (D + sum of sections) P[D[u]] + offset.

    `held` names for each input the output at which G(1) is kept, and its value: that element of
    `feedthrough` follows from the sections. `offsets` holds for each experiment (knots, outputs), evenly
    spaced with straight lines between them; `starts` holds None for an experiment that comes from rest.
    """

    hysteresis: list[Hysteresis]
    sections: list[Section]
    feedthrough: np.ndarray
    held: list[tuple[int, float]]
    delay: int = 0
    offsets: list[np.ndarray] = field(default_factory=list)
    starts: list[Start | None] = field(default_factory=list)
    inputs: list[str] = field(default_factory=lambda: ["u"])
    outputs: list[str] = field(default_factory=lambda: ["y"])

    def state_space(self) -> StateMatrices:
        """(A, B, C, D) of G without its delay."""
        inputs, outputs = len(self.inputs), len(self.outputs)
        a = scipy.linalg.block_diag(np.zeros((0, 0)), *[section.matrix() for section in self.sections])
        b = np.vstack([np.zeros((0, inputs)), *[section.b for section in self.sections]])
        c = np.hstack([np.zeros((outputs, 0)), *[section.c for section in self.sections]])
        d = self.feedthrough.copy()
        for column, (row, gain) in enumerate(self.held):
            d[row, column] += gain - dc_gain(a, b, c, d)[row, column]
        return a, b, c, d

    def delayed_state_space(self) -> StateMatrices:
        """(A, B, C, D) with the delay as a chain of states before the sections."""
        a, b, c, d = self.state_space()
        for _ in range(self.delay):
            chained = np.zeros((len(a), b.shape[1]))
            a = np.block([[a, b], [np.zeros((b.shape[1], len(a))), np.zeros((b.shape[1], b.shape[1]))]])
            c = np.hstack([c, d])
            b, d = np.vstack([chained, np.eye(b.shape[1])]), np.zeros_like(d)
        return a, b, c, d

    def intermediate(self, u: np.ndarray, start: Start | None = None) -> np.ndarray:
        """v (samples, inputs), from rest or from a start."""
        v = np.zeros_like(u)
        for i, channel in enumerate(self.hysteresis):
            z = deadzones(u[:, i], channel.thresholds, channel.deadzone_weights, channel.reading)
            from_rest = start is None or start.sides is None
            before = None if from_rest else z[0] + start.sides[i] * channel.half_widths
            v[:, i], _ = play_bank(z, channel.half_widths, channel.weights, before)
        return v

    def simulate(self, u: np.ndarray, experiment: int = 0, first: int = 0) -> np.ndarray:
        """The output (samples, outputs) where v stood at v(0) until the record began.

        What the start says of the sections' state holds at sample `first`.
        """
        start = self.starts[experiment]
        v = self.intermediate(u, start)
        v = v[np.maximum(np.arange(len(v)) - self.delay, 0)]
        a, b, c, d = self.state_space()
        state = np.linalg.solve(np.eye(len(a)) - a, b @ v[0])
        y, _ = simulate(a, b, c, d, v, state)
        if start is not None:
            free, _ = simulate(a, b, c, d, np.zeros_like(v[first:]), start.state)
            y[first:] += free
        knots = self.offsets[experiment]
        at = np.linspace(0, len(knots) - 1, len(u))
        for j in range(y.shape[1]):
            y[:, j] += np.interp(at, np.arange(len(knots)), knots[:, j])
        return y

    def _place(self, name: str) -> tuple[np.ndarray, int | tuple[int, int]]:
        """The array and the index at which a named parameter stands."""
        if match := re.fullmatch(r"(\w+)\.(deadzone_weights|thresholds|weights|half_widths)\[(\d+)\]", name):
            channel = self.hysteresis[self.inputs.index(match[1])]
            return getattr(channel, match[2]), int(match[3])
        if match := re.fullmatch(r"section\[(\d+)\]\.a(\d)", name):
            return self.sections[int(match[1])].a, int(match[2]) - 1
        if match := re.fullmatch(r"section\[(\d+)\]\.b(\d)\[(\w+)\]", name):
            return self.sections[int(match[1])].b, (int(match[2]) - 1, self.inputs.index(match[3]))
        if match := re.fullmatch(r"section\[(\d+)\]\.c(\d)\[(\w+)\]", name):
            return self.sections[int(match[1])].c, (self.outputs.index(match[3]), int(match[2]) - 1)
        if match := re.fullmatch(r"feedthrough\[(\w+), (\w+)\]", name):
            return self.feedthrough, (self.outputs.index(match[1]), self.inputs.index(match[2]))
        if match := re.fullmatch(r"offset\[(\d+)\]\.(\w+)(?:\[(\d+)\])?", name):
            return self.offsets[int(match[1])], (int(match[3] or 0), self.outputs.index(match[2]))
        if match := re.fullmatch(r"start\[(\d+)\]\.state\[(\d+)\]", name):
            return self.starts[int(match[1])].state, int(match[2])
        if match := re.fullmatch(r"start\[(\d+)\]\.(\w+)\[(\d+)\]", name):
            return self.starts[int(match[1])].sides[self.inputs.index(match[2])], int(match[3])
        raise KeyError(name)

    def value(self, name: str) -> float:
        """The parameter of this name."""
        array, index = self._place(name)
        return float(array[index])

    def with_values(self, values: dict[str, float]) -> Plant:
        """A copy with other values of the named parameters."""
        moved = copy.deepcopy(self)
        for name, value in values.items():
            array, index = moved._place(name)
            array[index] = value
        return moved


# --- the noncausal inverse -----------------------------------------------------------------------


def laurent(a, b, c, d, lags, size=2**14):
    """The coefficients h_i, i = -lags .. lags, of 1 / G on the unit circle, equation (45).

    Returns (inputs, outputs, 2 lags + 1). `size` is the length of the Fourier transform; zeros and
    poles within about 40 / size of the circle need a longer one.
    """
    response = frequency_response(a, b, c, d, 2 * np.pi * np.arange(size) / size)
    series = np.real(np.fft.ifft(np.linalg.inv(response), axis=0))
    return np.moveaxis(np.concatenate([series[-lags:], series[: lags + 1]]), 0, 2)


def truncation_error(series, r, d):
    """The norms of the taps outside -d .. r, as a fraction of those of all."""
    lags = (series.shape[2] - 1) // 2
    norms = np.linalg.norm(series, axis=(0, 1))
    return (norms[: lags - d].sum() + norms[lags + r + 1 :].sum()) / norms.sum()


def apply_noncausal(taps, d, y):
    """v(k) = sum_i h_i y(k - i), equation (47); the ends of y are held."""
    v = np.zeros((len(y), taps.shape[0]))
    for index in range(taps.shape[2]):
        lag = index - d
        held = [y[min(max(k - lag, 0), len(y) - 1)] for k in range(len(y))]
        v += np.array(held) @ taps[:, :, index].T
    return v


# --- errors --------------------------------------------------------------------------------------


def errors(y, predicted):
    """The four error measures of a prediction."""
    e = np.asarray(predicted) - np.asarray(y)
    rms = np.sqrt(np.mean(e**2))
    return {
        "rms": rms,
        "nrmse": rms / (np.max(y) - np.min(y)),
        "fit_percent": 100 * (1 - np.linalg.norm(e) / np.linalg.norm(y - np.mean(y))),
        "max": np.max(np.abs(e)),
    }
