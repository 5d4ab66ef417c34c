//! Inversion of the output effects: the displacement for which the sensor shows a given signal.

use super::solve::zero_of;
use crate::effects::{Moment, OutputStage};
use crate::{Error, Matrix, Model};

/// First step of the search for a sample's displacement, as a fraction of the largest signal: about the change between
/// samples of a slow reference.
const STEP: f64 = 1e-4;

/// The displacements (samples, outputs) for which the sensors show a signal (samples, outputs).
pub(super) fn before_sensor(model: &Model, shown: &Matrix) -> Matrix {
    let mut displacement = shown.clone();
    for (output, mut column) in displacement.column_iter_mut().enumerate() {
        column.add_scalar_mut(-model.offsets()[output]);
        let effects = model.effects().iter().filter_map(|effect| effect.place().output_stage());
        for effect in effects.rev().filter(|effect| effect.output() == output) {
            undo(effect, column.as_mut_slice(), model.rate());
        }
    }
    displacement
}

/// Every value of a reference must be one that the sensors can show.
pub(super) fn require_in_range(model: &Model, reference: &Matrix) -> Result<(), Error> {
    for effect in model.effects().iter().filter_map(|effect| effect.place().output_stage()) {
        let output = effect.output();
        let offset = model.offsets()[output];
        let [lowest, highest] = effect.range().map(|end| end + offset);
        let is_beyond = |value: &&f64| !(lowest..=highest).contains(*value);
        if let Some(value) = reference.column(output).iter().find(is_beyond) {
            let range = match [lowest, highest].map(f64::is_finite) {
                [true, true] => format!("{lowest} to {highest}"),
                [true, false] => format!("at least {lowest}"),
                _ => format!("at most {highest}"),
            };
            let requirement = format!(
                "the sensor of {} reads {range} only; let the reference stay within, or take \
                 output-nonlinearity out of the model",
                model.outputs()[output].name
            );
            return Err(Error::parameter("reference", value, requirement));
        }
    }
    Ok(())
}

/// Inverts one effect sample by sample; the search for each sample starts at the previous one.
fn undo(effect: &dyn OutputStage, signal: &mut [f64], rate: f64) {
    const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
    let size = signal.iter().fold(f64::MIN_POSITIVE, |size, value| size.max(value.abs()));
    let moment = |k: usize| Moment { time: k as f64 / rate, rate, covariates: &[] };
    let (mut before, mut memory) = (signal[0], None::<Vec<f64>>);
    for (k, value) in signal.iter_mut().enumerate() {
        let [lowest, highest] = effect.range();
        let wanted = value.max(lowest).min(highest);
        let show = |x: f64| {
            let mut own = memory.clone().unwrap_or_else(|| effect.rest(x, None));
            (effect.sense(&mut own, x, moment(k)).0, own)
        };
        before = zero_of(|x| show(x).0 - wanted, before, STEP * size, ALL);
        memory = Some(show(before).1);
        *value = before;
    }
}
