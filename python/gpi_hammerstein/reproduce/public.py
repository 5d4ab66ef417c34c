"""Public benchmarks: what a model lacks, and its errors next to published ones."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gpi_hammerstein._native import Explanation, Model, Progress, Record, explain
from gpi_hammerstein.reproduce.benchmark_data import local_folder

#: The part of a benchmark that is used for the fit.
TRAINING = "training"


@dataclass(frozen=True)
class Benchmark:
    """A public benchmark: where its data come from, and what is known of it."""

    name: str
    #: The folder of its files in the data folder.
    folder: str
    title: str
    #: What is known of the plant, as a sentence.
    truth: str
    #: The effects of the catalogue that the plant has.
    effects: tuple[str, ...]
    #: The unit of all errors, and the factor from the unit of the record.
    unit: str
    factor: float
    #: Reads the parts of the benchmark from a folder, the training part first.
    read: Callable[[Path], dict[str, Record]]
    #: Published rms errors by the part of the benchmark, with their sources.
    published: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    #: Seconds over which predictions are scored too, for a plant that integrates its input.
    horizon: float | None = None


@dataclass(frozen=True)
class Reproduction:
    """The answer on one benchmark."""

    benchmark: Benchmark
    found: Explanation
    parts: dict[str, Record]
    #: Rms errors of the declared model and of the model with all effects, by the part.
    errors: dict[str, tuple[float, float]]
    seconds: float

    @property
    def false_names(self) -> list[str]:
        """Names that are not among the known effects. Autocorrelated noise is no statement on the plant."""
        allowed = {*self.benchmark.effects, "coloured-noise"}
        return [name for name in self.found.effects if name not in allowed]


def reproduce(
    benchmark: Benchmark,
    folder: Path | None = None,
    *,
    progress: Callable[[Progress], object] | None = None,
) -> Reproduction:
    """Explain the training part of a benchmark, and test the models on its other parts.

    Parameters
    ----------
    benchmark
        One of `gpi_hammerstein.reproduce.catalogue.BENCHMARKS`.
    folder
        The folder of its files. None takes the data folder, or downloads them.
    progress
        As in `explain`.

    Returns
    -------
    Reproduction
        The explanation, and the rms errors of simulation on each part. The error of the training part is that
        of the blocks of time that were held out; that of its horizons is over all of its samples
        (`Model.over_horizons`).

    Raises
    ------
    DataError
        The files are not found and cannot be downloaded.

    Examples
    --------
    >>> from gpi_hammerstein.reproduce.catalogue import BENCHMARKS
    >>> reproduce(BENCHMARKS["bouc-wen"]).found.effects  # doctest: +SKIP
    ['hysteretic-stiffness']
    """
    parts = benchmark.read(folder or local_folder(benchmark.folder))
    start = time.perf_counter()
    found = explain(parts[TRAINING], progress=progress)
    seconds = time.perf_counter() - start
    models = found.models[0], found.model
    held_out = found.before["holdout"]["rms"], found.after["holdout"]["rms"]
    errors = {TRAINING: (held_out[0] * benchmark.factor, held_out[1] * benchmark.factor)}
    if (horizon := benchmark.horizon) is not None:
        part = f"{TRAINING}, horizons of {horizon:g} s"
        before, after = (model.over_horizons(parts[TRAINING], horizon)["rms"] for model in models)
        errors[part] = (before * benchmark.factor, after * benchmark.factor)
    for name, record in parts.items():
        if name != TRAINING:
            before, after = (rms(model, record) * benchmark.factor for model in models)
            errors[name] = (before, after)
    return Reproduction(benchmark, found, parts, errors, seconds)


def rms(model: Model, record: Record) -> float:
    """Return the rms error of a simulation whose initial state is fitted to the first samples.

    Parameters
    ----------
    model
        The model; its offset is kept.
    record
        The record. Its warm-up is not scored.

    Returns
    -------
    float
        In the unit of the output.

    Examples
    --------
    >>> rms(model, record)  # doctest: +SKIP
    0.00023
    """
    result: dict[str, Any] = model.on_another_record(record)
    return float(result["error"]["rms"])
