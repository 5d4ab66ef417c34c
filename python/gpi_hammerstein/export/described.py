"""What the comments of an exported model say."""

from collections.abc import Callable

from gpi_hammerstein._native import Model
from gpi_hammerstein.export.chain import Chain, Channel
from gpi_hammerstein.export.templates import in_unit, maker, origin

Escaped = Callable[[str], str]


def title_of(chain: Chain, escaped: Escaped) -> str:
    """Return the first line."""
    outputs, inputs = _listed(chain.outputs, escaped), _listed(chain.inputs, escaped)
    return f"Model: {outputs} as the response to {inputs}"


def facts_of(model: Model, chain: Chain, escaped: Escaped) -> list[str]:
    """Return the properties of the model, one a line."""
    names = list(dict.fromkeys(str(effect["name"]) for effect in model.effects))
    effects = ", ".join(escaped(name) for name in names) or "none"
    return [*origin(model), f"Effects: {effects}.", maker()]


def channels_said(chain: Chain, escaped: Escaped) -> dict[str, str]:
    """Return the elements of each array, with their units."""
    groups = {"inputs": chain.inputs, "outputs": chain.outputs, "covariates": chain.covariates}
    return {f"{group}_said": _numbered(channels, escaped) for group, channels in groups.items()}


def _listed(channels: list[Channel], escaped: Escaped) -> str:
    return ", ".join(escaped(channel.name) for channel in channels)


def _numbered(channels: list[Channel], escaped: Escaped) -> str:
    said = (f"{escaped(own.name)}{in_unit(escaped(own.unit))}" for own in channels)
    return ", ".join(f"[{place}] {text}" for place, text in enumerate(said))


def sizes(chain: Chain) -> dict[str, str]:
    """Return the sizes of the arrays; `held` are those of C, whose arrays have at least one element."""
    plays = sum(len(bank.weights) for bank in chain.hysteresis)
    return {
        "inputs": str(len(chain.inputs)),
        "outputs": str(len(chain.outputs)),
        "covariates": str(len(chain.covariates)),
        "states": str(chain.states),
        "plays": str(plays),
        "memory": str(chain.memory),
        "states_held": str(max(1, chain.states)),
        "plays_held": str(max(1, plays)),
        "memory_held": str(max(1, chain.memory)),
    }


def without_gaps(text: str) -> str:
    """Return a text without the empty lines that are left where a model has no effect at a place."""
    kept: list[str] = []
    for line in text.splitlines():
        last = kept[-1].strip() if kept else ""
        inside = bool(kept) and kept[-1].startswith(" ") and last.endswith((";", "{"))
        if line.strip() or (last and not inside):
            kept.append(line.rstrip())
    return "\n".join(kept) + "\n"
