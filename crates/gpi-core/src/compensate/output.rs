//! The output stage: what the sensor has to see for what it is to show.

use super::solve::zero_of;
use crate::effects::{Moment, OutputStage};
use crate::{Matrix, Model};

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

/// Sample by sample, each from the one before on.
fn undo(effect: &dyn OutputStage, signal: &mut [f64], rate: f64) {
    const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
    let size = signal.iter().fold(f64::MIN_POSITIVE, |size, value| size.max(value.abs()));
    let moment = |k: usize| Moment { time: k as f64 / rate, rate, covariates: &[] };
    let (mut before, mut memory) = (signal[0], None::<Vec<f64>>);
    for (k, value) in signal.iter_mut().enumerate() {
        let wanted = *value;
        let show = |x: f64| {
            let mut own = memory.clone().unwrap_or_else(|| effect.rest(x));
            (effect.sense(&mut own, x, moment(k)).0, own)
        };
        before = zero_of(|x| show(x).0 - wanted, before, 1e-4 * size, ALL);
        memory = Some(show(before).1);
        *value = before;
    }
}
