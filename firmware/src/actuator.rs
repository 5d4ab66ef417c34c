//! The parameters of `model.json`, and the operators of gpi-core with these parameters.
#![allow(clippy::excessive_precision)]

use gpi_core::operators::{
    Compensator, CompensatorState, Deadzones, Gpi, GpiState, Lags, LagsState, Operator,
    OperatorError, PlayBank, Reading, StateSpaceStep,
};

const THRESHOLDS: [f32; 17] = [
    -120.0, -105.0, -90.0, -75.0, -60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0, 75.0,
    90.0, 105.0, 120.0,
];
const SLOPES: [f32; 17] = [
    0.02, -0.03, 0.01, 0.02, -0.04, 0.03, -0.02, 0.02, 1.0, 0.01, 0.03, -0.02, 0.02, 0.01, -0.03,
    0.02, 0.01,
];
const HALF_WIDTHS: [f32; 8] = [0.0, 2.0, 5.0, 9.0, 14.0, 20.0, 28.0, 40.0];
const WEIGHTS: [f32; 8] = [0.3, 0.04, 0.03, 0.025, 0.02, 0.015, 0.012, 0.01];
pub const CREEP_RATES: [f32; 2] = [0.0049875206, 0.00019998];
pub const CREEP_GAINS: [f32; 2] = [0.03, 0.05];
const LIMITS: [f32; 2] = [-120.0, 120.0];
pub const INVERSE_PLAYS: [(f32, f32); 8] = [
    (0.0, 3.3333333),
    (0.6, -0.39215687),
    (1.62, -0.23847377),
    (3.1, -0.17105713),
    (5.075, -0.12200701),
    (7.565, -0.08405716),
    (11.005, -0.063137956),
    (16.309, -0.05005406),
];
pub const INVERSE_DEADZONES: [(f32, f32); 17] = [
    (-120.9, -0.020002),
    (-106.05, 0.029708853),
    (-90.75, -0.009706853),
    (-75.6, -0.020002),
    (-60.75, 0.039227225),
    (-45.3, -0.029126214),
    (-30.3, 0.019607844),
    (-15.0, -0.019607844),
    (0.0, 1.0),
    (15.0, -0.00990099),
    (30.15, -0.028560549),
    (45.75, 0.018853696),
    (61.05, -0.018853696),
    (76.65, -0.00915751),
    (92.4, 0.028011205),
    (107.7, -0.018853696),
    (123.3, -0.00915751),
];
pub const OFFSET: f32 = 2.0;
const A: [[f32; 2]; 2] = [[1.6423154, 1.0], [-0.9450205, 0.0]];
const B: [[f32; 1]; 2] = [[0.15135257], [0.15135257]];
const C: [[f32; 2]; 1] = [[1.0, 0.0]];
const D: [[f32; 1]; 1] = [[0.0]];

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
