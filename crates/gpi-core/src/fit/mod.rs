//! The estimation problem: what is fitted to a record, from where, and how.

mod bridge;
mod certainty;
pub(crate) mod gather;
mod grid;
pub(crate) mod hysteresis;
mod initial_state;
pub(crate) mod memory;
pub(crate) mod minimize;
mod model_sections;
pub(crate) mod preparation;
pub(crate) mod problem;
pub(crate) mod refine;
pub(crate) mod representatives;
mod sensitivities;

pub use crate::optimize::Status;
pub use grid::Grid;
pub use hysteresis::{HysteresisFit, fit_hysteresis};
pub use initial_state::residuals_from_fitted_start;
pub use refine::{Parameter, RefineOptions, Refinement, refine};
pub use sensitivities::{Sensitivities, sensitivities};
