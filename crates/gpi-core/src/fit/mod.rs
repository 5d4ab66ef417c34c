//! Fits of a model to a record: preparation, the least squares problem, the joint fit, and its uncertainty.

mod bridge;
mod certainty;
mod finish;
pub(crate) mod gather;
mod grid;
pub(crate) mod hysteresis;
mod initial_state;
pub(crate) mod joint;
pub(crate) mod memory;
pub(crate) mod minimize;
mod misfit;
mod model_sections;
mod prediction;
pub(crate) mod preparation;
pub(crate) mod problem;
mod refine;
mod refinement;
pub(crate) mod representatives;
mod sensitivities;
mod settings;

pub use crate::optimize::Status;
pub use grid::Grid;
pub use hysteresis::{HysteresisFit, fit_hysteresis};
pub use initial_state::residuals_from_fitted_start;
pub use refine::refine;
pub use refinement::{Parameter, RefineOptions, Refinement};
pub use sensitivities::{Sensitivities, sensitivities};
