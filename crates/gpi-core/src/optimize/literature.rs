//! Problems of the literature, with their published minima.

use super::problem::Check;
use super::{
    Bounds, LeastSquares, Linearization, Loss, Minimum, SolverSettings, Status, levenberg_marquardt,
};
use crate::Matrix;
use nalgebra::DVector;
use std::convert::Infallible;

type Residuals = dyn Fn(&DVector<f64>) -> (DVector<f64>, Matrix);

/// Residuals (measured minus model) and the derivatives of the model by the unknowns.
struct Problem {
    residuals: Box<Residuals>,
    /// Bounds of the unknowns themselves.
    bounds: Option<(DVector<f64>, DVector<f64>)>,
    loss: Loss,
    /// Whether the curvature pretends to be that of a part of the residuals.
    approximate: bool,
}

impl Problem {
    fn new(residuals: impl Fn(&DVector<f64>) -> (DVector<f64>, Matrix) + 'static) -> Self {
        let (bounds, loss) = (None, Loss::squares(1));
        Self { residuals: Box::new(residuals), bounds, loss, approximate: false }
    }

    fn minimum(&self, start: &[f64]) -> Minimum<DVector<f64>> {
        self.minimum_with_goal(start, 500, 0.0)
    }

    fn minimum_with_goal(&self, start: &[f64], steps: usize, goal: f64) -> Minimum<DVector<f64>> {
        let settings = SolverSettings { steps, gain: 1e-14, goal, ..SolverSettings::default() };
        let start = DVector::from_column_slice(start);
        levenberg_marquardt(self, start, &settings, &mut |_| Ok(())).unwrap_or_else(|e| match e {})
    }
}

impl LeastSquares for Problem {
    type Point = DVector<f64>;
    type Error = Infallible;

    fn evaluate(&self, point: &DVector<f64>) -> Result<f64, Infallible> {
        Ok((self.residuals)(point).0.iter().map(|&e| self.loss.of(0, e).1).sum())
    }

    fn linearize(
        &self,
        point: &DVector<f64>,
        _: Check<Infallible>,
    ) -> Result<Linearization, Infallible> {
        let (residuals, jacobian) = (self.residuals)(point);
        let weights = residuals.map(|e| self.loss.of(0, e).0);
        let weighted = Matrix::from_diagonal(&weights) * &jacobian;
        Ok(Linearization {
            gram: jacobian.tr_mul(&weighted).into(),
            descent: weighted.tr_mul(&residuals),
            cost: self.evaluate(point)?,
            age: self.approximate.then_some(0),
        })
    }

    fn bounds(&self, point: &DVector<f64>) -> Bounds {
        match &self.bounds {
            Some((low, high)) => Bounds { lower: low - point, upper: high - point },
            None => Bounds::none(point.len()),
        }
    }

    fn step(&self, point: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        point + step
    }

    fn is_linear(&self, _: usize) -> bool {
        false
    }

    fn rounding(&self) -> f64 {
        1e-30
    }
}

/// What `1 / (1 + a_1 q^-1 + a_2 q^-2)` makes of a signal.
fn divided(signal: impl Iterator<Item = f64>, a: [f64; 2]) -> Vec<f64> {
    let mut last = [0.0; 2];
    let next = |value: f64| {
        last = [value - a[0] * last[0] - a[1] * last[1], last[0]];
        last[0]
    };
    signal.map(next).collect()
}

/// Two lags of 800 and 170 samples, `y = (b_1 q^-1 + b_2 q^-2) / (1 + a_1 q^-1 + a_2 q^-2) u`, from lags of 500 and 250 samples (Ljung,
/// *System Identification*, 1999, section 10.3, output error). All four coefficients hardly differ in what they do; those of powers of
/// `z - 1` do.
#[test]
fn coefficients_of_two_slow_lags_are_found_in_a_few_steps() {
    const SAMPLES: usize = 6000;
    let u = |k: usize| (2.399 * (k / 300) as f64).sin();
    let delayed = move |by: usize| (0..SAMPLES).map(move |k| if k < by { 0.0 } else { u(k - by) });
    let coefficients = |constants: [f64; 2]| {
        let [p, q] = constants.map(|constant: f64| (-1.0 / constant).exp());
        [-p - q, p * q, 0.0, (1.0 - p) * (1.0 - q)]
    };
    let output = move |x: &[f64]| -> Vec<f64> {
        let driven = delayed(1).zip(delayed(2)).map(|(first, second)| x[2] * first + x[3] * second);
        divided(driven, [x[0], x[1]])
    };
    let wanted = coefficients([800.0, 170.0]);
    let measured = output(&wanted);
    // from coefficients p (z - 1) + (p + q) or p z + q to those of powers of z
    let by_powers = |x: &[f64], is_delta: bool| {
        let difference = if is_delta { [x[0], x[2]] } else { [0.0; 2] };
        [x[0], x[1] - difference[0], x[2], x[3] - difference[1]]
    };
    let steps = |is_delta: bool| {
        let measured = measured.clone();
        let problem = Problem::new(move |x| {
            let x = by_powers(x.as_slice(), is_delta);
            let (a, y) = ([x[0], x[1]], output(&x));
            let past =
                |by: usize| std::iter::repeat_n(0.0, by).chain(y.iter().map(|y| -y)).take(SAMPLES);
            let columns = [divided(past(1), a), divided(past(2), a)];
            let columns = columns.into_iter().chain([1, 2].map(|by| divided(delayed(by), a)));
            let residuals = measured.iter().zip(&y).map(|(measured, y)| measured - y);
            let mut columns: Vec<Vec<f64>> = columns.collect();
            for pair in columns.chunks_mut(2).filter(|_| is_delta) {
                let [p, q] = pair else { continue };
                p.iter_mut().zip(q).for_each(|(p, q)| *p -= *q);
            }
            let columns: Vec<f64> = columns.into_iter().flatten().collect();
            (DVector::from_iterator(SAMPLES, residuals), Matrix::from_vec(SAMPLES, 4, columns))
        });
        let mut start = coefficients([500.0, 250.0]);
        if is_delta {
            (start[1], start[3]) = (start[0] + start[1], start[2] + start[3]);
        }
        let found = problem.minimum(&start);
        let point = DVector::from_row_slice(&by_powers(found.point.as_slice(), is_delta));
        // beyond this, all is rounding
        let steps = found.history.iter().take_while(|cost| **cost > 1e-15).count();
        (is_near(&point, &wanted, 1e-9), steps)
    };
    let (is_found, few) = steps(true);
    let (_, many) = steps(false);
    assert!(is_found && few < 6 && many > 6, "{is_found} {few} {many}");
}

/// H. H. Rosenbrock (1960): a curved valley, minimum 0 at (1, 1).
fn rosenbrock() -> Problem {
    Problem::new(|x| {
        let residuals = DVector::from_vec(vec![-10.0 * (x[1] - x[0] * x[0]), x[0] - 1.0]);
        (residuals, Matrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]))
    })
}

fn is_near(found: &DVector<f64>, wanted: &[f64], tolerance: f64) -> bool {
    found.iter().zip(wanted).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn rosenbrock_is_followed_to_its_minimum() {
    let found = rosenbrock().minimum(&[-1.2, 1.0]);
    assert!(is_near(&found.point, &[1.0, 1.0], 1e-9), "{}", found.point);
    assert!(found.history.len() < 40 && found.history.windows(2).all(|pair| pair[1] < pair[0]));
}

#[test]
fn an_approximate_curvature_is_kept_and_leads_there_too() {
    let problem = Problem { approximate: true, ..rosenbrock() };
    let found = problem.minimum(&[-1.2, 1.0]);
    assert!(is_near(&found.point, &[1.0, 1.0], 1e-6), "{}", found.point);
}

/// M. J. D. Powell (1962): the Jacobian is singular at the minimum 0 at the origin.
#[test]
fn powells_singular_function_reaches_zero() {
    let (r5, r10) = (5.0_f64.sqrt(), 10.0_f64.sqrt());
    let problem = Problem::new(move |x| {
        let (a, b) = (x[1] - 2.0 * x[2], x[0] - x[3]);
        let model = [x[0] + 10.0 * x[1], r5 * (x[2] - x[3]), a * a, r10 * b * b];
        let (da, db) = (2.0 * a, 2.0 * r10 * b);
        let rows = [
            [1.0, 10.0, 0.0, 0.0],
            [0.0, 0.0, r5, -r5],
            [0.0, da, -2.0 * da, 0.0],
            [db, 0.0, 0.0, -db],
        ];
        let residuals = DVector::from_iterator(4, model.into_iter().map(|value| -value));
        (residuals, Matrix::from_row_slice(4, 4, &rows.concat()))
    });
    let found = problem.minimum(&[3.0, -1.0, 0.0, 1.0]);
    assert!(is_near(&found.point, &[0.0; 4], 1e-3), "{}", found.point);
    assert!(found.linearization.cost < 1e-12);
}

/// Problem 2 of W. Hock and K. Schittkowski (1981): Rosenbrock's valley with x2 >= 1.5, minimum 0.0504261879.
#[test]
fn a_minimum_on_a_bound_is_found_and_known_as_such() {
    let bounds = (DVector::from_vec(vec![f64::NEG_INFINITY, 1.5]), Bounds::none(2).upper);
    let problem = Problem { bounds: Some(bounds), ..rosenbrock() };
    let found = problem.minimum(&[2.0, 2.0]);
    assert!(is_near(&found.point, &[1.224_370_749, 1.5], 1e-8), "{}", found.point);
    assert!((found.linearization.cost - 0.050_426_187_9).abs() < 1e-10);
    assert_eq!(problem.bounds(&found.point).free(), [0]);
    assert_eq!(found.status, Status::Converged);
}

/// x^2 and 1: each step halves x, and the cost x^4 + 1 comes no nearer to a half.
#[test]
fn a_minimisation_that_does_not_come_near_its_goal_ends() {
    let problem = Problem::new(|x| {
        let residuals = DVector::from_vec(vec![-x[0] * x[0], 1.0]);
        (residuals, Matrix::from_row_slice(2, 1, &[2.0 * x[0], 0.0]))
    });
    let of = |goal| problem.minimum_with_goal(&[100.0], 40, goal);
    let (all, ended) = (of(0.0), of(0.5));
    assert_eq!([all.status, ended.status], [Status::Converged, Status::Limit]);
    assert!(ended.history.len() < all.history.len());
    assert_eq!(ended.history, all.history[..ended.history.len()]);
    // one within reach changes nothing
    assert_eq!(of(1.5).history, all.history);
}

/// Two unknowns of which the data show the sum alone: any split is as good, and none runs away.
#[test]
fn a_rank_deficient_problem_ends_near_its_start() {
    let problem = Problem::new(|x| {
        let residuals = DVector::from_fn(5, |k, _| (k as f64) * (3.0 - x[0] - x[1]));
        (residuals, Matrix::from_fn(5, 2, |k, _| k as f64))
    });
    let found = problem.minimum(&[0.5, -0.5]);
    assert!((found.point.sum() - 3.0).abs() < 1e-9);
    assert!((found.point[0] - found.point[1] - 1.0).abs() < 1e-6, "{}", found.point);
}

/// A straight line with three wrong samples of twenty: squares follow these, Huber's loss (P. J. Huber, 1964) hardly.
#[test]
fn hubers_loss_resists_outliers() {
    let line = |x: &DVector<f64>| {
        let noise = |k: usize| 0.01 * (7.0 * k as f64).sin();
        let wrong = |k: usize| if k % 8 == 3 { 40.0 } else { 0.0 };
        let value = |k: usize| 1.0 + 0.5 * k as f64 + noise(k) + wrong(k);
        let residuals = DVector::from_fn(20, |k, _| value(k) - x[0] - x[1] * k as f64);
        (residuals, Matrix::from_fn(20, 2, |k, j| if j == 0 { 1.0 } else { k as f64 }))
    };
    let squares = Problem::new(line).minimum(&[0.0, 0.0]);
    let loss = Loss { turns: vec![0.02], ..Loss::squares(1) };
    let robust = Problem { loss, ..Problem::new(line) }.minimum(&[0.0, 0.0]);
    let error = |found: &DVector<f64>| (found[0] - 1.0).abs() + 20.0 * (found[1] - 0.5).abs();
    assert!(error(&squares.point) > 1.0, "{}", squares.point);
    assert!(error(&robust.point) < 0.03, "{}", robust.point);
}

#[test]
fn an_interruption_ends_the_work() {
    struct Stopped;
    struct Endless;
    impl LeastSquares for Endless {
        type Point = ();
        type Error = Stopped;
        fn evaluate(&self, (): &()) -> Result<f64, Stopped> {
            Ok(1.0)
        }
        fn linearize(&self, (): &(), check: Check<Stopped>) -> Result<Linearization, Stopped> {
            check()?;
            let (gram, descent) = (Matrix::identity(1, 1), DVector::from_element(1, 1.0));
            Ok(Linearization { gram: gram.into(), descent, cost: 2.0, age: None })
        }
        fn bounds(&self, (): &()) -> Bounds {
            Bounds::none(1)
        }
        fn step(&self, (): &(), _: &DVector<f64>) {}
        fn is_linear(&self, _: usize) -> bool {
            false
        }
        fn rounding(&self) -> f64 {
            0.0
        }
    }
    let mut calls = 0;
    let mut check = |_: f64| {
        calls += 1;
        if calls > 3 { Err(Stopped) } else { Ok(()) }
    };
    let found = levenberg_marquardt(&Endless, (), &SolverSettings::default(), &mut check);
    assert!(found.is_err() && calls == 4);
}
