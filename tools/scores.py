"""The answer of `explain` on one record whose effects are known, and its score."""

import json
import sys
import time
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import plants
from plants import textbook

# Effects whose name in the labels differs from that in the catalogue.
ALSO = {"duffing": "stiffness", "preisach": "hysteresis-shape"}
# Verdict where the record was rejected.
REFUSED = "refused"
# Held-out error over the noise up to which nothing is left to be named.
ABSORBED = 1.05
# Relative change of each output sample of a changed copy: far below any noise, and far above rounding.
CHANGE = 1e-9
# Sampling rate in Hz of long records from which pieces are cut.
RATE_OF_PIECES = 1000.0
# Seed of the changes, if copies are explained.
COPY: ContextVar[int | None] = ContextVar("COPY", default=None)


@dataclass(frozen=True)
class Result:
    """The result of one record: errors over the noise, and the strength of a single effect, if given.

    ``again`` is the error on another experiment, NaN where there is none; ``stage`` is the name of a stage of
    another textbook; ``one_of`` are names of which one must be found.
    """

    name: str
    wanted: tuple[str, ...]
    found: tuple[str, ...]
    verdict: str
    before: float
    after: float
    again: float
    seconds: float
    is_outside: bool = False
    strength: float | None = None
    may: tuple[str, ...] | None = None
    stage: str | None = None
    one_of: tuple[str, ...] = ()

    def is_right(self) -> bool:
        """Return whether the effects are those of the label.

        A label with effects that may be named (records of other simulators) does not ask for an effect that
        the declared model has explained down to the noise.
        """
        if self.verdict == REFUSED:
            return False
        if self.may is None:
            return sorted(self.wanted) == sorted(self.found)
        return not self.has_false() and not self.is_missed()

    def is_missed(self) -> bool:
        """Return whether an effect that must be named is missing."""
        is_named = set(self.wanted) <= set(self.found)
        if self.one_of:
            is_named = is_named and not set(self.one_of).isdisjoint(self.found)
        return not is_named and not self.is_absorbed()

    def is_absorbed(self) -> bool:
        """Return whether the error is down to the noise, so that nothing is left to be named."""
        return self.after <= ABSORBED

    def has_false(self) -> bool:
        """Return whether an effect was named that is not present."""
        return bool(self.false_names())

    def false_names(self) -> list[str]:
        """Return what was named and is not present."""
        return [name for name in self.found if name not in {*self.wanted, *(self.may or ()), *self.one_of}]

    def kind(self) -> str:
        """Return the kind of answer: right, partly right, nothing found, or wrong."""
        if self.is_right():
            return "right"
        if self.has_false():
            return "wrong"
        return "partly right" if self.found else "nothing found"


def explained(
    name: str,
    wanted: tuple[str, ...],
    record: gpi.Record,
    again: gpi.Record | None,
    noise: float,
    *,
    is_outside: bool = False,
    strength: float | None = None,
    may: tuple[str, ...] | None = None,
) -> Result:
    """Explain a record and score the model on another experiment of the same plant."""
    record = copied(record)
    begin = time.perf_counter()
    found = gpi.explain(record)
    seconds = time.perf_counter() - begin
    error = np.nan if again is None else found.model.error(again, fit_start=True)["rms"]
    before, after = (errors["holdout"]["rms"] / noise for errors in (found.before, found.after))
    return Result(
        name,
        wanted,
        tuple(found.effects),
        found.verdict,
        before,
        after,
        error / noise,
        seconds,
        is_outside,
        strength,
        may,
    )


def copied(record: gpi.Record) -> gpi.Record:
    """Return the record, or a copy whose outputs differ by `CHANGE` where a copy is wanted."""
    seed = COPY.get()
    if seed is None:
        return record
    random = np.random.default_rng(seed)
    outputs = [y * (1.0 + CHANGE * random.standard_normal(y.shape)) for y in record.y]
    return gpi.Record(
        record.u,
        outputs,
        rate=record.rate,
        covariates=record.covariates if record.covariate_names else None,
        warmup=record.warmup,
        input_units=record.input_units,
        output_units=record.output_units,
    )


def of_copy(seed: int, function: Callable[..., Result], *values: object) -> Result:
    """Explain a changed copy of a record. The answer should be that for the record itself."""
    token = COPY.set(seed)
    try:
        return function(*values)
    finally:
        COPY.reset(token)


def labelled(folder: Path, name: str) -> Result:
    """Explain one record of the data folder."""
    label = json.loads((folder / "labels.json").read_text())[name]
    wanted = tuple(ALSO.get(effect, effect) for effect in label["effects"])
    record, again = (gpi.read_record(folder / f"{name}{part}.csv.gz") for part in ("", ".again"))
    return explained(name, wanted, record, again, label["noise_std_um"])


def foreign(folder: Path, name: str) -> Result:
    """Explain one record of another simulator, whose label says what must and what may be named."""
    label = json.loads((folder / "labels.json").read_text())[name]
    columns = dict(zip(("input", "output"), label.get("columns", "u -> y").split(" -> "), strict=True))
    record = gpi.read_record(folder / f"{name}.csv.gz", **columns)
    path = folder / f"{name}.again.csv.gz"
    again = gpi.read_record(path, **columns) if path.exists() else None
    noise = label["noise_rms_um"] or label["noise_rms_nm"]
    is_outside = not label["must"]
    return explained(
        name, tuple(label["must"]), record, again, noise, is_outside=is_outside, may=tuple(label["may"])
    )


def simulated(seed: int, effects: tuple[str, ...], strength: float | None, seconds: float) -> Result:
    """Explain one record of the simulator."""
    plant = plants.draw(seed, effects, strength, seconds)
    record, again = (as_record(plant.record(number)) for number in (0, 1))
    is_outside = any(effect in plants.OUTSIDE or effect == "unattributed" for effect in effects)
    wanted = () if is_outside else effects
    name = f"plant {seed} {'+'.join(plant.effects) if is_outside else ''}".strip()
    return explained(name, wanted, record, again, plant.noise_std, is_outside=is_outside, strength=strength)


def piece(seed: int, effects: tuple[str, ...], seconds: float) -> Result:
    """Explain a piece of a record that is ten times as long, cut out while the stage moves.

    Slow effects are older than the piece, and its excitation may be a single one, so that no effect has to be
    named. None may be named that the stage does not have.
    """
    plant = plants.draw(seed, effects, None, 10.0 * seconds, RATE_OF_PIECES, in_motion=False)
    samples = round(RATE_OF_PIECES * seconds)
    first = int(np.random.default_rng(seed).integers(samples, 9 * samples))
    record, again = (as_record(cut(plant.record(number), first, first + samples)) for number in (0, 1))
    name = f"piece of plant {seed}, {first / RATE_OF_PIECES:.0f} s"
    return explained(name, (), record, again, plant.noise_std, may=effects)


def cut(run: plants.Recording, first: int, end: int) -> plants.Recording:
    """Return the samples of a recording from the first one to before the end."""
    column = None if run.x is None else run.x[first:end]
    return replace(run, t=run.t[first:end], u=run.u[first:end], y=run.y[first:end], x=column)


def clean(seed: int, seconds: float) -> Result:
    """Explain one record of a simulated stage that lacks nothing; odd seeds start in motion.

    A record that starts in motion has an unknown past, and two or three kinds of excitation.
    """
    in_motion = textbook.is_in_motion(seed)
    plant = plants.draw(seed, (), seconds=seconds, in_motion=in_motion)
    number = within(lambda number: plant.record(number).u)
    record, again = (as_record(plant.record(number)) for number in (0, number))
    name = f"clean plant {seed}{', in motion' if in_motion else ''}"
    return explained(name, (), record, again, plant.noise_std)


def within(drive: Callable[[int], NDArray[np.float64]], most: int = 30) -> int:
    """Return the number of the first other experiment whose drive stays in the range of that of experiment 0.

    Nothing can be known of a stage where it was not driven, so that an experiment beyond that range
    measures luck. If none of ``most`` experiments stays inside, it is the one that leaves the range least.
    """
    known = drive(0)
    beyond = {}
    for number in range(1, most + 1):
        other = drive(number)
        beyond[number] = max(known.min() - other.min(), other.max() - known.max(), 0.0)
        if beyond[number] == 0.0:
            break
    return min(beyond, key=beyond.__getitem__)


def of_textbook(stage: str, seed: int) -> Result:
    """Explain one record of a stage of another textbook; the label says what must and what may be named."""
    label = (textbook.ORDINARY | textbook.MECHANICS)[stage]
    number = within(lambda number: textbook.draw(stage, seed, number).u)
    one, two = (textbook.draw(stage, seed, number) for number in (0, number))
    record, again = (
        gpi.Record(
            run.u, run.y, rate=run.rate, covariates=run.columns, input_units=["V"], output_units=["um"]
        )
        for run in (one, two)
    )
    name = f"{stage} {seed}{', in motion' if one.in_motion else ''}"
    must, may = tuple(sorted(label.must)), tuple(sorted(label.may))
    is_outside = not must and bool(may)
    try:
        result = explained(name, must, record, again, one.noise, is_outside=is_outside, may=may)
    except gpi.GpiError as refusal:
        print(f"{name}: {refusal}", file=sys.stderr, flush=True)
        nothing = (np.nan, np.nan, np.nan, np.nan)
        result = Result(name, must, (), REFUSED, *nothing, is_outside=is_outside, may=may)
    return replace(result, stage=stage, one_of=tuple(sorted(label.one_of)))


def as_record(run: plants.Recording) -> gpi.Record:
    """Return a simulated recording as a record of the package."""
    return gpi.Record(run.u, run.y, rate=run.rate, covariates=run.x, input_units=["V"], output_units=["um"])
