"""Whether two models have the same structure, so that their parameters can be compared."""

from collections.abc import Iterator

from gpi_hammerstein._native import DataError, Model
from gpi_hammerstein.difference.row import Difference, tested, untested
from gpi_hammerstein.summary import START, Parameter, parameters

# Relative difference below which two half-widths or thresholds are the same.
SAME = 1e-6


def require_same_channels(a: Model, b: Model) -> None:
    """Reject models of different channels, units or sampling rates.

    Parameters
    ----------
    a, b
        Two models.

    Raises
    ------
    DataError
        What differs, and what to do.
    """
    for what, ours, theirs in (
        ("inputs", a.input_units, b.input_units),
        ("outputs", a.output_units, b.output_units),
    ):
        if len(ours) != len(theirs):
            raise DataError(f"model A has {len(ours)} {what}, but model B has {len(theirs)}")
        for place, (first, second) in enumerate(zip(ours, theirs, strict=True)):
            if first and second and first != second:
                raise DataError(
                    f"the unit of {what[:-1]} {place} is {first} in model A, but {second} in model B; "
                    "identify both models in the same units"
                )
    if abs(a.rate - b.rate) > 1e-3 * a.rate:
        raise DataError(
            f"model A is sampled at {a.rate:g} Hz, but model B at {b.rate:g} Hz; identify both at one rate "
            "(--resample)"
        )


def structural_differences(a: Model, b: Model) -> Iterator[str]:
    """Yield why parameters of the same name do not mean the same in two models.

    Parameters
    ----------
    a, b
        Two models with the same channels.

    Yields
    ------
    str
        One reason; none for models with the same structure.
    """
    if (a.input_names, a.output_names) != (b.input_names, b.output_names):
        yield "other names of channels"
        return
    estimated = {one.name for one in _own(a)} & {one.name for one in _own(b)}
    for name, ours, theirs in zip(a.input_names, a.hysteresis, b.hysteresis, strict=True):
        if ours.envelope.reading != theirs.envelope.reading:
            yield f"deadzone conventions of {name}"
        for what, singular, first, second in (
            ("half_widths", "plays", ours.plays.half_widths, theirs.plays.half_widths),
            ("thresholds", "deadzones", ours.envelope.thresholds, theirs.envelope.thresholds),
        ):
            if len(first) != len(second):
                yield f"{len(first)} and {len(second)} {singular} of {name}"
            elif any(
                f"{name}.{what}[{place}]" not in estimated and abs(p - q) > SAME * max(abs(p), abs(q))
                for place, (p, q) in enumerate(zip(first, second, strict=True))
            ):
                yield f"{what.replace('_', '-')} of {name}"
    if a.linear.order != b.linear.order:
        yield f"orders {a.linear.order} and {b.linear.order} of G"
    effects = [sorted(effect["name"] for effect in model.effects) for model in (a, b)]
    if effects[0] != effects[1]:
        yield "effects " + " and ".join(", ".join(own) or "none" for own in effects)


def parameter_rows(a: Model, b: Model, *, is_tested: bool = True) -> list[Difference]:
    """Return the rows of the parameters of two models with the same structure.

    Parameters
    ----------
    a, b
        Two models.
    is_tested
        Whether the standard deviations are those of the truth, so that rows are tested.

    Returns
    -------
    list of Difference
        Those that both models have, without offsets, initial states and effects. Several sections of G may
        have another order in each model; they are left out, because the resonances show them.
    """
    theirs = {one.name: one for one in _own(b)}
    pairs = [(one, theirs[one.name]) for one in _own(a) if one.name in theirs]
    rows = [
        untested(p.name, "parameter", p.unit or q.unit, (p.value, q.value), (p.std, q.std)) for p, q in pairs
    ]
    return [tested(row) for row in rows] if is_tested else rows


def _own(model: Model) -> list[Parameter]:
    offsets = {f"offset.{name}" for name in model.output_names}
    others = (START, "offset[", *(f"{effect['name']}." for effect in model.effects))
    found = [one for one in parameters(model) if one.name not in offsets and not one.name.startswith(others)]
    if any(one.name.startswith("section[1]") for one in found):
        return [one for one in found if not one.name.startswith("section[")]
    return found
