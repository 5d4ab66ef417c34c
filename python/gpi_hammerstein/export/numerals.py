"""Numbers of source code in single and double precision."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gpi_hammerstein._native import ParameterError

Precision = Literal["single", "double"]


@dataclass(frozen=True)
class Numerals:
    """How a language writes numbers of a precision."""

    precision: Precision
    #: The name of the type.
    real: str
    #: The largest number; what an infinite limit becomes.
    largest: str
    suffix: str = ""

    @property
    def number(self) -> type[np.floating[Any]]:
        """The type of NumPy."""
        return np.float32 if self.precision == "single" else np.float64

    def written(self, value: float) -> str:
        """Return a number in the shortest form without loss of precision."""
        with np.errstate(over="ignore"):
            rounded = self.number(value)
        if np.isinf(rounded):
            return f"-{self.largest}" if rounded < 0 else self.largest
        text = str(rounded)
        return (text if "." in text or "e" in text else f"{text}.0") + self.suffix

    def listed(self, values: ArrayLike) -> str:
        """Return the elements of an array, six in a line."""
        each = [self.written(value) for value in np.ravel(np.asarray(values, dtype=np.float64))]
        return in_lines(each)

    def require(self, name: str, values: ArrayLike, owner: str) -> None:
        """Reject a parameter that becomes infinite in this precision, and a gain whose reciprocal does."""
        with np.errstate(over="ignore", under="ignore"):
            rounded = np.asarray(values, dtype=np.float64).astype(self.number)
        if not np.isfinite(rounded).all() or (
            name.endswith("gain") and not np.all(np.abs(rounded) > np.finfo(self.number).tiny)
        ):
            raise ParameterError(
                f"`precision` = {self.precision}: `{name}` of the {owner} is not a normal number in it; "
                "use double precision or other units"
            )


def quadrature(numerals: Numerals) -> dict[str, str]:
    """Return nodes x^2 and weights 2 x w of Gauss's quadrature from 0 to 1, by the names in the templates."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    nodes = (nodes + 1) / 2
    listed = {"nodes": nodes**2, "shares": nodes * weights}
    return {name: numerals.listed(values) for name, values in listed.items()}


def in_lines(each: list[str]) -> str:
    """Return a list of numbers, six in a line."""
    lines = [", ".join(each[i : i + 6]) for i in range(0, len(each), 6)]
    return ",\n    ".join(lines) if len(lines) < 2 else "\n    " + ",\n    ".join(lines) + ",\n"


def numerals_of_c(precision: Precision) -> Numerals:
    """Return how C writes numbers."""
    require_precision(precision)
    return (
        Numerals(precision, "float", "FLT_MAX", "f")
        if precision == "single"
        else Numerals(precision, "double", "DBL_MAX")
    )


def numerals_of_rust(precision: Precision) -> Numerals:
    """Return how Rust writes numbers."""
    require_precision(precision)
    return Numerals(precision, "f32" if precision == "single" else "f64", "Real::INFINITY")


def require_precision(precision: str) -> None:
    """Reject another word than `single` and `double`."""
    if precision not in ("single", "double"):
        raise ParameterError(f"`precision` = {precision}: must be single or double")
