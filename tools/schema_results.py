"""The JSON Schemas of what commands say of models: identification, explanation, validation, simulation."""

from schema_parts import (
    PARAMETER,
    Schema,
    closed,
    count,
    flag,
    listed,
    maybe,
    number,
    numbers,
    of,
    one_of,
    pair,
    part,
    size,
    text,
)
from schema_signals import FILES

RULE = text("how the error on held-out data is counted")
IDENTIFIED: dict[str, Schema] = {
    "order": count("of the dynamics"),
    "poles": listed(part("complex")),
    "dc_gain": listed(listed(maybe(number())), "(outputs, inputs)"),
    "half_widths": listed(listed(size()), "of the plays of each input"),
    "weights": listed(numbers(), "of the plays of each input"),
    "thresholds": listed(numbers(), "of the deadzones of each input"),
    "deadzone_weights": listed(numbers(), "of the deadzones of each input"),
    "offsets": numbers("of each output"),
    "delay": maybe(count("dead time in samples")),
    "taps": maybe(count("length of the impulse responses")),
    "excited": maybe(count("order of persistent excitation")),
    "rounds": listed(closed({"rms": maybe(size()), "order": count(), "taps": count()})),
    "candidates": listed(part("structure")),
    "notes": listed(text()),
}
REFINED: dict[str, Schema] = {
    "status": text("how the refinement ended"),
    "cost_history": numbers(),
    "residual_rms": size(),
    "noise_floor": part("noise"),
    "parameters": listed(part("parameter")),
    "undetermined": listed(
        listed(of("array", prefixItems=[text(), number()], items=False, minItems=2)),
        "combinations of parameters that the data do not determine, with the share of each",
    ),
    "pole_std": listed(listed(maybe(number()), minItems=2, maxItems=2)),
    "outliers": count(),
    "robust": flag("whether outliers have a reduced weight"),
}
SPLIT = closed({"train": part("figures"), "holdout": part("figures")})
IDENTIFICATION = closed(
    {
        "schema": {"const": "gpi-identification/1"},
        "record": part("record"),
        "holdout": text("which data were held out"),
        **IDENTIFIED,
        "mean_removed": flag(),
        "start_fitted": flag(),
        "rule": RULE,
        "error": closed({"train": part("figures"), "holdout": maybe(part("figures"))}),
        "rivals": part("rivals"),
        "files": FILES,
    },
    REFINED,
)
STEP = closed(
    {
        "effect": maybe(text("null for the declared model")),
        "parameters": of("object", additionalProperties=closed(PARAMETER)),
        "evidence": closed(
            {
                "promised": maybe(number("what the score test promised")),
                "deviance": maybe(number("what the effect took from the sum of squares, over its noise")),
                "chance": maybe(number("what chance takes")),
                "dropped": listed(text(), "effects that it replaced"),
                "probability": maybe(
                    size("that it predicts held-out blocks better than the alternatives; null without any")
                ),
                "alternatives": of(
                    "object", "other effects that would be accepted", additionalProperties=size()
                ),
            }
        ),
        "train_rms": maybe(size()),
        "holdout_rms": maybe(size()),
    }
)
STAGE = closed(
    {
        "loops": listed(
            closed(
                {
                    "input": text(),
                    "output": text(),
                    "range": pair("of the input"),
                    "sensitivity": maybe(number()),
                    "unit": text("of the sensitivity"),
                    "width": maybe(number("largest opening of the loop over its travel")),
                }
            )
        ),
        "first_resonance": maybe(closed({"frequency_hz": size(), "damping": number()})),
        "without": listed(text(), "effects that are forces inside the mechanics"),
    }
)
EXPLANATION_PARTS: dict[str, Schema] = {
    "schema": {"const": "gpi-explanation/1"},
    "record": part("record"),
    "noise_floor": part("noise"),
    "effects": listed(text(), "that were found, in the order in which they were added"),
    "steps": listed(STEP),
    "moved_resonance": maybe(
        listed(closed({"swing": size(), "frequency": size("Hz"), "std": size("Hz")}), minItems=2, maxItems=2)
    ),
    "stage": STAGE,
    "rejected": listed(
        closed(
            {
                "effect": text(),
                "holdout_rms": maybe(size()),
                "why": text(),
                "confounded_with": listed(text()),
                "probability": maybe(size("that it predicts better than the others that would be accepted")),
            }
        )
    ),
    "error": closed({"before": SPLIT, "after": SPLIT}),
    "residual": closed({"structured": flag(), "tests": listed(part("test"))}),
    "rivals": part("rivals"),
    "verdict": one_of("explained", "partly-explained", "unattributed", "outside-class"),
    "verdict_reason": maybe(text()),
    "notes": listed(text()),
    "next_experiment": maybe(part("next")),
    "wrong_samples": listed(closed({"experiment": count(), "output": text(), "row": count()})),
    "interrupted": flag(),
}
EXPLANATION = closed(EXPLANATION_PARTS, {"holdout": text(), "rule": RULE, "files": FILES})
COUNTED: dict[str, Schema] = {
    "model": text("file of the model"),
    "record": part("record"),
    "mean_removed": flag(),
    "start_fitted": flag(),
    "rule": RULE,
    "skipped_s": size("s at the start of each experiment that are not scored"),
    "files": FILES,
}
VALIDATION = closed(
    {
        "schema": {"const": "gpi-validation/1"},
        **COUNTED,
        "left_out": listed(text(), "effects that were left out"),
        "error": part("figures"),
        "horizons": maybe(closed({"seconds": size("s"), "error": part("figures")})),
        "residual": closed({"structured": flag(), "tests": listed(part("test"))}),
        "figures": listed(part("left")),
    }
)
SIMULATION = closed(
    {"schema": {"const": "gpi-simulation/1"}, **COUNTED, "error": maybe(part("figures"))},
)
DEMO = closed(
    {
        "schema": {"const": "gpi-demo/1"},
        "identified": closed(IDENTIFIED, REFINED),
        "left": part("left"),
        "explanation": closed(EXPLANATION_PARTS),
        "truth": of("object", "what the simulator of the record contains"),
        "files": FILES,
    }
)
RELATIVE = closed({"relative_error": maybe(size())})
SPAN = closed({"rms_over_span": maybe(size())})
PAPER = closed(
    {
        "schema": {"const": "gpi-reproduction/1"},
        "example": {"const": "paper"},
        "period_s": size(),
        "poles": listed(part("complex")),
        "zeros": listed(part("complex")),
        "markov": numbers(),
        "readings": listed(
            closed(
                {
                    "reading": text("the convention of the deadzones"),
                    "condition": maybe(number()),
                    "figure_3": closed({"markov": numbers(), "relative_error": maybe(size())}),
                    "realisations": listed(
                        closed(
                            {
                                "order": count(),
                                "poles": listed(part("complex")),
                                "figure_4": RELATIVE,
                                "figure_5": SPAN,
                                "figure_6": SPAN,
                                "inverse_truncation": maybe(size()),
                            }
                        )
                    ),
                    "refined": closed(
                        {
                            "relative_error": maybe(size()),
                            "weights_error": maybe(size()),
                            "deadzone_weights_error": maybe(size()),
                            "undetermined": count(),
                            "status": text(),
                        }
                    ),
                }
            )
        ),
        "errata": text(),
        "files": FILES,
    }
)
STEERING_MIRROR = closed(
    {
        "schema": {"const": "gpi-reproduction/1"},
        "example": {"const": "fsm"},
        "fitted_mv": listed(count()),
        "seconds": size(),
        "published_percent": of("object", additionalProperties=numbers()),
        "stages": listed(
            closed(
                {
                    "name": text(),
                    "parameters": count(),
                    "error_percent": of("object", additionalProperties=number()),
                }
            )
        ),
        "explanation": closed(EXPLANATION_PARTS),
        "files": FILES,
    }
)
BEFORE_AND_AFTER = closed({"before": size(), "after": size()})
PUBLIC_BENCHMARK = closed(
    {
        "schema": {"const": "gpi-reproduction/1"},
        "example": {"enum": ["silverbox", "bouc-wen", "emps", "cascaded-tanks", "friction-damper"]},
        "title": text(),
        "truth": text("what is known of the plant"),
        "true_effects": listed(text()),
        "false_names": listed(text(), "effects that were named and that the plant does not have"),
        "unit": text("of the errors"),
        "errors": of("object", "rms errors by part", additionalProperties=BEFORE_AND_AFTER),
        "published": of("object", additionalProperties=of("object", additionalProperties=number())),
        "seconds": size(),
        "explanation": closed(EXPLANATION_PARTS),
        "files": FILES,
    }
)
REPRODUCTION: Schema = {"oneOf": [PAPER, STEERING_MIRROR, PUBLIC_BENCHMARK]}
