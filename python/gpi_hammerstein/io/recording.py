"""The content of a record file, with or without an output."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import DataError, ParameterError, Record
from gpi_hammerstein.io.columns import Column

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """One experiment: uninterrupted samples."""

    u: Array
    """(samples, inputs)"""
    y: Array
    """(samples, outputs); without columns if the output was not measured"""
    covariates: Array
    """(samples, covariates)"""
    warmup: int = 0
    """Samples at the start that are not scored."""
    start: float = 0.0
    """Time of the first sample in s."""


@dataclass(frozen=True)
class Recording:
    """Experiments of one actuator at one sampling rate, with or without a measured output."""

    runs: list[Run]
    rate: float
    inputs: list[Column]
    outputs: list[Column]
    covariates: list[Column]
    notes: list[str] = field(default_factory=list)
    """Notes on changes of the samples while they were read, and on guesses."""
    undecided: list[Column] = field(default_factory=list)
    """Columns of which each may be the output, so that none was taken."""
    why: dict[str, str] = field(default_factory=dict)
    """Why each guessed column was taken for its role, by its header."""
    time: Column | None = None
    """The column of the time; None if there is none or the rate was given."""

    def record(self) -> Record:
        """Return the record for the identification.

        Raises
        ------
        DataError
            The output was not measured.
        """
        if not self.outputs:
            others = [column.header for column in self.undecided or self.covariates]
            which = "each of these may be it" if self.undecided else "the other columns are"
            there = f"; {which}: {', '.join(others)}" if others else ""
            raise DataError(f"the record has no output column; name one with output= (--output){there}")
        return Record(
            [run.u for run in self.runs],
            [run.y for run in self.runs],
            self.rate,
            warmup=[run.warmup for run in self.runs],
            input_names=[column.name for column in self.inputs],
            input_units=[column.unit for column in self.inputs],
            output_names=[column.name for column in self.outputs],
            output_units=[column.unit for column in self.outputs],
            covariates=[run.covariates for run in self.runs] if self.covariates else None,
            covariate_names=[column.name for column in self.covariates] if self.covariates else None,
            covariate_units=[column.unit for column in self.covariates] if self.covariates else None,
        )

    def select(self, experiments: str | int | Sequence[int] | None) -> "Recording":
        """Keep some of the experiments.

        Parameters
        ----------
        experiments
            Their numbers, starting at 0: ``3``, ``[0, 2]``, ``"0-4,7"``; None keeps all.

        Raises
        ------
        ParameterError
            The record has no experiment of this number.
        """
        if experiments is None:
            return self
        chosen = parse_experiments(experiments)
        missing = [index for index in chosen if index >= len(self.runs)]
        if missing:
            raise ParameterError(
                f"`experiments`: number {missing[0]} is requested, but the record has {len(self.runs)}, "
                f"numbered from 0 to {len(self.runs) - 1}"
            )
        return replace(self, runs=[self.runs[index] for index in chosen])

    def without(self, experiments: str | int | Sequence[int]) -> "Recording":
        """Keep all experiments except these."""
        left_out = set(parse_experiments(experiments))
        kept = [index for index in range(len(self.runs)) if index not in left_out]
        if not kept:
            raise ParameterError(
                f"`experiments`: all {len(self.runs)} experiments are held out; keep at least one for the fit"
            )
        return self.select(kept)

    def map_runs(self, change: Callable[[Run], Run]) -> "Recording":
        """Apply `change` to every experiment."""
        return replace(self, runs=[change(run) for run in self.runs])

    def skip(self, seconds: float) -> "Recording":
        """Do not score the first seconds of every experiment.

        Raises
        ------
        ParameterError
            The time is negative.
        DataError
            No samples remain to be scored.
        """
        if not seconds >= 0:
            raise ParameterError(f"`skip` = {seconds}: must be a time in s, zero or larger")
        samples = round(seconds * self.rate)

        def later(run: Run) -> Run:
            if samples >= len(run.u):
                raise DataError(
                    f"`skip` = {seconds} s is {samples} samples, but an experiment has {len(run.u)}; "
                    "give a shorter time"
                )
            return replace(run, warmup=max(run.warmup, samples))

        return self.map_runs(later)


def raise_warmup(record: Record, warmup: Sequence[int]) -> Record:
    """Do not score at least the first `warmup` samples of every experiment.

    Parameters
    ----------
    record
        The record.
    warmup
        Number of samples at the start of each experiment. A number below that of the record has no effect.

    Returns
    -------
    Record
        The same samples, with a larger warm-up.

    Examples
    --------
    >>> raise_warmup(record, [100]).warmup  # doctest: +SKIP
    [100]
    """
    covered = len(record.covariate_names) > 0
    return Record(
        record.u,
        record.y,
        record.rate,
        covariates=record.covariates if covered else None,
        warmup=[max(pair) for pair in zip(record.warmup, warmup, strict=True)],
        input_names=record.input_names,
        input_units=record.input_units,
        output_names=record.output_names,
        output_units=record.output_units,
        covariate_names=record.covariate_names if covered else None,
        covariate_units=record.covariate_units if covered else None,
    )


def parse_experiments(experiments: str | int | Sequence[int]) -> list[int]:
    """Parse a selection of experiments, for example ``"0-4,7"``.

    Parameters
    ----------
    experiments
        A number, several numbers, or a text of numbers and ranges. Numbers start at 0; ranges include their
        end.

    Returns
    -------
    list of int
        The numbers, in the given order.

    Raises
    ------
    ParameterError
        The text cannot be parsed, or a number is negative.

    Examples
    --------
    >>> parse_experiments("0-2,5")
    [0, 1, 2, 5]
    """
    if isinstance(experiments, int):
        numbers = [experiments]
    elif isinstance(experiments, str):
        numbers = []
        for part in experiments.split(","):
            first, dash, last = part.strip().partition("-")
            if not first.isdecimal() or (dash and not last.isdecimal()):
                raise ParameterError(f"`experiments` = {experiments}: give numbers from 0, such as `0-4,7`")
            numbers += range(int(first), int(last if dash else first) + 1)
    else:
        numbers = [int(number) for number in experiments]
    if not numbers or min(numbers) < 0:
        raise ParameterError(
            f"`experiments` = {experiments}: selects no experiment; give numbers from 0, such as `0-4,7`"
        )
    return numbers
