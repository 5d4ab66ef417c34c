"""A model as text: its parameters with their standard deviations, as a table."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gpi_hammerstein._native import Model
from gpi_hammerstein.stage import natural
from gpi_hammerstein.uncertain import BAND, NOT_DETERMINED

__all__ = ["Parameter", "Summary", "parameters", "summary"]

WIDTH = 78
# What a parameter of the state at the start of an experiment begins with. It says nothing about the stage.
START = "start["


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model.

    Parameters
    ----------
    name
        Such as ``u.weights[0]``; that of an effect begins with the name of the effect.
    value
        The estimate, in ``unit``.
    std
        The standard deviation, in ``unit``: 0 for a value at its bound, None if it is unknown or the data do
        not determine the parameter.
    unit
        The unit; empty for a pure number or if it is unknown.
    determined
        Whether the data determine the parameter, as in `Refinement.parameters`.

    Examples
    --------
    >>> gpi.Parameter("u.weights[0]", 1.25, 0.02, "um/V", True).std
    0.02
    """

    name: str
    value: float
    std: float | None
    unit: str
    determined: bool


class Summary(str):
    r"""A text that Python and notebooks show as it is printed.

    Examples
    --------
    >>> gpi.Summary("two\nlines")
    two
    lines
    """

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the text itself."""
        return str(self)


def parameters(model: Model) -> list[Parameter]:
    """Return the parameters of a model: those of its refinement or its blocks, and those of its effects.

    Parameters
    ----------
    model
        A model.

    Returns
    -------
    list of Parameter
        The parameters, in the order of the signal chain; those of effects are in the units of an engineer.
    """
    effects = [
        Parameter(f"{effect['name']}.{row['name']}", row["value"], row["std"], row["unit"], row["determined"])
        for effect in model.effects
        for row in effect["parameters"]
    ]
    if model.refinement is None:
        return [*of_blocks(model), *effects]
    # the refinement has the values of an effect without the names and units that an engineer reads
    names = tuple(f"{effect['name']}." for effect in model.effects)
    own = [row for row in model.refinement.parameters if not row["name"].startswith(names or ("\0",))]
    return [*(Parameter(**row) for row in own), *effects]


def of_blocks(model: Model) -> Iterator[Parameter]:
    """Yield the parameters of a model without a refinement, whose standard deviations are unknown."""
    for name, unit, own in zip(model.input_names, model.input_units, model.hysteresis, strict=True):
        groups = [
            ("half_widths", unit, own.plays.half_widths),
            ("weights", "", own.plays.weights),
            ("thresholds", unit, own.envelope.thresholds),
            ("deadzone_weights", "", own.envelope.weights),
        ]
        for group, its, values in groups:
            for index, value in enumerate(values):
                yield Parameter(f"{name}.{group}[{index}]", float(value), None, its, True)
    for name, unit, value in zip(model.output_names, model.output_units, model.offsets, strict=True):
        yield Parameter(f"offset.{name}", float(value), None, unit, True)


def summary(model: Model) -> Summary:
    """Return a model as a text table.

    Parameters
    ----------
    model
        A model.

    Returns
    -------
    Summary
        The structure and the fit, all parameters of the stage with standard deviations and 95 % intervals,
        the poles of G, and the parameters that the data do not determine.
    """
    lines = ["=" * WIDTH, f"{'Hammerstein model with hysteresis':^{WIDTH}}".rstrip(), "=" * WIDTH]
    lines += pairs(facts(model))
    own = [one for one in parameters(model) if not one.name.startswith(START)]
    lines += ["-" * WIDTH, *table(own), *poles(model), "=" * WIDTH]
    lines += notes(model)
    return Summary("\n".join(lines))


def facts(model: Model) -> list[tuple[str, str]]:
    """Return the structure of a model and the quality of its fit, as names and texts."""

    def labels(names: Sequence[str], units: Sequence[str]) -> str:
        return ", ".join(f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True))

    counts = "; ".join(
        f"{len(own.plays.weights)} plays, {len(own.envelope.weights)} deadzones" for own in model.hysteresis
    )
    found = [
        ("Input", labels(model.input_names, model.input_units)),
        ("Output", labels(model.output_names, model.output_units)),
        ("Rate", f"{model.rate:.6g} Hz"),
        ("Hysteresis", counts),
        ("Order of G", str(model.linear.order)),
        ("Effects", ", ".join(effect["name"] for effect in model.effects) or "none"),
    ]
    refinement = model.refinement
    if refinement is not None:
        floor = refinement.noise_floor
        found += [
            ("Refinement", refinement.status),
            ("Residual rms", ", ".join(f"{rms:.4g}" for rms in refinement.residual_rms)),
            ("Noise floor rms", ", ".join(f"{rms:.4g}" for rms in floor["rms"])),
            ("Outliers", str(refinement.outliers)),
        ]
    return found


def pairs(found: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield names and texts in two columns, or in one where a text is long."""
    half = WIDTH // 2
    cells = [f"{name + ':':<17}{text}" for name, text in found]
    left = ""
    for cell in cells:
        if left and len(cell) < half:
            yield f"{left:<{half}}{cell}".rstrip()
            left = ""
        elif left:
            yield left
            left = cell
        else:
            left = cell
        if len(left) >= half - 1:
            yield left
            left = ""
    if left:
        yield left


def table(own: Iterable[Parameter]) -> Iterator[str]:
    """Yield one line for each parameter: value, standard deviation, 95 % interval."""
    yield f"{'':<26}{'value':>12}{'std':>11}{'[0.025':>11}{'0.975]':>11}  unit"
    yield "-" * WIDTH
    for one in own:
        row = f"{one.name:<26}{one.value:>12.5g}"
        if one.std is None:
            row += f"{'-':>11}{'':>22}"
        else:
            low, high = one.value - BAND * one.std, one.value + BAND * one.std
            row += f"{one.std:>11.2g}{low:>11.5g}{high:>11.5g}"
        row += f"  {one.unit}"
        yield row.rstrip() + ("" if one.determined else f"  {NOT_DETERMINED}")


def poles(model: Model) -> Iterator[str]:
    """Yield one line for each pole of G, or pair of poles."""
    known = [pole for pole in model.linear.poles if pole.imag >= 0 and pole != 0]
    if not known:
        return
    yield "-" * WIDTH
    yield f"{'poles of G':<26}{'frequency':>12}{'damping':>11}{'time const.':>13}"
    yield "-" * WIDTH
    for pole in sorted(known, key=lambda pole: -abs(pole)):
        name = f"{pole.real:.5g}" + (f" ± {pole.imag:.5g}i" if pole.imag else "")
        if pole.imag:
            frequency, damping = natural(pole, model.rate)
            yield f"{name:<26}{frequency:>9.5g} Hz{damping:>11.3g}"
        elif 0 < pole.real < 1:
            constant = f"{-1 / (model.rate * np.log(pole.real)):.4g} s"
            yield f"{name:<26}{'':>12}{'':>11}{constant:>13}"
        else:
            yield name  # an integrator, or an alternating term


def notes(model: Model) -> Iterator[str]:
    """Yield what a reader of the table must know."""
    if model.refinement is None:
        yield "The standard deviations are unknown: gpi.refine(model, record) computes them."
        return
    yield "The intervals are 95 % intervals if the errors have a normal distribution."
    together = [names for names in model.refinement.undetermined if len(names) > 1]
    if together:
        count = len(together)
        yield f"The data do not determine {count} combinations of parameters (refinement.undetermined)."
