"""Calls of the templates' functions, in the syntax of C or Rust."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from gpi_hammerstein.export.chain import Chain
from gpi_hammerstein.export.numerals import Numerals
from gpi_hammerstein.export.operations import Operation


@dataclass
class Calls:
    """Writes operations as calls, and collects the tables that they need."""

    numerals: Numerals
    #: The state: `state->` or `self.`.
    own: str
    #: A part of the memory from a first to a last place.
    part: Callable[[int, int], str]
    #: How a table is passed to a function.
    passed: Callable[[str], str]
    #: How the states and v are passed.
    signals: str
    #: Whether tables are passed with their lengths.
    counted: bool
    #: The definition of a table of numbers or of whole numbers.
    defined: Callable[[str, ArrayLike, bool], str]
    tables: dict[str, str] = field(default_factory=dict)
    #: The length of each table, by the way in which it is passed.
    lengths: dict[str, int] = field(default_factory=dict)

    def table(self, name: str, values: ArrayLike, *, whole: bool = False) -> str:
        """Define a table, and return how it is passed to a function."""
        # no language has a use for tables without elements
        values = np.ravel(np.asarray(values, dtype=np.float64))
        if not whole:
            self.numerals.require(name, values, "model")
        values = values if len(values) else np.zeros(1)
        self.tables[name] = self.defined(name, values, whole)
        self.lengths[self.passed(name)] = len(values)
        return self.passed(name)

    def memory(self, operation: Operation) -> str:
        """Return the memory of an operation."""
        return self.part(operation.first, operation.first + operation.memory)

    def numbers(self, operation: Operation, *names: str) -> list[str]:
        """Return numbers of an operation, or all of them."""
        own = operation.numbers
        if "turns" in own:
            # in single precision, a rounded frequency would soon be out of phase
            own = own | {"turns_rest": own["turns"] - float(self.numerals.number(own["turns"]))}
        return [self.number(operation.kind, own[name]) for name in names or own]

    def number(self, name: str, value: float) -> str:
        """Return one number; whole numbers have another type in both languages."""
        if isinstance(value, int):
            return str(value)
        self.numerals.require(f"number of {name}", value, "model")
        return self.numerals.written(value)

    def call(self, operation: Operation, *signals: str) -> str:
        """Return the call of an operation with its signals: memory, signals, numbers, tables, sample."""
        arguments = [self.memory(operation)] if operation.memory else []
        arguments += [*signals, *self.numbers(operation)]
        count = 0
        for name, values in operation.arrays.items():
            count = len(values)
            arguments.append(self.table(f"{operation.kind}_{name}_{operation.number}", values))
        if operation.arrays and self.counted:
            arguments.append(str(count))
        if operation.timed:
            arguments.append(f"{self.own}sample")
        return f"{operation.kind}({', '.join(arguments)})"

    def linear(self, chain: Chain) -> None:
        """Define the tables of the linear dynamics."""
        factors, columns, ends = sparse(chain.system)
        self.table("factors", factors)
        self.table("columns", columns, whole=True)
        self.table("row_ends", ends, whole=True)
        self.table("steady", chain.steady)
        self.table("offsets", chain.offsets)

    def bank(self, chain: Chain, place: int) -> "Bank":
        """Define the tables of the hysteresis of an input."""
        own = chain.hysteresis[place]
        return Bank(
            self.table(f"thresholds_{place}", own.thresholds),
            self.table(f"slopes_{place}", own.slopes),
            self.table(f"half_widths_{place}", own.half_widths),
            self.table(f"weights_{place}", own.weights),
            self,
            [widening for widening in chain.at("widths") if widening.channel == place],
            [curve for curve in chain.at("curves") if curve.channel == place],
        )

    def drive(self, chain: Chain) -> list[str]:
        """Return the statements of the input stage."""
        return [f"v[{own.channel}] = {self.call(own, f'v[{own.channel}]')};" for own in chain.at("input")]

    def respond(self, chain: Chain, declared: str) -> list[str]:
        """Return the statements of the sections in parallel with the dynamics, then of the loops around them.

        `declared` are the words that declare a number.
        """
        lines = []
        for (channel, samples), first in chain.lines.items():
            value = f"late({self.part(first, first + samples)}, v[{channel}]"
            value += f", {samples})" if self.counted else ")"
            lines.append(f"{declared} late_{channel}_{samples} = {value};")
        # loops that take several steps see it at the next sample
        beside = f"{self.own}memory[{chain.pending + chain.states + len(chain.inputs)}]"
        if chain.steps:
            lines.append(f"{beside} = 0.0;")
        for own in chain.at("parallel"):
            v = f"late_{own.channel}_{own.late}" if own.late else f"v[{own.channel}]"
            if chain.steps:
                lines.append(f"{beside} += {self.call(own, v)};")
            else:
                lines.append(f"y[0] += {self.call(own, v)};")
        if chain.steps:
            return [*lines, f"y[0] += {beside};", *self.keep(chain)]
        loops = chain.at("loops")
        # no loop sees what another one has changed
        for place, own in enumerate(loops):
            seen = f"y[{own.channel}]"
            if own.seen is not None:
                seen = f"dot({self.table(f'seen_{place}', own.seen)}, {self.signals})"
            lines.append(f"{declared} force_{place} = {self.call(own, seen)};")
        for place, own in enumerate(loops):
            drives = np.zeros(0) if own.drives is None else own.drives
            for state in np.flatnonzero(drives):
                lines.append(f"next[{state}] += {self.numerals.written(drives[state])} * force_{place};")
        return lines

    def settle(self, chain: Chain, declared: str) -> list[str]:
        """Return the statements of loops that take several steps from the sample before to this one.

        They stand before the linear dynamics, because the states of this sample depend on them.
        """
        if not chain.steps:
            return []
        loops, size = chain.at("loops"), chain.states + len(chain.inputs)
        before = self.part(chain.pending, chain.pending + size)
        lines = []
        for place, step in enumerate(chain.steps):
            own = loops[step.loop]
            terms = [f"dot({self.table(f'seen_{place}', step.seen)}, {before})"]
            if np.any(step.ahead):
                terms.append(f"dot({self.table(f'ahead_{place}', step.ahead)}, {self.signals})")
            if own.seen is None:
                terms.append(f"{self.own}memory[{chain.pending + size + own.channel}]")
            for other, factor in enumerate(step.earlier):
                terms.append(f"{self.numerals.written(factor)} * force_{other}")
            lines.append(f"{declared} signal_{place} = {' + '.join(terms)};")
            lines.append(f"{declared} force_{place} = {self.call(own, f'signal_{place}')};")
        for place, step in enumerate(chain.steps):
            for state in np.flatnonzero(step.drives):
                written = self.numerals.written(step.drives[state])
                lines.append(f"signals[{state}] += {written} * force_{place};")
        return lines

    def keep(self, chain: Chain) -> list[str]:
        """Return the statements that keep what loops need of a sample at the next one: states and v."""
        size = chain.states + len(chain.inputs)
        return [f"{self.own}memory[{chain.pending + place}] = signals[{place}];" for place in range(size)]

    def read(self, chain: Chain) -> list[str]:
        """Return the statements from the displacement to the reading."""
        lines = []
        for own in chain.at("displaced", "output", "added"):
            y = f"y[{own.channel}]"
            if own.place == "output":
                lines.append(f"{y} = {self.call(own, y)};")
            elif own.column is not None:
                lines.append(f"{y} += {self.call(own, f'{self.own}covariates[{own.column}]')};")
            else:
                lines.append(f"{y} += {self.call(own)};")
        return lines

    def standing(self, chain: Chain) -> list[tuple[str, str, str]]:
        """Return the memory, its factors and the signal of everything that is not zero at rest."""
        parts = []
        for own in chain.operations:
            if own.standing is not None:
                source = f"{self.own}input" if own.place == "input" else "v"
                factors = self.table(f"standing_{own.first}", own.standing)
                parts.append((self.memory(own), factors, f"{source}[{own.channel}]"))
        for (channel, samples), first in chain.lines.items():
            factors = self.table(f"standing_{first}", np.ones(samples))
            parts.append((self.part(first, first + samples), factors, f"v[{channel}]"))
        return parts


@dataclass
class Bank:
    """The hysteresis of one input: how its tables are passed, and the effects on its plays."""

    thresholds: str
    slopes: str
    half_widths: str
    weights: str
    calls: Calls
    widenings: list[Operation]
    curves: list[Operation]

    @property
    def widened(self) -> bool:
        """Whether half-widths grow with the speed."""
        return bool(self.widenings)

    @property
    def speeds(self) -> list[tuple[str, str]]:
        """The functions of `speed` that half-widths grow with: names and calls."""
        bent = []
        for own in self.widenings:
            if "exponent" in own.numbers:
                law = ", ".join(self.calls.numbers(own, "share", "exponent", "knee"))
                bent.append((f"bent_{own.number}", f"bent({self.calls.memory(own)}, speed, {law})"))
        return bent

    def width(self, width: str) -> str:
        """Return the half-width of a play, from the one at rest."""
        for own in self.widenings:
            seen = f"bent_{own.number}" if "exponent" in own.numbers else "speed"
            growth = ", ".join(self.calls.numbers(own, "relative", "absolute"))
            width = f"widened({width}, {seen}, {growth})"
        return width

    def read(self, place: str, row: Callable[[str, int], str]) -> str:
        """Return what a play contributes, from its place; `row` is the row of a table at the play."""
        for own in self.curves:
            rows = self.calls.table(f"curved_rows_{own.number}", own.arrays["rows"])
            degrees = int(own.numbers["degrees"])
            place = f"curved({place}, {row(rows, degrees)}, {', '.join(self.calls.numbers(own))})"
        return place


def used_parts(chain: Chain) -> set[str]:
    """Return the names of the template's parts that a model needs."""
    used = chain.kinds
    used |= {"directional" if bank.directional else "one_sided" for bank in chain.hysteresis}
    used |= {"late"} if chain.lines else set()
    mixes = bool(chain.steps) or any(own.seen is not None for own in chain.operations)
    used |= {"mixture"} if mixes else set()
    used |= {"steps"} if chain.steps else set()
    used |= {"bent"} if any("exponent" in own.numbers for own in chain.at("widths")) else set()
    if chain.lines or any(own.standing is not None for own in chain.operations):
        used |= {"stand"}
    return used


def sparse(matrix: ArrayLike) -> tuple[list[float], list[int], list[int]]:
    """Return the elements of a matrix that are not zero, their columns, and where each row ends."""
    rows = np.atleast_2d(np.asarray(matrix, dtype=np.float64))
    places = [np.flatnonzero(row) for row in rows]
    factors = [float(row[column]) for row, own in zip(rows, places, strict=True) for column in own]
    columns = [int(column) for own in places for column in own]
    ends = np.cumsum([len(own) for own in places]).tolist()
    return factors, columns, ends
