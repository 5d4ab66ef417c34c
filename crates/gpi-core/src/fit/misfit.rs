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

use super::preparation::Prepared;
use super::refinement::Refinement;
use super::settings::MisfitSettings;
use crate::chain::hysteresis::Parameters;
use crate::{Error, Model, Record};

/// The misfit of each output and the movement of which it is a part, as root mean squares.
pub(super) struct Misfit {
    pub misfit: Vec<f64>,
    pub movement: Vec<f64>,
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
        let mut found = Self { misfit: Vec::new(), movement: Vec::new() };
        for output in 0..model.outputs().len() {
            let mut covariances = vec![0.0; settings.lags.into_iter().max().unwrap_or(1) + 1];
            let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
            let pairs = refinement.residuals.iter().zip(&moved).zip(scored.experiments());
            for ((residual, moved), experiment) in pairs {
                for rows in experiment.scored_rows(residual) {
                    let e = rows.column(output);
                    for (lag, sum) in covariances.iter_mut().enumerate().take(e.len()) {
                        *sum += (lag..e.len()).map(|k| e[k] * e[k - lag]).sum::<f64>();
                    }
                }
                for rows in experiment.scored_rows(moved) {
                    let y = rows.column(output);
                    sum += y.sum();
                    squares += y.norm_squared();
                    count += y.len() as f64;
                }
            }
            let variance = covariances[0] / count;
            let power = |lags: usize| {
                let mean = covariances[1..=lags].iter().sum::<f64>() / (lags as f64 * count);
                let error = variance / (count * lags as f64).sqrt();
                if mean > settings.standard_errors * error { mean.min(variance) } else { 0.0 }
            };
            found.misfit.push(settings.lags.map(power).into_iter().fold(0.0, f64::max).sqrt());
            found.movement.push((squares / count - (sum / count).powi(2)).max(0.0).sqrt());
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use crate::identify::{IdentifyOptions, identify};
    use crate::{Channel, Experiment, Matrix, Record};

    /// A gain of one with a cubic error of the given size, and white noise of 0.01.
    fn misfit(size: f64) -> (f64, f64) {
        let mut random = 4711.0;
        let mut noise = || {
            random = (random * 16807.0) % 2_147_483_647.0;
            (random / 2_147_483_647.0 - 0.5) * 12.0_f64.sqrt()
        };
        let u = Matrix::from_fn(6000, 1, |k, _| {
            let t = k as f64;
            if k < 50 { 0.0 } else { (0.031 * t).sin() + 0.5 * (0.0173 * t + 1.0).cos() - 0.5 }
        });
        let y = u.map(|u| u + size * (9.0 * u).sin() + 0.01 * noise());
        let channel = |name: &str| vec![Channel::new(name, "")];
        let run = vec![Experiment::new(u, y)];
        let record = Record::new(run, 1e3, channel("u"), channel("y"), vec![]).unwrap();
        let options = IdentifyOptions {
            delay: Some(0),
            half_widths: Some(crate::identify::Grid::Count(1)),
            thresholds: Some(crate::identify::Grid::Count(0)),
            ..IdentifyOptions::default()
        };
        let found = identify(&record, &options, &mut |_| true).unwrap();
        let model = found.model.with_prediction(&found.refinement, &record).unwrap();
        let prediction = model.prediction().unwrap();
        (prediction.misfit()[0], prediction.movement()[0])
    }

    #[test]
    fn a_misfit_is_told_from_noise() {
        let (nothing, movement) = misfit(0.0);
        assert!(nothing < 0.002, "{nothing}");
        assert!((0.6..1.0).contains(&movement), "{movement}");
        let (found, _) = misfit(0.02);
        assert!((found / (0.02 / 2.0_f64.sqrt()) - 1.0).abs() < 0.15, "{found}");
    }
}
