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
//! The same is done for every piece of a second. So that noise alone makes no piece stand out among B of them, `sqrt(2 ln B)`
//! more standard errors are asked for: the largest of B normal numbers is about so large.

use super::preparation::Prepared;
use super::refinement::Refinement;
use super::settings::MisfitSettings;
use crate::chain::hysteresis::Parameters;
use crate::{Error, Model, Record};

/// The misfit of each output and the movement of which it is a part, as root mean squares, and the misfit of the piece in
/// which it is largest.
pub(super) struct Misfit {
    pub misfit: Vec<f64>,
    pub movement: Vec<f64>,
    pub largest_misfit: Vec<f64>,
}

/// Sums over products of a residual with its past, by lag.
#[derive(Clone)]
struct Covariances {
    sums: Vec<f64>,
    count: f64,
}

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

    /// The mean square of the misfit, zero unless it exceeds so many standard errors.
    fn misfit(&self, lags: &[usize], standard_errors: f64) -> f64 {
        let variance = self.sums[0] / self.count;
        let power = |&lags: &usize| {
            let mean = self.sums[1..=lags].iter().sum::<f64>() / (lags as f64 * self.count);
            let error = variance / (self.count * lags as f64).sqrt();
            if mean > standard_errors * error { mean.min(variance) } else { 0.0 }
        };
        lags.iter().map(power).fold(0.0, f64::max)
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
        let (misfit, movement, largest_misfit) = (Vec::new(), Vec::new(), Vec::new());
        let mut found = Self { misfit, movement, largest_misfit };
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
            found.misfit.push(covariances.misfit(&settings.lags, errors).sqrt());
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
    fn the_worst_second_is_known() {
        let found = known(|k| if (4000..5000).contains(&k) { 0.1 } else { 0.0 });
        let (all, largest) = (found.misfit()[0], found.largest_misfit()[0]);
        assert!((0.05..0.08).contains(&largest) && all < 0.5 * largest, "{all} {largest}");
    }
}
