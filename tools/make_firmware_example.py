"""Write the example of `firmware`: a model, its parameters in Rust, and its compensators from `gpi export`.

The actuator has 17 deadzones, 8 plays, two lags of creep and a resonance. Its parameters are invented, with
the magnitudes of a piezo stage for 120 V.
"""

import json
import sys
from pathlib import Path

import numpy as np

import gpi_hammerstein as gpi

ROOT = Path(__file__).resolve().parent.parent
LIMITS = (-120.0, 120.0)
RATE = 10_000.0
THRESHOLDS = [15.0 * (j - 8) for j in range(17)]
SLOPES = [0.02, -0.03, 0.01, 0.02, -0.04, 0.03, -0.02, 0.02, 1.0]
SLOPES += [0.01, 0.03, -0.02, 0.02, 0.01, -0.03, 0.02, 0.01]
HALF_WIDTHS = [0.0, 2.0, 5.0, 9.0, 14.0, 20.0, 28.0, 40.0]
WEIGHTS = [0.3, 0.04, 0.03, 0.025, 0.02, 0.015, 0.012, 0.01]
TIMES, GAINS = [0.02, 0.5], [0.03, 0.05]
OFFSET = 2.0


def resonance(frequency: float, damping: float) -> dict[str, list[float]]:
    """Return the matrices of a lightly damped mode of unit DC gain, as rows."""
    w = 2 * np.pi * frequency / RATE
    radius = np.exp(-damping * w)
    a1, a2 = -2 * radius * np.cos(w * np.sqrt(1 - damping**2)), radius**2
    gain = (1 + a1 + a2) / 2
    return {"a": [[-a1, 1.0], [-a2, 0.0]], "b": [[gain], [gain]], "c": [[1.0, 0.0]], "d": [[0.0]]}


def model() -> gpi.Model:
    """Return the model."""
    mode = resonance(900.0, 0.05)

    def matrix(rows: list[list[float]]) -> list[object]:
        return [np.ravel(rows, order="F").tolist(), len(rows), len(rows[0])]

    creep = {"name": "creep", "input": 0, "time_constants": TIMES, "gains": GAINS, "dead_time": 0}
    bank = {"half_widths": HALF_WIDTHS, "weights": WEIGHTS}
    zones = {"thresholds": THRESHOLDS, "weights": SLOPES, "reading": "one-sided"}
    return gpi.Model.from_json(
        json.dumps(
            {
                "schema": "gpi-model/1",
                "rate": RATE,
                "inputs": [{"name": "u", "unit": "V"}],
                "outputs": [{"name": "y", "unit": "um"}],
                "hysteresis": [{"envelope": zones, "plays": bank}],
                "linear": {name: matrix(rows) for name, rows in mode.items()},
                "offsets": [OFFSET],
                "effects": [creep],
            }
        )
    )


def array(values: object) -> str:
    """Return numbers as a Rust array in single precision."""
    if isinstance(values, (list, np.ndarray)):
        return "[" + ", ".join(array(value) for value in values) + "]"
    if isinstance(values, tuple):
        return "(" + ", ".join(array(value) for value in values) + ")"
    return str(np.float32(values))


def actuator(compensator: gpi.Compensator) -> str:
    """Return `actuator.rs`."""
    inverse, mode = compensator.hysteresis, resonance(900.0, 0.05)
    pairs = {
        "INVERSE_PLAYS": list(zip(inverse.plays.half_widths, inverse.plays.weights, strict=True)),
        "INVERSE_DEADZONES": list(zip(inverse.envelope.thresholds, inverse.envelope.weights, strict=True)),
    }
    arrays = {
        "THRESHOLDS": THRESHOLDS,
        "SLOPES": SLOPES,
        "HALF_WIDTHS": HALF_WIDTHS,
        "WEIGHTS": WEIGHTS,
        "CREEP_RATES": list(compensator.creep_rates),
        "CREEP_GAINS": GAINS,
        "LIMITS": list(LIMITS),
    }
    lines = [f"const {name}: [f32; {len(values)}] = {array(values)};" for name, values in arrays.items()]
    lines += [
        f"pub const {name}: [(f32, f32); {len(values)}] = {array(values)};" for name, values in pairs.items()
    ]
    lines.append(f"pub const OFFSET: f32 = {array(OFFSET)};")
    for name, rows in mode.items():
        lines.append(f"const {name.upper()}: [[f32; {len(rows[0])}]; {len(rows)}] = {array(rows)};")
    for name in ("CREEP_RATES", "CREEP_GAINS"):
        lines = [line.replace(f"const {name}", f"pub const {name}") for line in lines]
    return ACTUATOR.replace("NUMBERS", "\n".join(lines))


def numbers(compensator: gpi.Compensator) -> str:
    """Return `numbers.h`."""
    inverse = compensator.hysteresis
    arrays = {
        "lag_rates": ("LAGS", compensator.creep_rates),
        "lag_gains": ("LAGS", compensator.creep_gains),
        "half_widths": ("PLAYS", inverse.plays.half_widths),
        "weights": ("PLAYS", inverse.plays.weights),
        "thresholds": ("DEADZONES", inverse.envelope.thresholds),
        "slopes": ("DEADZONES", inverse.envelope.weights),
    }
    lines = ["/* The parameters of `model.json` for `by_hand.c`. */", f"#define OFFSET {np.float32(OFFSET)}f"]
    lines += [f"#define {size} {len(values)}" for size, values in dict(arrays.values()).items()]
    for name, (size, values) in arrays.items():
        texts = ", ".join(f"{np.float32(value)}f" for value in values)
        lines.append(f"static const float {name}[{size}] = {{{texts}}};")
    return "\n".join(lines) + "\n"


ACTUATOR = """//! The parameters of `model.json`, and the operators of gpi-core with these parameters.
#![allow(clippy::excessive_precision)]

use gpi_core::operators::{
    Compensator, CompensatorState, Deadzones, Gpi, GpiState, Lags, LagsState, Operator,
    OperatorError, PlayBank, Reading, StateSpaceStep,
};

NUMBERS

type Hysteresis = Gpi<[f32; THRESHOLDS.len()], [f32; WEIGHTS.len()]>;
type Creep = [f32; CREEP_RATES.len()];

/// Hysteresis, creep and a resonance.
pub struct Actuator {
    hysteresis: Hysteresis,
    creep: Lags<Creep>,
    dynamics: StateSpaceStep<f32, 2, 1, 1>,
}

/// The state of the actuator.
pub struct State {
    hysteresis: GpiState<f32, [f32; WEIGHTS.len()]>,
    creep: LagsState<Creep>,
    dynamics: [f32; 2],
}

fn hysteresis() -> Result<Hysteresis, OperatorError> {
    let envelope = Deadzones::new(THRESHOLDS, SLOPES, Reading::OneSided)?;
    Ok(Gpi::new(envelope, PlayBank::new(HALF_WIDTHS, WEIGHTS)?))
}

/// The actuator of the model.
pub fn actuator() -> Result<Actuator, OperatorError> {
    let creep = Lags::new(CREEP_RATES, CREEP_GAINS)?;
    Ok(Actuator { hysteresis: hysteresis()?, creep, dynamics: StateSpaceStep::new(A, B, C, D)? })
}

/// The compensator of its hysteresis and its creep.
pub fn compensator()
-> Result<Compensator<[f32; THRESHOLDS.len()], [f32; WEIGHTS.len()], Creep>, OperatorError> {
    let inverse = hysteresis()?.inverse_within(LIMITS[0], LIMITS[1])?;
    Compensator::new(inverse, Lags::new(CREEP_RATES, CREEP_GAINS)?, 1.0, OFFSET)
}

/// The state of [`compensator`].
pub type Remembered = CompensatorState<[f32; WEIGHTS.len()], Creep>;

impl Actuator {
    /// Returns the steady state after the drive has moved from zero to this value.
    pub fn standing_at(&self, drive: f32) -> State {
        let mut hysteresis = self.hysteresis.rest();
        let v = self.hysteresis.step(&mut hysteresis, drive);
        // the DC gain is one, and the output is the first state
        let dynamics = [v, A[1][0] * v + B[1][0] * v];
        State { hysteresis, creep: self.creep.settled(v), dynamics }
    }

    /// Returns the output for one sample of the drive.
    pub fn step(&self, state: &mut State, drive: f32) -> f32 {
        let v = self.hysteresis.step(&mut state.hysteresis, drive);
        let [y] = self.dynamics.step(&mut state.dynamics, &[v]);
        y + self.creep.step(&mut state.creep, v) + OFFSET
    }
}
"""


def main(folder: Path) -> None:
    """Write all files."""
    own = model()
    gpi.save(own, folder / "model.json")
    compensator = gpi.export_rust(own, folder / "src/compensator.rs", limits=LIMITS)
    gpi.export_c(own, folder / "c", limits=LIMITS)
    (folder / "c/numbers.h").write_text(numbers(compensator))
    (folder / "src/actuator.rs").write_text(actuator(compensator))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "firmware")
