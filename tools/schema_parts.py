"""Parts of the JSON Schemas that several files share, and short ways to write a schema."""

from collections.abc import Mapping
from typing import Any

Schema = dict[str, Any]


def of(kind: str, said: str = "", **more: Any) -> Schema:
    """A value of a type."""
    return {"type": kind, **({"description": said} if said else {}), **more}


def number(said: str = "", **more: Any) -> Schema:
    return of("number", said, **more)


def size(said: str = "") -> Schema:
    """A number that is not negative."""
    return of("number", said, minimum=0)


def count(said: str = "") -> Schema:
    return of("integer", said, minimum=0)


def text(said: str = "") -> Schema:
    return of("string", said)


def flag(said: str = "") -> Schema:
    return of("boolean", said)


def one_of(*values: str, said: str = "") -> Schema:
    return {"enum": list(values), **({"description": said} if said else {})}


def listed(items: Schema, said: str = "", **more: Any) -> Schema:
    return of("array", said, items=items, **more)


def numbers(said: str = "") -> Schema:
    return listed(number(), said)


def pair(said: str = "") -> Schema:
    return listed(number(), said, minItems=2, maxItems=2)


def part(name: str, said: str = "") -> Schema:
    """One of the shared parts."""
    return {"$ref": f"#/$defs/{name}", **({"description": said} if said else {})}


def maybe(schema: Schema) -> Schema:
    """The value, or null where it is not known or not finite."""
    said = schema.get("description")
    inner = {key: value for key, value in schema.items() if key != "description"}
    if isinstance(inner.get("type"), str) and "enum" not in inner:
        inner["type"] = [inner["type"], "null"]
    else:
        inner = {"anyOf": [inner, {"type": "null"}]}
    return {**({"description": said} if said else {}), **inner}


def closed(
    required: Mapping[str, Schema], optional: Mapping[str, Schema] | None = None, said: str = ""
) -> Schema:
    """An object that has exactly these members."""
    optional = optional or {}
    return of(
        "object",
        said,
        properties={**required, **optional},
        required=list(required),
        additionalProperties=False,
    )


def all_of_file(title: str, name: str, schema: Schema) -> Schema:
    """A whole schema, with the shared parts that it needs."""
    needed: dict[str, Schema] = {}

    def collect(value: Any) -> None:
        if isinstance(value, Mapping):
            target = value.get("$ref", "")
            if target:
                own = target.rsplit("/", 1)[1]
                if own not in needed:
                    needed[own] = PARTS[own]
                    collect(PARTS[own])
            for inner in value.values():
                collect(inner)
        elif isinstance(value, list):
            for inner in value:
                collect(inner)

    collect(schema)
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": f"urn:gpi-hammerstein:{name}"}
    whole |= {"title": title, **schema}
    return whole | ({"$defs": dict(sorted(needed.items()))} if needed else {})


FIGURES = closed(
    {
        "rms": maybe(size("root mean square, in the unit of the output")),
        "nrmse": maybe(size("rms over the span of the output")),
        "fit_percent": maybe(number("100 (1 - |y - yhat| / |y - mean y|)")),
        "max": maybe(size("largest error, in the unit of the output")),
    },
    said="The error of a simulation.",
)
PARAMETER = {
    "value": maybe(number("in the unit")),
    "std": maybe(size("standard deviation; null if it is not known")),
    "unit": text("empty for a pure number"),
    "determined": flag("whether the data determine it"),
}
RECORD_FILES = {
    "files": listed(text()),
    "experiments": count(),
    "notes": listed(text(), "what was changed or guessed while the record was read"),
}

PARTS: dict[str, Schema] = {
    "figures": FIGURES,
    "complex": pair("real and imaginary part"),
    "record": closed(
        {
            "samples": count(),
            "rate_hz": size("sampling rate in Hz"),
            "inputs": listed(text()),
            "outputs": listed(text()),
            "covariates": listed(text()),
        },
        RECORD_FILES,
        "The record; its files if a command has read them.",
    ),
    "noise": closed(
        {
            "rms": size("over all outputs"),
            "how": one_of(
                "repeated-periods", "rests", "high-frequency-residual", said="how it was estimated"
            ),
            "per_output": listed(size(), "in the unit of each output"),
        },
        {"period": count("samples of a period"), "samples": count("samples that it was estimated from")},
        "The noise floor.",
    ),
    "parameter": closed({"name": text(), **PARAMETER}),
    "rival": closed(
        {
            "name": one_of("static-polynomial", "plays", "fir", "arx"),
            "detail": text(),
            "train_rms": maybe(size()),
            "holdout_rms": maybe(size()),
        }
    ),
    "rivals": listed(part("rival"), "Simple models of the same record."),
    "test": closed(
        {
            "name": text(),
            "output": text(),
            "statistic": maybe(number()),
            "threshold": maybe(number()),
            "p_value": maybe(number("null for a threshold of practical size")),
            "level": maybe(number("level of significance")),
            "passed": flag(),
            "points_to": text("effects that such a structure points to"),
        },
        {"picture": maybe(text("file of its picture"))},
        "A test of the residual.",
    ),
    "left": closed(
        {
            "output": text(),
            "rms": maybe(size("without its mean")),
            "lag1": maybe(number("correlation of neighbouring samples")),
            "noise_rms": maybe(size("rms of the noise, if it is white")),
        },
        said="The residual of one output.",
    ),
    "next": closed({"why": text(), "command": text()}, said="A command that goes on from here."),
    "structure": closed(
        {
            "rms": maybe(number()),
            "order": count(),
            "plays": count(),
            "deadzones": count(),
            "delay": count("samples"),
            "parameters": count(),
            "used": maybe(number("parameters that the criterion counts")),
            "criterion": maybe(number("null for a structure that was ruled out")),
            "chosen": flag(),
        },
        said="A structure that was compared.",
    ),
}
