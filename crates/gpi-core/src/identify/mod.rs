//! From a record to a model: the paper's chain, its loop closed on the measured output.
//!
//! 1. G by FIR least squares from u to y, then ERA: the paper's start, biased by the plays (a play
//!    has memory, so more data does not help).
//! 2. The hysteresis by bounded least squares and Gauss-Newton, all its columns filtered through G
//!    and compared with y itself: running the noise of y backwards through G is not needed.
//! 3. G again, now from the hysteresis' own output v to y; back to 2 until nothing is gained.
//!
//! Everything is fitted and chosen on the record that is given.

mod alternation;
mod criterion;
mod dead_band;
mod elements;
mod entry;
mod identification;
mod integrating_plant;
pub(crate) mod long_record;
pub(crate) mod procedure;
mod quasi_static;
mod realization;
mod settings;
mod slow_plant;
mod structure;

pub use crate::chain::hysteresis::Elements;
pub use crate::fit::{
    Grid, HysteresisFit, OnAnotherRecord, Parameter, RefineOptions, Refinement, Sensitivities,
    Status, fit_hysteresis, functions_of_time, on_another_record, over_horizons, refine,
    residuals_from_fitted_start, sensitivities,
};
pub use crate::progress::{Progress, Report};
pub use crate::uncertainty::{Bands, NoiseFloor, NoiseMethod, PoleDeviations, ResponseDeviation};
pub use entry::identify;
pub(crate) use identification::Quick;
pub use identification::{Candidate, Identification, IdentifyOptions, Round};
