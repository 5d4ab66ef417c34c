"""Small record files for the tests of reading and of the command line, and models from numbers."""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gpi_hammerstein as gpi
import oracle

Array = NDArray[np.float64]

RATE = 1000.0


def actuator(u: Array, noise: float = 1e-3, seed: int = 1) -> Array:
    """Two plays before a slow pole, written from the definitions."""
    half_widths, weights = np.array([0.0, 0.8]), np.array([1.0, 0.6])
    plays = np.clip(np.zeros(2), u[0] - half_widths, u[0] + half_widths)
    x, y = 0.0, np.empty_like(u)
    for k, value in enumerate(u):
        plays = np.clip(plays, value - half_widths, value + half_widths)
        y[k] = x
        x = 0.7 * x + 0.3 * float(weights @ plays)
    return y + noise * np.random.default_rng(seed).standard_normal(len(u))


def drive(samples: int = 2000, seed: int = 0) -> Array:
    """Random phases up to 490 Hz and a slow swing that opens the loop, faded in from rest."""
    random = np.random.default_rng(seed)
    t = np.arange(samples) / RATE
    lines = np.arange(1.0, 490.0)
    phases = 2 * np.pi * random.random(len(lines))
    fast = np.cos(2 * np.pi * np.outer(t, lines) + phases).sum(axis=1)
    u: Array = np.minimum(1.0, t / 0.1) * (2.0 * np.sin(2 * np.pi * 1.5 * t) + 0.8 * fast / fast.std())
    return u


def write_csv(path: Path, columns: dict[str, object]) -> Path:
    """Write columns of equal length; cells are numbers or text."""
    rows = zip(*(list(values) for values in columns.values()), strict=True)  # type: ignore[call-overload]
    lines = [",".join(columns), *(",".join(str(cell) for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def good_columns(samples: int = 2000, seed: int = 0) -> dict[str, object]:
    """The columns of a record that can be identified."""
    u = drive(samples, seed)
    t = np.round(np.arange(samples) / RATE, 9)
    return {"t_s": t, "u_V": np.round(u, 6), "y_um": np.round(actuator(u, seed=seed + 1), 6)}


def model_of(plant: oracle.Plant, rate: float = RATE) -> gpi.Model:
    """The model with the numbers of a plant; the offset is that of its first experiment."""

    def matrix(values: Array) -> list[object]:
        return [np.ravel(values, order="F").tolist(), *values.shape]

    a, b, c, d = plant.delayed_state_space()
    layout = {
        "schema": "gpi-model/1",
        "rate": rate,
        "inputs": [{"name": name, "unit": ""} for name in plant.inputs],
        "outputs": [{"name": name, "unit": ""} for name in plant.outputs],
        "hysteresis": [
            {
                "envelope": {
                    "thresholds": channel.thresholds.tolist(),
                    "weights": channel.deadzone_weights.tolist(),
                    "reading": channel.reading,
                },
                "plays": {"half_widths": channel.half_widths.tolist(), "weights": channel.weights.tolist()},
            }
            for channel in plant.hysteresis
        ],
        "linear": {"a": matrix(a), "b": matrix(b), "c": matrix(c), "d": matrix(d)},
        "offsets": plant.offsets[0].mean(axis=0).tolist(),
    }
    return gpi.Model.from_json(json.dumps(layout))
