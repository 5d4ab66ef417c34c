//! Inversion of the input effects: delays shift the drive, and limits of its slope clamp it.

use crate::effects::{Block, Effect};
use crate::{Matrix, Model};

/// Number of samples by which delays make the drive begin earlier.
pub(super) fn lead(model: &Model) -> usize {
    model.effects().iter().map(|effect| effect.block().late().ceil() as usize).sum()
}

/// Shifts each drive by its delay to earlier times, with linear interpolation between samples.
pub(super) fn advance(model: &Model, drive: &mut Matrix) {
    let last = drive.nrows() - 1;
    for block in model.effects().iter().map(Effect::block) {
        let late = block.late();
        if late > 0.0 {
            let mut column = drive.column_mut(block.channel());
            let before: Vec<f64> = column.iter().copied().collect();
            let (whole, part) = (late as usize, late.fract());
            for (k, value) in column.iter_mut().enumerate() {
                let (left, right) = ((k + whole).min(last), (k + whole + 1).min(last));
                *value = (1.0 - part) * before[left] + part * before[right];
            }
        }
    }
}

/// Limits the slope of each drive to `slew` (per second) and to the limits of its effects; returns the number of clamped
/// samples.
pub(super) fn slow_down(model: &Model, drive: &mut Matrix, slew: f64) -> usize {
    let mut too_fast = 0;
    let blocks = || model.effects().iter().map(Effect::block);
    for (input, mut column) in drive.column_iter_mut().enumerate() {
        let own = blocks().filter(|block| block.fastest().is_finite() && block.channel() == input);
        let most = own.map(Block::fastest).fold(slew, f64::min) / model.rate();
        for k in 1..column.len() {
            let before = column[k - 1];
            let value = column[k].clamp(before - most, before + most);
            too_fast += usize::from(value != column[k]);
            column[k] = value;
        }
    }
    too_fast
}
