"""The JSON Schema of what `gpi compare` says of two models or of two fleets."""

from schema_parts import Schema, closed, count, flag, listed, maybe, number, one_of, pair, part, size, text

DECISION = maybe(flag("with the correction of Holm over all rows; null if it was not tested"))
ROW = closed(
    {
        "name": text(),
        "group": one_of("figure", "effect", "parameter"),
        "unit": text("empty for a pure number"),
        "a": maybe(number("null if the model does not have it")),
        "b": maybe(number("null if the model does not have it")),
        "std_a": maybe(size("null if it is not known")),
        "std_b": maybe(size("null if it is not known")),
        "difference": maybe(number("b - a")),
        "std": maybe(size("of the difference")),
        "z": maybe(number("difference over its standard deviation")),
        "p_value": maybe(size()),
        "differs": DECISION,
    },
    said="One value of two models.",
)
SIMULATED = closed(
    {
        "drive": one_of("record", "triangle"),
        "error_a": maybe(part("figures")),
        "error_b": maybe(part("figures")),
        "rule": maybe(text("how the errors are counted")),
        "rms": size("of the difference of the simulated outputs"),
        "movement": size("of the outputs of A about their means"),
        "expected_rms": maybe(size("of two models of the same stage; null if it is not known")),
        "explained": maybe(size("part of the squares that this explains")),
        "unit": text("of the outputs"),
    },
    said="The simulated outputs of two models.",
)
HEAD: dict[str, Schema] = {
    "schema": {"const": "gpi-comparison/1"},
    "a": text("the file"),
    "b": text("the file"),
    "level": size("probability that anything is named if all is equal"),
    "differing": listed(text(), "what differs"),
}
MODELS = closed(
    {
        **HEAD,
        "kind": {"const": "models"},
        "rows": listed(ROW),
        "other_structure": listed(text(), "why parameters were not compared"),
        "only_a": listed(text(), "effects and resonances that only A has"),
        "only_b": listed(text(), "effects and resonances that only B has"),
        "ranges": listed(
            closed({"input": text(), "range": maybe(pair("of slow motion, in the input's unit"))})
        ),
        "simulation": maybe(SIMULATED),
        "notes": listed(text()),
    },
    {"record": maybe(part("record"))},
)
COUNTS = listed(count(), minItems=2, maxItems=2)
FIGURE = closed(
    {
        "name": text(),
        "unit": text("empty for a pure number or if it is not known"),
        **{f"count_{own}": count("number of values") for own in "ab"},
        **{f"median_{own}": maybe(number()) for own in "ab"},
        **{f"spread_{own}": maybe(size("robust standard deviation")) for own in "ab"},
        "difference": maybe(number("b - a")),
        "test": maybe(one_of("mann-whitney", "wilcoxon")),
        "p_value": maybe(size()),
        "differs": DECISION,
    },
    said="One figure of two fleets.",
)
EFFECT = closed(
    {
        "effect": text(),
        **{f"{what}_{own}": count() for own in "ab" for what in ("count", "total")},
        "p_value": size("of Fisher's exact test"),
        "differs": DECISION,
    },
    said="How often an effect occurs in two fleets.",
)
FLEETS = closed(
    {
        **HEAD,
        "kind": {"const": "fleets"},
        "records": COUNTS,
        "failed": COUNTS,
        "devices": COUNTS,
        "pairs": maybe(count("devices in both tables; null if all devices were compared")),
        "figures": listed(FIGURE),
        "effects": listed(EFFECT),
    }
)
COMPARISON: Schema = {"oneOf": [MODELS, FLEETS]}
