//! Nonlinear least squares within bounds.
//!
//! A problem implements [`LeastSquares`]: it says what a point costs, how the cost behaves around it, and which
//! steps are allowed. [`levenberg_marquardt`] minimises the cost. Nothing here knows what the unknowns mean.

mod levenberg_marquardt;
mod linearization;
#[cfg(test)]
mod literature;
mod loss;
mod problem;
mod settings;
mod whitening;

pub use levenberg_marquardt::Status;
pub(crate) use levenberg_marquardt::{Minimum, levenberg_marquardt};
pub(crate) use linearization::Linearization;
pub(crate) use loss::Loss;
pub(crate) use problem::{Bounds, LeastSquares};
pub(crate) use settings::SolverSettings;
pub(crate) use whitening::{Autoregression, Whitening};
