//! What a model file says of the uncertainty of the model's parameters.
//!
//! A refinement ends with the covariance of all parameters, residuals of all experiments and the history of the fit. A
//! model file keeps what a reader of the numbers needs: each parameter with its standard deviation, the quantities of
//! each effect likewise, the noise floor, and how the fit ended. It does not keep the covariance, the history, the
//! residuals, nor the standard deviations of what follows from the parameters (poles, Markov parameters, frequency
//! response, loop); `refine` computes them again from the record.

/// Standard deviations on each side of an estimate between which 95 % of a normal distribution lie.
const BAND: f64 = 1.96;

/// A parameter and how sure it is, in its own unit.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// Such as `u.weights[3]`.
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// Its standard deviation: 0 for a value that was not estimated or is held at its bound, none where the data do not
    /// determine it.
    pub std: Option<f64>,
    /// Its unit, empty for a pure number or where it is unknown.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Whether the data determine it, see [`Estimate::new`].
    pub determined: bool,
}

/// An effect's quantities.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EffectEstimates {
    /// The effect.
    pub name: String,
    /// What an engineer would call its parameters, as in [`Model::quantities`](crate::Model::quantities).
    pub parameters: Vec<Estimate>,
}

/// The noise of each output, and what it was estimated from.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EstimatedNoise {
    /// Standard deviation of each output's noise, in its unit.
    pub rms: Vec<f64>,
    /// `repeated-periods`, `rests` or `high-frequency-residual`.
    pub how: String,
    /// The period in samples, for repeated periods.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period: Option<usize>,
    /// The number of samples, for rests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

/// What a model file keeps of a refinement.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimates {
    /// How the fit ended: `converged`, `stalled` or `limit`.
    pub status: String,
    /// All that was estimated.
    pub parameters: Vec<Estimate>,
    /// The quantities of every effect of the model, in its order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEstimates>,
    /// Names and shares of the combinations of parameters that the data do not determine.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undetermined: Vec<Vec<(String, f64)>>,
    /// Root mean square residual of each output on the training data, in its unit.
    pub residual_rms: Vec<f64>,
    /// The noise floor.
    pub noise_floor: EstimatedNoise,
    /// Isolated outliers in the residual.
    pub outliers: usize,
    /// Whether Huber's loss was used.
    pub robust: bool,
}

impl Estimate {
    /// A parameter; a deviation that is not finite is none.
    ///
    /// It is determined if it has a deviation, and if its 95 % interval does not hold zero where zero would mean that
    /// what the parameter describes is absent (`zero_is_absence`: gains, coefficients, amplitudes).
    pub fn new(
        name: impl Into<String>,
        unit: impl Into<String>,
        value: f64,
        deviation: f64,
        zero_is_absence: bool,
    ) -> Self {
        let holds_zero = deviation > 0.0 && value.abs() <= BAND * deviation;
        Self {
            name: name.into(),
            value,
            std: Some(deviation).filter(|deviation| deviation.is_finite()),
            unit: unit.into(),
            determined: deviation.is_finite() && !(zero_is_absence && holds_zero),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_that_holds_zero_determines_no_gain() {
        let is_determined = |value, deviation, zero_is_absence| {
            Estimate::new("gain", "", value, deviation, zero_is_absence).determined
        };
        assert!(!is_determined(0.3, 0.2, true) && !is_determined(-0.3, 0.2, true));
        assert!(is_determined(0.4, 0.2, true) && is_determined(-0.4, 0.2, true));
        // a time of zero or a place at zero is a value like others
        assert!(is_determined(0.3, 0.2, false));
        // a weight at its bound is known
        assert!(is_determined(0.0, 0.0, true));
        assert!(!is_determined(5.0, f64::NAN, false));
        assert_eq!(Estimate::new("gain", "", 5.0, f64::NAN, true).std, None);
    }
}
