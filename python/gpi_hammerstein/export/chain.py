"""A model as tables and operations, which every exported form contains."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gpi_hammerstein._native import Model, ParameterError
from gpi_hammerstein.export.effects import EXPORTED, Around
from gpi_hammerstein.export.operations import Array, Operation, Place


@dataclass(frozen=True)
class Channel:
    """A signal outside of the model."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class Hysteresis:
    """Envelope and plays of one input."""

    thresholds: Array
    slopes: Array
    directional: bool
    half_widths: Array
    weights: Array


@dataclass(frozen=True)
class LoopStep:
    """One loop in one step from a sample to the next."""

    #: The place of the loop among all loops.
    loop: int
    #: Factors of the states and v of a sample, and of the states and v of the next one.
    seen: Array
    ahead: Array
    #: Factors of the forces of all steps before.
    earlier: Array
    #: What the force adds to each state.
    drives: Array


@dataclass(frozen=True)
class Chain:
    """A model: y = H(G P[D[I(u)]] + d) + e + offset, one sample after the other."""

    rate: float
    inputs: list[Channel]
    outputs: list[Channel]
    #: The measured columns that effects read.
    covariates: list[Channel]
    #: Their places among the covariates of the record.
    columns: list[int]
    hysteresis: list[Hysteresis]
    #: The matrices in one: (x(k + 1), y(k)) = system (x(k), v(k)).
    system: Array
    #: The states for a constant v of 1 of each input.
    steady: Array
    offsets: Array
    operations: list[Operation]
    #: Delay lines of v: input and samples, and the place in the memory.
    lines: dict[tuple[int, int], int]
    #: The size of the memory of all operations and delay lines.
    memory: int
    #: The loops in all steps from a sample to the next, where they take more than one.
    steps: list[LoopStep] = field(default_factory=list)
    #: The place in the memory of what they remember of the sample before: states, v, and what is beside G.
    pending: int = 0

    def at(self, *places: Place) -> list[Operation]:
        """Return the operations of these places, in the order of the model."""
        return [own for place in places for own in self.operations if own.place == place]

    def first_play(self, place: int) -> int:
        """Return the number of the first play of an input among all plays."""
        return sum(len(own.weights) for own in self.hysteresis[:place])

    @property
    def states(self) -> int:
        """The number of states of G."""
        return len(self.steady)

    @property
    def kinds(self) -> set[str]:
        """The kinds of its operations."""
        return {own.kind for own in self.operations}


def chain_of(model: Model) -> Chain:
    """Return a model as tables and operations.

    Raises
    ------
    ParameterError
        An effect of the model cannot be exported.
    """
    saved = json.loads(model.to_json())
    a, b, c, d = (
        np.reshape(values, (rows, columns), order="F")
        for values, rows, columns in (saved["linear"][name] for name in "abcd")
    )
    banks = [_hysteresis(own) for own in saved["hysteresis"]]
    substeps = saved.get("intersample", {"substeps": 1})["substeps"]
    widths = [bank.half_widths for bank in banks]
    around = Around(saved["rate"], len(a), b.shape[1], widths, a, b, substeps)
    operations = [own for effect in saved.get("effects", []) for own in _operations(effect, around)]
    placed, lines, size = _placed(operations)
    steps = _steps(model, substeps, len(a), b.shape[1])
    pending, size = size, size + (len(a) + b.shape[1] + len(c) if steps else 0)
    labels = {own.column: own.label for own in placed if own.column is not None}
    columns = sorted(labels)
    placed = [own if own.column is None else replace(own, column=columns.index(own.column)) for own in placed]
    return Chain(
        saved["rate"],
        [Channel(**channel) for channel in saved["inputs"]],
        [Channel(**channel) for channel in saved["outputs"]],
        [Channel(labels[column]) for column in columns],
        columns,
        banks,
        np.block([[a, b], [c, d]]),
        _steady(a, b),
        np.array(saved["offsets"]),
        placed,
        lines,
        size,
        steps,
        pending,
    )


def _steps(model: Model, substeps: int, states: int, inputs: int) -> list[LoopStep]:
    """Return the loops in all steps from a sample to the next; none where each takes a single one."""
    if substeps == 1:
        return []
    rows = model.loop_steps()
    loops = len(rows) // substeps
    found = []
    for place, row in enumerate(rows):
        own = states - len(row["states"])
        # behind a dead time, v leaves the last states of its shift register
        first = own - inputs if own > 0 else states
        seen, ahead = np.zeros(states + inputs), np.zeros(states + inputs)
        seen[own:states] = row["states"]
        seen[first : first + inputs] = row["inputs"]
        ahead[first : first + inputs] = row["next"]
        drives = np.concatenate([np.zeros(own), row["drives"]])
        found.append(LoopStep(place % loops, seen, ahead, row["earlier"], drives))
    return found


def _hysteresis(own: dict[str, Any]) -> Hysteresis:
    envelope, plays = own["envelope"], own["plays"]
    return Hysteresis(
        np.array(envelope["thresholds"], dtype=np.float64),
        np.array(envelope["weights"], dtype=np.float64),
        envelope["reading"] == "directional",
        np.array(plays["half_widths"], dtype=np.float64),
        np.array(plays["weights"], dtype=np.float64),
    )


def _operations(effect: dict[str, Any], around: Around) -> list[Operation]:
    name = effect["name"]
    if name not in EXPORTED:
        raise ParameterError(
            f"the effect `{name}` of the model cannot be exported: it has no form that is computed sample by "
            f"sample in another language. Export the model without it, or simulate it with `gpi simulate`"
        )
    return EXPORTED[name](effect, around)


def _placed(operations: Sequence[Operation]) -> tuple[list[Operation], dict[tuple[int, int], int], int]:
    """Give each operation and each delay line its place in the memory."""
    size = 0
    placed = []
    for number, own in enumerate(operations):
        placed.append(replace(own, number=number, first=size))
        size += own.memory
    lines: dict[tuple[int, int], int] = {}
    for own in operations:
        if own.late > 0 and (own.channel, own.late) not in lines:
            lines[own.channel, own.late] = size
            size += own.late
    return placed, lines, size


def _steady(a: Array, b: Array) -> Array:
    """Return (I - A)^-1 B, or zeros where an integrator has no steady state."""
    try:
        return np.asarray(np.linalg.solve(np.eye(len(a)) - a, b), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.zeros_like(b)
