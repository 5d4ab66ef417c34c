"""The JSON Schema of model files."""

from schema_parts import (
    PARTS,
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

CHANNEL = closed({"name": text(), "unit": text("empty if it is not known")})
MATRIX = of(
    "array",
    "elements by columns, number of rows, number of columns",
    prefixItems=[numbers(), count(), count()],
    items=False,
    minItems=3,
)
INPUT, OUTPUT = count("number of the input, from 0"), count("number of the output, from 0")
CHANGES = {
    "changes": numbers("values at evenly spaced later knots; the first value is 0"),
    "duration": size("time of the last knot in s"),
}
BEFORE_SENSOR = {"moves_stage": flag("whether it is added before the output stage")}
LOOP = closed(
    {
        "sees": {
            "oneOf": [
                closed({"output": OUTPUT}),
                closed({"mixture": closed({"states": numbers(), "inputs": numbers()})}),
            ]
        },
        "law": {
            "oneOf": [
                closed({"power": closed({"exponent": of("integer", minimum=2), "scale": size()})}),
                closed({"stops": closed({"half_widths": listed(size()), "weights": numbers()})}),
                closed(
                    {
                        "bouc-wen": closed(
                            {
                                "beta": size("1 over the unit of z to the power of the exponent"),
                                "gamma": number(),
                                "exponent": of("number", minimum=1),
                            }
                        )
                    }
                ),
                closed(
                    {
                        "dahl": closed(
                            {
                                "distance": size("break-away distance in the unit of z"),
                                "averaged": flag("whether w is exact in the mean"),
                            }
                        )
                    }
                ),
                {"const": "speed"},
                closed({"damping": closed({"scale": size("in the unit of z")})}),
                closed(
                    {
                        "excess": closed(
                            {
                                "limit": number("in the unit of z"),
                                "is_lower": flag("whether z exceeds it downwards"),
                            }
                        )
                    }
                ),
            ]
        },
        "drives": {
            "oneOf": [
                numbers("what the force adds to each state"),
                closed(
                    {
                        "input": INPUT,
                        "force": number("how much of v of that input it takes away"),
                        "states": count("states behind the dead time"),
                    }
                ),
            ]
        },
    }
)
LAW = closed({"exponent": number(), "knee": size(), "lag": size("time constant in s")})
#: The members of each effect. An effect that is not here has a name and any members.
EFFECTS: dict[str, Schema] = {
    "delay": closed({"input": INPUT, "samples": size()}),
    "amplifier-slew": closed({"input": INPUT, "limit": size("in units of the input per s")}),
    "rate-dependence": closed(
        {
            "input": INPUT,
            "relative": number("growth in proportion to the half-width, in s per unit of the input"),
            "absolute": number("growth of all half-widths, in s"),
            "speed": size(),
            "widest": size(),
        },
        {"law": maybe(LAW)},
    ),
    "hysteresis-shape": closed(
        {
            "input": INPUT,
            "coefficients": numbers(),
            "widths": count(),
            "middle": number(),
            "scale": size(),
            "widest": size(),
        }
    ),
    "linear-dynamics": closed(
        {
            "input": INPUT,
            "denominator": pair("a1, a2"),
            "numerator": pair("b1, b2"),
            "rate": size("Hz"),
            "dead_time": count("samples"),
        }
    ),
    "creep": closed(
        {
            "input": INPUT,
            "time_constants": listed(size(), "s"),
            "gains": numbers(),
            "dead_time": count("samples"),
        }
    ),
    "stiffness": closed({"loops": listed(LOOP)}),
    "hysteretic-stiffness": closed({"loops": listed(LOOP)}),
    "friction": closed({"loops": listed(LOOP)}),
    "saturation": closed({"loops": listed(LOOP)}),
    "output-nonlinearity": closed(
        {"output": OUTPUT, "coefficients": numbers(), "middle": number(), "scale": size()},
        {
            "lowest": number("the lowest reading of a sensor that clips, without the offset"),
            "highest": number("the highest reading of a sensor that clips, without the offset"),
        },
    ),
    "gain-drift": closed({"output": OUTPUT, **CHANGES}),
    "backlash": closed(
        {"output": OUTPUT, "half_width": size()},
        {
            "missing": number(
                "the part of a force's stiffness that is missing while the gap is open",
                exclusiveMinimum=0,
                maximum=1,
            )
        },
    ),
    "drift": closed({"output": OUTPUT, **CHANGES, "span": size()}, BEFORE_SENSOR),
    "periodic-disturbance": closed(
        {
            "output": OUTPUT,
            "frequency": size("Hz"),
            "cosine": number(),
            "sine": number(),
            "duration": size(),
            "span": size(),
        },
        BEFORE_SENSOR,
    ),
    "covariate": closed(
        {
            "output": OUTPUT,
            "column": count("number of the measured column, from 0"),
            "label": text("its name"),
            "gain": number(),
            "time_constant": size("of the lag in s; 0 for none"),
            "step": number(),
        },
        BEFORE_SENSOR
        | {
            "start": number("by which the lag differs from the first value before the record"),
            "range": size("largest less smallest value of the column, which bounds the start; 0 holds it"),
        },
    ),
    "outliers": closed({"count": count(), "samples": count(), "size": size()}),
    "coloured-noise": closed(
        {"output": OUTPUT, "coefficients": numbers(), "innovation": size(), "deviation": size()}
    ),
}


def _with_name(name: str, schema: Schema) -> Schema:
    return {
        **schema,
        "properties": {"name": {"const": name}, **schema["properties"]},
        "required": ["name", *schema["required"]],
    }


PARTS["effect"] = {
    "type": "object",
    "description": "An effect with its parameters.",
    "properties": {"name": text()},
    "required": ["name"],
    "allOf": [
        {
            "if": {"properties": {"name": {"const": name}}, "required": ["name"]},
            "then": _with_name(name, schema),
        }
        for name, schema in EFFECTS.items()
    ],
}
PARTS["estimate"] = closed(
    {
        "name": text(),
        "value": number(),
        "std": maybe(size("standard deviation")),
        "determined": flag("whether the data determine it"),
    },
    {"unit": text()},
)
ESTIMATES = closed(
    {
        "status": text("how the refinement ended"),
        "parameters": listed(part("estimate")),
        "residual_rms": listed(size()),
        "noise_floor": closed(
            {"rms": listed(size()), "how": text()}, {"period": count(), "samples": count()}
        ),
        "outliers": count(),
        "robust": flag(),
    },
    {
        "effects": listed(closed({"name": text(), "parameters": listed(part("estimate"))})),
        "undetermined": listed(
            listed(of("array", prefixItems=[text(), number()], items=False, minItems=2)),
            "combinations of parameters that the data do not determine, with the share of each",
        ),
    },
    "How sure the parameters are.",
)
PREDICTION = closed(
    {
        "numbers": listed(count(), "which numbers of the model are uncertain"),
        "axes": listed(numbers(), "axes of their covariance"),
        "misfit": listed(size()),
        "movement": listed(size()),
    },
    {
        "expected_misfit": listed(size(), "the one that was found, or what the noise may hide"),
        "largest_misfit": listed(size(), "of the second in which it is largest"),
    },
    said="What the model knows about the errors of its simulations.",
)
MODEL = closed(
    {
        "schema": {"const": "gpi-model/1"},
        "rate": of("number", "sampling rate in Hz", exclusiveMinimum=0),
        "inputs": listed(CHANNEL, minItems=1),
        "outputs": listed(CHANNEL, minItems=1),
        "hysteresis": listed(
            closed(
                {
                    "envelope": closed(
                        {
                            "thresholds": numbers("in the unit of the input"),
                            "weights": numbers("slopes"),
                            "reading": one_of("one-sided", "directional"),
                        }
                    ),
                    "plays": closed({"half_widths": listed(size()), "weights": numbers()}),
                }
            ),
            "deadzones and plays of each input",
        ),
        "linear": closed({name: MATRIX for name in "abcd"}, said="x+ = A x + B v, y = C x + D v"),
        "offsets": numbers("of each output"),
    },
    {
        "effects": listed(part("effect")),
        "intersample": closed(
            {
                "substeps": count("steps of the loops from one sample to the next"),
                "hold": one_of("zero", "first"),
            },
            said="how loops are computed between samples, see (T13) of the theory",
        ),
        "estimates": ESTIMATES,
        "prediction": PREDICTION,
    },
)
