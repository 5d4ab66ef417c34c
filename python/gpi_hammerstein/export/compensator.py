"""Export of compensators as source code for microcontrollers.

The source code contains the parameters of :meth:`Model.compensator`. It needs no heap and no library.
"""

import os
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from gpi_hammerstein._native import Compensator, Model
from gpi_hammerstein.escaping import in_c, in_rust
from gpi_hammerstein.export.numerals import Numerals, Precision, numerals_of_c, numerals_of_rust
from gpi_hammerstein.export.templates import filled, in_unit, maker, origin, require_identifier
from gpi_hammerstein.files import staged, write_atomically


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
    require_identifier(name)
    compensator = model.compensator(limits=limits)
    texts = sources_in_c(model, compensator, precision, name)
    with staged(folder) as place:
        for file, text in texts.items():
            (place / file).write_text(text, encoding="utf-8")
    return compensator


def sources_in_c(model: Model, compensator: Compensator, precision: Precision, name: str) -> dict[str, str]:
    """Return the names and the texts of the files in C."""
    numerals = numerals_of_c(precision)
    values = written_numbers(compensator, numerals)
    values |= {"real": numerals.real, "largest": numerals.largest, "name": name, "NAME": name.upper()}
    values |= described(model, compensator, " * ", in_c)
    used = {"creep"} if len(compensator.creep_rates) > 0 else set()
    return {f"{name}.{ending}": filled(f"compensator.{ending}", values, used) for ending in ("h", "c")}


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
    numerals = numerals_of_rust(precision)
    values = written_numbers(compensator, numerals) | {"real": numerals.real}
    values |= described(model, compensator, "//! ", in_rust)
    used = {"creep"} if len(compensator.creep_rates) > 0 else set()
    write_atomically(file, filled("compensator.rs", values, used))
    return compensator


def written_numbers(compensator: Compensator, numerals: Numerals) -> dict[str, str]:
    """Return all numbers of a template, each in the shortest form without loss of precision."""
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
        numerals.require(what, values, "compensator")
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
        | {key: numerals.listed(values) for key, values in arrays.items()}
        | {key: numerals.written(value) for key, value in scalars.items()}
        | {key: str(count) for key, count in counts.items()}
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
        *origin(model),
        f"Reference: {output_name}{in_unit(output_unit)}.",
        f"Drive: {input_name}{in_unit(input_unit)}, {between}.",
        f"Compensated: {', '.join(compensator.compensated)}.",
        *(f"Not compensated: {part}: {why}." for part, why in compensator.left),
        maker(),
    ]
    return {
        "title": f"Compensator: drive of {input_name} for a reference of {output_name}",
        "facts": "\n".join((begin + fact).rstrip() for fact in facts),
        "input_unit": in_unit(input_unit),
        "output_unit": in_unit(output_unit),
    }
