use super::*;
use crate::operators::play;
use crate::{Channel, Experiment};

/// Numbers between -1 and 1 that look random.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A slow walk in two inputs, in volts around 40.
fn inputs(samples: usize) -> Matrix {
    let mut next = noise(3);
    let mut u = Matrix::zeros(samples, 2);
    for k in 1..samples {
        for i in 0..2 {
            u[(k, i)] = 0.97 * u[(k - 1, i)] + 4.0 * next();
        }
    }
    u.add_scalar(40.0)
}

fn record(input: Matrix, output: Matrix) -> Record {
    let channels = |n: usize| (0..n).map(|i| Channel::new(format!("c{i}"), "")).collect();
    let (u, y) = (channels(input.ncols()), channels(output.ncols()));
    let rows = input.nrows();
    let held_out = vec![rows / 4..rows / 3, rows / 2..3 * rows / 5];
    let run = Experiment { held_out, ..Experiment::new(input, output) };
    Record::new(vec![run], 100.0, u, y, vec![]).unwrap()
}

fn named<'a>(found: &'a [Rival], name: &str) -> &'a Rival {
    found.iter().find(|one| one.name == name).unwrap()
}

fn deviation(record: &Record) -> f64 {
    let zero: Vec<Matrix> = record
        .experiments()
        .iter()
        .map(|e| {
            let mut centred = e.output.clone();
            for mut column in centred.column_iter_mut() {
                let mean = column.mean();
                column.add_scalar_mut(-mean);
            }
            centred
        })
        .collect();
    SimulationError::of(record, &zero, false).rms
}

/// An output as a function of both inputs.
type Plant<'a> = &'a dyn Fn(&[f64], &[f64]) -> Vec<f64>;

/// The outputs of two plants.
fn outputs(u: &Matrix, of: [Plant; 2]) -> Matrix {
    let columns: Vec<Vec<f64>> = u.column_iter().map(|c| c.iter().copied().collect()).collect();
    let values = of.map(|of| nalgebra::DVector::from_vec(of(&columns[0], &columns[1])));
    Matrix::from_columns(&values)
}

#[test]
fn each_rival_finds_its_own_kind_of_plant() {
    let u = inputs(6000);
    let polynomial = outputs(
        &u,
        [&|a, b| a.iter().zip(b).map(|(a, b)| 3.0 + 0.02 * a.powi(3) - b).collect(), &|a, _| {
            a.iter().map(|a| 0.1 * a * a).collect()
        }],
    );
    let filtered = |x: &[f64], taps: &[f64]| -> Vec<f64> {
        let at = |k: usize| taps.iter().enumerate().map(|(l, h)| h * x[k.saturating_sub(l)]).sum();
        (0..x.len()).map(at).collect()
    };
    let fir = outputs(
        &u,
        [&|a, _| filtered(a, &[0.0, 0.5, 0.3, 0.0, -0.2]), &|a, b| {
            filtered(a, &[1.0]).iter().zip(filtered(b, &[0.0, 0.7])).map(|(a, b)| a + b).collect()
        }],
    );
    let recursive = |x: &[f64]| -> Vec<f64> {
        let mut y = vec![0.0, 0.0];
        for k in 2..x.len() {
            y.push(1.9 * y[k - 1] - 0.95 * y[k - 2] + 0.05 * x[k - 1]);
        }
        y
    };
    let arx = outputs(&u, [&|a, _| recursive(a), &|_, b| recursive(b)]);
    let hysteresis = |x: &[f64], j: f64, delay: usize| -> Vec<f64> {
        let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
        let (half_width, mut place) = (j / 21.0 * 0.5 * (high - low), x[0]);
        let all: Vec<f64> = x
            .iter()
            .map(|x| {
                place = play(half_width, *x, place);
                2.0 * x + place
            })
            .collect();
        (0..x.len()).map(|k| all[k.saturating_sub(delay)]).collect()
    };
    let plays = outputs(&u, [&|a, _| hysteresis(a, 5.0, 11), &|_, b| hysteresis(b, 9.0, 11)]);
    for (name, output, detail) in [
        ("static-polynomial", polynomial, "degree 3"),
        ("fir", fir, "5 lags"),
        ("arx", arx, ""), // higher orders are exact too
        ("plays", plays, "20 plays, delay of 11 samples"),
    ] {
        let record = record(u.clone(), output);
        let found = rivals(&record, None).unwrap();
        let own = named(&found, name);
        let size = deviation(&record);
        assert!(own.detail.starts_with(detail), "{own:?}");
        assert!(own.train_rms < 1e-5 * size && own.holdout_rms.unwrap() < 1e-5 * size, "{own:?}");
        assert_eq!(found.len(), 4);
    }
}

#[test]
fn what_is_held_out_takes_no_part() {
    let u = inputs(4000);
    let y = Matrix::from_fn(4000, 1, |k, _| u[(k.saturating_sub(2), 0)] + 0.3 * u[(k, 1)]);
    let clean = record(u, y);
    let mut runs = clean.experiments().to_vec();
    for held in runs[0].held_out.clone() {
        held.for_each(|k| runs[0].output[(k, 0)] += 1e3);
    }
    let spoilt = clean.with_experiments(runs).unwrap();
    for (a, b) in rivals(&clean, None).unwrap().iter().zip(rivals(&spoilt, None).unwrap()) {
        assert_eq!((a.name, a.train_rms, &a.detail), (b.name, b.train_rms, &b.detail));
        assert!(b.holdout_rms.unwrap() > 900.0, "the offset of the training data is kept: {b:?}");
    }
}

#[test]
fn another_record_is_simulated_from_its_own_start() {
    let u = inputs(4000);
    let plant = |u: &Matrix, start: f64| {
        let mut y = Matrix::zeros(u.nrows(), 1);
        y[(0, 0)] = start;
        for k in 1..u.nrows() {
            y[(k, 0)] = 0.98 * y[(k - 1, 0)] + 0.02 * u[(k, 0)] + 0.1;
        }
        y
    };
    let training = record(u.clone(), plant(&u, 0.0));
    let other = u.rows(2000, 500).into_owned();
    let other = training
        .with_experiments(vec![Experiment::new(other.clone(), plant(&other, 70.0))])
        .unwrap();
    let found = rivals(&training, Some(&other)).unwrap();
    assert!(named(&found, "arx").holdout_rms.unwrap() < 1e-6, "{found:?}");
    assert!(named(&found, "fir").holdout_rms.unwrap() > 0.1, "an unknown start: {found:?}");
}

#[test]
fn what_the_data_cannot_determine_is_left_out() {
    let u = inputs(30);
    let y = Matrix::from_fn(30, 1, |k, _| u[(k, 0)]);
    let names: Vec<_> = rivals(&record(u, y), None).unwrap().iter().map(|one| one.name).collect();
    assert!(names.contains(&"static-polynomial") && !names.contains(&"plays"), "{names:?}");
    let flat = record(Matrix::from_element(200, 1, 2.0), Matrix::from_fn(200, 1, |k, _| k as f64));
    assert!(rivals(&flat, None).unwrap().iter().all(|one| one.train_rms.is_finite()));
}

#[test]
fn other_channels_are_refused() {
    let u = inputs(100);
    let two = record(u.clone(), u.clone());
    let one = record(u.columns(0, 1).into_owned(), u.columns(0, 1).into_owned());
    let error = rivals(&two, Some(&one)).unwrap_err().to_string();
    assert!(error.contains("held-out inputs"), "{error}");
}

#[test]
fn todays_settings_are_valid() {
    RivalPolicy::default().validate().unwrap();
}
