//! The linear dynamics run backwards.

use super::CompensateOptions;
use crate::linear::{InverseOptions, NoncausalFir, StateSpace};
use crate::{Error, Matrix, Model};

/// From the displacement to v.
pub(super) enum Backward {
    /// G and what stands beside it, by its noncausal inverse.
    Fir(NoncausalFir),
    /// A gain.
    Gain(Matrix),
}

impl Model {
    /// The model whose G is only its DC gain.
    pub(super) fn quasi_static(&self) -> Result<Self, Error> {
        let mut still = self.clone();
        // loops act on the states of G, which are gone
        still.effects.retain(|effect| effect.place().closed_loops().is_none());
        still.linear = StateSpace::delayed_gain(&self.linear().dc_gain()?, 0);
        Ok(still)
    }
}

/// The inverse of the DC gain.
pub(super) fn inverse_gain(linear: &StateSpace) -> Result<Matrix, Error> {
    let gain = linear.dc_gain()?;
    let text = format!("{:?}", gain.as_slice());
    let requirement =
        "the DC gain of G has no inverse: an input moves nothing, or two move the same";
    gain.try_inverse().ok_or_else(|| Error::parameter("model", text, requirement))
}

impl Backward {
    /// Samples by which v begins before the displacement.
    pub(super) fn lead(&self) -> usize {
        match self {
            Self::Fir(inverse) => inverse.noncausal,
            Self::Gain(_) => 0,
        }
    }

    pub(super) fn new(model: &Model, options: &CompensateOptions) -> Result<Self, Error> {
        /// What is cut off here, the next pass makes up for.
        const TOLERANCE: f64 = 1e-11;
        let linear = model.linear();
        if linear.order() == 0 {
            return Ok(Self::Gain(inverse_gain(linear)?));
        }
        let wanted =
            InverseOptions { causal: None, noncausal: options.preview, tolerance: TOLERANCE };
        Ok(Self::Fir(linear.noncausal_inverse(&wanted)?))
    }

    /// v (samples, inputs) for a displacement (samples, outputs) that stood before and stays afterwards.
    pub(super) fn run(&self, displacement: &Matrix) -> Result<Matrix, Error> {
        match self {
            Self::Gain(inverse) => Ok(displacement * inverse.transpose()),
            Self::Fir(inverse) => {
                let rows = displacement.nrows().max(inverse.taps.len());
                let last = displacement.nrows() - 1;
                let long = Matrix::from_fn(rows, displacement.ncols(), |k, o| {
                    displacement[(k.min(last), o)]
                });
                let v = inverse.apply(&long)?.values;
                Ok(v.rows(0, displacement.nrows()).into_owned())
            }
        }
    }
}
