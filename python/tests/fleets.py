"""Simulated tables of fleets: what `gpi batch` would find on usual devices, and on devices with a defect."""

from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from gpi_hammerstein.fleet import row

Rows = list[dict[str, Any]]
Draw = Callable[[np.random.Generator, tuple[int, int]], NDArray[np.float64]]

# Relative spreads of resonance, sensitivity, damping and width of the loop; how they depend on each other.
SPREAD = {"resonance_hz": 0.01, "sensitivity": 0.02, "damping": 0.1, "hysteresis_width": 0.05}
USUAL = {"resonance_hz": 800.0, "sensitivity": 1.2, "damping": 0.02, "hysteresis_width": 0.12}
CORRELATION = np.array([[1, 0.6, -0.2, 0.1], [0.6, 1, 0, -0.3], [-0.2, 0, 1, 0.1], [0.1, -0.3, 0.1, 1]])


def normal(random: np.random.Generator, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Draw from a normal distribution."""
    return random.normal(size=shape)


def usual(devices: int, seed: int, draw: Draw = normal) -> Rows:
    """Return the rows of devices without a defect: each has creep, and was recorded once."""
    random = np.random.default_rng(seed)
    spread = draw(random, (devices, 4)) @ np.linalg.cholesky(CORRELATION).T
    rows = []
    for device in range(devices):
        noise = 0.01 * np.exp(0.1 * random.normal())
        figures = {
            name: USUAL[name] * np.exp(SPREAD[name] * spread[device, at]) for at, name in enumerate(USUAL)
        }
        sizes = [
            size("creep", "gain[0]", 0.05 * (1 + 0.1 * random.normal()), 0.002),
            size("creep", "time_constant[0]", 2 * np.exp(0.2 * random.normal()), 0.1, "s"),
        ]
        rows.append(
            dict.fromkeys(row.COLUMNS)
            | {"file": f"runs/{device}.csv", "name": f"r{device}", "device": f"D{device:04}", "unit": "um"}
            | {"verdict": "explained", "verdict_reason": "", "effects": ["creep"], "sizes": sizes}
            | {"rms_before": noise * 8 * np.exp(0.1 * random.normal()), "noise_floor": noise}
            | {"rms_after": noise * (1 + 0.02 * abs(random.normal()))}
            | figures
        )
    return rows


def size(effect: str, name: str, value: float, std: float = 0.0, unit: str = "") -> dict[str, Any]:
    """Return a parameter of an effect."""
    return {
        "effect": effect,
        "name": name,
        "value": value,
        "std": std,
        "unit": unit,
        "determined": True,
    }


def with_defects(rows: Rows, share: float, seed: int) -> set[str]:
    """Give some devices a defect, and return their names.

    A cracked stack: sensitivity and resonance are lower. A loose screw: backlash. A bent sensor curve. A gain
    that changes.
    """
    random = np.random.default_rng(seed)
    chosen = random.choice(len(rows), round(share * len(rows)), replace=False)
    for number, device in enumerate(chosen):
        own = rows[device]
        match number % 4:
            case 0:
                own["sensitivity"] *= 0.85 * np.exp(0.02 * random.normal())
                own["resonance_hz"] *= 0.94
            case 1:
                own["effects"] = [*own["effects"], "backlash"]
                own["sizes"] = [*own["sizes"], size("backlash", "gap", 0.1, 0.01, "um")]
            case 2:
                own["effects"] = ["output-nonlinearity", *own["effects"]]
            case _:
                own["effects"] = [*own["effects"], "gain-drift"]
                own["sensitivity"] *= 0.97
    return {rows[device]["device"] for device in chosen}


def table(rows: Rows) -> pl.DataFrame:
    """Return rows as the table of a batch."""
    return row.table(rows)
