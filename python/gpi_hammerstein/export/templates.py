"""Templates of source code: lines that are used only for some models, and values."""

import hashlib
import re
from collections.abc import Collection, Mapping
from importlib.resources import files as resources
from string import Template

from gpi_hammerstein._native import Model, ParameterError, __version__

_MARK = re.compile(r"@([a-z_|]+)")


def filled(template: str, values: Mapping[str, str], used: Collection[str]) -> str:
    """Return a template with its values.

    Lines from `@name` to `@else` or `@end` are left out unless `name` is in `used`; `@one|two` asks for one
    of two names. Lines from `@else` to `@end` are used otherwise.
    """
    lines, wanted = [], True
    text = resources("gpi_hammerstein.export").joinpath("templates", template).read_text(encoding="utf-8")
    for line in text.splitlines(keepends=True):
        mark = _MARK.fullmatch(line.strip())
        if mark is None:
            if wanted:
                lines.append(line)
        elif mark[1] == "end":
            wanted = True
        elif mark[1] == "else":
            wanted = not wanted
        else:
            wanted = any(name in used for name in mark[1].split("|"))
    return Template("".join(lines)).substitute(values)


def origin(model: Model) -> list[str]:
    """Return what a reader of an exported file must know of its model."""
    return [
        f"Model: SHA-256 {digest(model)} of its file.",
        f"Rate: {model.rate:g} samples a second.",
    ]


def maker() -> str:
    """Return what made a file."""
    return f"Made by gpi-hammerstein {__version__}, `gpi export`."


def digest(model: Model) -> str:
    """Return the SHA-256 of the model's file."""
    return hashlib.sha256(model.to_json().encode()).hexdigest()


def require_identifier(name: str) -> None:
    """Reject a name that C does not take."""
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise ParameterError(f"`name` = {name}: must contain only letters, digits and `_`, such as x_axis")


def in_unit(unit: str) -> str:
    """Return a unit as a part of a sentence."""
    return f" in {unit}" if unit else ""
