"""The difference of the simulated outputs of two models."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Model, Record, decaying_triangle
from gpi_hammerstein.compared import compare as simulated_beside
from gpi_hammerstein.difference.neighbours import Neighbours
from gpi_hammerstein.stage import Range

Array = NDArray[np.float64]

# The drive without a record: a triangle of this many samples and periods.
SAMPLES, PERIODS = 4000, 8
# How much larger the misfit is on data that the fit has not seen, as in the expected error of `compensate`.
UNSEEN = 2.0


@dataclass(frozen=True)
class SimulatedDifference:
    """The difference of the simulated outputs of two models for the same input.

    Parameters
    ----------
    drive
        ``record``, or ``triangle``: a decaying triangle over the range of each input.
    error_a, error_b
        The error of each model on the record, as `Model.error` returns it: ``rms`` and ``max`` in the
        output's unit, ``nrmse``, ``fit_percent``; None without a record.
    rule
        How the errors were counted, in words; None without a record.
    rms
        The root mean square difference of the simulated outputs over all outputs, in the output's unit.
    movement
        The root mean square movement of the outputs of model A about their means, in the output's unit.
    expected_rms
        The root mean square difference to be expected if both are models of the same stage, from the
        uncertainty of both, in the output's unit; None if it is not known.
    explained
        The part of the squares of the difference that this explains, ``min(1, expected_rms^2 / rms^2)``, a
        pure number; None if it is not known.
    unit
        The unit of the outputs; empty if it is not known or not the same for all.

    Examples
    --------
    >>> bank = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> noise = 0.01 * np.random.default_rng(1).normal(size=(2, 2000))
    >>> records = [gpi.Record(u, bank(u) + own, 1000.0) for own in noise]
    >>> a, b = (gpi.identify(own, delay=0, half_widths=[0.0, 1.0], thresholds=0) for own in records)
    >>> found = gpi.compare(a, b, records[0]).simulation
    >>> found.drive, found.rms < 0.002, found.explained > 0.2
    ('record', True, True)
    """

    drive: Literal["record", "triangle"]
    error_a: Mapping[str, float] | None
    error_b: Mapping[str, float] | None
    rule: str | None
    rms: float
    movement: float
    expected_rms: float | None
    explained: float | None
    unit: str


def on_record(
    a: Neighbours,
    b: Neighbours,
    models: tuple[Model, Model],
    record: Record,
    *,
    fit_start: bool,
    remove_mean: bool,
) -> SimulatedDifference:
    """Return the difference on a record, with the error of each model by the rule of all commands.

    Parameters
    ----------
    a, b
        The models.
    models
        The same models, with the effects that depend only on time.
    record
        A record of the same channels.
    fit_start, remove_mean
        As in `Model.on_another_record`.

    Returns
    -------
    SimulatedDifference
        The difference.
    """
    first, second = (
        simulated_beside(model, record, fit_start=fit_start, remove_mean=remove_mean) for model in models
    )

    def scored(outputs: list[Array]) -> Array:
        pieces = [own[warmup:] for own, warmup in zip(outputs, record.warmup, strict=True)]
        return np.concatenate([own - own.mean(axis=0) if remove_mean else own for own in pieces])

    def outputs(model: Model) -> Array:
        return scored(model.simulate(record))

    pair = scored(first.simulated), scored(second.simulated)
    return _difference(
        (a, b), pair, outputs, drive="record", errors=(first.error, second.error), rule=first.rule
    )


def on_triangle(a: Neighbours, b: Neighbours, ranges: Sequence[Range]) -> SimulatedDifference:
    """Return the difference for a decaying triangle at each input, while the others rest at their middle.

    Parameters
    ----------
    a, b
        The models.
    ranges
        The range of each input.

    Returns
    -------
    SimulatedDifference
        The difference.
    """
    rate = a.model.rate
    middle = np.array([0.5 * (low + high) for low, high in ranges])
    drives = []
    for place, own in enumerate(ranges):
        u = np.tile(middle, (SAMPLES, 1))
        u[:, place] = decaying_triangle(SAMPLES, rate, rate * PERIODS / SAMPLES, own)
        drives.append(u)

    def outputs(model: Model) -> Array:
        effects = json.loads(model.to_json()).get("effects", [])
        # a measured column that is not there counts as zero
        others = np.zeros((SAMPLES, 1 + max((effect.get("column", -1) for effect in effects), default=-1)))
        found = [model.simulate(u, covariates=others if others.shape[1] else None) for u in drives]
        return np.concatenate([own.reshape(SAMPLES, -1) for own in found])

    return _difference((a, b), (outputs(a.model), outputs(b.model)), outputs, drive="triangle")


def _difference(
    models: tuple[Neighbours, Neighbours],
    pair: tuple[Array, Array],
    outputs: Callable[[Model], Array],
    *,
    drive: Literal["record", "triangle"],
    errors: tuple[Mapping[str, float] | None, Mapping[str, float] | None] = (None, None),
    rule: str | None = None,
) -> SimulatedDifference:
    rms = float(np.sqrt(np.mean((pair[1] - pair[0]) ** 2)))
    variances = [_variance(own, y, outputs) for own, y in zip(models, pair, strict=True)]
    expected = explained = None
    if variances[0] is not None and variances[1] is not None:
        expected = float(np.sqrt(variances[0] + variances[1]))
        explained = min(1.0, (expected / rms) ** 2) if rms > 0 else 1.0
    units = set(models[0].model.output_units)
    return SimulatedDifference(
        drive=drive,
        error_a=errors[0],
        error_b=errors[1],
        rule=rule,
        rms=rms,
        movement=float(np.sqrt(np.mean((pair[0] - pair[0].mean(axis=0)) ** 2))),
        expected_rms=expected,
        explained=explained,
        unit=units.pop() if len(units) == 1 else "",
    )


def _variance(own: Neighbours, y: Array, outputs: Callable[[Model], Array]) -> float | None:
    """Return the mean variance of the simulated outputs, by the parameters and by the misfit."""
    deviation = own.deviation(outputs) if own.is_complete else None
    if deviation is None:
        return None
    misfit = UNSEEN * own.misfit * y.std(axis=0) / own.movement
    return float(np.mean(deviation**2) + np.mean(misfit**2))
