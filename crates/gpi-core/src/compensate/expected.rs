//! The error that is to be expected of a drive: not that of the model, but that of the stage.
//!
//! Let y be the true output of the stage under the drive, without the noise of the sensor, and r the reference. Four parts
//! of `y - r` are independent of each other, so that their squares add up:
//!
//! ```text
//! inversion:   y_hat - r                                     y_hat the model's output, what limits and passes leave
//! parameters:  sum_k (dy_hat / d d_k)^2                      d_k the axes of the parameters' covariance
//! model:       (unseen misfit rms(r) / rms(y_train))^2       what the model's structure leaves, scaled to the movement
//! past:        mean_s (y_hat(start s) - y_hat)^2             other places of the plays before the drive begins
//! ```
//!
//! The first two lines of variances are sensitivities along this drive: a parameter that the training data hardly show
//! counts as much as this drive moves it. The misfit is what the residual of the training data contains beyond noise, or where
//! it contains no more than noise, what the noise may hide ([`Prediction::expected_misfit`](crate::Prediction::expected_misfit)); it
//! grows with the movement, and is larger on a drive that the model has not seen because the estimate has
//! adapted to the training data.

use super::start::Start;
use crate::parallel::install;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};
use crate::{Error, Matrix, Model, ModelState};
use rayon::prelude::*;

settings! {
    /// How the expected error is computed.
    struct ExpectationSettings {
        /// Ratio of the misfit on data that the fit has not seen to that on the training data: the estimate absorbs a part
        /// of the misfit. The median over simulated stages, see docs/tracking.md.
        unseen: f64 = 2.0, FROM_ONE;
        /// Longest step along an axis, in standard deviations: the response is linear over it.
        step: f64 = 0.1, POSITIVE;
        /// The step as a part of each number at most, so that it is small along axes that the data hardly determine.
        part: f64 = 1e-5, POSITIVE;
        /// Numbers below this part of the largest count as this part, so that zeros do not forbid a step. By hand.
        least: f64 = 1e-4, PART;
        /// Standard deviations of the bound, which 95 % of Gaussian errors do not exceed.
        deviations: f64 = 2.0, POSITIVE;
    }
}

/// The root mean square error that is to be expected, over all outputs, in their unit, and its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedError {
    /// Root of the sum of the squares of all parts that are known.
    pub rms: f64,
    /// What 95 % of the errors at the worst sample do not exceed.
    pub bound: f64,
    /// The error of the model's own output.
    pub inversion: f64,
    /// From the covariance of the parameters; `None` for a model without [`Prediction`](crate::Prediction).
    pub parameters: Option<f64>,
    /// From the misfit of the model's structure; `None` for a model without [`Prediction`](crate::Prediction).
    pub model: Option<f64>,
    /// From the unknown state before the drive begins.
    pub past: f64,
}

impl ExpectedError {
    /// Names of the parts that are not known, so that `rms` and `bound` are too small.
    pub fn missing(&self) -> Vec<&'static str> {
        let parts = [("parameters", self.parameters), ("model", self.model)];
        parts.into_iter().filter(|(_, part)| part.is_none()).map(|(name, _)| name).collect()
    }
}

/// A drive (lead + samples, inputs) for a reference (lead + samples, outputs), and the output that a model predicts.
pub(super) struct Run<'a> {
    pub model: &'a Model,
    pub drive: &'a Matrix,
    pub reference: &'a Matrix,
    pub predicted: &'a Matrix,
    pub start: &'a Start,
    pub lead: usize,
}

impl Run<'_> {
    /// The error that is to be expected behind the lead.
    pub(super) fn expected_error(&self) -> Result<ExpectedError, Error> {
        let settings = ExpectationSettings::default();
        settings.validate()?;
        let missed = self.scored(self.predicted - self.reference);
        let parameters = self.of_parameters(&settings)?;
        let model = self.of_model(&settings);
        let past = self.of_past()?;
        let rms = |squares: &Matrix| squares.mean().sqrt();
        let inversion = rms(&missed.map(|value| value * value));
        let none = Matrix::zeros(missed.nrows(), missed.ncols());
        let (known, scaled) =
            (parameters.as_ref().unwrap_or(&none), model.clone().unwrap_or_default());
        let misfit = |o: usize| scaled.get(o).map_or(0.0, |part: &f64| part.powi(2));
        let bound = |(k, o): (usize, usize)| {
            let variance = known[(k, o)] + past[(k, o)] + misfit(o);
            missed[(k, o)].abs() + settings.deviations * variance.sqrt()
        };
        let places = (0..missed.ncols()).flat_map(|o| (0..missed.nrows()).map(move |k| (k, o)));
        let found = ExpectedError {
            rms: 0.0,
            bound: places.map(bound).fold(0.0, f64::max),
            inversion,
            parameters: parameters.as_ref().map(rms),
            model: model.map(|own| {
                (own.iter().map(|part| part * part).sum::<f64>() / own.len() as f64).sqrt()
            }),
            past: rms(&past),
        };
        let parts = [Some(found.inversion), found.parameters, found.model, Some(found.past)];
        let total = parts.into_iter().flatten().map(|part| part * part).sum::<f64>().sqrt();
        Ok(ExpectedError { rms: total, ..found })
    }

    /// The rows behind the lead.
    fn scored(&self, signal: Matrix) -> Matrix {
        signal.rows(self.lead, signal.nrows() - self.lead).into_owned()
    }

    fn output(&self, model: &Model, mut state: ModelState) -> Result<Matrix, Error> {
        Ok(self.scored(model.simulate_from(&mut state, self.drive)?))
    }

    /// Variances of the output by the parameters, (samples, outputs).
    fn of_parameters(&self, settings: &ExpectationSettings) -> Result<Option<Matrix>, Error> {
        let Some(prediction) = self.model.prediction() else { return Ok(None) };
        let numbers = self.model.numbers();
        let largest = numbers.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let along = |axis: &Vec<f32>| {
            let parts = || prediction.numbers.iter().zip(axis).map(|(&i, &d)| (i, f64::from(d)));
            let reach = |(i, part): (usize, f64)| {
                let value: f64 = numbers[i];
                settings.part * value.abs().max(settings.least * largest) / part.abs()
            };
            let step = parts().filter(|(_, d)| *d != 0.0).map(reach).fold(settings.step, f64::min);
            let moved = |step: f64| {
                let mut there = numbers.clone();
                parts().for_each(|(i, part)| there[i] += step * part);
                let model = self.model.with_numbers(&there)?;
                let state = self.start.state(&model)?;
                self.output(&model, state)
            };
            // a neighbour may be no valid model: a gap below zero, an unstable pole
            let here = || self.scored(self.predicted.clone());
            let pair = (moved(step), moved(-step));
            let slope = match pair {
                (Ok(up), Ok(down)) => (up - down) / (2.0 * step),
                (Ok(up), Err(_)) => (up - here()) / step,
                (Err(_), Ok(down)) => (here() - down) / step,
                (Err(error), Err(_)) => return Err(error),
            };
            Ok::<_, Error>(slope.map(|change| change * change))
        };
        let (rows, outputs) = (self.predicted.nrows() - self.lead, self.predicted.ncols());
        let none = || Matrix::zeros(rows, outputs);
        let sum = |a: Matrix, b: Matrix| Ok(a + b);
        install(|| prediction.axes.par_iter().map(along).try_reduce(none, sum)).map(Some)
    }

    /// The misfit of each output, scaled to the movement of its reference.
    fn of_model(&self, settings: &ExpectationSettings) -> Option<Vec<f64>> {
        let prediction = self.model.prediction()?;
        let reference = self.scored(self.reference.clone());
        let pairs = prediction.expected_misfit().iter().zip(&prediction.movement);
        let scaled = pairs.zip(reference.column_iter()).map(|((misfit, movement), reference)| {
            let own = reference.variance().sqrt();
            let share = if *movement > 0.0 { own / movement } else { 1.0 };
            settings.unseen * misfit * share
        });
        Some(scaled.collect())
    }

    /// Mean squares of what other states at the start change, (samples, outputs).
    fn of_past(&self) -> Result<Matrix, Error> {
        let expected = self.scored(self.predicted.clone());
        let others = self.start.others(self.model)?;
        let mut sum = Matrix::zeros(expected.nrows(), expected.ncols());
        let count = others.len().max(1) as f64;
        for state in others {
            let change = self.output(self.model, state)? - &expected;
            sum += change.map(|value| value * value / count);
        }
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compensate::CompensateOptions;
    use crate::linear::StateSpace;
    use crate::operators::{Deadzones, Gpi, PlayBank, Reading};
    use crate::{Channel, Prediction};

    /// `v = 1 u + 0.5 F_1(u)`, without dynamics.
    fn model() -> Model {
        let scalar = |value| Matrix::from_element(1, 1, value);
        let none = Matrix::zeros(0, 0);
        let (b, c) = (Matrix::zeros(0, 1), Matrix::zeros(1, 0));
        let linear = StateSpace::new(none, b, c, scalar(1.0)).unwrap();
        let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided).unwrap();
        let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0, 1.0], vec![1.0, 0.5]).unwrap());
        let channel = |name| vec![Channel::new(name, "")];
        Model::new(1e3, channel("u"), channel("y"), vec![gpi], linear, vec![0.0]).unwrap()
    }

    fn reference() -> Matrix {
        Matrix::from_fn(400, 1, |k, _| 3.0 + 2.0 * (0.05 * k as f64).sin())
    }

    #[test]
    fn usual_settings_are_valid() {
        ExpectationSettings::default().validate().unwrap();
    }

    #[test]
    fn parts_that_are_not_known_are_named() {
        let found = model().compensate(&reference(), &CompensateOptions::default()).unwrap();
        assert_eq!(found.expected_error.missing(), ["parameters", "model"]);
        assert_eq!(found.expected_error.parameters, None);
    }

    #[test]
    fn parts_are_those_of_the_definitions() {
        let mut model = model();
        // the numbers: threshold, slope, half-widths, weights, D, offset; axes of the first weight and of the offset
        let axes = vec![vec![0.01, 0.0], vec![0.0, 0.03]];
        let (misfit, movement) = (vec![0.02], vec![0.5]);
        let prediction = Prediction {
            numbers: vec![4, 7],
            axes,
            misfit,
            // what the noise may hide counts, not only what was found
            expected_misfit: vec![0.03],
            movement,
            largest_misfit: vec![],
        };
        model.prediction = Some(prediction);
        let options =
            CompensateOptions { start: Some(Start::Input(vec![0.0])), ..Default::default() };
        let reference = reference();
        let found = model.compensate(&reference, &options).unwrap();
        let expected = &found.expected_error;
        let by_weight = 1e-4 * found.drive.norm_squared() / 400.0;
        let parameters = (by_weight + 9e-4).sqrt();
        assert!((expected.parameters.unwrap() / parameters - 1.0).abs() < 1e-6);
        let misfit = 2.0 * 0.03 * reference.column(0).variance().sqrt() / 0.5;
        assert!((expected.model.unwrap() / misfit - 1.0).abs() < 1e-12);
        assert_eq!(expected.past, 0.0);
        let rms = (parameters.powi(2) + misfit.powi(2)).sqrt();
        assert!((expected.rms / rms - 1.0).abs() < 1e-6);
        assert!(expected.bound > 2.0 * expected.rms);
    }

    #[test]
    fn the_past_is_unknown_until_the_plays_are_swept() {
        let start = |start: Start| CompensateOptions { start: Some(start), ..Default::default() };
        let past = |options: &CompensateOptions, reference: &Matrix| {
            model().compensate(reference, options).unwrap().expected_error.past
        };
        let input = start(Start::Input(vec![2.0]));
        let swept = past(&input, &reference());
        let still = past(&input, &Matrix::from_element(400, 1, 2.5));
        assert!(still > 0.2 && swept > 0.0 && swept < 0.5 * still, "{still} {swept}");
        // at rest at 2, F is between 1 and 3, so the output between 2.5 and 3.5
        let output = start(Start::Output { input: 2.0, output: 2.7 });
        assert!(past(&output, &Matrix::from_element(400, 1, 2.7)) < 1e-6);
        let state = start(Start::State { input: vec![2.0], state: model().start(&[2.0]).unwrap() });
        assert_eq!(past(&state, &reference()), 0.0);
    }

    #[test]
    fn a_start_is_where_the_drive_goes_on() {
        let asked = |output: f64| CompensateOptions {
            start: Some(Start::Output { input: 2.0, output }),
            ..CompensateOptions::default()
        };
        let reference = Matrix::from_fn(200, 1, |k, _| 3.2 + 0.01 * k as f64);
        let found = model().compensate(&reference, &asked(3.2)).unwrap();
        assert!((found.drive[0] - 2.0).abs() < 1e-9 && found.error.max < 1e-9);
        // the play stands at 2.4: it moves from u = 3.4 on, at y = 4.6
        assert!((found.drive[100] - 3.0).abs() < 1e-9);
        let refused = model().compensate(&reference, &asked(3.6)).unwrap_err().to_string();
        assert!(refused.contains("start_output") && refused.contains("3.5"), "{refused}");
    }

    #[test]
    fn backlash_is_jumped_across() {
        let mut model = model();
        let plays = PlayBank::new(vec![0.0, 0.3, 1.0], vec![0.0, 1.0, 0.5]).unwrap();
        let gpi = Gpi::new(model.hysteresis()[0].envelope().clone(), plays);
        let (inputs, outputs) = (model.inputs().to_vec(), model.outputs().to_vec());
        let linear = model.linear().clone();
        model = Model::new(1e3, inputs, outputs, vec![gpi], linear, vec![0.0]).unwrap();
        let found = model.compensate(&reference(), &CompensateOptions::default()).unwrap();
        assert!(found.error.rms < 1e-5, "{:?} {:?}", found.error, found.passes);
        let most =
            (1..400).map(|k| (found.drive[k] - found.drive[k - 1]).abs()).fold(0.0, f64::max);
        assert!((0.55..0.75).contains(&most), "{most}");
        let refused = model.compensator((-10.0, 10.0)).unwrap_err().to_string();
        assert!(refused.contains("backlash") && refused.contains("0.3"), "{refused}");
    }
}
