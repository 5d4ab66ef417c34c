"""The model in Rust."""

import numpy as np
from numpy.typing import ArrayLike

from gpi_hammerstein._native import Model
from gpi_hammerstein.escaping import in_rust
from gpi_hammerstein.export.calls import Calls, used_parts
from gpi_hammerstein.export.chain import Chain, chain_of
from gpi_hammerstein.export.described import channels_said, facts_of, sizes, title_of, without_gaps
from gpi_hammerstein.export.numerals import Precision, in_lines, numerals_of_rust, quadrature
from gpi_hammerstein.export.templates import filled


def model_in_rust(model: Model, precision: Precision) -> str:
    """Return the text of the module."""
    chain, numerals = chain_of(model), numerals_of_rust(precision)

    def defined(table: str, values: ArrayLike, whole: bool) -> str:
        values = np.asarray(values)
        text = in_lines([str(int(value)) for value in values]) if whole else numerals.listed(values)
        return f"const {table.upper()}: [{'usize' if whole else 'Real'}; {len(values)}] = [{text}];"

    calls = Calls(
        numerals,
        own="self.",
        part=lambda first, last: f"&mut self.memory[{first}..{last}]",
        passed=lambda table: f"&{table.upper()}",
        signals="&signals",
        counted=False,
        defined=defined,
    )
    calls.linear(chain)
    inputs = range(len(chain.inputs))
    hysteresis = [_hysteresis(calls, chain, place) for place in inputs]
    standing = [f"stand({memory}, {table}, {signal});" for memory, table, signal in calls.standing(chain)]
    statements = {
        "start_hysteresis": [f"v[{i}] = own.hysteresis_{i}(own.input[{i}], 0.0);" for i in inputs],
        "move": [f"v[{i}] = self.hysteresis_{i}(v[{i}], RATE);" for i in inputs],
        "start_effects": [line.replace("self.", "own.") for line in standing],
        "drive": calls.drive(chain),
        "settle": calls.settle(chain, "let"),
        "respond": calls.respond(chain, "let"),
        "read": calls.read(chain),
    }
    if not chain.at("widths"):
        for key in ("start_hysteresis", "move"):
            statements[key] = [line.rsplit(", ", 1)[0] + ");" for line in statements[key]]
    values = {key: "\n".join(" " * 8 + line for line in lines) for key, lines in statements.items()}
    values["settle"] = "\n".join(" " * 12 + line for line in statements["settle"])
    values |= {
        "real": numerals.real,
        "rate": numerals.written(chain.rate),
        "ln_two": numerals.written(float(np.log(2.0))),
        **quadrature(numerals),
        "two_pi": numerals.written(2.0 * np.pi),
        "tables": "\n".join(calls.tables.values()),
        "hysteresis": "\n\n".join(hysteresis),
        "title": title_of(chain, in_rust),
        "facts": "\n".join(f"//! {fact}".rstrip() for fact in facts_of(model, chain, in_rust)),
    }
    values |= sizes(chain) | channels_said(chain, in_rust)
    used = used_parts(chain)
    values["operations"] = filled("operations.rs", values, used)
    return without_gaps(filled("model.rs", values, used))


def _hysteresis(calls: Calls, chain: Chain, place: int) -> str:
    """Return the method from the drive of an input to its v."""
    bank, own = chain.hysteresis[place], calls.bank(chain, place)
    first, count = chain.first_play(place), len(bank.weights)
    before = f", self.drive[{place}]" if bank.directional else ""
    kind = "directional" if bank.directional else "one_sided"
    moving = bool(chain.at("widths"))
    lines = [f"let z = {kind}(u{before}, {own.thresholds}, {own.slopes});"]
    if own.widened:
        lines.append(f"let change = u - self.drive[{place}];")
        lines.append("let speed = if change < 0.0 { -change * rate } else { change * rate };")
    lines += [f"let {name} = {call};" for name, call in own.speeds]
    width = own.width(f"{own.half_widths[1:]}[i]")
    read = own.read("*place", lambda rows, degrees: f"{rows}[i * {degrees}..]")
    lines += [
        "let mut v = 0.0;",
        f"for (i, place) in self.plays[{first}..{first + count}].iter_mut().enumerate() {{",
        f"    *place = play({width}, z, *place);",
        f"    v += {own.weights[1:]}[i] * {read};",
        "}",
        f"self.drive[{place}] = u;",
        "v",
    ]
    pace = (", rate: Real" if own.widened else ", _: Real") if moving else ""
    head = f"    /// v of {in_rust(chain.inputs[place].name)}.\n    #[inline]\n"
    head += f"    fn hysteresis_{place}(&mut self, u: Real{pace}) -> Real {{\n"
    return head + "\n".join(" " * 8 + line for line in lines) + "\n    }"
