//! What is asked of a refinement, and what it answers.

use crate::optimize::Status;
use crate::uncertainty::{Bands, NoiseFloor, NoiseMethod};
use crate::{EffectEstimates, Error, Estimate, EstimatedNoise, Estimates, Matrix, Model};

/// What a refinement may move besides weights, deadzone weights, dynamics and offset, and how residuals
/// count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefineOptions {
    /// Whether the thresholds of the deadzones move; they stay on their side of zero.
    pub thresholds: bool,
    /// Whether the half-widths of the plays move; the widest one stays and sets the scale of z.
    pub half_widths: bool,
    /// Huber's loss instead of squares; decided by whether isolated outliers are found when `None`.
    pub robust: Option<bool>,
    /// Knots of a slowly varying offset of each experiment, linear between them; at most 1 is a
    /// constant. It is estimated so that it does not disturb the rest; the model keeps its mean.
    pub offset_knots: usize,
}

/// An estimated number.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Such as `u.weights[3]`: numbered as in the model.
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// Its standard deviation; 0 for a weight that is held at zero by its bound, NaN where the data do
    /// not determine it.
    pub deviation: f64,
    /// Its unit, empty for a pure number or where it is unknown.
    pub unit: String,
    /// Whether zero means that what it describes is absent: weights, coefficients of numerators.
    pub zero_is_absence: bool,
}

impl Parameter {
    /// The parameter as a model file keeps it, with whether it is determined.
    pub fn estimate(&self) -> Estimate {
        let Self { name, value, deviation, unit, zero_is_absence } = self;
        Estimate::new(name, unit, *value, *deviation, *zero_is_absence)
    }
}

/// How a model was refined, and the uncertainty of its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// How it ended.
    pub status: Status,
    /// Root mean square residual at the start and after every step that was accepted.
    pub history: Vec<f64>,
    /// All that was estimated, with standard deviations from the residual's own autocorrelation.
    pub parameters: Vec<Parameter>,
    /// Unidentifiable parameters: names and shares of each combination that the data do not determine, largest first.
    pub undetermined: Vec<Vec<(String, f64)>>,
    /// Root mean square residual of each output on the training data.
    pub residual_rms: Vec<f64>,
    /// Measured minus simulated outputs of each experiment, (samples, outputs), with the initial
    /// states that were fitted; warm-ups included.
    pub residuals: Vec<Matrix>,
    /// The noise of each output, and what it was estimated from.
    pub noise_floor: NoiseFloor,
    /// Isolated outliers in the residual.
    pub outliers: usize,
    /// Whether Huber's loss was used.
    pub robust: bool,
    /// Standard deviations of whatever follows from the parameters.
    pub bands: Bands,
}

impl Refinement {
    /// Covariance of the parameters, (parameters, parameters), in the products of their units. It is made from its parts, so
    /// that many experiments with unknown initial states of their own need its memory only if it is asked for.
    pub fn covariance(&self) -> Matrix {
        self.bands.uncertainty.covariance(&self.bands.estimated)
    }

    /// What the file of the refined model keeps: see [`Estimates`].
    ///
    /// # Errors
    /// The covariance's decomposition does not converge.
    pub fn estimates(&self, model: &Model) -> Result<Estimates, Error> {
        let deviations = self.bands.effect_deviations()?;
        let effect = |(place, effect): (usize, &crate::effects::Effect)| {
            // what only describes the residual is not estimated in the fit
            let own = deviations.get(place).filter(|_| effect.block().is_some());
            let deviation = |i: usize| own.and_then(|all| all.get(i)).copied().unwrap_or(0.0);
            let quantities = model.quantities(effect).into_iter().enumerate();
            let parameters = quantities.map(|(i, own)| {
                Estimate::new(own.name, own.unit, own.value, deviation(i), own.zero_is_absence)
            });
            EffectEstimates { name: effect.name().to_owned(), parameters: parameters.collect() }
        };
        let (period, samples) = match self.noise_floor.method {
            NoiseMethod::RepeatedPeriods { period } => (Some(period), None),
            NoiseMethod::Rests { samples } => (None, Some(samples)),
            NoiseMethod::HighFrequencyResidual => (None, None),
        };
        Ok(Estimates {
            status: self.status.name().to_owned(),
            parameters: self.parameters.iter().map(Parameter::estimate).collect(),
            effects: model.effects().iter().enumerate().map(effect).collect(),
            undetermined: self.undetermined.clone(),
            residual_rms: self.residual_rms.clone(),
            noise_floor: EstimatedNoise {
                rms: self.noise_floor.rms.clone(),
                how: self.noise_floor.method.name().to_owned(),
                period,
                samples,
            },
            outliers: self.outliers,
            robust: self.robust,
        })
    }
}
