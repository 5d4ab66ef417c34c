//! What an estimated model knows about its errors: the axes of the covariance by the model's numbers, and its misfit.

use super::misfit::Misfit;
use super::refinement::Refinement;
use crate::chain::point::Point;
use crate::uncertainty::Prediction;
use crate::uncertainty::eigen::descending_eigen;
use crate::{Error, Matrix, Model, Record};

/// Axes shorter than this part of the longest are left out: the numbers of an axis are stored with 24 bits.
const PRECISION: f64 = 1e-7;

/// The uncertain numbers of a model and the axes of their covariance.
fn axes_of(
    model: &Model,
    refinement: &Refinement,
    record: &Record,
) -> Result<(Vec<usize>, Vec<Vec<f32>>), Error> {
    let bands = &refinement.bands;
    let count = model.numbers().len();
    // the means of the outputs do not change
    let means = vec![0.0; model.outputs().len()];
    let numbers = |point: &Point| {
        let numbers = point.to_model(record, record, &means)?.numbers();
        Error::require_equal("numbers", ("model", count), ("a near one", numbers.len()))?;
        Ok(numbers)
    };
    let moved = bands.axes(numbers)?;
    let uncertain: Vec<usize> =
        (0..count).filter(|&i| moved.iter().any(|axis| axis[i] != 0.0)).collect();
    let scale: Vec<f64> = uncertain
        .iter()
        .map(|&i| moved.iter().map(|axis| axis[i].powi(2)).sum::<f64>().sqrt())
        .collect();
    let all =
        Matrix::from_fn(uncertain.len(), moved.len(), |row, axis| moved[axis][uncertain[row]]);
    let scaled = Matrix::from_fn(all.nrows(), all.ncols(), |i, k| all[(i, k)] / scale[i]);
    // turned to principal axes: no more of them than numbers are long
    let (lengths, turned) = descending_eigen(scaled.tr_mul(&scaled));
    let least = PRECISION.powi(2) * lengths.iter().copied().fold(0.0, f64::max);
    let axes = (all * turned)
        .column_iter()
        .zip(lengths.iter())
        .filter(|(_, length)| **length > least)
        .map(|(axis, _)| axis.iter().map(|&part| part as f32).collect())
        .collect();
    Ok((uncertain, axes))
}

impl Model {
    /// The model with what the [`Refinement`] that led to it on `record` knows about its errors; without it, where the
    /// covariance cannot be expressed by the numbers of the model or is not finite, or where a loop of the model diverges from
    /// rest. That is a numerical weakness, of which [`Model::prediction`] tells, and no error.
    ///
    /// ```
    /// use gpi_core::identify::{Grid, IdentifyOptions, identify};
    /// use gpi_core::{Channel, Experiment, Matrix, Record};
    /// let u = Matrix::from_fn(2000, 1, |k, _| if k < 20 { 0.0 } else { (0.02 * k as f64 + 1e-5 * (k * k) as f64).sin() });
    /// let y = Matrix::from_fn(2000, 1, |k, _| 2.0 * u[k] + 1e-3 * (7.0 * k as f64).cos());
    /// let channel = |name| vec![Channel::new(name, "")];
    /// let record = Record::new(vec![Experiment::new(u, y)], 1e3, channel("u"), channel("y"), vec![])?;
    /// let [plays, deadzones] = [Grid::Count(1), Grid::Count(0)].map(Some);
    /// let options = IdentifyOptions {
    ///     delay: Some(0), half_widths: plays, thresholds: deadzones, ..IdentifyOptions::default()
    /// };
    /// let found = identify(&record, &options, &mut |_| true)?;
    /// let model = found.model.with_prediction(&found.refinement, &record)?;
    /// assert!(model.prediction().is_some());
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// A record of other channels than the model's, or one that the refinement did not see.
    pub fn with_prediction(
        mut self,
        refinement: &Refinement,
        record: &Record,
    ) -> Result<Self, Error> {
        let experiments = ("record", record.experiments().len());
        let known = ("refinement", refinement.residuals.len());
        Error::require_equal("experiments", experiments, known)?;
        let Ok((numbers, axes)) = axes_of(&self, refinement, record) else { return Ok(self) };
        let Misfit { misfit, expected_misfit, movement, largest_misfit } =
            match Misfit::of(&self, refinement, record) {
                Err(Error::Diverged { .. }) => return Ok(self),
                known => known?,
            };
        let prediction =
            Prediction { numbers, axes, misfit, expected_misfit, movement, largest_misfit };
        self.prediction = prediction.is_finite().then_some(prediction);
        Ok(self)
    }
}
