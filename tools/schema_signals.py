"""The JSON Schemas of what commands say of signals: compensation, excitation, inspection, public records."""

from schema_parts import (
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

FILES: Schema = listed(text(), "files that were written to the folder of results")
SHARES = ("inversion", "parameters", "model", "past")
COMPENSATION = closed(
    {
        "schema": {"const": "gpi-compensation/1"},
        "model": text("file of the model"),
        "reference": text("file of the reference"),
        "samples": count(),
        "rate_hz": size(),
        "lead_s": size("how long before the reference the drive begins"),
        "drive": of(
            "object",
            "of each input",
            additionalProperties=closed(
                {
                    "unit": text(),
                    "lowest": number(),
                    "highest": number(),
                    "fastest": size("in units per s"),
                }
            ),
        ),
        "start": maybe(closed({"input": numbers(), "output": maybe(number())})),
        "expected_error": closed(
            {
                "rms": maybe(size()),
                "bound": maybe(size("of the worst sample, with a probability of 95 %")),
                "parts": closed({name: maybe(size()) for name in SHARES}),
                "missing": listed(one_of(*SHARES)),
            }
        ),
        "error": closed({"inversion": part("figures"), "static_curve": part("figures")}),
        "passes": listed(maybe(number()), "rms error after each pass"),
        "out_of_reach": count("samples with the drive at a limit"),
        "too_fast": count("samples at which the slope is limited"),
        "compensated": listed(text()),
        "left": listed(closed({"effect": text(), "why": text()})),
        "files": FILES,
    }
)
COUNTS: Schema = of("object", "how often each of them occurs", additionalProperties=count())
BATCH = closed(
    {
        "schema": {"const": "gpi-batch/1"},
        "records": count("rows of the table"),
        "failed": count("records without a result"),
        "verdicts": COUNTS,
        "effects": COUNTS,
        "table": text("file of the table, which has the schema `gpi-fleet/1`"),
    }
)
EXCITATION = closed(
    {
        "schema": {"const": "gpi-excitation/1"},
        "kind": one_of("multisine", "prbs", "triangle", "steps"),
        "rate_hz": size(),
        "samples": count(),
        "unit": text(),
        "min": number(),
        "max": number(),
        "mean": number(),
        "rms": size("about the mean"),
        "crest_factor": maybe(size()),
        "max_slew": size("in units per s"),
        "file": text(),
    },
    {
        "band_hz": pair(),
        "odd": flag("whether the lines are odd"),
        "detection": flag("whether lines are left out"),
        "seed": count(),
        "clock_hz": size(),
        "frequency_hz": size(),
    },
)
CLOCK = {name: count() for name in ("gaps", "backward", "repeated")}
CLOCK_TIMES = {
    name: number("s") for name in ("median_step_s", "smallest_step_s", "largest_step_s", "duration_s")
}
SIGNAL = {"name": text(), "unit": text(), "low": maybe(number()), "high": maybe(number())}
INSPECTION = closed(
    {
        "schema": {"const": "gpi-inspection/1"},
        "files": listed(text()),
        "problem": maybe(text("why the record cannot be used as it is")),
        "assumed": maybe(text("the option with which it was read in spite of a problem")),
        "columns": listed(
            closed(
                {
                    "header": text(),
                    "name": text(),
                    "unit": text(),
                    "role": one_of("time", "input", "output", "covariate", "unused"),
                    "why": text("why it has this role"),
                    "low": maybe(number()),
                    "high": maybe(number()),
                    "step": maybe(size("the resolution")),
                    "missing": count("samples"),
                    "constant": flag(),
                    "text": maybe(text("a cell that is no number")),
                }
            )
        ),
        "clock": maybe(closed(CLOCK, CLOCK_TIMES)),
        "record": maybe(
            closed(
                {
                    "samples": count(),
                    "experiments": count(),
                    "rate_hz": size(),
                    "duration_s": size(),
                    "excitation_order": maybe(count("null if it grows with the number of taps")),
                }
            )
        ),
        "inputs": listed(
            closed(
                {
                    **SIGNAL,
                    "band_hz": maybe(listed(maybe(number()), minItems=2, maxItems=2)),
                    "swings": count(),
                    "largest_swing": maybe(size()),
                    "lengths": count("different lengths of swings"),
                    "speeds": maybe(size("ratio of the fast to the slow swings")),
                    "longest_hold_s": maybe(size()),
                    "period_s": maybe(size()),
                    "fed_back": flag("whether past outputs predict the input"),
                }
            )
        ),
        "outputs": listed(
            closed(
                {
                    **SIGNAL,
                    "step": maybe(size("the resolution")),
                    "clipped": maybe(size("part of the samples at a limit while the input moves")),
                    "noise_at_most": maybe(size()),
                }
            )
        ),
        "notes": listed(text()),
        "findings": listed(text()),
        "identifiable": listed(
            closed({"what": text(), "possible": one_of("yes", "partly", "no"), "why": text()})
        ),
        "next": {"anyOf": [part("next"), closed({})]},
        "next_experiment": maybe(part("next")),
    }
)
DATASETS = of(
    "object",
    additionalProperties=closed(
        {
            "what": text(),
            "parts": listed(text()),
            "authors": text(),
            "licence": text(),
            "home": text("address of its page"),
        }
    ),
)
