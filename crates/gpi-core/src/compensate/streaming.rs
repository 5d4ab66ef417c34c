//! The compensator for real-time use, which computes one sample of the drive at a time.

use super::backlash::half_gap;
use crate::effects::{Effect, Place, Stage};
use crate::operators::{Compensator, Lags};
use crate::{Error, Model};

/// A compensator for a reference that is not known in advance.
#[derive(Clone, Debug)]
pub struct StreamingCompensator {
    /// Computes the drive for one sample of the reference.
    pub compensator: Compensator<Vec<f64>, Vec<f64>, Vec<f64>>,
    /// The parts of the model that it compensates.
    pub compensated: Vec<&'static str>,
    /// The parts that it does not compensate, each with the reason.
    pub left: Vec<(&'static str, &'static str)>,
}

impl Model {
    /// The compensator for real-time use: it inverts hysteresis and creep exactly, and the DC gain of the dynamics.
    ///
    /// `(lower, upper)` are the limits of the drive, in its unit. The compensator needs no preview, so the output follows
    /// the reference with the lag of G. For firmware, see [`Compensator`]; [`Model::compensate`] inverts the dynamics
    /// too.
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
    /// The model has several inputs or outputs, the envelope does not increase between the limits, the plays have a gap
    /// (backlash), or the hysteresis or the DC gain has no inverse.
    pub fn compensator(&self, (lower, upper): (f64, f64)) -> Result<StreamingCompensator, Error> {
        for (name, channels) in [("inputs", self.inputs()), ("outputs", self.outputs())] {
            Error::require_equal(name, ("model", channels.len()), ("a compensator", 1))?;
        }
        let mut gain = self.linear().dc_gain()?[0];
        let (mut rates, mut gains) = (Vec::new(), Vec::new());
        let (mut compensated, mut left) = (vec!["hysteresis"], Vec::new());
        if self.linear().order() > 0 {
            left.push(("dynamics", "only the DC gain of G is inverted"));
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
        if let Some(half_gap) = half_gap(&self.hysteresis()[0]) {
            let requirement = "half the gap of the plays (backlash): at each reversal the drive would have to jump across it \
                               at once, which is possible only for a reference known in advance (`compensate`)";
            return Err(Error::parameter("half_widths", half_gap, requirement));
        }
        let hysteresis = self.hysteresis()[0].inverse_within(lower, upper)?;
        let offset = self.offsets()[0];
        let compensator = Compensator::new(hysteresis, Lags::new(rates, gains)?, gain, offset)?;
        Ok(StreamingCompensator { compensator, compensated, left })
    }
}

/// The reason why a compensator without preview does not compensate an effect.
fn reason(effect: &Effect) -> &'static str {
    match effect.stage() {
        _ if !effect.entry().driven => "the input does not drive it",
        Stage::Dynamics => "only the DC gain of its dynamics is inverted",
        _ => "it is compensated only if the reference is known in advance",
    }
}
