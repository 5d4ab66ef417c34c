//! From a record to a model: the paper's chain, its loop closed on the measured output.
//!
//! 1. G by FIR least squares from u to y, then ERA: the paper's start, biased by the plays (a play
//!    has memory, so more data does not help).
//! 2. The hysteresis by bounded least squares and Gauss-Newton, all its columns filtered through G
//!    and compared with y itself: running the noise of y backwards through G is not needed.
//! 3. G again, now from the hysteresis' own output v to y; back to 2 until nothing is gained.
//!
//! Everything is fitted and chosen on the record that is given.

mod adjoint;
mod bands;
mod bridge;
pub(crate) mod chain;
pub(crate) mod colour;
mod dynamic;
mod dynamics;
mod fit_start;
pub(crate) mod free_run;
mod grid;
mod hysteresis;
mod identification;
mod injections;
mod inner_loops;
mod lanes;
pub(crate) mod levenberg_marquardt;
pub(crate) mod linearization;
#[cfg(test)]
pub(crate) mod looped;
pub(crate) mod memory;
mod motion;
mod names;
pub(crate) mod noise_floor;
pub(crate) mod outliers;
mod placement;
pub(crate) mod point;
pub(crate) mod preparation;
mod quasi_static;
pub(crate) mod refine;
pub(crate) mod representatives;
mod sensing;
mod sensitivities;
pub(crate) mod sensitivity;
pub(crate) mod stream;
pub(crate) mod structure;
mod tangents;
pub(crate) mod uncertainty;

pub use bands::{PoleDeviations, ResponseDeviation};
pub use chain::identify;
pub use fit_start::residuals_from_fitted_start;
pub use grid::Grid;
pub use hysteresis::{HysteresisFit, fit_hysteresis};
pub use identification::{Identification, IdentifyOptions, Round};
pub use levenberg_marquardt::Status;
pub use noise_floor::{NoiseFloor, NoiseMethod};
pub use refine::{Parameter, RefineOptions, Refinement, refine};
pub use sensitivities::{Sensitivities, sensitivities};
pub use structure::Candidate;

/// Called with the stage's name and the fraction done (0 to 1); `false` asks to stop, which ends the
/// work with [`Error::Interrupted`](crate::Error::Interrupted).
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64) -> bool;

pub(crate) fn report(progress: Progress, stage: &str, done: f64) -> Result<(), crate::Error> {
    if progress(stage, done) { Ok(()) } else { Err(crate::Error::Interrupted) }
}
