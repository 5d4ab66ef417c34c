"""Export of compensators as source code for microcontrollers.

The source code contains the parameters of :meth:`Model.compensator`. It needs no heap and no library.
"""

import hashlib
import os
import re
from collections.abc import Callable
from importlib.resources import files as resources
from string import Template
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gpi_hammerstein._native import Compensator, Model, ParameterError, __version__
from gpi_hammerstein.escaping import in_c, in_rust
from gpi_hammerstein.files import staged, write_atomically

__all__ = ["export_c", "export_rust"]

Precision = Literal["single", "double"]


def export_c(
    model: Model,
    folder: str | os.PathLike[str],
    *,
    limits: tuple[float, float] | None = None,
    precision: Precision = "single",
    name: str = "gpi_compensator",
) -> Compensator:
    """Write a compensator in C99: ``NAME.h`` and ``NAME.c``.

    Parameters
    ----------
    model
        A model of one input and one output.
    folder
        The folder of the two files. It is created if it does not exist.
    limits
        Lowest and highest drive, in the input's unit.
    precision
        ``"single"`` for `float`, ``"double"`` for `double`.
    name
        Prefix of the names of files, types and functions. It allows several compensators in one program.

    Returns
    -------
    Compensator
        The compensator that the code implements.

    Raises
    ------
    ParameterError
        The limits leave no range, the hysteresis has no inverse, the precision is too low for a parameter,
        the name is not a valid C identifier, or the folder cannot be written.
    DataError
        The model has several inputs or outputs.

    Examples
    --------
    >>> import os, tempfile
    >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
    >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
    >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
    >>> folder = tempfile.mkdtemp()
    >>> compensator = gpi.export_c(model, folder, limits=(0.0, 10.0))
    >>> sorted(os.listdir(folder))
    ['gpi_compensator.c', 'gpi_compensator.h']
    """
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise ParameterError(f"`name` = {name}: must contain only letters, digits and `_`, such as x_axis")
    compensator = model.compensator(limits=limits)
    real, largest, suffix = ("float", "FLT_MAX", "f") if precision == "single" else ("double", "DBL_MAX", "")
    numbers = written_numbers(compensator, precision, largest, suffix)
    numbers |= {"real": real, "largest": largest, "name": name, "NAME": name.upper()}
    numbers |= described(model, compensator, " * ", in_c)
    with staged(folder) as place:
        for ending in ("h", "c"):
            (place / f"{name}.{ending}").write_text(
                filled(f"compensator.{ending}", compensator, numbers), encoding="utf-8"
            )
    return compensator


def export_rust(
    model: Model,
    file: str | os.PathLike[str],
    *,
    limits: tuple[float, float] | None = None,
    precision: Precision = "single",
) -> Compensator:
    """Write a compensator in Rust: one module without dependencies, which compiles with and without `std`.

    Parameters
    ----------
    model
        A model of one input and one output.
    file
        The file, for example ``src/compensator.rs``.
    limits
        Lowest and highest drive, in the input's unit.
    precision
        ``"single"`` for `f32`, ``"double"`` for `f64`.

    Returns
    -------
    Compensator
        The compensator that the code implements.

    Raises
    ------
    ParameterError
        The limits leave no range, the hysteresis has no inverse, the precision is too low for a parameter, or
        the file cannot be written.
    DataError
        The model has several inputs or outputs.

    Examples
    --------
    >>> gpi.export_rust(model, "src/compensator.rs", precision="double")  # doctest: +SKIP
    """
    compensator = model.compensator(limits=limits)
    real = "f32" if precision == "single" else "f64"
    numbers = written_numbers(compensator, precision, "Real::INFINITY", "") | {"real": real}
    numbers |= described(model, compensator, "//! ", in_rust)
    write_atomically(file, filled("compensator.rs", compensator, numbers))
    return compensator


def written_numbers(
    compensator: Compensator, precision: Precision, infinity: str, suffix: str
) -> dict[str, str]:
    """Return all numbers of a template, each in the shortest form without loss of precision."""
    if precision not in ("single", "double"):
        raise ParameterError(f"`precision` = {precision}: must be single or double")
    number = np.float32 if precision == "single" else np.float64

    def written(value: float) -> str:
        with np.errstate(over="ignore"):
            rounded = number(value)
        if np.isinf(rounded):
            return f"-{infinity}" if rounded < 0 else infinity
        text = str(rounded)
        return (text if "." in text or "e" in text else f"{text}.0") + suffix

    def listed(values: np.ndarray) -> str:
        lines = [", ".join(written(value) for value in values[i : i + 6]) for i in range(0, len(values), 6)]
        return ",\n    ".join(lines) if len(lines) < 2 else "\n    " + ",\n    ".join(lines) + ",\n"

    inverse = compensator.hysteresis
    plays = inverse.plays
    knots, heights, slopes = inverse.curve
    arrays = {
        "lag_rates": compensator.creep_rates,
        "lag_gains": compensator.creep_gains,
        "half_widths": plays.half_widths,
        "weights": plays.weights,
        "knots": knots,
        "heights": heights,
        "slopes": slopes,
    }
    standing_gain = float(sum(compensator.creep_gains, start=compensator.gain))
    lowest_v, highest_v = compensator.range
    safe_below, safe_above = inverse.safe
    finite: dict[str, ArrayLike] = {
        **arrays,
        "gain": compensator.gain,
        "standing_gain": standing_gain,
        "offset": compensator.offset,
        "range": compensator.range,
        # the largest sum and the largest drive within this range
        "sum": np.sum(np.abs(plays.weights)) * np.array(compensator.range),
        "drive": np.max(np.abs(slopes)) * np.sum(np.abs(plays.weights)) * np.array(compensator.range),
    }
    for what, values in finite.items():
        require_written(what, values, number)
    rates = compensator.creep_rates
    coupling = float(np.sum(rates * np.abs(compensator.creep_gains / compensator.gain)))
    recovery = (highest_v - lowest_v) * coupling
    edges = [compensator.offset + standing_gain * v for v in (lowest_v, highest_v)]
    pairs = {
        ("lowest_v", "highest_v"): (lowest_v, highest_v),
        ("usual_below", "usual_above"): (max(lowest_v, safe_below), min(highest_v, safe_above)),
        ("lowest_drive", "highest_drive"): inverse.limits,
        ("lowest", "highest"): inverse.reach,
        ("safe_below", "safe_above"): inverse.safe,
    }
    scalars = {
        "offset": compensator.offset,
        "gain": compensator.gain,
        "standing_gain": standing_gain,
    }
    for names, values in pairs.items():
        scalars |= dict(zip(names, values, strict=True))
    counts = {"plays": len(plays.weights), "knot_count": len(knots), "lags": len(compensator.creep_rates)}
    said = {
        "v_range": f"{lowest_v:g} .. {highest_v:g}",
        "widest": f"{2 * max(plays.half_widths):g}",
        "rest": f"{compensator.offset:g}",
        "lowest_reference": f"{min(edges):g}",
        "highest_reference": f"{max(edges):g}",
        "recovery": f"{recovery:.3g}",
        "decay": f"{1 - min(rates, default=0.0):.9g}",
    }
    return (
        said
        | {key: listed(values) for key, values in arrays.items()}
        | {key: written(value) for key, value in scalars.items()}
        | {key: str(count) for key, count in counts.items()}
    )


def require_written(name: str, values: ArrayLike, number: type[np.floating[Any]]) -> None:
    """Reject a parameter that becomes infinite in this precision, and a gain whose reciprocal does."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = np.asarray(values, dtype=np.float64).astype(number)
    if not np.isfinite(rounded).all() or (
        name.endswith("gain") and not np.all(np.abs(rounded) > np.finfo(number).tiny)
    ):
        precision = "single" if number is np.float32 else "double"
        raise ParameterError(
            f"`precision` = {precision}: `{name}` of the compensator is not a normal number in it; "
            "use double precision or other units"
        )


def described(
    model: Model, compensator: Compensator, begin: str, escaped: Callable[[str], str]
) -> dict[str, str]:
    """Return the title, the properties of the model as comments, and the units."""
    input_unit, output_unit = model.input_units[0], model.output_units[0]
    input_unit, output_unit = escaped(input_unit), escaped(output_unit)
    input_name, output_name = escaped(model.input_names[0]), escaped(model.output_names[0])
    low, high = compensator.hysteresis.limits
    between = "without limits" if np.isinf([low, high]).all() else f"from {low:g} to {high:g} {input_unit}"
    facts = [
        f"Model: SHA-256 {hashlib.sha256(model.to_json().encode()).hexdigest()} of its file.",
        f"Rate: {model.rate:g} samples a second.",
        f"Reference: {output_name}{in_unit(output_unit)}.",
        f"Drive: {input_name}{in_unit(input_unit)}, {between}.",
        f"Compensated: {', '.join(compensator.compensated)}.",
        *(f"Not compensated: {part}: {why}." for part, why in compensator.left),
        f"Made by gpi-hammerstein {__version__}, `gpi export`.",
    ]
    return {
        "title": f"Compensator: drive of {input_name} for a reference of {output_name}",
        "facts": "\n".join((begin + fact).rstrip() for fact in facts),
        "input_unit": in_unit(input_unit),
        "output_unit": in_unit(output_unit),
    }


def in_unit(unit: str) -> str:
    """Return a unit as a part of a sentence."""
    return f" in {unit}" if unit else ""


def filled(template: str, compensator: Compensator, values: dict[str, str]) -> str:
    """Return a template with its values. Lines from `@creep` to `@else` or `@end` are used only for creep."""
    creeps = len(compensator.creep_rates) > 0
    lines, wanted = [], True
    text = resources("gpi_hammerstein.export").joinpath("templates", template).read_text(encoding="utf-8")
    for line in text.splitlines(keepends=True):
        mark = line.strip()
        if mark in ("@creep", "@else", "@end"):
            wanted = {"@creep": creeps, "@else": not creeps, "@end": True}[mark]
        elif wanted:
            lines.append(line)
    return Template("".join(lines)).substitute(values)
