//! The tests on records of a known model with a known residual.

use super::outcome::PREDICTION;
use super::*;
use crate::linear::TransferFunction;
use crate::operators::{Deadzones, Gpi, PlayBank, Reading};
use crate::{Channel, Experiment};

const SAMPLES: usize = 4000;

/// Standard normal numbers: Lehmer's generator, sums of twelve.
fn noise(seed: u64) -> Vec<f64> {
    let mut x = 48_271 * (seed + 1) % 2_147_483_647;
    let mut uniform = || {
        x = x * 48_271 % 2_147_483_647;
        x as f64 / 2_147_483_647.0
    };
    (0..SAMPLES).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
}

fn model() -> Model {
    let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided).unwrap();
    let plays = PlayBank::new(vec![0.0, 0.5, 1.0], vec![1.0, 0.4, 0.3]).unwrap();
    let linear =
        TransferFunction::new(&[0.2], &[1.0, -1.5, 0.7]).unwrap().to_state_space().unwrap();
    let channel = |name: &str| vec![Channel::new(name, "")];
    let hysteresis = vec![Gpi::new(envelope, plays)];
    Model::new(1000.0, channel("u"), channel("y"), hysteresis, linear, vec![0.0]).unwrap()
}

/// A drive whose swing grows and falls.
fn drive() -> Vec<f64> {
    let mut slow = 0.0;
    let fast = noise(999);
    (0..SAMPLES)
        .map(|k| {
            let t = k as f64 / SAMPLES as f64;
            slow = 0.8 * slow + fast[k];
            (0.4 + (12.0 * t).sin().powi(2)) * slow + 2.0 * (40.0 * t).sin()
        })
        .collect()
}

/// A record of the true model with this residual on top.
fn recorded(residual: &[f64]) -> Record {
    let model = model();
    let column = |values: &[f64]| Matrix::from_column_slice(values.len(), 1, values);
    let input = column(&drive());
    let output = model.simulate(&input).unwrap() + column(residual);
    let covariates = Matrix::zeros(input.nrows(), 0);
    let run = Experiment { input, output, covariates, warmup: 0, held_out: vec![] };
    let (u, y) = (model.inputs().to_vec(), model.outputs().to_vec());
    Record::new(vec![run], 1000.0, u, y, vec![]).unwrap()
}

fn tested(residual: &[f64]) -> Vec<ResidualTest> {
    let (record, options) = (recorded(residual), ResidualOptions::default());
    residual_tests(&model(), &record, &options, &mut |_| true).unwrap()
}

fn failed(residual: &[f64]) -> Vec<&'static str> {
    let tests = tested(residual);
    tests.iter().filter(|test| !test.passed()).map(|test| test.name).collect()
}

/// Noise of standard deviation 0.1 with a signal of this size on top.
fn with(size: f64, signal: impl Fn(usize) -> f64) -> Vec<f64> {
    let values: Vec<f64> = (0..SAMPLES).map(signal).collect();
    let rms = (values.iter().map(|x| x * x).sum::<f64>() / SAMPLES as f64).sqrt();
    noise(7).iter().zip(values).map(|(e, x)| 0.1 * (e + size * x / rms)).collect()
}

/// `e(k) = 0.95 e(k-1) + w(k)`.
fn coloured(seed: u64) -> Vec<f64> {
    let mut state = 0.0;
    let filter = |w: f64| {
        state = 0.95 * state + 0.1 * w;
        state
    };
    noise(seed).into_iter().map(filter).collect()
}

#[test]
fn every_test_has_its_name_and_threshold() {
    let tests = tested(&noise(1));
    assert_eq!(tests.iter().map(|test| test.name).collect::<Vec<_>>(), NAMES);
    let chance = 0.01 / NAMES.len() as f64;
    for test in &tests {
        let Some(Significance { p_value, level }) = test.significance else { continue };
        assert!((0.0..=1.0).contains(&p_value), "{test:?}");
        assert!(level > 0.0 && level <= chance * (1.0 + 1e-6), "{test:?}");
    }
    let without: Vec<&str> =
        tests.iter().filter(|test| test.significance.is_none()).map(|test| test.name).collect();
    assert_eq!(without, [PREDICTION, "outliers"]);
    assert!(STRUCTURE.iter().all(|name| NAMES.contains(name)));
}

#[test]
fn decision_threshold_and_p_value_agree() {
    let u = drive();
    let sized = |size: f64| -> Vec<Vec<f64>> {
        vec![
            with(size, |_| 1.0),
            with(size, |k| (0.314 * k as f64).sin()),
            with(size, |k| u[k]),
            with(size, |k| u[k].abs()),
            with(size, |k| k as f64),
            with(size, |k| f64::from(u8::from(k % 999 == 5))),
            with(size, |k| coloured(3)[k]),
        ]
    };
    let residuals: Vec<Vec<f64>> = [0.0, 0.03, 0.1, 0.2, 0.5, 3.0, 1e3]
        .into_iter()
        .flat_map(sized)
        .chain([coloured(5), vec![0.0; SAMPLES]])
        .collect();
    let (mut failures, mut passes) = (vec![0; NAMES.len()], vec![0; NAMES.len()]);
    for residual in &residuals {
        for (place, test) in tested(residual).iter().enumerate() {
            assert_eq!(test.passed(), test.statistic <= test.threshold, "{test:?}");
            if let Some(Significance { p_value, level }) = test.significance {
                assert_eq!(test.passed(), p_value >= level, "{test:?}");
            }
            if test.passed() { passes[place] += 1 } else { failures[place] += 1 }
        }
    }
    // both decisions were seen of all tests but those of what is none of these signals
    assert!(passes.iter().all(|&count| count > 0), "{passes:?}");
    assert!(failures.iter().filter(|&&count| count > 0).count() >= 10, "{failures:?}");
}

/// The autocorrelation of a residual that is large against noise and small in size has no p-value.
#[test]
fn small_correlations_of_a_long_record_pass_without_a_p_value() {
    let longer: Vec<f64> = (0..25).flat_map(noise).collect();
    let residual = |k: usize| longer[k] + 0.06 * longer[k.saturating_sub(1)];
    let record = |samples: usize| {
        let u: Vec<f64> = drive().into_iter().cycle().take(samples).collect();
        let input = Matrix::from_column_slice(samples, 1, &u);
        let disturbance = Matrix::from_fn(samples, 1, |k, _| 0.1 * residual(k));
        let output = model().simulate(&input).unwrap() + disturbance;
        recorded(&[0.0; SAMPLES]).with_experiments(vec![Experiment::new(input, output)]).unwrap()
    };
    let of = |samples: usize| {
        let options = ResidualOptions::default();
        let tests = residual_tests(&model(), &record(samples), &options, &mut |_| true).unwrap();
        tests.into_iter().find(|test| test.name == WHITENESS).unwrap()
    };
    let (short, long) = (of(SAMPLES), of(longer.len()));
    assert!(short.significance.is_some());
    assert!(long.significance.is_none() && long.passed());
    assert!(significance::chi_square_tail(long.statistic, 25.0) < 1e-20);
}

#[test]
fn white_noise_passes() {
    let records = 50;
    let failures: Vec<_> =
        (0..records).map(|seed| failed(&noise(seed))).filter(|names| !names.is_empty()).collect();
    // half a record is expected
    assert!(failures.len() <= 2, "{failures:?}");
    assert!(!failures.iter().flatten().any(|name| *name == "level-to-level"));
}

#[test]
fn noise_with_memory_is_no_dependence() {
    let mut structured = 0;
    for seed in 0..50 {
        let names = failed(&coloured(seed));
        assert!(names.contains(&"whiteness"));
        structured += usize::from(names.iter().any(|name| STRUCTURE.contains(name)));
        assert!(!names.contains(&"level-to-level"));
    }
    assert!(structured <= 2, "{structured}");
}

#[test]
fn dynamics_that_change_with_the_swing_fail_from_level_to_level() {
    let u = drive();
    let swing = |k: usize| (12.0 * k as f64 / SAMPLES as f64).sin().powi(2);
    for lag in [0, 2, 5, 11] {
        let residual = with(1.0, |k| if k < lag { 0.0 } else { swing(k) * u[k - lag] });
        assert!(failed(&residual).contains(&"level-to-level"), "lag {lag}");
    }
}

#[test]
fn dynamics_that_are_missing_at_every_swing_are_told_apart() {
    let u = drive();
    let residual = with(3.0, |k| if k < 4 { 0.0 } else { u[k] - 0.7 * u[k - 1] + 0.5 * u[k - 4] });
    let names = failed(&residual);
    assert!(names.contains(&"past-input"));
    assert!(!names.contains(&"level-to-level"), "{names:?}");
}

#[test]
fn a_line_of_any_size_is_found() {
    for size in [0.3, 1.0, 3.0, 10.0, 100.0] {
        let residual = with(size, |k| (0.314 * k as f64).sin());
        assert!(failed(&residual).contains(&"lines"), "{size}");
    }
}

#[test]
fn a_line_is_found_in_short_runs() {
    for frequency in [0.1, 0.314, 1.5] {
        let residual = with(1.0, |k| (frequency * k as f64).sin());
        let mut record = recorded(&residual).experiments()[0].clone();
        record.held_out = (1..10).map(|i| 400 * i..400 * i + 60).collect();
        let record = recorded(&residual).with_experiments(vec![record]).unwrap();
        let options = ResidualOptions::default();
        let tests = residual_tests(&model(), &record, &options, &mut |_| true).unwrap();
        assert!(tests.iter().any(|t| t.name == "lines" && !t.passed()), "{frequency}");
    }
}

#[test]
fn a_steep_spectrum_has_no_line() {
    for seed in 0..20 {
        let mut level = 0.0;
        let walk = |w: f64| {
            level += 0.1 * w;
            level
        };
        let residual: Vec<f64> = noise(seed).into_iter().map(walk).collect();
        assert!(!failed(&residual).contains(&"lines"), "{seed}");
    }
}

#[test]
fn a_resonance_is_no_line() {
    for seed in 0..20 {
        let (mut last, mut before) = (0.0, 0.0);
        let ring = |w: f64| {
            (last, before) = (1.95 * last - 0.96 * before + w, last);
            last
        };
        let residual: Vec<f64> = noise(seed).into_iter().map(ring).collect();
        assert!(!failed(&residual).contains(&"lines"), "{seed}");
    }
}

#[test]
fn the_past_of_v_is_looked_at() {
    let v = model().intermediate(&Matrix::from_column_slice(SAMPLES, 1, &drive())).unwrap();
    let residual = with(0.5, |k| if k < 9 { 0.0 } else { v[k - 8] - v[k - 9] });
    assert!(failed(&residual).contains(&"past-intermediate"));
}

#[test]
fn an_offset_fails_alone() {
    let residual: Vec<f64> = noise(3).iter().map(|e| 0.1 * e + 0.05).collect();
    assert_eq!(failed(&residual), ["mean"]);
}

#[test]
fn nothing_left_is_nothing_found() {
    assert!(failed(&[0.0; SAMPLES]).is_empty());
}

#[test]
fn another_rate_is_refused() {
    let model = model();
    let signal = Matrix::from_column_slice(SAMPLES, 1, &drive());
    let covariates = Matrix::zeros(SAMPLES, 0);
    let run = Experiment {
        input: signal.clone(),
        output: signal,
        covariates,
        warmup: 0,
        held_out: vec![],
    };
    let (u, y) = (model.inputs().to_vec(), model.outputs().to_vec());
    let record = Record::new(vec![run], 500.0, u, y, vec![]).unwrap();
    let options = ResidualOptions::default();
    let error = residual_tests(&model, &record, &options, &mut |_| true).unwrap_err();
    assert!(error.to_string().contains("500") && error.to_string().contains("1000"), "{error}");
}
