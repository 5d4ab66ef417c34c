//! The part of a model's residual that is not white noise.
//!
//! A residual is `e(k) = m(k) + n(k)`, m the error of the model's structure and n the noise. m is smooth, as the motion is,
//! and white noise is not correlated with its past. With the autocovariance `r(l) = mean e(k) e(k - l)` of N scored samples,
//!
//! ```text
//! var m = max_L mean of r(1) .. r(L),   standard error of the mean = r(0) / sqrt(N L) for white noise
//! ```
//!
//! over the numbers of lags L at which the mean exceeds twice its standard error; m is zero where none does. Coloured noise
//! counts as misfit: the residual alone does not tell the two apart.
//!
//! A misfit that is not found may still be there, hidden by the noise. The mean `a` of `r(1) .. r(L)`, L the most lags, has a normal
//! error of the standard deviation `s`, and var m is not negative. Without other knowledge, what is to be expected is the mean of this
//! normal distribution beyond zero:
//!
//! ```text
//! E[var m] = a + s phi(a / s) / Phi(a / s)
//! ```
//!
//! with the density phi and the distribution function Phi of the standard normal distribution.
//!
//! The same is done for every piece of a second. So that noise alone makes no piece stand out among B of them, `sqrt(2 ln B)`
//! more standard errors are asked for: the largest of B normal numbers is about so large.

use super::preparation::Prepared;
use super::refinement::Refinement;
use super::settings::MisfitSettings;
use crate::chain::hysteresis::Parameters;
use crate::{Error, Model, Record};
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// The misfit of each output that is found, the one that is to be expected, and the movement of which they are a part, as root mean
/// squares, and the misfit of the piece in which it is largest.
pub(super) struct Misfit {
    pub misfit: Vec<f64>,
    pub expected_misfit: Vec<f64>,
    pub movement: Vec<f64>,
    pub largest_misfit: Vec<f64>,
}

/// Sums over products of a residual with its past, by lag.
#[derive(Clone)]
struct Covariances {
    sums: Vec<f64>,
    count: f64,
}

/// Standard errors below zero at which an estimate of a square is cut off. By hand: chance alone does not lead there.
const LEAST: f64 = 5.0;

impl Covariances {
    fn new(settings: &MisfitSettings) -> Self {
        let lags = settings.lags.into_iter().max().unwrap_or(1);
        Self { sums: vec![0.0; lags + 1], count: 0.0 }
    }

    fn add(&mut self, e: &[f64]) {
        for (lag, sum) in self.sums.iter_mut().enumerate().take(e.len()) {
            *sum += (lag..e.len()).map(|k| e[k] * e[k - lag]).sum::<f64>();
        }
        self.count += e.len() as f64;
    }

    fn variance(&self) -> f64 {
        self.sums[0] / self.count
    }

    /// The mean over so many lags, and its standard error for white noise.
    fn mean(&self, lags: usize) -> (f64, f64) {
        let mean = self.sums[1..=lags].iter().sum::<f64>() / (lags as f64 * self.count);
        (mean, self.variance() / (self.count * lags as f64).sqrt())
    }

    /// The mean square of the misfit, zero unless it exceeds so many standard errors.
    fn misfit(&self, lags: &[usize], standard_errors: f64) -> f64 {
        let power = |&lags: &usize| {
            let (mean, error) = self.mean(lags);
            if mean > standard_errors * error { mean.min(self.variance()) } else { 0.0 }
        };
        lags.iter().map(power).fold(0.0, f64::max)
    }

    /// The mean square of a misfit that is to be expected where none is found.
    fn hidden(&self) -> f64 {
        let (mean, error) = self.mean(self.sums.len() - 1);
        if error == 0.0 || !error.is_finite() {
            return 0.0;
        }
        let (normal, a) = (Normal::standard(), mean / error);
        // far below zero, the quotient of the two would be that of two zeros
        let a = a.max(-LEAST);
        (error * (a + normal.pdf(a) / normal.cdf(a))).clamp(0.0, self.variance())
    }
}

impl Misfit {
    /// From the residuals of a refinement on a record.
    pub(super) fn of(
        model: &Model,
        refinement: &Refinement,
        record: &Record,
    ) -> Result<Self, Error> {
        let settings = MisfitSettings::default();
        settings.validate()?;
        // an unknown initial state is not a misfit: the same samples are scored as in the fit
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let scored = Prepared::new(record, channels)?.record;
        let driven = model.driven();
        let moved: Result<Vec<_>, Error> =
            scored.experiments().iter().map(|e| driven.simulate(&e.input)).collect();
        let moved = moved?;
        let length = settings.samples.max((settings.seconds * record.rate()).round() as usize);
        let mut found = Self {
            misfit: Vec::new(),
            expected_misfit: Vec::new(),
            movement: Vec::new(),
            largest_misfit: Vec::new(),
        };
        for output in 0..model.outputs().len() {
            let mut covariances = Covariances::new(&settings);
            let mut pieces = Vec::new();
            let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
            let pairs = refinement.residuals.iter().zip(&moved).zip(scored.experiments());
            for ((residual, moved), experiment) in pairs {
                for rows in experiment.scored_rows(residual) {
                    let e: Vec<f64> = rows.column(output).iter().copied().collect();
                    covariances.add(&e);
                    for piece in e.chunks(length) {
                        let mut own = Covariances::new(&settings);
                        own.add(piece);
                        pieces.push(own);
                    }
                }
                for rows in experiment.scored_rows(moved) {
                    let y = rows.column(output);
                    sum += y.sum();
                    squares += y.norm_squared();
                    count += y.len() as f64;
                }
            }
            let errors = settings.standard_errors;
            let misfit = covariances.misfit(&settings.lags, errors);
            let expected = if misfit > 0.0 { misfit } else { covariances.hidden() };
            found.misfit.push(misfit.sqrt());
            found.expected_misfit.push(expected.sqrt());
            let errors = errors + (2.0 * (pieces.len().max(1) as f64).ln()).sqrt();
            let largest = pieces.iter().map(|own| own.misfit(&settings.lags, errors));
            found.largest_misfit.push(largest.fold(0.0, f64::max).sqrt());
            found.movement.push((squares / count - (sum / count).powi(2)).max(0.0).sqrt());
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::Covariances;
    use crate::identify::{IdentifyOptions, identify};
    use crate::linear::StateSpace;
    use crate::{Channel, Experiment, Matrix, Model, Prediction, Record};

    /// What is known of a gain of one with a sine of the input as its error, `size(k)`, and white noise of 0.01.
    fn known(size: impl Fn(usize) -> f64) -> Prediction {
        predicting(size, |_| ()).prediction().unwrap().clone()
    }

    /// The model with what is known of it, after it was changed.
    fn predicting(size: impl Fn(usize) -> f64, change: impl Fn(&mut Model)) -> Model {
        let mut random = 4711.0;
        let mut noise = || {
            random = (random * 16807.0) % 2_147_483_647.0;
            (random / 2_147_483_647.0 - 0.5) * 12.0_f64.sqrt()
        };
        let u = Matrix::from_fn(6000, 1, |k, _| {
            let t = k as f64;
            if k < 50 { 0.0 } else { (0.031 * t).sin() + 0.5 * (0.0173 * t + 1.0).cos() - 0.5 }
        });
        let y =
            Matrix::from_fn(6000, 1, |k, _| u[k] + size(k) * (9.0 * u[k]).sin() + 0.01 * noise());
        let channel = |name: &str| vec![Channel::new(name, "")];
        let run = vec![Experiment::new(u, y)];
        let record = Record::new(run, 1e3, channel("u"), channel("y"), vec![]).unwrap();
        let options = IdentifyOptions {
            delay: Some(0),
            half_widths: Some(crate::identify::Grid::Count(1)),
            thresholds: Some(crate::identify::Grid::Count(0)),
            ..IdentifyOptions::default()
        };
        let mut found = identify(&record, &options, &mut |_| true).unwrap();
        change(&mut found.model);
        found.model.with_prediction(&found.refinement, &record).unwrap()
    }

    #[test]
    fn a_model_that_diverges_from_rest_has_no_prediction() {
        let diverging = |model: &mut Model| {
            // a gain at which the output overflows, so that the model has as many numbers as before
            let [a, b, c] =
                [(0, 0), (0, 1), (1, 0)].map(|(rows, columns)| Matrix::zeros(rows, columns));
            let d = Matrix::from_element(1, 1, f64::MAX);
            model.linear = StateSpace::new(a, b, c, d).unwrap();
            assert!(model.simulate(&Matrix::from_fn(9, 1, |k, _| 5.0 * k as f64)).is_err());
        };
        assert!(predicting(|_| 0.0, |_| ()).prediction().is_some());
        assert!(predicting(|_| 0.0, diverging).prediction().is_none());
    }

    #[test]
    fn a_misfit_is_told_from_noise() {
        let nothing = known(|_| 0.0);
        assert!(nothing.misfit()[0] < 0.002, "{nothing:?}");
        assert_eq!(nothing.largest_misfit(), [0.0]);
        let movement = nothing.movement()[0];
        assert!((0.6..1.0).contains(&movement), "{movement}");
        let found = known(|_| 0.02).misfit()[0];
        assert!((found / (0.02 / 2.0_f64.sqrt()) - 1.0).abs() < 0.15, "{found}");
    }

    #[test]
    fn a_misfit_that_the_noise_may_hide_is_expected() {
        let found = known(|_| 0.02);
        assert_eq!(found.expected_misfit(), found.misfit());
        // white noise of variance 1: a mean of zero over 10 lags, and one of -2 and of +1 standard errors
        let expected = |errors: f64| {
            let mut noise = Covariances { sums: vec![0.0; 11], count: 4000.0 };
            noise.sums[0] = 4000.0;
            noise.sums[3] = 10.0 * 4000.0 * errors / 200.0;
            noise.hidden() * 200.0
        };
        // the means of the normal distribution beyond zero: sqrt(2 / pi), phi(2) / Phi(-2) - 2, 1 + phi(1) / Phi(1)
        for (errors, mean) in [(0.0, 0.797_885), (-2.0, 0.373_216), (1.0, 1.287_600)] {
            assert!((expected(errors) - mean).abs() < 1e-5, "{errors}: {}", expected(errors));
        }
        assert!(expected(-50.0) > 0.0 && expected(-50.0) < 0.2);
        assert_eq!(Covariances { sums: vec![0.0; 11], count: 4000.0 }.hidden(), 0.0);
    }

    #[test]
    fn the_worst_second_is_known() {
        let found = known(|k| if (4000..5000).contains(&k) { 0.1 } else { 0.0 });
        let (all, largest) = (found.misfit()[0], found.largest_misfit()[0]);
        assert!((0.05..0.08).contains(&largest) && all < 0.5 * largest, "{all} {largest}");
    }
}
