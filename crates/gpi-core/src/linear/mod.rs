//! The linear dynamics G: estimated, realized, simulated, and run backwards.

mod decompose;
mod dot;
mod double_double;
mod era;
mod fir;
mod fir_statistic;
mod laurent;
mod least_squares;
mod section;
mod sections;
mod state_space;
mod transfer_function;
mod triangular_factor;
mod zero_order_hold;
mod zeros;

pub use era::{Era, EraOptions, realize};
pub use fir::{Fir, estimate};
pub use fir_statistic::FirStatistic;
pub use laurent::{IntermediateSignal, InverseOptions, NoncausalFir, ZERO_TOLERANCE};
pub use state_space::StateSpace;
pub use transfer_function::TransferFunction;
pub use zero_order_hold::zero_order_hold;

pub(crate) use decompose::symmetric_eigen;
pub(crate) use dot::dot;
pub(crate) use era::Hankel;
pub(crate) use fir::excitation_limit;
pub(crate) use least_squares::{NormalEquations, bounded};
pub(crate) use section::{Section, advance, move_poles};
pub(crate) use sections::Sections;
