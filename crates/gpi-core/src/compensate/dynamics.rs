//! Inversion of the linear dynamics.

use super::CompensateOptions;
use crate::linear::{InverseOptions, NoncausalFir, StateSpace};
use crate::{Error, Matrix, Model};

/// Truncation error of the inverse of G. Later passes reduce what is left; a smaller one would lengthen the inverse.
const TOLERANCE: f64 = 1e-11;

impl Model {
    /// The model with G replaced by its DC gain.
    pub(super) fn quasi_static(&self) -> Result<Self, Error> {
        let mut still = self.clone();
        // loops act on the states of G, which the DC gain does not have
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
        "the DC gain of G is singular: an input has no effect, or two inputs have the same effect";
    gain.try_inverse().ok_or_else(|| Error::parameter("model", text, requirement))
}

/// The inverse of G and of the sections in parallel with it, from the displacement to v; without states, it is one tap.
pub(super) fn inverse(model: &Model, options: &CompensateOptions) -> Result<NoncausalFir, Error> {
    let linear = model.linear();
    if linear.order() == 0 {
        return Ok(NoncausalFir { taps: vec![inverse_gain(linear)?], noncausal: 0, error: 0.0 });
    }
    let wanted = InverseOptions { causal: None, noncausal: options.preview, tolerance: TOLERANCE };
    linear.noncausal_inverse(&wanted)
}

/// v (samples, inputs) for a displacement (samples, outputs) that is constant before and after its samples.
pub(super) fn invert(inverse: &NoncausalFir, displacement: &Matrix) -> Result<Matrix, Error> {
    let (samples, outputs) = displacement.shape();
    let rows = samples.max(inverse.taps.len());
    let long = Matrix::from_fn(rows, outputs, |k, o| displacement[(k.min(samples - 1), o)]);
    Ok(inverse.apply(&long)?.values.rows(0, samples).into_owned())
}
