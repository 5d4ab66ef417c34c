"""The comparison of two models: which values differ beyond their uncertainty."""

import os
from collections.abc import Iterator, Sequence

from gpi_hammerstein._native import GpiError, Model, Record
from gpi_hammerstein.difference.effects import effect_rows
from gpi_hammerstein.difference.figures import Figure, Figures, figures_of
from gpi_hammerstein.difference.models import ModelDifferences
from gpi_hammerstein.difference.neighbours import Neighbours
from gpi_hammerstein.difference.pairs import nearest_pairs
from gpi_hammerstein.difference.ranges import common_ranges, is_linear
from gpi_hammerstein.difference.row import Difference, decided, tested, untested
from gpi_hammerstein.difference.simulation import SimulatedDifference, on_record, on_triangle
from gpi_hammerstein.difference.structure import (
    parameter_rows,
    require_same_channels,
    structural_differences,
)
from gpi_hammerstein.files import load_model
from gpi_hammerstein.io import read_record
from gpi_hammerstein.stage import Range, input_ranges


def compare(
    a: Model | str | os.PathLike[str],
    b: Model | str | os.PathLike[str],
    record: Record | str | os.PathLike[str] | None = None,
    *,
    fit_start: bool = True,
    remove_mean: bool = False,
) -> ModelDifferences:
    """Return which values of two models differ beyond their uncertainty.

    Three groups of values are compared: figures of the stage (sensitivity and width of the hysteresis in slow
    motion, bandwidth, resonances, offset), the quantities of the effects, and, if both models have the same
    structure, their parameters. Models of different structure can describe the same motion; then only figures
    and effects are compared. The figures do not contain the effects.

    The models are independent estimates, so that a difference has the variance of both values::

        z = (b - a) / sqrt(std_a^2 + std_b^2),   p = P(|N(0, 1)| > |z|)

    The standard deviation of a figure follows from the covariance of the numbers of its model. That of
    sensitivity, hysteresis width and offset also contains what the structure of the model leaves of its
    training data. It is not known for a figure of parameters that the data do not determine. Values differ if
    p is small enough by the procedure of Holm over all rows: the probability that any value of two equal
    stages is named is at most 5 %. A value without a standard deviation is not tested.

    Parameters
    ----------
    a, b
        Models, or the files of models.
    record
        A record of the same channels, or its file. It defines the range of the inputs, and the outputs of
        both models are compared on it. Without a record, half-widths and thresholds of the models define the
        range, and a decaying triangle over this range is simulated.
    fit_start, remove_mean
        How the error on the record is counted, as in `Model.on_another_record`.

    Returns
    -------
    ModelDifferences
        The rows, and the difference of the simulated outputs. ``print`` shows it as a table.

    Raises
    ------
    DataError
        A file is no model, or the models have other numbers of channels, units or sampling rates.
    ParameterError
        The record has another sampling rate than the models.

    Examples
    --------
    The second stage has lost 2 % of its sensitivity:

    >>> bank = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> noise = 0.01 * np.random.default_rng(1).normal(size=(2, 2000))
    >>> old, new = gpi.Record(u, bank(u) + noise[0], 1000.0), gpi.Record(u, 0.98 * bank(u) + noise[1], 1000.0)
    >>> a, b = (gpi.identify(own, delay=0, half_widths=[0.0, 1.0], thresholds=0) for own in (old, new))
    >>> [row.name for row in gpi.compare(a, b).rows if row.differs and row.group == "figure"]
    ['sensitivity[u -> y]']
    """
    first, second = (own if isinstance(own, Model) else load_model(own) for own in (a, b))
    names = tuple(label if isinstance(own, Model) else os.fspath(own) for own, label in ((a, "A"), (b, "B")))
    require_same_channels(first, second)
    if record is not None and not isinstance(record, Record):
        record = read_record(record)
    pair = Neighbours(first), Neighbours(second, like=first)
    if record is None:
        ranges = common_ranges(first, second)
    else:
        ranges = [own if own[0] < own[1] else None for own in input_ranges(record)]
    figures = [figures_of(own, _with_any(ranges, first, second)) for own in pair]
    rows, only = _of_figures(*figures)
    is_tested = not any(own.is_biased for own in pair)
    of_effects, effects_only, notes = effect_rows(first, second, is_tested=is_tested)
    other_structure = tuple(structural_differences(first, second))
    rows += of_effects
    rows += [] if other_structure else parameter_rows(first, second, is_tested=is_tested)
    if record is not None:
        simulation: SimulatedDifference | None = on_record(
            *pair, (first, second), record, fit_start=fit_start, remove_mean=remove_mean
        )
    else:
        simulation, problem = _without_record(*pair, ranges)
        notes += problem
    notes += _notes(pair, names, ranges, effects_only)
    return ModelDifferences(
        names=(names[0], names[1]),
        rows=tuple(decided(rows)),
        other_structure=other_structure,
        only_a=tuple(only["a"] + effects_only["a"]),
        only_b=tuple(only["b"] + effects_only["b"]),
        ranges=tuple(zip(first.input_names, ranges, strict=True)),
        simulation=simulation,
        notes=tuple(notes),
    )


def _with_any(ranges: Sequence[Range | None], a: Model, b: Model) -> list[Range | None]:
    """Return the ranges, with any range where both hystereses are gains: their loops do not depend on it."""
    pairs = zip(a.hysteresis, b.hysteresis, strict=True)
    gains = [all(map(is_linear, pair)) for pair in pairs]
    return [
        (0.0, 1.0) if own is None and is_gain else own for own, is_gain in zip(ranges, gains, strict=True)
    ]


def _of_figures(a: Figures, b: Figures) -> tuple[list[Difference], dict[str, list[str]]]:
    """Return the rows of the figures, and the resonances that only one model has."""
    ours, theirs = ({one.name: one for one in own.plain} for own in (a, b))
    rows = [_row(name, ours[name], theirs[name]) for name in ours if name in theirs]
    only: dict[str, list[str]] = {"a": [], "b": []}
    frequencies = [[own[0].value for own in figures.resonances] for figures in (a, b)]
    for number, (i, j) in enumerate(nearest_pairs(*frequencies)):
        first, second = None if i is None else a.resonances[i], None if j is None else b.resonances[j]
        for place, what in enumerate(("frequency", "damping")):
            pair = (None if own is None else own[place] for own in (first, second))
            rows.append(_row(f"resonance[{number}].{what}", *pair))
        alone = (first or second) if first is None or second is None else None
        if alone is not None:
            label = f"resonance[{number}] at {alone[0].value:.4g} Hz"
            only["b" if first is None else "a"].append(label)
    return rows, only


def _row(name: str, a: Figure | None, b: Figure | None) -> Difference:
    unit = next(own.unit for own in (a, b) if own is not None)
    values = (None if a is None else a.value, None if b is None else b.value)
    stds = (None if a is None else a.std, None if b is None else b.std)
    return tested(untested(name, "figure", unit, values, stds))


def _without_record(
    a: Neighbours, b: Neighbours, ranges: Sequence[Range | None]
) -> tuple[SimulatedDifference | None, list[str]]:
    """Return the difference for a triangle, or why there is none."""
    known = [own for own in ranges if own is not None]
    if len(known) < len(ranges):
        return None, ["The outputs were not simulated, because the models show no range of the inputs."]
    try:
        return on_triangle(a, b, known), []
    except GpiError as error:
        return None, [f"The outputs were not simulated: {error}."]


def _notes(
    pair: Sequence[Neighbours],
    names: Sequence[str],
    ranges: Sequence[Range | None],
    effects_only: dict[str, list[str]],
) -> Iterator[str]:
    """Yield what a reader of the rows must know."""
    for own, name in zip(pair, names, strict=True):
        if not own.is_known:
            yield (
                f"{name} contains no standard deviations, so that its figures cannot be tested: `gpi "
                "identify` and `gpi explain` write them."
            )
        elif own.is_biased:
            sizes = ", ".join(f"{one:.3g}" for one in own.misfit)
            yield (
                f"Most of what {name} leaves of its training data is not white noise ({sizes} rms). How much "
                "this changes dynamics, effects and parameters is not known, so that they are not tested. "
                "`gpi validate` shows what is left."
            )
    if any(effects_only.values()):
        yield (
            "The figures do not contain the effects. If an effect is in one model only, the other model may "
            "describe a part of it by its figures."
        )
    if None in ranges and not all(is_linear(own) for one in pair for own in one.model.hysteresis):
        yield "Sensitivity and hysteresis width were not compared for every input: give a record."
