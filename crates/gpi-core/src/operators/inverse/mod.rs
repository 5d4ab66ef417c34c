//! The exact inverse of the cascade: the drive u for a wanted signal v.

mod bank;
mod cascade;
mod compensator;
mod curve;
mod envelope;
mod range;

pub use cascade::{InverseGpi, InverseState};
pub use compensator::{Compensator, CompensatorState};
pub use curve::Curve;
pub use range::Faults;
