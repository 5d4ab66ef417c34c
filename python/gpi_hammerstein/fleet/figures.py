"""The figures of a table: one number for each record, with its standard deviation where the table has it.

Positive figures are compared on a logarithmic scale, because their spread is a part of their size: the
resonances of a fleet differ by some percent. A figure of which more than `MIXED` of the values do not have
the sign of the median, such as the coefficient of a sensor curve, is compared on a linear scale.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from gpi_hammerstein.escaping import visible
from gpi_hammerstein.fleet.robust import Array

MIXED = 0.05
"""Largest share of values without the sign of the median on a logarithmic scale; they count as `LEAST`."""
LEAST = 1e-3
"""Smallest value on a logarithmic scale over the median."""
NOISE_LIKE = ("outliers", "coloured-noise")
"""Effects of the measurement: cable, electronics, sampling rate. They say little about the device."""
LARGEST = 1e100
"""Larger numbers are no measured figures and are unknown; smaller ones than its inverse count as zero."""
MOST_SIZES = 24
"""Largest number of figures that are sizes of effects: those that most records have."""
# A parameter that is the value of a curve at a time.
_AT_TIME = re.compile(r"(.*)\[[\d.]+ s\]")


@dataclass(frozen=True)
class Figure:
    """One figure of all records.

    Attributes
    ----------
    key, label, unit
        Its name in the table, its name in sentences, and its unit.
    values, std
        Values and standard deviations, shape (records,), in `unit`; NaN is unknown.
    upward
        Whether only large values stand out: a small error is no defect.
    joint
        Whether it describes the device, so that it takes part in the joint distance.
    judged
        Whether a device can stand out by it.
    effect
        The effect of which it is a size, else empty.
    """

    key: str
    label: str
    unit: str
    values: Array
    std: Array
    upward: bool = False
    joint: bool = True
    judged: bool = True
    effect: str = ""


def figures(table: pl.DataFrame) -> tuple[list[Figure], list[str]]:
    """Return the figures of a table.

    Parameters
    ----------
    table
        The columns of `gpi-fleet/1`.

    Returns
    -------
    list of Figure
        Errors over the noise, noise, resonance, damping, sensitivity, width of the hysteresis loop, sizes of
        effects.
    list of str
        Notes on what cannot be compared.
    """
    known = (table["error"].is_null() & table["verdict"].is_not_null()).to_numpy()
    units = Counter(unit or "" for unit, one in zip(table["unit"], known, strict=True) if one)
    unit = units.most_common(1)[0][0] if units else ""
    same = np.array([(one or "") == unit for one in table["unit"]], dtype=bool)
    notes = []
    if len(units) > 1:
        notes.append(
            f"{int((known & ~same).sum())} records have another unit than {visible(unit) or 'none'}; their "
            "noise, sensitivity and sizes of effects are not compared"
        )

    def number(name: str, *, least: float = -np.inf, of_unit: bool = False) -> Array:
        values = plausible(table[name].cast(pl.Float64).fill_null(np.nan).to_numpy().astype(np.float64))
        usable = known & np.isfinite(values) & (values > least)
        return np.where(usable & same if of_unit else usable, values, np.nan)

    noise = number("noise_floor", least=0.0)
    exact = np.zeros(len(table))
    shown = visible(unit)
    with np.errstate(over="ignore"):
        ratios = [
            np.where(np.isinf(own := number(name) / noise), np.nan, own)
            for name in ("rms_before", "rms_after")
        ]
    error: dict[str, Any] = {"upward": True, "joint": False}
    found = [
        Figure(
            "rms_before_over_noise", "error over noise of the declared model", "", ratios[0], exact, **error
        ),
        Figure("rms_after_over_noise", "error over noise", "", ratios[1], exact, **error),
        Figure("noise_floor", "noise", shown, np.where(same, noise, np.nan), exact, **error),
        Figure("resonance_hz", "resonance", "Hz", number("resonance_hz"), exact),
        Figure("damping", "damping", "", number("damping"), exact),
        Figure("sensitivity", "sensitivity", "", number("sensitivity", of_unit=True), exact),
        Figure("hysteresis_width", "hysteresis width", "", number("hysteresis_width"), exact),
    ]
    return [one for one in found if np.isfinite(one.values).any()] + sizes(table, known & same), notes


def plausible(values: Array) -> Array:
    """Return numbers with which one can calculate: NaN for those that are too large, 0 for those too small.

    Parameters
    ----------
    values
        Any numbers.

    Returns
    -------
    ndarray
        Of the same shape.

    Examples
    --------
    >>> plausible(np.array([1e300, 1e-300, -2.0, np.inf])).tolist()
    [nan, 0.0, -2.0, nan]
    """
    size = np.abs(values)
    return np.where(size <= LARGEST, np.where(size < 1 / LARGEST, 0.0, values), np.nan)


def sizes(table: pl.DataFrame, usable: Array) -> list[Figure]:
    """Return the sizes of effects as figures, those of most records first.

    Parameters of effects that have the same names are compared: the gains of two creep terms are another
    figure than the gain of one. Angles have no order and are left out. Of a curve over time, the largest
    value counts.

    Parameters
    ----------
    table
        The column ``sizes`` of `gpi-fleet/1`.
    usable
        Which records are compared, shape (records,).

    Returns
    -------
    list of Figure
        At most `MOST_SIZES`.
    """
    found: dict[tuple[str, tuple[str, ...], str], dict[int, tuple[float, float]]] = {}
    units: dict[tuple[str, tuple[str, ...], str], str] = {}
    for record, own in enumerate(table["sizes"]):
        if own is None or not usable[record]:
            continue
        for effect, names, parameters in _effects(own.to_list()):
            for name, (value, std, unit) in parameters.items():
                key = (effect, names, name)
                found.setdefault(key, {})[record] = (value, std)
                units.setdefault(key, unit)
    most = sorted(found, key=lambda key: (-len(found[key]), key))[:MOST_SIZES]
    several = Counter((effect, name) for effect, _, name in most)
    result = []
    for effect, names, name in most:
        values, deviations = np.full(len(table), np.nan), np.zeros(len(table))
        for record, pair in found[effect, names, name].items():
            values[record], deviations[record] = pair
        values, deviations = plausible(values), np.nan_to_num(plausible(deviations))
        label = visible(f"{effect}: {name}")
        if several[effect, name] > 1:
            label += f" (of {len(names)} parameters)"
        result.append(
            Figure(
                f"{effect}.{name}",
                label,
                visible(units[effect, names, name]),
                values,
                deviations,
                judged=effect not in NOISE_LIKE,
                effect=effect,
            )
        )
    return result


def _effects(
    own: Sequence[Mapping[str, Any]],
) -> list[tuple[str, tuple[str, ...], dict[str, tuple[float, float, str]]]]:
    """Return name, names of parameters and known parameters of each effect; of equal effects, the first."""
    grouped: dict[str, dict[str, tuple[float, float, str]]] = {}
    for one in own:
        effect, name, value = one["effect"], one["name"], one["value"]
        unit = one["unit"] or ""
        if effect is None or name is None or unit == "rad":
            continue
        parameters = grouped.setdefault(effect, {})
        known = value is not None and np.isfinite(value) and one["determined"] is not False
        std = one["std"] if one["std"] is not None and np.isfinite(one["std"]) else 0.0
        if curve := _AT_TIME.fullmatch(name):
            name = f"largest {curve[1]}"
            if name in parameters and not (known and abs(value) > np.nan_to_num(abs(parameters[name][0]))):
                continue
        elif name in parameters:
            continue
        parameters[name] = (float(value) if known else np.nan, abs(float(std)), unit)
    return [
        (effect, tuple(parameters), {k: v for k, v in parameters.items() if np.isfinite(v[0])})
        for effect, parameters in grouped.items()
    ]


@dataclass(frozen=True)
class Scaled:
    """A figure on the scale on which it is compared.

    Attributes
    ----------
    values, std
        On this scale, shape (devices,); NaN is unknown.
    original
        The values in the figure's unit.
    logarithmic
        Whether the scale is logarithmic.
    sign
        The sign of the values on a logarithmic scale.
    median
        The median in the figure's unit.
    """

    values: Array
    std: Array
    original: Array
    logarithmic: bool
    sign: float
    median: float


def scaled(values: Array, std: Array) -> Scaled:
    """Return values on a logarithmic scale, or on a linear one if they have both signs.

    Parameters
    ----------
    values, std
        Values and standard deviations, shape (devices,); NaN is unknown.

    Returns
    -------
    Scaled
        On a logarithmic scale, a standard deviation is a part of the value.

    Examples
    --------
    >>> scaled(np.array([1.0, 1.0, np.e]), np.zeros(3)).values.tolist()
    [0.0, 0.0, 1.0]
    >>> scaled(np.array([1.0, -1.0, 2.0]), np.zeros(3)).logarithmic
    False
    """
    known = np.isfinite(values)
    median = float(np.median(values[known])) if known.any() else np.nan
    sign = float(np.sign(median)) if known.any() else 0.0
    if sign == 0 or np.mean(sign * values[known] <= 0) > MIXED:
        return Scaled(values, std, values, False, 1.0, median)
    least = LEAST * abs(median)
    size = np.maximum(sign * values, least)
    return Scaled(np.log(size), np.minimum(std / size, 1e3), values, True, sign, median)
