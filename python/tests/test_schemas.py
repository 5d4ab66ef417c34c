"""The published JSON Schemas: complete, valid, satisfied by what is written, and not by what is changed."""

import contextlib
import copy
import io
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import gpi_hammerstein as gpi
import schemas
import write_schemas
from exported_models import CASES, EFFECTS, with_effects
from gpi_hammerstein import cli
from records import RATE, good_columns, write_csv
from schema_model import EFFECTS as DESCRIBED
from test_effects import with_effect

PACKAGE = Path(gpi.__file__).parent
FINDINGS = {
    "outliers": {"count": 2, "samples": 100, "size": 1.0},
    "coloured-noise": {"output": 0, "coefficients": [0.5], "innovation": 1.0, "deviation": 1.2},
}


def test_every_schema_is_published_as_the_tool_writes_it():
    assert {file.stem for file in schemas.FOLDER.glob("*.json")} == {
        name.replace("/", "-") for name in write_schemas.SCHEMAS
    }
    page = (schemas.FOLDER.parent / "schemas.md").read_text(encoding="utf-8")
    for name in write_schemas.SCHEMAS:
        file = write_schemas.file_of(name)
        assert file.read_text(encoding="utf-8") == write_schemas.written(name), "run tools/write_schemas.py"
        Draft202012Validator.check_schema(json.loads(file.read_text(encoding="utf-8")))
        assert f"schemas/{file.name}" in page


def test_every_name_in_the_source_has_a_schema():
    # the schema of models is named in Rust
    sources = [*PACKAGE.rglob("*.py"), PACKAGE.parents[1] / "crates" / "gpi-core" / "src" / "model.rs"]
    named = {
        name
        for source in sources
        for name in re.findall(
            r'(?:"schema": |SCHEMA(?:: [^=]*)? = )"(gpi-[a-z]+/\d)"', source.read_text(encoding="utf-8")
        )
    }
    assert named == set(write_schemas.SCHEMAS) - {"gpi-datasets"}


def printed(*call: str) -> Any:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert cli.run([*call, "--json"]) == 0
    return json.loads(out.getvalue())


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """One object of each schema that a quick command prints, and a model with every effect."""
    folder = tmp_path_factory.mktemp("written")
    record = str(write_csv(folder / "run.csv", good_columns()))
    t = np.arange(400) / RATE
    path = str(write_csv(folder / "path.csv", {"t_s": t, "y_um": np.sin(20 * t) * t}))
    model = str(folder / "model.json")
    gpi.identify(gpi.read_record(record), half_widths=[0.0, 0.8], thresholds=0, delay=0).save(model)
    known = ["--half-widths", "0,0.8", "--thresholds", "0", "--delay", "0"]
    found = [
        printed("identify", record, *known),
        printed("explain", record, *known, "--effects", "backlash"),
        printed("validate", model, record),
        printed("compensate", model, path, "--limits=-5,5"),
        json.loads(CASES["every-effect"]().model.to_json()),
    ]
    return {own["schema"]: own for own in found}


def test_what_is_only_printed_is_as_its_schema(written, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_csv(tmp_path / "run.csv", good_columns(500))
    (tmp_path / "model.json").write_text(json.dumps(written["gpi-model/1"] | {"effects": []}))
    band = ["--rate", "1000", "--duration", "1", "--range", "0,10"]
    for call in (
        ["simulate", "model.json", "run.csv"],
        ["inspect", "run.csv"],
        ["excite", "multisine", *band, "--band", "1,100", "-o", "a.csv"],
        ["excite", "prbs", *band, "--clock", "100", "-o", "b.csv"],
        ["excite", "triangle", *band, "--frequency", "2", "-o", "c.csv"],
        ["excite", "steps", *band, "-o", "d.csv"],
    ):
        schemas.require(printed(*call))
    schemas.require(printed("datasets", "list"), "gpi-datasets")


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The places of all members and elements."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in pairs:
        yield (*at, key)
        yield from places(inner, (*at, key))


def inner(value: Any, at: tuple[Any, ...]) -> Any:
    for key in at:
        value = value[key]
    return value


def broken(value: Any) -> Any:
    """A value of another type."""
    return [["no such value"]] if not isinstance(value, list) else "no such value"


def without(value: Any, at: tuple[Any, ...]) -> None:
    del inner(value, at[:-1])[at[-1]]


def of_another_type(value: Any, at: tuple[Any, ...]) -> None:
    inner(value, at[:-1])[at[-1]] = broken(inner(value, at))


def with_one_more(value: Any, at: tuple[Any, ...]) -> None:
    inner(value, at)["no such member"] = 1


CHANGES: list[Callable[[Any, tuple[Any, ...]], None]] = [without, of_another_type, with_one_more]
#: Members that a file may have or not.
OPTIONAL = {"files", "experiments", "notes", "holdout", "rule", "effects", "estimates", "prediction", "unit"}
OPTIONAL |= {"undetermined", "moves_stage", "law", "picture", "period", "samples", "start"}
OPTIONAL |= {"lowest", "highest", "range"}


@pytest.mark.parametrize(
    "name",
    [
        "gpi-model/1",
        "gpi-identification/1",
        "gpi-explanation/1",
        "gpi-validation/1",
        "gpi-compensation/1",
    ],
)
def test_a_file_that_is_changed_is_refused(written, name):
    """Members are removed, added, or of another type, at random places of every depth."""
    whole = written[name]
    schemas.require(whole)
    random = np.random.default_rng(7)
    everywhere = list(places(whole))
    count = {change.__name__: 0 for change in CHANGES}
    for place in [everywhere[i] for i in random.permutation(len(everywhere))[:60]]:
        for change in CHANGES:
            value = copy.deepcopy(whole)
            parent, own = inner(value, place[:-1]), inner(value, place)
            if change is without and (
                not isinstance(parent, dict) or place[-1] in REFINED or place[-1] in OPTIONAL
            ):
                continue
            if change is with_one_more and not isinstance(own, dict):
                continue
            if change is not of_another_type and is_open(place):
                continue
            change(value, place)
            assert schemas.problems(value, name), f"{change.__name__} at {place} is not seen"
            count[change.__name__] += 1
    assert count["of_another_type"] == min(60, len(everywhere)) and count["without"] > 3


#: Members of an identification that exist after a refinement only.
REFINED = set(write_schemas.results.REFINED)


def is_open(place: tuple[Any, ...]) -> bool:
    """Whether the members of an object have names that the schema does not know."""
    return place[-2:-1] == ("drive",) or place[-1:] == ("drive",) or "parameters" in place[-2:]


def test_every_effect_of_the_catalogue_has_a_schema_and_others_are_open():
    assert set(DESCRIBED) == set(gpi.effect_names())
    for name, values in (EFFECTS | FINDINGS).items():
        model = json.loads(with_effect(with_effects(), name=name, **values).to_json())
        schemas.require(model)
        [effect] = model["effects"]
        key = next(key for key in effect if key not in ("name", "moves_stage", "law"))
        model["effects"] = [{own: value for own, value in effect.items() if own != key}]
        assert schemas.problems(model), f"{name} without {key}"
    model["effects"] = [{"name": "an-effect-of-the-future", "anything": 1}]
    schemas.require(model)
