//! The input stage: what arrives late is sent earlier, what is too fast is slowed down.

use crate::effects::InputStage;
use crate::{Matrix, Model};

/// The effects of the input stage.
fn effects(model: &Model) -> impl Iterator<Item = &dyn InputStage> {
    model.effects().iter().filter_map(|effect| effect.place().input_stage())
}

/// Samples by which delays let the drive begin earlier.
pub(super) fn lead(model: &Model) -> usize {
    effects(model).map(|effect| effect.late().ceil() as usize).sum()
}

/// Sends each drive earlier by its delay; between samples it is a straight line.
pub(super) fn advance(model: &Model, drive: &mut Matrix) {
    let last = drive.nrows() - 1;
    for effect in effects(model) {
        let late = effect.late();
        if late > 0.0 {
            let mut column = drive.column_mut(effect.input());
            let before: Vec<f64> = column.iter().copied().collect();
            let (whole, part) = (late as usize, late.fract());
            for (k, value) in column.iter_mut().enumerate() {
                let (left, right) = ((k + whole).min(last), (k + whole + 1).min(last));
                *value = (1.0 - part) * before[left] + part * before[right];
            }
        }
    }
}

/// Keeps each drive as slow as `slew` and its own effects ask for, and counts where it was not.
pub(super) fn slow_down(model: &Model, drive: &mut Matrix, slew: f64) -> usize {
    let mut too_fast = 0;
    for (input, mut column) in drive.column_iter_mut().enumerate() {
        let own = effects(model).filter(|effect| effect.input() == input);
        let most = own.map(InputStage::fastest).fold(slew, f64::min) / model.rate();
        for k in 1..column.len() {
            let before = column[k - 1];
            let value = column[k].clamp(before - most, before + most);
            too_fast += usize::from(value != column[k]);
            column[k] = value;
        }
    }
    too_fast
}
