//! Fits of a model to a record: preparation, the least squares problem, the joint fit, and its uncertainty.
//!
//! For the unknowns theta of a [`Table`](crate::chain::table::Table), the residuals e_o(k) of a free run and the loss
//! rho of [`Loss`](crate::optimize::Loss) with weight w (`rho(e) = w e^2` for squares), the cost and its linearization
//! are
//!
//! ```text
//! J = sum_k,o rho_o(e_o(k)),      psi_o(k) = d y_o(k) / d theta            (p)
//! H = sum w psi psi'  (p, p),     d = sum w psi e  (p),      dJ/dtheta = -2 d
//! ```
//!
//! H and d are all that a step, the projections of `explain` and, with the residual's autocorrelation, the covariance
//! need; the rows psi are streamed and never stored.

mod another_record;
mod bridge;
mod certainty;
pub(crate) mod dense;
pub(crate) mod excerpt;
mod finish;
pub(crate) mod gather;
mod grid;
mod horizons;
pub(crate) mod hysteresis;
pub(crate) mod initial_state;
pub(crate) mod joint;
pub(crate) mod line_modes;
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
pub(crate) mod smooth;

pub use crate::optimize::Status;
pub use another_record::{OnAnotherRecord, functions_of_time, on_another_record};
pub use grid::Grid;
pub use horizons::over_horizons;
pub use hysteresis::{HysteresisFit, fit_hysteresis};
pub use initial_state::residuals_from_fitted_start;
pub use refine::refine;
pub use refinement::{Parameter, RefineOptions, Refinement};
pub use sensitivities::{Sensitivities, sensitivities};
