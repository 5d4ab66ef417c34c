"""The model in C99."""

import numpy as np
from numpy.typing import ArrayLike

from gpi_hammerstein._native import Model
from gpi_hammerstein.escaping import in_c
from gpi_hammerstein.export.calls import Calls, used_parts
from gpi_hammerstein.export.chain import Chain, chain_of
from gpi_hammerstein.export.described import channels_said, facts_of, sizes, title_of, without_gaps
from gpi_hammerstein.export.numerals import Precision, in_lines, numerals_of_c, quadrature
from gpi_hammerstein.export.templates import filled


def model_in_c(model: Model, precision: Precision, name: str) -> dict[str, str]:
    """Return the names and the texts of the files."""
    chain, numerals = chain_of(model), numerals_of_c(precision)

    def defined(table: str, values: ArrayLike, whole: bool) -> str:
        values = np.asarray(values)
        text = in_lines([str(int(value)) for value in values]) if whole else numerals.listed(values)
        return f"static const {'int' if whole else 'real'} {table}[{len(values)}] = {{{text}}};"

    calls = Calls(
        numerals,
        own="state->",
        part=lambda first, last: f"state->memory + {first}",
        passed=lambda table: table,
        signals="signals",
        counted=True,
        defined=defined,
    )
    calls.linear(chain)
    inputs = range(len(chain.inputs))
    hysteresis = [_hysteresis(calls, chain, place, name) for place in inputs]
    moving = bool(chain.at("widths"))
    start, on = (", 0", ", rate") if moving else ("", "")
    statements = {
        "start_hysteresis": [f"v[{i}] = hysteresis_{i}(state, state->input[{i}]{start});" for i in inputs],
        "move": [f"v[{i}] = hysteresis_{i}(state, v[{i}]{on});" for i in inputs],
        "start_effects": [
            f"stand({memory}, {table}, {calls.lengths[table]}, {signal});"
            for memory, table, signal in calls.standing(chain)
        ],
        "drive": calls.drive(chain),
        "settle": calls.settle(chain, "const real"),
        "respond": calls.respond(chain, "const real"),
        "read": calls.read(chain),
    }
    values = {key: "\n".join(f"    {line}" for line in lines) for key, lines in statements.items()}
    values["settle"] = "\n".join(f"        {line}" for line in statements["settle"])
    values |= {
        "name": name,
        "NAME": name.upper(),
        "real": numerals.real,
        "largest": numerals.largest,
        "rate": numerals.written(chain.rate),
        "ln_two": numerals.written(float(np.log(2.0))),
        **quadrature(numerals),
        "two_pi": numerals.written(2.0 * np.pi),
        "tables": "\n".join(calls.tables.values()),
        "hysteresis": "\n".join(hysteresis),
        "title": title_of(chain, in_c),
        "facts": "\n".join(f" * {fact}".rstrip() for fact in facts_of(model, chain, in_c)),
    }
    values |= sizes(chain) | channels_said(chain, in_c)
    used = used_parts(chain)
    values["operations"] = filled("operations.c", values, used)
    texts = {f"{name}.{ending}": filled(f"model.{ending}", values, used) for ending in ("h", "c")}
    return {file: without_gaps(text) for file, text in texts.items()}


def _hysteresis(calls: Calls, chain: Chain, place: int, name: str) -> str:
    """Return the function from the drive of an input to its v."""
    bank, own = chain.hysteresis[place], calls.bank(chain, place)
    count = len(bank.thresholds)
    before = "before, " if bank.directional else ""
    kind = "directional" if bank.directional else "one_sided"
    moving = bool(chain.at("widths"))
    lines = [f"real *const plays = state->plays + {chain.first_play(place)};"]
    if bank.directional or own.widened:
        lines.append(f"const real before = state->drive[{place}];")
    lines.append(f"const real z = {kind}(u, {before}{own.thresholds}, {own.slopes}, {count});")
    if own.widened:
        lines.append("const real speed = (u > before ? u - before : before - u) * pace;")
    lines += [f"const real {seen} = {call};" for seen, call in own.speeds]
    width = own.width(f"{own.half_widths}[i]")
    read = own.read("plays[i]", lambda rows, degrees: f"{rows} + i * {degrees}")
    lines += [
        "real v = 0;",
        "int i;",
        f"for (i = 0; i < {len(bank.weights)}; ++i) {{",
        f"    plays[i] = play({width}, z, plays[i]);",
        f"    v += {own.weights}[i] * {read};",
        "}",
        *(["(void)pace;"] if moving and not own.widened else []),
        f"state->drive[{place}] = u;",
        "return v;",
    ]
    body = "\n".join(f"    {line}" for line in lines)
    pace = ", real pace" if moving else ""
    head = f"/* v of {in_c(chain.inputs[place].name)} */\n"
    head += f"static real hysteresis_{place}({name}_state *state, real u{pace})"
    return f"{head}\n{{\n{body}\n}}\n"
