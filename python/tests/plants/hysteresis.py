"""Asymmetric play hysteresis: v = travel sum_k p_k R_k(F_k[D[u / volts]]), R_k the identity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from .excitation import Array


def play_bank(z: Array, half_widths: Array) -> Array:
    """F(k) = clamp(F(k-1), z(k) - r, z(k) + r) from F(-1) = 0, (samples, plays).

    Along a monotone branch of z the clamps fold into the last one: the recursion runs over the turning
    points alone, and all samples in between follow from the state at the turning point before them.
    """
    direction = np.sign(np.diff(z))
    moving = np.flatnonzero(direction)
    reversals = moving[1:][direction[moving[1:]] != direction[moving[:-1]]]
    turning = np.concatenate([[0], reversals, [len(z) - 1]])
    lower, upper = z[turning, None] - half_widths, z[turning, None] + half_widths
    before = np.zeros((len(turning) + 1, len(half_widths)))
    for k in range(len(turning)):
        np.clip(before[k], lower[k], upper[k], out=before[k + 1])
    branch = np.searchsorted(turning, np.arange(len(z)), side="left")
    return np.clip(before[branch], z[:, None] - half_widths, z[:, None] + half_widths)


def varying_play_bank(z: Array, half_widths: Array) -> Array:
    """The same with half-widths of every sample, (samples, plays)."""
    lower, upper = z[:, None] - half_widths, z[:, None] + half_widths
    outputs = np.empty_like(lower)
    state = np.zeros(half_widths.shape[1])
    for k in range(len(z)):
        np.minimum(state, upper[k], out=state)
        np.maximum(state, lower[k], out=state)
        outputs[k] = state
    return outputs


@dataclass(frozen=True, eq=False)
class Hysteresis:
    """An envelope D, then plays; `growth` and `readout` are for effects that change the plays."""

    volts: float
    travel: float
    envelope: Callable[[Array], Array]
    half_widths: Array
    weights: Array
    growth: Callable[[Array], Array] | None = None  # of u: half-widths at every sample, (samples, plays)
    readout: Callable[[Array], Array] | None = None  # of the plays' outputs, (samples, plays)

    def __call__(self, u: Array) -> Array:
        """V in um, 0 at rest and about `travel` at full drive."""
        z = self.envelope(u / self.volts)
        plays = (
            play_bank(z, self.half_widths) if self.growth is None else varying_play_bank(z, self.growth(u))
        )
        if self.readout is not None:
            plays = self.readout(plays)
        return np.asarray(self.travel * (plays @ self.weights))


def draw_envelope(random: Generator) -> Callable[[Array], Array]:
    """A monotone curve from (0, 0) to (1, 1): broken, cubic or exponential."""
    kind = random.choice(["deadzones", "cubic", "exponential"])
    if kind == "deadzones":
        thresholds = np.sort(random.uniform(0.1, 0.85, int(random.integers(1, 4))))
        slopes = random.uniform(-0.25, 0.6, len(thresholds))

        def broken(w: Array) -> Array:
            bends = np.maximum(w[:, None] - thresholds, 0.0) @ slopes
            return np.asarray((w + bends) / (1.0 + (1.0 - thresholds) @ slopes))

        return broken
    if kind == "cubic":
        a, b = random.uniform(-0.3, 0.5), random.uniform(-0.1, 0.3)
        return lambda w: np.asarray((w + a * w**2 + b * w**3) / (1.0 + a + b))
    bend = float(random.choice([-1.0, 1.0]) * random.uniform(0.2, 1.0))
    return lambda w: np.asarray(np.expm1(bend * w) / np.expm1(bend))


def draw_hysteresis(random: Generator, volts: float) -> Hysteresis:
    """6 to 30 plays with smoothly decaying weights that hold 20 to 50 % of the gain."""
    plays = int(random.integers(6, 31))
    widest = random.uniform(0.25, 0.5)
    grid = (np.arange(plays) + random.uniform(0.2, 0.8, plays)) / plays
    half_widths = widest * grid ** random.uniform(1.0, 2.0)
    density = np.exp(-half_widths / (widest * random.uniform(0.3, 1.5))) * random.uniform(0.85, 1.15, plays)
    density *= np.gradient(half_widths)
    share = random.uniform(0.2, 0.5)
    weights = np.concatenate([[1.0 - share], share * density / density.sum()])
    half_widths = np.concatenate([[0.0], half_widths])
    travel = float(np.exp(random.uniform(np.log(4.0), np.log(80.0))))
    weights /= weights @ (1.0 - half_widths)
    return Hysteresis(volts, travel, draw_envelope(random), half_widths, weights)
