//! A plant with every kind of thing in the loops around G and behind them, for tests.
//!
//! Two inputs and two outputs, three states, eight loops: one sum of stops that sees a mixture of states and inputs, a
//! cubic power, a force of Bouc and Wen, Dahl's friction, a speed, a damping and two limits that see an output each, a backlash and a polynomial behind one output. The gains of
//! the loops are small enough that the plant stays in motion and that plays and stops both stick and slide within a
//! run.

use crate::effects::{
    Backlash, Drives, Effect, InnerLoop, Law, OutputNonlinearity, Sees, Stiffness,
};
use crate::linear::{Sections, StateSpace};
use crate::operators::{Deadzones, Gpi, PlayBank, Reading};
use crate::{Channel, Experiment, Hold, Intersample, Matrix, Model, Record};
use std::ops::Range;

const STATES: usize = 3;

fn stiffness() -> Stiffness {
    let stops = |half_widths: [f64; 2]| Law::Stops {
        half_widths: half_widths.to_vec(),
        weights: vec![0.6, 1.0],
    };
    let mixture = Sees::Mixture { states: vec![0.8, -0.3, 0.4], inputs: vec![0.2, 0.1] };
    let drives = |scale: f64| Drives::States((1..=STATES).map(|j| scale / j as f64).collect());
    let force = Drives::Input { input: 1, force: 0.2, states: STATES };
    Stiffness {
        loops: vec![
            InnerLoop { sees: mixture, law: stops([0.2, 0.7]), drives: drives(0.05) },
            InnerLoop {
                sees: Sees::Output(1),
                law: Law::Power { exponent: 3, scale: 4.0 },
                drives: drives(-0.02),
            },
            InnerLoop {
                sees: Sees::Output(0),
                law: Law::BoucWen { beta: 0.6, gamma: -0.2, exponent: 1.5 },
                drives: drives(0.03),
            },
            InnerLoop {
                sees: Sees::Output(0),
                law: Law::Dahl { distance: 0.4, averaged: true },
                drives: force,
            },
            InnerLoop { sees: Sees::Output(1), law: Law::Speed, drives: drives(0.05) },
            InnerLoop {
                sees: Sees::Output(0),
                law: Law::Damping { scale: 0.3 },
                drives: drives(0.04),
            },
            InnerLoop {
                sees: Sees::Output(0),
                law: Law::Excess { limit: 0.6, is_lower: false },
                drives: drives(-0.1),
            },
            InnerLoop {
                sees: Sees::Output(1),
                law: Law::Excess { limit: -0.4, is_lower: true },
                drives: drives(-0.1),
            },
        ],
    }
}

/// Two inputs and two outputs, with every kind of thing in the loops and behind them.
pub(crate) fn model() -> Model {
    let a = [0.6, 0.5, 0.1, -0.4, 0.5, 0.0, 0.0, 0.1, 0.7];
    let linear = StateSpace::new(
        Matrix::from_row_slice(STATES, STATES, &a),
        Matrix::from_row_slice(STATES, 2, &[0.4, 0.1, 0.2, -0.3, 0.1, 0.5]),
        Matrix::from_row_slice(2, STATES, &[1.0, 0.2, 0.3, -0.1, 0.7, 0.9]),
        Matrix::from_row_slice(2, 2, &[0.1, 0.0, 0.05, 0.2]),
    );
    let channels = |name: &str| (0..2).map(|i| Channel::new(format!("{name}{i}"), "")).collect();
    let hysteresis = (0..2).map(|input| {
        let zones = Deadzones::new(vec![0.0, 0.4], vec![1.0, 0.3], Reading::OneSided).unwrap();
        let widths = vec![0.0, 0.3 + 0.2 * f64::from(input)];
        Gpi::new(zones, PlayBank::new(widths, vec![0.8, 0.4]).unwrap())
    });
    let (u, y) = (channels("u"), channels("y"));
    let effects: [Effect; 3] = [
        stiffness().into(),
        Backlash { output: 1, half_width: 0.2, missing: None }.into(),
        OutputNonlinearity {
            output: 1,
            coefficients: vec![0.1, -0.05],
            middle: 0.1,
            scale: 3.0,
            lowest: Some(-2.0),
            highest: None,
        }
        .into(),
    ];
    Model::new(100.0, u, y, hysteresis.collect(), linear.unwrap(), vec![0.0; 2])
        .and_then(|model| model.with_effects(effects.to_vec()))
        .unwrap()
}

/// The same with loops that take three steps a sample and look ahead, behind a dead time of two samples.
pub(crate) fn fine() -> Model {
    let plain = model();
    let mut late = Sections::from_state_space(plain.linear(), 0).unwrap();
    late.delay = 2;
    let (inputs, outputs) = (plain.inputs().to_vec(), plain.outputs().to_vec());
    let hysteresis = plain.hysteresis().to_vec();
    let linear = late.to_state_space().unwrap();
    Model::new(100.0, inputs, outputs, hysteresis, linear, vec![0.0; 2])
        .and_then(|model| model.with_effects(plain.effects().to_vec()))
        .and_then(|model| model.with_intersample(Intersample { substeps: 3, hold: Hold::First }))
        .unwrap()
}

/// An experiment of a given amplitude, from rest or with an unknown initial state.
pub(crate) fn run(
    amplitude: f64,
    first: f64,
    warmup: usize,
    held_out: Vec<Range<usize>>,
) -> Experiment {
    let input = Matrix::from_fn(700, 2, |k, input| {
        let t = k as f64 - if first == 0.0 { 20.0 } else { 0.0 };
        let moved = (0.11 * t).sin() + 0.7 * (0.047 * t + input as f64).cos();
        if t < 0.0 { 0.0 } else { first + amplitude * moved }
    });
    let output = Matrix::from_fn(700, 2, |k, o| amplitude * (0.2 * (k + 3 * o) as f64).sin());
    Experiment { input, output, covariates: Matrix::zeros(700, 0), warmup, held_out }
}

pub(crate) fn record(model: &Model, runs: Vec<Experiment>) -> Record {
    Record::new(runs, 100.0, model.inputs().to_vec(), model.outputs().to_vec(), vec![]).unwrap()
}
