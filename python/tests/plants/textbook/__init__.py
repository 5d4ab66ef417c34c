"""Stages of other textbooks: each is written from published equations, and shares no code with the package.

`draw("relays", 7)` is the stage `relays` with the parameters of seed 7 in its first experiment;
`draw("relays", 7, 1)` is the same stage in another one. Odd seeds begin in motion: what the stage did before
the first sample is not recorded, and the record has fewer kinds of excitation.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ..excitation import Array, stream
from . import acquisition, loops, mechanics, operators, process, sensing, slow
from .combined import BESIDE, FORCES
from .drives import Drive, drive
from .run import Run

__all__ = ["ACQUISITION", "MECHANICS", "STAGES", "Record", "Stage", "draw", "is_in_motion"]

MEMORY_IN_THE_FORCE = ("stiffness", "hysteretic-stiffness", "friction", "bouc-wen", "hysteresis-shape")


@dataclass(frozen=True)
class Stage:
    """A stage, what an answer must name, and what it may name besides: any other name is false.

    `one_of`: names of which one must be given, where the catalogue has several for the same law.
    `is_bipolar`: the drive goes to both sides of 0. `seconds`: least length of the record, for what is slow.
    """

    simulate: Callable[[Generator, Drive], Run]
    must: frozenset[str] = frozenset()
    may: frozenset[str] = frozenset()
    one_of: frozenset[str] = frozenset()
    is_bipolar: bool = False
    seconds: float = 0.0


def stage(
    simulate: Callable[[Generator, Drive], Run],
    must: Iterable[str] = (),
    may: Iterable[str] = (),
    *,
    is_bipolar: bool = False,
    seconds: float = 0.0,
) -> Stage:
    """A stage with its label."""
    names = frozenset(must), frozenset(may)
    return Stage(simulate, *names, is_bipolar=is_bipolar, seconds=seconds)


STAGES: dict[str, Stage] = {
    "clean": stage(sensing.clean),
    "relays": stage(operators.relays, may=["hysteresis-shape"]),
    "ramps": stage(operators.ramps, may=["hysteresis-shape"]),
    "bouc-wen": stage(operators.bouc_wen, may=["hysteresis-shape"]),
    "duhem": stage(operators.duhem, may=["hysteresis-shape"]),
    "bouc-wen-spring": stage(mechanics.bouc_wen_spring, may=MEMORY_IN_THE_FORCE, is_bipolar=True),
    "maxwell-slip": stage(mechanics.maxwell_slip, may=MEMORY_IN_THE_FORCE),
    "dahl": stage(mechanics.dahl, may=MEMORY_IN_THE_FORCE, is_bipolar=True),
    "lugre": stage(mechanics.lugre, may=MEMORY_IN_THE_FORCE, is_bipolar=True),
    "motor": stage(mechanics.motor, may=["friction"], is_bipolar=True),
    "end-stops": stage(mechanics.slide, may=["friction", "saturation"], is_bipolar=True),
    "hydraulic": stage(mechanics.hydraulic, is_bipolar=True),
    "tanks": stage(process.tanks, may=["output-nonlinearity", "saturation"]),
    "heater": stage(process.heater),
    "two-modes": stage(loops.two_modes, may=["delay", "linear-dynamics"]),
    "flexure": stage(loops.flexure, may=["linear-dynamics"]),
    "feedback": stage(loops.feedback),
    "log-creep": stage(slow.creep, must=["creep"], may=["linear-dynamics"], seconds=12),
    "thermal": stage(slow.thermal, must=["drift"], seconds=12),
    "gain": stage(slow.gain, must=["gain-drift"], seconds=12),
    "self-heating": stage(slow.self_heating, seconds=12),
    "leak": stage(slow.leak, must=["covariate"], seconds=12),
    "lagged-leak": stage(slow.lagged_leak, must=["covariate"], seconds=12),
    "idle-columns": stage(slow.idle_columns, seconds=12),
    "hum": stage(slow.hum, must=["periodic-disturbance"]),
    "one-over-f": stage(sensing.one_over_f, may=["coloured-noise"]),
    "burst": stage(sensing.burst, may=["coloured-noise"]),
    "quantised": stage(sensing.quantised),
    "clipped": stage(sensing.clipped, may=["output-nonlinearity", "saturation"]),
    "bent": stage(sensing.bent, must=["output-nonlinearity"]),
}

#: Ordinary stages whose data acquisition is at fault.
ACQUISITION: dict[str, Stage] = {
    "clocks": stage(acquisition.clocks),
    "jitter": stage(acquisition.jitter),
    "repeated": stage(acquisition.repeated, may=["outliers"]),
    "interpolation": stage(acquisition.interpolation),
    # the error of a converter is noise where the drive passes many steps
    "converter": stage(acquisition.converter, may=["coloured-noise"]),
    "coupled": stage(acquisition.coupled),
    "wandering-hum": stage(acquisition.wandering_hum, may=["periodic-disturbance"]),
    "slips": stage(acquisition.slips),
    "squared": stage(acquisition.squared, may=["output-nonlinearity", "hysteresis-shape"]),
}

#: All stages but those whose forces inside the mechanics are asked for beside other effects.
ORDINARY: dict[str, Stage] = STAGES | ACQUISITION

#: Forces inside the mechanics, alone and beside another effect.
MECHANICS: dict[str, Stage] = {
    f"{name}+{other}": Stage(
        put_beside(force), frozenset(effects), one_of=names, is_bipolar=True, seconds=12 if effects else 0
    )
    for name, (force, names) in FORCES.items()
    for other, (put_beside, effects) in BESIDE.items()
}


@dataclass(frozen=True, eq=False)
class Record:
    """What was measured, and the noise's rms; `columns` are (samples, columns) measured besides."""

    u: Array
    y: Array
    rate: float
    noise: float
    columns: Array | None
    in_motion: bool
    kinds: tuple[str, ...]


def is_in_motion(seed: int) -> bool:
    """Whether the records of a seed begin in motion."""
    return seed % 2 == 1


def draw(name: str, seed: int, number: int = 0) -> Record:
    """Experiment `number` on the stage `name` of a seed."""
    kind = (ORDINARY | MECHANICS)[name]
    random = stream("textbook " + name, seed)
    rate = float(random.choice([1000.0, 2000.0, 4000.0]))
    if kind.seconds:
        rate = 1000.0
    samples = max(int(random.integers(7_000, 12_000)), round(kind.seconds * rate))
    volts = float(random.choice([10.0, 60.0, 100.0, 150.0]))
    resonance = rate * random.uniform(0.03, 0.08)
    travel = float(np.exp(random.uniform(np.log(5), np.log(60))))
    offset = random.uniform(-0.2, 0.2) * travel
    sizes = (volts, travel, resonance)
    run = drive(
        (zlib.crc32(f"{name} {seed}".encode()), number),
        rate,
        samples,
        sizes,
        is_bipolar=kind.is_bipolar,
        in_motion=is_in_motion(seed),
    )
    found = kind.simulate(random, run)
    return Record(
        u=run.recorded(found.u),
        y=run.recorded(found.y) + offset,
        rate=rate,
        noise=found.noise,
        columns=None if found.columns is None else run.recorded(found.columns),
        in_motion=run.history > 0,
        kinds=run.kinds,
    )
