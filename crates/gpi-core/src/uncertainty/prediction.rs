//! What a model knows about the errors of its own simulations, for data that it has not seen.

use crate::Error;

/// What a model knows about the errors of its own simulations.
///
/// Two errors remain in a model that was estimated from noisy data. Its parameters are uncertain: their covariance is
/// `C = sum_k d_k d_k'`, each axis d_k the change of the model's numbers over one standard deviation. The numbers are the
/// thresholds and weights of the deadzones and the half-widths and weights of the plays of each input; the elements of A, B,
/// C and D, column by column; the offsets; and the values of the effects that the input drives. And its structure leaves
/// a [`misfit`](Prediction::misfit), which the input drives.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Prediction {
    /// Places of the uncertain numbers among all.
    pub(crate) numbers: Vec<usize>,
    /// d_k, (axes, uncertain numbers), each number in its own unit.
    pub(crate) axes: Vec<Vec<f32>>,
    /// Of each output, the root mean square error on the training data that the input drives, in its unit.
    pub(crate) misfit: Vec<f64>,
    /// Of each output, the misfit that is to be expected, including one that the noise may hide; empty if it is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) expected_misfit: Vec<f64>,
    /// Of each output, the root mean square movement about its mean in the training data, in its unit.
    pub(crate) movement: Vec<f64>,
    /// Of each output, the misfit of that second of the training data in which it was largest; empty if it is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) largest_misfit: Vec<f64>,
}

impl Prediction {
    /// Of each output, the root mean square error on the training data that the input drives, in its unit.
    pub fn misfit(&self) -> &[f64] {
        &self.misfit
    }

    /// Of each output, the misfit that is to be expected, in its unit: the one that was found, or where none was found, the root of the
    /// expected square of a misfit that the noise may hide. For a model that was saved by a version that did not determine it, the one
    /// that was found.
    pub fn expected_misfit(&self) -> &[f64] {
        if self.expected_misfit.is_empty() { &self.misfit } else { &self.expected_misfit }
    }

    /// Of each output, the root mean square movement about its mean in the training data, in its unit.
    pub fn movement(&self) -> &[f64] {
        &self.movement
    }

    /// Of each output, the misfit of that second of the training data in which it was largest, in the unit of the output;
    /// empty for a model that was saved by a version that did not determine it.
    pub fn largest_misfit(&self) -> &[f64] {
        &self.largest_misfit
    }

    /// Whether every number is finite, as a file requires.
    pub(crate) fn is_finite(&self) -> bool {
        let sizes = [&self.misfit, &self.expected_misfit, &self.movement, &self.largest_misfit];
        self.axes.iter().flatten().all(|part| part.is_finite())
            && sizes.into_iter().flatten().all(|value| value.is_finite())
    }

    /// Refuses axes that are not those of a model of so many numbers and outputs.
    pub(crate) fn validate(&self, count: usize, outputs: usize) -> Result<(), Error> {
        let requirement = "must name numbers of the model";
        let inside = self.numbers.iter().all(|&place| place < count);
        Error::require(inside, "prediction.numbers", format!("{:?}", self.numbers), requirement)?;
        let uncertain = ("prediction.numbers", self.numbers.len());
        for axis in &self.axes {
            Error::require_equal("numbers", ("prediction.axes", axis.len()), uncertain)?;
        }
        let outputs = ("model", outputs);
        for (name, values) in
            [("prediction.misfit", &self.misfit), ("prediction.movement", &self.movement)]
        {
            Error::require_equal("outputs", (name, values.len()), outputs)?;
        }
        for (name, values) in [
            ("prediction.expected_misfit", &self.expected_misfit),
            ("prediction.largest_misfit", &self.largest_misfit),
        ] {
            if !values.is_empty() {
                Error::require_equal("outputs", (name, values.len()), outputs)?;
            }
        }
        Ok(())
    }
}
