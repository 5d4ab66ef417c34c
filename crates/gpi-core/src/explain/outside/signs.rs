//! What a record shows before any model is fitted to it.

use super::{feedback, saturation};
use crate::explain::policy::OutsidePolicy;
use crate::linear::excitation_limit;
use crate::rivals::{RivalPolicy, Units};
use crate::{Error, Record};

/// What a record shows before any model is fitted to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Signs {
    /// Whether past outputs predict each input beyond what its own past predicts, as they do under feedback.
    pub fed_back: Vec<bool>,
    /// The part of all samples at which each output stands at its limit while an input moves.
    pub clipped: Vec<f64>,
    /// The order of persistent excitation of the inputs; none where it grows with the number of taps.
    pub excitation_order: Option<usize>,
}

/// Asks the questions that need no model.
///
/// # Errors
/// [`Error::Data`] for a record that is too short for a regression on past samples.
///
/// # Examples
/// ```
/// use gpi_core::{Channel, Experiment, Matrix, Record, explain::signs};
///
/// let u = Matrix::from_fn(2000, 1, |k, _| (0.1 * k as f64).sin());
/// let run = Experiment::new(u.clone(), u.map(|u| u.min(0.5)));
/// let channel = |name, unit| vec![Channel::new(name, unit)];
/// let record = Record::new(vec![run], 100.0, channel("u", "V"), channel("y", "um"), vec![])?;
/// let found = signs(&record)?;
/// assert!(found.clipped[0] > 0.2 && !found.fed_back[0]);
/// assert_eq!(found.excitation_order, Some(2));
/// # Ok::<(), gpi_core::Error>(())
/// ```
pub fn signs(record: &Record) -> Result<Signs, Error> {
    let (rivals, policy) = (RivalPolicy::default(), OutsidePolicy::default());
    let scaled = Units::of(record).scaled(record)?;
    let fed_back = feedback::inputs(&scaled, &rivals, &policy);
    let order = excitation_limit(record)?;
    Ok(Signs {
        fed_back: (0..record.inputs().len()).map(|input| fed_back.contains(&input)).collect(),
        clipped: (0..record.outputs().len())
            .map(|output| saturation::clipped(&scaled, output, &policy).share())
            .collect(),
        excitation_order: (order < usize::MAX).then_some(order),
    })
}
