"""The published JSON Schemas, and a watch on all that the commands write while tests run."""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from gpi_hammerstein import json_values
from gpi_hammerstein.cli import output
from gpi_hammerstein.files import models

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "reference" / "schemas"


@cache
def validator(name: str) -> Draft202012Validator:
    """The validator of the objects whose member `schema` has this value."""
    file = FOLDER / f"{name.replace('/', '-')}.json"
    return Draft202012Validator(json.loads(file.read_text(encoding="utf-8")))


def problems(value: Any, name: str | None = None) -> list[str]:
    """What is wrong with a value, by its place."""
    found = validator(name or value["schema"]).iter_errors(value)
    return [f"{error.json_path}: {error.message[:300]}" for error in found]


def require(value: Any, name: str | None = None) -> None:
    found = problems(value, name)
    assert not found, f"not as its JSON Schema: {'; '.join(found[:3])}"


def watch(patch: pytest.MonkeyPatch) -> None:
    """Check every result that a command prints or writes, and every model file that is saved."""
    plain, write = json_values.plain, models.write_atomically

    def checked(value: Any) -> Any:
        result = plain(value)
        if isinstance(value, Mapping) and str(value.get("schema", "")).startswith("gpi-"):
            require(result)
        return result

    def checked_model(path: Any, content: Any) -> None:
        require(json.loads(content))
        write(path, content)

    patch.setattr(output, "plain", checked)
    patch.setattr(json_values, "plain", checked)
    patch.setattr(models, "write_atomically", checked_model)
