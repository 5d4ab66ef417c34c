"""Piezo stages with effects that no model was told of: a test bed that shares no code with the package.

    u -> [drive] -> hysteresis -> [relaxation] -> mechanics -> [output] -> + offset + noise -> [measured] -> y

`draw(7, ("creep",)).record(1)` is experiment 1 on stage 7. The same seed with other effects is the same
stage under the same experiments, and so is `record` with another seed under another experiment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from .added import ColouredNoise, Covariate, Drift, Outliers, PeriodicDisturbance
from .effects import (
    AmplifierSlew,
    Backlash,
    Base,
    Creep,
    Delay,
    Effect,
    GainDrift,
    HysteresisShape,
    LinearDynamics,
    OutputNonlinearity,
    RateDependence,
    Stiffness,
    log_uniform,
)
from .excitation import Array, Experiment, Limits, experiment, stream
from .hysteresis import draw_hysteresis
from .mechanics import draw_mechanics
from .outside import Chaos, PeakMemory, Quantisation, SpeedNoise, StickSlip

__all__ = ["CATALOGUE", "OUTSIDE", "Plant", "Recording", "draw"]

# In the order of the chain.
CATALOGUE: dict[str, type[Effect]] = {
    "delay": Delay,
    "amplifier-slew": AmplifierSlew,
    "rate-dependence": RateDependence,
    "hysteresis-shape": HysteresisShape,
    "creep": Creep,
    "linear-dynamics": LinearDynamics,
    "stiffness": Stiffness,
    "output-nonlinearity": OutputNonlinearity,
    "gain-drift": GainDrift,
    "backlash": Backlash,
    "drift": Drift,
    "periodic-disturbance": PeriodicDisturbance,
    "covariate": Covariate,
    "coloured-noise": ColouredNoise,
    "outliers": Outliers,
}
OUTSIDE: dict[str, type[Effect]] = {
    "stick-slip": StickSlip,
    "peak-memory": PeakMemory,
    "chaos": Chaos,
    "speed-noise": SpeedNoise,
    "quantisation": Quantisation,
}
EFFECTS = CATALOGUE | OUTSIDE

LARGEST_EFFECT = 0.01  # rms over the span: what is bigger would have been declared
REFERENCE = 0  # the experiment in which effects have the wanted strength
QUIETEST, LOUDEST = 1e-4, 5e-3  # noise over the span
SCALING_TOLERANCE = 0.005
MOST_ROUNDS = 60


@dataclass(frozen=True, eq=False)
class Recording:
    """What was measured, and what only a simulator knows: the white noise and every effect's rms over it."""

    t: Array
    u: Array
    y: Array
    x: Array | None
    rate: float
    noise_std: float
    effect_rms_over_noise: dict[str, float]


@dataclass(eq=False)
class Plant:
    """A stage; `strengths` are the effects' own, `noise_std` is in um."""

    seed: int
    base: Base
    effects: dict[str, Effect]
    column: Covariate | None
    in_motion: bool
    noise_std: float = 0.0
    strengths: dict[str, float] = field(default_factory=dict)

    @property
    def resonance_hz(self) -> float:
        """Undamped, of the first mode."""
        return self.base.mechanics.modes[0].hz

    @property
    def damping_ratio(self) -> float:
        """Of the first mode."""
        return self.base.mechanics.modes[0].damping

    def experiment(self, excitation_seed: int) -> Experiment:
        """The drive of an experiment."""
        limits = Limits(self.base.rate, self.base.hysteresis.volts, self.resonance_hz)
        return experiment((self.seed, excitation_seed), limits, self.base.seconds, self.in_motion)

    def simulate(self, run: Experiment, strengths: Mapping[str, float]) -> Array:
        """Y over the recorded samples under the effects that `strengths` names."""
        active = [(effect, strengths[name]) for name, effect in self.effects.items() if name in strengths]
        u = run.u
        for effect, strength in active:
            u = effect.drive(u, strength, run)
        hysteresis, mechanics = self.base.hysteresis, self.base.mechanics
        for effect, strength in active:
            hysteresis = effect.hysteresis(hysteresis, strength)
            mechanics = effect.mechanics(mechanics, strength)
        v = hysteresis(u)
        for effect, strength in active:
            v = effect.relaxation(v, strength, run)
        y = mechanics.respond(v)
        for effect, strength in active:
            y = effect.output(y, strength, run)
        y = y + self.base.offset + self.noise_std * run.random("noise").standard_normal(len(y))
        for effect, strength in active:
            y = effect.measured(y, strength, run)
        return run.recorded(y)

    def rms_over_noise(
        self, name: str, run: Experiment, others: Mapping[str, float], strength: float
    ) -> float:
        """Rms of what one effect changes among the others, the mean removed."""
        difference = self.simulate(run, {**others, name: strength}) - self.simulate(run, others)
        return float(np.std(difference)) / self.noise_std

    def record(self, excitation_seed: int) -> Recording:
        """Run an experiment."""
        run = self.experiment(excitation_seed)
        rms = {}
        for name, strength in self.strengths.items():
            others = {other: value for other, value in self.strengths.items() if other != name}
            rms[name] = self.rms_over_noise(name, run, others, strength)
        return Recording(
            t=run.recorded(run.t),
            u=run.recorded(run.u),
            y=self.simulate(run, self.strengths),
            x=None if self.column is None else run.recorded(self.column.column(run)),
            rate=self.base.rate,
            noise_std=self.noise_std,
            effect_rms_over_noise=rms,
        )


def strength_for(wanted: float, rms_at: Callable[[float], float]) -> float:
    """The strength at which the growing `rms_at` is `wanted`: by false position between logarithms."""
    strength, low, high = 1e-2, (0.0, 0.0), (math.inf, math.inf)
    for round_number in range(MOST_ROUNDS):
        found = rms_at(strength)
        if abs(found / wanted - 1) < SCALING_TOLERANCE:
            return strength
        if found < wanted:
            low = (strength, found)
        else:
            high = (strength, found)
        if low[0] == 0.0 or high[0] == math.inf:
            strength *= min(max(wanted / found, 0.1), 10.0) if found > 0 else 10.0
        elif low[1] == 0.0 or round_number % 3 == 2:
            strength = math.sqrt(low[0] * high[0])
        else:
            share = math.log(wanted / low[1]) / math.log(high[1] / low[1])
            strength = low[0] * (high[0] / low[0]) ** share
    raise RuntimeError(f"no strength makes the effect {wanted} times the noise: {low}, {high}")


def draw_base(seed: int, seconds: float, rate: float | None) -> Base:
    """The stage without effects; 10 V are the low side of its amplifier."""
    random = stream("base", seed)
    drawn = float(random.choice([1000.0, 2000.0, 4000.0]))
    rate = drawn if rate is None else rate
    hysteresis = draw_hysteresis(random, float(random.choice([10.0, 60.0, 100.0, 120.0, 150.0])))
    offset = hysteresis.travel * random.uniform(-0.2, 0.2)
    return Base(rate, seconds, hysteresis, draw_mechanics(random, rate), offset)


def settle(plant: Plant, wanted: Mapping[str, float]) -> None:
    """Draw the noise, no louder than keeps all effects small and possible, and scale the effects to it."""
    run = plant.experiment(REFERENCE)
    # `noise_std` is 0 still: the span is that of the motion
    clean = plant.simulate(run, {})
    span = float(np.ptp(clean))
    loudest = LOUDEST * span
    scaled = [name for name, effect in plant.effects.items() if effect.scalable and wanted[name] > 0]
    for name in scaled:
        largest, strongest = LARGEST_EFFECT * span, plant.effects[name].strongest
        if strongest < math.inf:
            largest = min(largest, 0.9 * float(np.std(plant.simulate(run, {name: strongest}) - clean)))
        loudest = min(loudest, largest / wanted[name])
    noise = stream("noise", plant.seed)
    plant.noise_std = log_uniform(noise, min(QUIETEST * span, loudest), loudest)
    plant.strengths = {name: 1.0 for name, effect in plant.effects.items() if not effect.scalable}
    for name in scaled:
        rms_at = partial(plant.rms_over_noise, name, run, plant.strengths.copy())
        plant.strengths[name] = strength_for(wanted[name], rms_at)


def draw(
    seed: int,
    effects: Sequence[str] = ("creep",),
    strength: float | Mapping[str, float] | None = 10.0,
    seconds: float = 30.0,
    rate: float | None = None,
    in_motion: bool | None = None,
) -> Plant:
    """Draw a stage.

    `effects` are names of `CATALOGUE` or `OUTSIDE`, or `"unattributed"` for one of the latter. `strength`
    is the rms of each effect over the noise in experiment 0, or one by name; None, or no name, draws what
    is usual for the effect. A delay is whole samples and has the size that it has. `seconds` and `rate`,
    in Hz, are those of the records. `in_motion`: records begin in motion; None lets one seed in four do so.
    """
    random = stream("plant", seed)
    moves, has_column = bool(random.random() < 0.25), bool(random.random() < 0.3)
    in_motion = moves if in_motion is None else in_motion
    unnamed = str(random.choice(list(OUTSIDE)))
    names = {unnamed if name == "unattributed" else name for name in effects}
    if names - EFFECTS.keys():
        raise ValueError(f"no such effect: {sorted(names - EFFECTS.keys())}")
    base = draw_base(seed, seconds, rate)
    drawn = {name: kind(stream(name, seed), base) for name, kind in EFFECTS.items() if name in names}
    leak = drawn.get("covariate")
    column = leak if isinstance(leak, Covariate) else Covariate(stream("covariate", seed), base)
    plant = Plant(seed, base, drawn, column if leak or has_column else None, in_motion)

    wanted = {}
    for name, effect in drawn.items():
        usual = log_uniform(stream("strength of " + name, seed), *effect.usual)
        given = strength.get(name) if isinstance(strength, Mapping) else strength
        wanted[name] = usual if given is None else given
    settle(plant, wanted)
    return plant
