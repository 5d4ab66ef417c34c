//! The compensator that runs beside an actuator, one sample at a time.

use crate::effects::{Effect, Place, Stage};
use crate::operators::{Compensator, Lags};
use crate::{Error, Model};

/// What a model says of a reference that is not known beforehand.
#[derive(Clone, Debug)]
pub struct StreamingCompensator {
    /// From a sample of the reference to the drive.
    pub compensator: Compensator<Vec<f64>, Vec<f64>, Vec<f64>>,
    /// Parts of the model that it undoes.
    pub compensated: Vec<&'static str>,
    /// Parts that it does not, and why.
    pub left: Vec<(&'static str, &'static str)>,
}

impl Model {
    /// The compensator of one sample at a time: hysteresis and creep undone exactly, of the dynamics their DC gain.
    ///
    /// It looks at nothing that is yet to come, so that the output follows the reference as late as G lets it. For
    /// firmware, see [`Compensator`]; [`Model::compensate`] undoes the dynamics too.
    ///
    /// ```
    /// use gpi_core::linear::StateSpace;
    /// use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
    /// use gpi_core::{Channel, Matrix, Model};
    /// let scalar = |value| Matrix::from_element(1, 1, value);
    /// let linear = StateSpace::new(scalar(0.0), scalar(0.0), scalar(0.0), scalar(2.0))?;
    /// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
    /// let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0, 0.5], vec![1.0, 0.4])?);
    /// let channel = |name| vec![Channel::new(name, "")];
    /// let model = Model::new(1e3, channel("u"), channel("y"), vec![gpi], linear, vec![0.1])?;
    /// let found = model.compensator((-10.0, 10.0))?.compensator;
    /// let mut state = found.standing_at(0.1);
    /// let drive = Matrix::from_fn(9, 1, |k, _| found.step(&mut state, 0.1 + (k as f64).sin()));
    /// let y = model.simulate(&drive)?;
    /// assert!((0..9).all(|k| (y[k] - 0.1 - (k as f64).sin()).abs() < 1e-14));
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// Several inputs or outputs, limits between which the envelope does not rise, a hysteresis or a DC gain without an
    /// inverse.
    pub fn compensator(&self, (lower, upper): (f64, f64)) -> Result<StreamingCompensator, Error> {
        for (name, channels) in [("inputs", self.inputs()), ("outputs", self.outputs())] {
            Error::require_equal(name, ("model", channels.len()), ("a compensator", 1))?;
        }
        let mut gain = self.linear().dc_gain()?[0];
        let (mut rates, mut gains) = (Vec::new(), Vec::new());
        let (mut compensated, mut left) = (vec!["hysteresis"], Vec::new());
        if self.linear().order() > 0 {
            left.push(("dynamics", "of G only the DC gain is undone"));
        }
        for effect in self.effects() {
            let sections = match effect.place() {
                Place::Parallel(own) => own.sections(self.rate()),
                _ => Vec::new(),
            };
            for (a, b) in &sections {
                let own = b.iter().sum::<f64>() / (1.0 + a.iter().sum::<f64>());
                if let [pole] = a[..] {
                    rates.push(1.0 + pole);
                    gains.push(own);
                } else {
                    gain += own;
                }
            }
            if !sections.is_empty() && sections.iter().all(|(a, _)| a.len() == 1) {
                compensated.push(effect.name());
            } else {
                left.push((effect.name(), reason(effect)));
            }
        }
        let hysteresis = self.hysteresis()[0].inverse_within(lower, upper)?;
        let offset = self.offsets()[0];
        let compensator = Compensator::new(hysteresis, Lags::new(rates, gains)?, gain, offset)?;
        Ok(StreamingCompensator { compensator, compensated, left })
    }
}

/// Why a compensator that knows the past only leaves an effect alone.
fn reason(effect: &Effect) -> &'static str {
    match effect.stage() {
        _ if !effect.entry().driven => "the input does not drive it",
        Stage::Dynamics => "of its dynamics only the DC gain is undone",
        _ => "it is undone where the reference is known beforehand",
    }
}
