//! From a record to a model: the paper's chain, its loop closed on the measured output.
//!
//! 1. G by FIR least squares from u to y, then ERA: the paper's start, biased by the plays (a play
//!    has memory, so more data does not help).
//! 2. The hysteresis by bounded least squares and Gauss-Newton, all its columns filtered through G
//!    and compared with y itself: running the noise of y backwards through G is not needed.
//! 3. G again, now from the hysteresis' own output v to y; back to 2 until nothing is gained.
//!
//! Everything is fitted and chosen on the record that is given.

mod chain;
mod dynamic;
mod dynamics;
mod grid;
mod hysteresis;
mod identification;
mod linearization;
mod quasi_static;
mod sensitivity;
mod start;

pub use chain::identify;
pub use grid::Grid;
pub use hysteresis::{HysteresisFit, fit_hysteresis};
pub use identification::{Identification, IdentifyOptions, Round};

/// Called with the stage's name and the fraction done (0 to 1); `false` asks to stop, which ends the
/// work with [`Error::Interrupted`](crate::Error::Interrupted).
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64) -> bool;

fn report(progress: Progress, stage: &str, done: f64) -> Result<(), crate::Error> {
    if progress(stage, done) { Ok(()) } else { Err(crate::Error::Interrupted) }
}
