"""The result of an identification, as JSON and as text."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from gpi_hammerstein._native import Identification, Model, Refinement
from gpi_hammerstein.cli.output import error_table, escape, rival_table, say_written
from gpi_hammerstein.comparison import compared_in_words

HOW = {
    "repeated-periods": "from repeated periods of the input",
    "rests": "from intervals of constant input",
    "high-frequency-residual": "from the highest frequencies of the residual",
}
# Number of names that are printed for a combination of parameters.
SHOWN_NAMES = 3


def describe_model(model: Model) -> dict[str, Any]:
    """Return the part of a result that describes the model."""
    return {
        "order": model.linear.order,
        "poles": model.linear.poles,
        "dc_gain": model.linear.dc_gain,
        "half_widths": [gpi.plays.half_widths for gpi in model.hysteresis],
        "weights": [gpi.plays.weights for gpi in model.hysteresis],
        "thresholds": [gpi.envelope.thresholds for gpi in model.hysteresis],
        "deadzone_weights": [gpi.envelope.weights for gpi in model.hysteresis],
        "offsets": model.offsets,
        **describe_identification(model.identification),
        **describe_refinement(model),
    }


def describe_identification(found: Identification | None) -> dict[str, Any]:
    """Return the part of a result that describes the choice of the structure."""
    candidates = found.candidates if found else []
    delays = [row["delay"] for row in candidates if row["chosen"]]
    return {
        "delay": delays[0] if delays else (found.delay if found else None),
        "taps": min(found.rounds, key=lambda one: one["rms"])["taps"] if found and found.rounds else None,
        "excited": found.supported_taps if found else None,
        "rounds": found.rounds if found else [],
        "candidates": candidates,
        "notes": found.notes if found else [],
    }


def describe_refinement(model: Model) -> dict[str, Any]:
    """Return the status of the joint refinement, and the uncertainty of its parameters."""
    refinement = model.refinement
    if refinement is None:
        return {}
    floor = refinement.noise_floor
    return {
        "status": refinement.status,
        "cost_history": refinement.history,
        "residual_rms": combined(refinement.residual_rms),
        "noise_floor": {**floor, "rms": combined(floor["rms"]), "per_output": floor["rms"]},
        "parameters": refinement.parameters,
        "undetermined": refinement.undetermined,
        "pole_std": pole_deviations(model.linear.poles, refinement),
        "outliers": refinement.outliers,
        "robust": refinement.robust,
    }


def combined(rms: Sequence[float] | NDArray[np.float64]) -> float:
    """Return the root mean square over all outputs."""
    return float(np.sqrt(np.mean(np.square(rms))))


def pole_deviations(poles: NDArray[np.complex128], refinement: Refinement) -> NDArray[np.complex128]:
    """Return the standard deviations of real and imaginary parts in the order of `poles`.

    Poles of a dead time have the value 0, because a refinement does not list them.
    """
    deviations = np.zeros(len(poles), dtype=np.complex128)
    free = np.ones(len(poles), dtype=bool)
    for pole, deviation in zip(*refinement.poles(), strict=True):
        nearest = int(np.argmin(np.where(free, np.abs(poles - pole), np.inf)))
        deviations[nearest], free[nearest] = deviation, False
    return deviations


def summarise(screen: Console, result: Mapping[str, Any], model: Model, unit: str, out: Path | None) -> None:
    """Print the result as text."""
    record = result["record"]
    screen.print(
        f"{record['samples']} samples at {record['rate_hz']:g} Hz in {record['experiments']} experiment(s): "
        + escape(f"{', '.join(record['inputs'])} -> {', '.join(record['outputs'])}")
    )
    for note in (*record["notes"], *result["notes"]):
        screen.print(f"[yellow]note[/] {escape(note)}")
    if len(result["candidates"]) > 1:
        screen.print(candidate_table(result["candidates"], unit))
    screen.print(
        f"Linear part: order {result['order']}, largest pole {model.linear.spectral_radius:.4f}"
        + (f", dead time {result['delay']} samples" if result["delay"] else "")
        + (
            ""
            if result["excited"] is None
            else f" (order of persistent excitation of the input: {result['excited']})"
        )
    )
    hysteresis = zip(model.input_names, result["half_widths"], result["thresholds"], strict=True)
    for name, plays, zones in hysteresis:
        screen.print(f"Hysteresis of {escape(name)}: {len(plays)} plays, {len(zones)} deadzones")
    if "status" in result:
        say_how_sure(screen, result, unit)
    screen.print(f"Held-out data: {escape(result['holdout'])}")
    screen.print(
        error_table(
            {"fitted": result["error"]["train"], "held out": result["error"]["holdout"]},
            unit,
            f"Simulation error (held out: {result['rule']})",
        )
    )
    screen.print(rival_table(result["rivals"], unit))
    held_out = result["error"]["holdout"]
    # the rivals keep the offset of the training data
    own = None if held_out is None or result["mean_removed"] else held_out["rms"]
    for sentence in compared_in_words(result["rivals"], own, unit):
        screen.print(escape(sentence))
    say_written(screen, out, result["files"])


def candidate_table(candidates: Sequence[Mapping[str, Any]], unit: str) -> Table:
    """Return a table of the structures that were compared; the chosen one is marked."""
    table = Table(title="Structures compared", title_justify="left")
    label = f" [{unit}]" if unit else ""
    for name in (
        "",
        "order",
        "plays",
        "deadzones",
        "delay",
        f"rms{label}",
        "parameters",
        "criterion minus best",
    ):
        table.add_column(escape(name), justify="right")
    best = min((row["criterion"] for row in candidates if row["criterion"] is not None), default=0.0)
    for row in candidates:
        table.add_row(
            "*" if row["chosen"] else "",
            *(str(row[name]) for name in ("order", "plays", "deadzones", "delay")),
            f"{row['rms']:.4g}",
            f"{row['used']:.0f}",
            "ruled out" if row["criterion"] is None else f"{row['criterion'] - best:.0f}",
            style="bold" if row["chosen"] else None,
        )
    return table


def say_how_sure(screen: Console, result: Mapping[str, Any], unit: str) -> None:
    """Print the residual, the noise floor, and the unidentifiable parameters."""
    floor, rms = result["noise_floor"], result["residual_rms"]
    ratio = f", {rms / floor['rms']:.2f} times the noise floor" if floor["rms"] > 0 else ""
    screen.print(
        escape(f"Residual {rms:.4g} {unit}".rstrip() + ratio)
        + escape(f" of {floor['rms']:.4g} {unit}".rstrip() if ratio else "")
        + f", estimated {HOW.get(floor['how'], floor['how'])}"
    )
    if result["outliers"]:
        treatment = "with reduced weight" if result["robust"] else "with full weight (see --robust)"
        screen.print(f"Outliers: {result['outliers']} in the residual, {treatment}")
    if result["status"] != "converged":
        why = {
            "limit": "reached the maximum number of steps",
            "stalled": "stopped, because no shorter step reduces the error",
        }
        screen.print(f"[yellow]note[/] the refinement {why.get(result['status'], result['status'])}")
    for combination in result["undetermined"]:
        largest = sorted(combination, key=lambda part: -abs(part[1]))[:SHOWN_NAMES]
        names = ", ".join(name for name, _ in largest)
        others = len(combination) - len(largest)
        rest = f" and {others} more" if others else ""
        together = " together" if len(combination) > 1 else ""
        screen.print(f"[yellow]warning[/] the data do not determine {escape(names)}{rest}{together}")
