//! The exact inverse of the cascade: what to drive it with so that it gives a wanted signal.

mod bank;
mod cascade;
mod envelope;

pub use cascade::{InverseGpi, InverseState};
