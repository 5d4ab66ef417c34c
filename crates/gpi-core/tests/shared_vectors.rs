//! The vectors in `testdata/`, which the Python tests read too; they come from the NumPy oracle.
#![cfg(feature = "identify")]
#![allow(clippy::unwrap_used)]

use gpi_core::linear::{
    EraOptions, InverseOptions, StateSpace, estimate, realize, zero_order_hold,
};
use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading, play};
use gpi_core::{Channel, Experiment, Matrix, Record};
use serde_json::Value;

fn read(name: &str) -> Value {
    let path = format!("{}/../../testdata/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn cases<'a>(file: &'a Value, group: &str) -> &'a [Value] {
    let cases = file[group].as_array().unwrap();
    assert!(!cases.is_empty());
    cases
}

fn vector(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|element| element.as_f64().unwrap()).collect()
}

fn matrix(value: &Value) -> Matrix {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(vector).collect();
    Matrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

/// (outputs, inputs, taps).
fn taps(value: &Value) -> Vec<Matrix> {
    let rows: Vec<Matrix> = value.as_array().unwrap().iter().map(matrix).collect();
    (0..rows[0].ncols())
        .map(|lag| Matrix::from_fn(rows.len(), rows[0].nrows(), |o, i| rows[o][(i, lag)]))
        .collect()
}

fn system(value: &Value) -> StateSpace {
    let part = |name: &str| matrix(&value[name]);
    StateSpace::new(part("A"), part("B"), part("C"), part("D")).unwrap()
}

fn assert_close(name: &Value, found: &[f64], expected: &[f64], tolerance: f64) {
    let scale = expected.iter().fold(1e-300, |scale: f64, value| scale.max(value.abs()));
    assert_eq!(found.len(), expected.len(), "{name}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * scale, "{name}: {a} and {b}");
    }
}

fn reading(case: &Value) -> Reading {
    serde_json::from_value(case["reading"].clone()).unwrap()
}

#[test]
fn operators() {
    let file = read("operators");
    for case in cases(&file, "deadzones") {
        let zones =
            Deadzones::new(vector(&case["thresholds"]), vector(&case["weights"]), reading(case));
        let zones = zones.unwrap();
        let mut state = zones.rest();
        state.previous = case["previous"].as_f64().unwrap();
        let mut signal = vector(&case["input"]);
        zones.in_place(&mut state, &mut signal);
        assert_close(&case["name"], &signal, &vector(&case["output"]), 1e-12);
    }
    for case in cases(&file, "plays") {
        let mut state = case["start"].as_f64().unwrap();
        let half_width = case["half_width"].as_f64().unwrap();
        let step = |value: &f64| {
            state = play(half_width, *value, state);
            state
        };
        let output: Vec<f64> = vector(&case["input"]).iter().map(step).collect();
        assert_close(&case["name"], &output, &vector(&case["output"]), 1e-12);
    }
    for case in cases(&file, "banks") {
        let bank = PlayBank::new(vector(&case["half_widths"]), vector(&case["weights"])).unwrap();
        let mut signal = vector(&case["input"]);
        bank.in_place(&mut bank.state_from(vector(&case["start"])).unwrap(), &mut signal);
        assert_close(&case["name"], &signal, &vector(&case["output"]), 1e-12);
    }
    for case in cases(&file, "gpis") {
        let (eta, g) = (vector(&case["thresholds"]), vector(&case["deadzone_weights"]));
        let plays = PlayBank::new(vector(&case["half_widths"]), vector(&case["weights"]));
        let gpi = Gpi::new(Deadzones::new(eta, g, reading(case)).unwrap(), plays.unwrap());
        let mut signal = vector(&case["input"]);
        gpi.in_place(&mut gpi.rest(), &mut signal);
        assert_close(&case["name"], &signal, &vector(&case["output"]), 1e-12);
    }
}

#[test]
fn fir() {
    for case in cases(&read("linear"), "fir") {
        let runs = case["experiments"].as_array().unwrap().iter().map(|run| {
            let input = matrix(&run["input"]);
            let covariates = Matrix::zeros(input.nrows(), 0);
            let warmup = run["warmup"].as_u64().unwrap() as usize;
            Experiment {
                input,
                output: matrix(&run["output"]),
                covariates,
                warmup,
                held_out: vec![],
            }
        });
        let runs: Vec<_> = runs.collect();
        let names =
            |count| (0..count).map(|index: usize| Channel::new(index.to_string(), "")).collect();
        let (inputs, outputs) = (names(runs[0].input.ncols()), names(runs[0].output.ncols()));
        let record = Record::new(runs, 1.0, inputs, outputs, vec![]).unwrap();
        let length = case["taps"].as_u64().unwrap() as usize;
        let fir = estimate(&record, length, case["ridge"].as_f64().unwrap()).unwrap();
        for (found, expected) in fir.markov.iter().zip(taps(&case["markov"])) {
            assert_close(&case["name"], found.as_slice(), expected.as_slice(), 1e-9);
        }
        let offsets = matrix(&case["offsets"]);
        assert_close(&case["name"], fir.offsets.as_slice(), offsets.as_slice(), 1e-9);
        assert_eq!(fir.rank as u64, case["rank"].as_u64().unwrap());
        let excited = &vector(&case["singular_values"])[..fir.rank];
        assert_close(&case["name"], &fir.singular_values[..fir.rank], excited, 1e-9);
    }
}

#[test]
fn era() {
    for case in cases(&read("linear"), "era") {
        let given = |name: &str| case[name].as_u64().map(|value| value as usize);
        let options = EraOptions { order: given("order"), blocks: given("blocks") };
        let era = realize(&taps(&case["markov"]), &options).unwrap();
        assert_eq!(era.system.order() as u64, case["realized_order"].as_u64().unwrap());
        assert_close(&case["name"], &era.singular_values, &vector(&case["singular_values"]), 1e-9);
        let expected = taps(&case["realized_markov"]);
        for (found, expected) in era.system.markov(expected.len()).iter().zip(&expected) {
            assert_close(&case["name"], found.as_slice(), expected.as_slice(), 1e-9);
        }
        let dc = matrix(&case["dc_gain"]);
        let found = era.system.dc_gain().unwrap();
        assert_close(&case["name"], found.as_slice(), dc.as_slice(), 1e-9);
    }
}

#[test]
fn zero_order_holds() {
    for case in cases(&read("linear"), "zero_order_hold") {
        let period = case["period"].as_f64().unwrap();
        let found = zero_order_hold(&system(&case["continuous"]), period).unwrap();
        let expected = system(&case["discrete"]);
        for (found, expected) in [(found.a(), expected.a()), (found.b(), expected.b())] {
            assert_close(&case["name"], found.as_slice(), expected.as_slice(), 1e-9);
        }
    }
}

#[test]
fn noncausal_inverses() {
    for case in cases(&read("linear"), "laurent") {
        let given = |name: &str| case[name].as_u64().map(|value| value as usize);
        let options = InverseOptions { causal: given("r"), noncausal: given("d"), tolerance: 1e-6 };
        let inverse = system(&case["system"]).noncausal_inverse(&options).unwrap();
        for (found, expected) in inverse.taps.iter().zip(taps(&case["taps"])) {
            assert_close(&case["name"], found.as_slice(), expected.as_slice(), 1e-9);
        }
        let seen = inverse.apply(&matrix(&case["y"])).unwrap();
        let expected = matrix(&case["v"]);
        assert_close(&case["name"], seen.values.as_slice(), expected.as_slice(), 1e-9);
    }
}
