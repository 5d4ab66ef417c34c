//! Models of the changed machine: what a change of each kind does to the output.
//!
//! The output of a machine whose quantity has changed by the part d is `y_hat + d (dy_hat / dd)`. The derivatives are
//! differences between two simulations, that of the model and that of a model with one quantity moved:
//!
//! ```text
//! offset       y_hat + 1
//! gain         y_hat + (y_hat - offset)
//! resonance    the poles exp((-zeta +- j sqrt(1 - zeta^2)) w T) of the first resonance with w (1 + step); its DC gain is kept
//! width        all half-widths of one input times 1 + step
//! ```

use super::settings::MonitorSettings;
use crate::effects::Place;
use crate::linear::{Section, Sections, StateSpace};
use crate::operators::{Gpi, PlayBank};
use crate::{Error, Hysteresis, Model};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// What may have changed.
#[derive(Clone, Debug, PartialEq)]
pub enum Watched {
    /// The constant term of the output.
    Offset,
    /// The movement of the output over that of the input.
    Gain,
    /// The frequency of the first resonance.
    Resonance {
        /// Its frequency in the model, in Hz.
        frequency: f64,
    },
    /// The width of the hysteresis loop of one input.
    HysteresisWidth {
        /// Number of the input.
        input: usize,
    },
    /// The size of what is left, without structure.
    Noise,
    /// A sine that was not there.
    Line {
        /// Its frequency in Hz.
        frequency: f64,
    },
}

impl Watched {
    /// The word for it in results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Offset => "offset",
            Self::Gain => "gain",
            Self::Resonance { .. } => "resonance",
            Self::HysteresisWidth { .. } => "hysteresis-width",
            Self::Noise => "noise",
            Self::Line { .. } => "line",
        }
    }
}

/// The quantities that need a simulation of their own, each with the moved model.
pub(super) fn moved_models(
    model: &Model,
    settings: &MonitorSettings,
) -> Result<Vec<(Watched, Model)>, Error> {
    let mut found = Vec::new();
    if let Some((frequency, moved)) = moved_resonance(model, settings.step)? {
        found.push((Watched::Resonance { frequency }, moved));
    }
    for input in 0..model.inputs().len() {
        if let Some(moved) = wider(model, input, settings.step)? {
            found.push((Watched::HysteresisWidth { input }, moved));
        }
    }
    Ok(found)
}

/// The model with the half-widths of one input times `1 + step`; `None` if no play has a width.
fn wider(model: &Model, input: usize, step: f64) -> Result<Option<Model>, Error> {
    let mut hysteresis = model.hysteresis().to_vec();
    let (envelope, plays) = (hysteresis[input].envelope(), hysteresis[input].plays());
    let has_width = |(r, p): (&f64, &f64)| *r > 0.0 && *p != 0.0;
    if !plays.half_widths().iter().zip(plays.weights()).any(has_width) {
        return Ok(None);
    }
    let half_widths = plays.half_widths().iter().map(|r| r * (1.0 + step)).collect();
    let bank = PlayBank::new(half_widths, plays.weights().to_vec())?;
    hysteresis[input] = Gpi::new(envelope.clone(), bank);
    rebuilt(model, hysteresis, model.linear().clone()).map(Some)
}

/// The frequency of the first resonance, and the model with it moved; `None` without a resonance, or if loops around the
/// dynamics determine it.
fn moved_resonance(model: &Model, step: f64) -> Result<Option<(f64, Model)>, Error> {
    let has_loops = |place: Place<'_>| place.closed_loops().is_some();
    if model.effects().iter().any(|effect| has_loops(effect.place())) {
        return Ok(None);
    }
    let mut sections = Sections::from_delayed_state_space(model.linear())?;
    let angle = |section: &Section| {
        let pole = section.poles()[0];
        (section.order() == 2 && pole.im != 0.0).then(|| pole.ln().norm())
    };
    let first = (sections.sections.iter().enumerate())
        .filter_map(|(place, section)| Some((place, angle(section)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((place, frequency)) = first else { return Ok(None) };
    move_section(&mut sections.sections[place], step);
    let moved = rebuilt(model, model.hysteresis().to_vec(), sections.to_state_space()?)?;
    Ok(Some((frequency * model.rate() / TAU, moved)))
}

/// The model with another hysteresis and other dynamics.
fn rebuilt(model: &Model, hysteresis: Vec<Hysteresis>, linear: StateSpace) -> Result<Model, Error> {
    let (inputs, outputs) = (model.inputs().to_vec(), model.outputs().to_vec());
    Model::new(model.rate(), inputs, outputs, hysteresis, linear, model.offsets().to_vec())?
        .with_effects(model.effects().to_vec())
}

/// Moves the natural frequency of a section with a complex pair of poles; damping and DC gain are kept.
fn move_section(section: &mut Section, step: f64) {
    let standing = section.standing(&section.b);
    let pole: Complex64 = (section.poles()[0].ln() * (1.0 + step)).exp();
    section.a = vec![-2.0 * pole.re, pole.norm_sqr()];
    section.b = &standing - section.matrix() * &standing;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;
    use crate::operators::{Deadzones, Reading};
    use crate::{Channel, Matrix};

    fn model(linear: StateSpace) -> Model {
        let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided).unwrap();
        let plays = PlayBank::new(vec![0.0, 0.5], vec![1.0, 0.4]).unwrap();
        let channel = |name| vec![Channel::new(name, "")];
        let gpi = vec![Gpi::new(envelope, plays)];
        Model::new(1e3, channel("u"), channel("y"), gpi, linear, vec![0.1]).unwrap()
    }

    /// A sampled resonance at f Hz of damping 0.05 and DC gain 2, with a delay of one sample.
    fn resonance(f: f64) -> StateSpace {
        let w = TAU * f / 1e3;
        let pole = Complex64::new(-0.05 * w, w * (1.0_f64 - 0.0025).sqrt()).exp();
        let (a1, a2) = (-2.0 * pole.re, pole.norm_sqr());
        let gain = 2.0 * (1.0 + a1 + a2);
        TransferFunction::new(&[0.6 * gain, 0.4 * gain], &[1.0, a1, a2])
            .unwrap()
            .to_state_space()
            .unwrap()
    }

    #[test]
    fn the_resonance_moves_and_the_gain_stays() {
        let model = model(resonance(120.0));
        let (frequency, moved) = moved_resonance(&model, 0.01).unwrap().unwrap();
        assert!((frequency - 120.0).abs() < 1e-6, "{frequency}");
        assert!((moved.linear().dc_gain().unwrap()[0] - 2.0).abs() < 1e-9);
        let (again, _) = moved_resonance(&moved, 0.01).unwrap().unwrap();
        assert!((again - 121.2).abs() < 1e-6, "{again}");
    }

    #[test]
    fn a_gain_has_no_resonance() {
        let scalar = |value| Matrix::from_element(1, 1, value);
        let lag = StateSpace::new(scalar(0.5), scalar(1.0), scalar(1.0), scalar(0.0)).unwrap();
        let quantities = moved_models(&model(lag), &MonitorSettings::default()).unwrap();
        let names: Vec<_> = quantities.iter().map(|(quantity, _)| quantity.name()).collect();
        assert_eq!(names, ["hysteresis-width"]);
    }
}
