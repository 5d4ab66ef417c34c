"""What the user has chosen on the page, checked and translated to the arguments of the package."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gpi_hammerstein._native import ParameterError

Names = list[str] | None


@dataclass(frozen=True)
class Choices:
    """How a record is read, and what is searched in it."""

    files: list[str] = field(default_factory=list)
    """Keys of the files."""
    input: Names = None
    output: Names = None
    covariate: Names = None
    time: str | None = None
    rate: float | None = None
    resample: float | bool | None = None
    experiments: str | None = None
    effects: Names = None

    def columns(self) -> dict[str, Any]:
        """Return the arguments of `inspect`."""
        return {
            "input": self.input,
            "output": self.output,
            "time": self.time,
            "rate": self.rate,
            "covariate": self.covariate,
            "resample": self.resample,
        }

    def reading(self) -> dict[str, Any]:
        """Return the arguments of `read_record`."""
        return {**self.columns(), "experiment": self.experiments}


def choices_from(request: Mapping[str, Any]) -> Choices:
    """Check what the page has sent.

    Parameters
    ----------
    request
        The fields of :class:`Choices`; those that are missing, None or empty are not chosen.

    Returns
    -------
    Choices
        The choices.

    Raises
    ------
    ParameterError
        A value has another type or cannot be parsed.

    Examples
    --------
    >>> choices_from({"files": ["a"], "rate": "1e3", "resample": "auto"}).reading()["resample"]
    True
    """
    return Choices(
        files=names(request, "files") or [],
        input=names(request, "input") or None,
        output=names(request, "output") or None,
        # an empty list means that other columns are ignored
        covariate=names(request, "covariate"),
        time=text(request, "time"),
        rate=number(request, "rate"),
        resample=True if request.get("resample") == "auto" else number(request, "resample"),
        experiments=text(request, "experiments"),
        effects=names(request, "effects"),
    )


def names(request: Mapping[str, Any], name: str) -> Names:
    """Return a list of texts; None if it is missing."""
    value = request.get(name)
    if value is None:
        return None
    if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
        raise ParameterError(f"`{name}` = {value!r}: must be a list of names")
    return value


def text(request: Mapping[str, Any], name: str) -> str | None:
    """Return a text; None if it is missing or empty."""
    value = request.get(name)
    if value is not None and not isinstance(value, str):
        raise ParameterError(f"`{name}` = {value!r}: must be a text")
    return value.strip() or None if value else None


def number(request: Mapping[str, Any], name: str) -> float | None:
    """Return a number; None if it is missing or empty."""
    value = request.get(name)
    if value is None or value == "":
        return None
    try:
        if isinstance(value, bool | list | dict):
            raise ValueError
        return float(value)
    except ValueError:
        raise ParameterError(f"`{name}` = {value}: must be a number, such as 1000") from None
