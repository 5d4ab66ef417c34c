"""Every argument, unit and shape of the public API is documented, and every name has an example."""

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import gpi_hammerstein as gpi
from api_walk import WALKED, Item, items

EXPORTED = [item for item in WALKED if item.kind in ("function", "class")]

ARRAY = re.compile(r"\w*Array\w*")
# A mapping to Any holds numbers among others.
NUMBER = re.compile(r"\w*Array\w*|\bfloat\b|dict\[str, Any\]")

# The words of which shapes are made, besides digits, `+` and `*`.
DIMENSIONS = {
    *("samples", "scored", "experiments", "inputs", "outputs", "channels", "columns", "covariates"),
    *("taps", "order", "lead", "plays", "lags", "states", "parameters", "passes", "steps", "angles"),
    *("count", "d", "m", "n", "r"),
}
SAME_SHAPE = re.compile(r"\b(?:shaped like|the shape of) \w+")

UNITS = {
    "of a signal": r"\b[Ii]n (?:[\w']+ ){0,4}units?\b(?! (?:circle|DC))|in ``unit``",
    "named": r"\b(?:Hz|seconds|in s|in samples|per second|radians|rad|dB|percent|GiB)\b",
    "none": r"\b(?:no unit|(?:a|the|what) (?:fraction|ratio|share|count)|pure numbers?)\b",
}
UNIT = re.compile("|".join(UNITS.values()))

# One statement for all parts of a tuple.
SHARED = re.compile(r"\b(?:both|each|neither)\b")


def undocumented(item: Item) -> list[str]:
    """Parameters without an entry or a description, entries without a parameter, no `Returns`."""
    if item.kind in ("property", "exception"):
        return [] if item.doc else ["no docstring"]
    if item.kind == "call":
        known = re.findall(r"\w+", item.doc)
        return [f"{name}: not in the class's Methods" for name in item.parameters if name not in known]
    said = item.entries
    found = [f"{name}: no entry" for name in item.parameters if name not in said]
    found += [f"{name}: no such parameter" for name in said if name not in item.parameters]
    found += [f"{name}: no description" for name, (_, text) in said.items() if not text]
    if item.returns and not item.sections.get("Returns", "").strip():
        found.append("no section Returns")
    return found


def parts(annotation: str, said: str, kind: re.Pattern[str]) -> int:
    """How many statements there must be: one for each part of a tuple that may differ from the others."""
    found = kind.findall(annotation)
    if not found or not annotation.startswith("tuple[") or SHARED.search(said):
        return min(1, len(found))
    return len(found) if ARRAY.search(annotation) else 1


def shapes(said: str) -> int:
    """How many shapes a text states."""
    groups = [re.findall(r"[a-z]+", group) for group in re.findall(r"\(([\w\s+*,]*,[\w\s+*,]*)\)", said)]
    known = [words for words in groups if words and set(words) <= DIMENSIONS]
    return len(known) + len(SAME_SHAPE.findall(said))


def without_shape(item: Item) -> list[str]:
    """Arrays whose shape is not told."""
    texts = item.texts()
    return [f"{name}: no shape" for name, kind, said in texts if shapes(said) < parts(kind, said, ARRAY)]


def without_unit(item: Item) -> list[str]:
    """Numbers whose unit is not told, nor that they have none."""
    texts = ((name, kind, " ".join(said.split())) for name, kind, said in item.texts())
    return [
        f"{name}: no unit"
        for name, kind, said in texts
        if len(UNIT.findall(said)) < parts(kind, said, NUMBER)
    ]


def without_example(item: Item) -> list[str]:
    """No examples, or examples that are not run though they need no file."""
    examples = item.sections.get("Examples", "")
    lines = [line for line in examples.splitlines() if line.startswith(">>>")]
    if not lines:
        return ["no examples"]
    skipped = [line for line in lines if "+SKIP" in line]
    needs_file = re.search(r'"[\w/-]+\.\w+"|\b(?:fetch|load)\("', examples)
    return [] if needs_file else [f"not run: {line}" for line in skipped]


every = pytest.mark.parametrize("item", WALKED, ids=lambda item: item.name)


@every
def test_every_argument_is_documented(item: Item) -> None:
    assert undocumented(item) == []


@every
def test_every_array_has_a_shape(item: Item) -> None:
    assert without_shape(item) == []


@every
def test_every_number_has_a_unit(item: Item) -> None:
    assert without_unit(item) == []


@pytest.mark.parametrize("item", EXPORTED, ids=lambda item: item.name)
def test_every_name_has_an_example_that_runs(item: Item) -> None:
    assert without_example(item) == []


def test_the_walk_reaches_everything() -> None:
    names = {item.name for item in WALKED}
    assert len(WALKED) > 200 and len(names) == len(WALKED)
    assert {"fir", "Gpi", "Gpi.run", "Gpi.__call__", "Model.rate", "Model.from_json"} <= names
    assert {"load", "plot.bode", "plot.Residuals.of", "interop.to_dlti", "datasets.fetch"} <= names
    assert {"estimator.GpiRegressor", "estimator.GpiRegressor.predict"} <= names


def test_dir_is_the_public_api() -> None:
    assert dir(gpi) == sorted(gpi.__all__)
    assert {"plot", "datasets", "interop"} <= set(dir(gpi))
    assert not {"Any", "TYPE_CHECKING", "annotations", "register"} & set(dir(gpi))


def careless(u: ArrayLike, rate: float, extra: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Do something, such as (means removed) with samples of unit gain.

    Parameters
    ----------
    u : array_like
        Input between (0, 1) or (low, high), inside the unit circle.
    rate : float
        Sampling rate.
    gone : int

    Returns
    -------
    tuple of ndarray
        The output, shape (samples,), in the output's unit, and the state.

    Examples
    --------
    >>> careless([0.0], 1.0, 2)  # doctest: +SKIP
    """
    raise NotImplementedError


def careful(u: ArrayLike, rate: float) -> NDArray[np.float64]:
    """Do something.

    Parameters
    ----------
    u : array_like, shape (samples,) or (samples, inputs)
        Input, in its own unit.
    rate : float
        Sampling rate in Hz.

    Returns
    -------
    ndarray
        The output, shaped like u, in units of the input per second.

    Examples
    --------
    >>> 1 + 1
    2
    """
    raise NotImplementedError


class Silent:
    """A class whose parts nobody has described.

    Methods
    -------
    __call__(v)
        The output.
    """

    def __init__(self, gain: float) -> None: ...

    def __call__(self, v: ArrayLike, start: int) -> float:
        raise NotImplementedError

    @property
    def taps(self) -> list[NDArray[np.float64]]:
        """Coefficients (highest, first)."""
        raise NotImplementedError

    def run(self) -> float:
        """Return it."""
        raise NotImplementedError


def complaints(thing: Any) -> dict[str, list[str]]:
    checks = (undocumented, without_shape, without_unit)
    return {item.name: [one for check in checks for one in check(item)] for item in items("it", thing)}


def test_the_checks_find_what_is_missing() -> None:
    assert complaints(careless) == {
        "it": [
            *("extra: no entry", "gone: no such parameter", "gone: no description"),
            *("u: no shape", "the return value: no shape"),
            *("u: no unit", "rate: no unit", "the return value: no unit"),
        ]
    }
    [item] = items("it", careless)
    assert without_example(item) == ["not run: >>> careless([0.0], 1.0, 2)  # doctest: +SKIP"]
    assert complaints(Silent) == {
        "it": ["gain: no entry", "gain: no unit"],
        "it.__call__": [
            *("start: not in the class's Methods", "v: no shape"),
            *("v: no unit", "the value: no unit"),
        ],
        "it.taps": ["the value: no shape", "the value: no unit"],
        "it.run": ["no section Returns", "the return value: no unit"],
    }


def test_the_checks_are_content_with_what_is_whole() -> None:
    assert complaints(careful) == {"it": []}
    [item] = items("it", careful)
    assert without_example(item) == []
