//! The exact inverse of the cascade: what to drive it with so that it gives a wanted signal.

mod bank;
mod cascade;
mod compensator;
mod curve;
mod envelope;

pub use cascade::{InverseGpi, InverseState};
pub use compensator::{Compensator, CompensatorState};
pub use curve::Curve;
