//! The linear dynamics G: estimation of its impulse response, realization as a state space, simulation, and inversion.

mod arrow;
mod dead_time;
mod decompose;
mod dot;
mod era;
mod fir;
mod laurent;
mod least_squares;
mod logarithm;
pub(crate) mod matrix_file;
mod section;
mod sections;
mod state_space;
mod transfer_function;
mod zero_order_hold;
mod zeros;

pub use era::{Era, EraOptions, realize};
pub use fir::{Fir, FirStatistic, estimate};
pub use laurent::{IntermediateSignal, InverseOptions, NoncausalFir, ZERO_TOLERANCE};
pub use state_space::StateSpace;
pub use transfer_function::TransferFunction;
pub use zero_order_hold::zero_order_hold;

pub(crate) use arrow::{Arrow, Group as ArrowGroup};
pub(crate) use decompose::symmetric_eigen;
pub(crate) use dot::dot;
pub(crate) use era::Hankel;
pub(crate) use fir::{excitation_limit, impulse_response};
pub(crate) use least_squares::{NormalEquations, bounded};
pub(crate) use logarithm::logarithm;
pub(crate) use section::{LARGEST_POLE, Section, advance, move_poles};
pub(crate) use sections::{Sections, resonates};
