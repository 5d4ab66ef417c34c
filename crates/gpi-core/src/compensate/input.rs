//! Inversion of the input effects: delays shift the drive, and limits of its slope clamp it.

use crate::effects::InputStage;
use crate::{Matrix, Model};

/// The effects of the input stage.
fn effects(model: &Model) -> impl Iterator<Item = &dyn InputStage> {
    model.effects().iter().filter_map(|effect| effect.place().input_stage())
}

/// Number of samples by which delays make the drive begin earlier.
pub(super) fn lead(model: &Model) -> usize {
    effects(model).map(|effect| effect.late().ceil() as usize).sum()
}

/// Shifts each drive by its delay to earlier times, with linear interpolation between samples.
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

/// Limits the slope of each drive to `slew` (per second) and to the limits of its effects, from the input `at_rest` on
/// where it is known; returns the number of clamped samples.
pub(super) fn slow_down(
    model: &Model,
    drive: &mut Matrix,
    slew: f64,
    at_rest: Option<&[f64]>,
) -> usize {
    let mut too_fast = 0;
    for (input, mut column) in drive.column_iter_mut().enumerate() {
        let own = effects(model).filter(|effect| effect.input() == input);
        let most = own.map(InputStage::fastest).fold(slew, f64::min) / model.rate();
        let mut before = at_rest.map_or(column[0], |values| values[input]);
        for k in 0..column.len() {
            // not `clamp`, which panics at a drive that has overflowed; the simulation refuses such a drive
            let value = column[k].max(before - most).min(before + most);
            too_fast += usize::from(value != column[k]);
            (column[k], before) = (value, value);
        }
    }
    too_fast
}
