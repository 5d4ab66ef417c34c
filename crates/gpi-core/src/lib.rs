//! Identify piezo and other smart-material actuators as Hammerstein systems, from measured data.
//!
//! The model, in the order the signal flows:
//!
//! ```text
//! u -> z = sum_j g_j Z_eta_j[u] -> v = sum_i p_i F_r_i[z] -> y = G(q) v + offset
//!      deadzones (envelope)        plays (hysteresis)       linear dynamics
//! ```
//!
//! u is the input (samples x inputs), y the output (samples x outputs); one hysteresis per input, G
//! maps all of them to all outputs. Only u and y are measured. The chain of
//! K. F. Aljanaideh et al., *Identification of Piezomicropositioning Hammerstein Systems with
//! Generalized Prandtl-Ishlinskii Hysteresis Nonlinearities*, whose equation numbers the
//! documentation cites, identifies G first, runs it backwards to see v, and fits the hysteresis.
//!
//! Without default features the crate is `no_std`, allocates nothing and has no dependency: it then
//! holds the [`operators`], for firmware.
#![cfg_attr(not(any(feature = "identify", test)), no_std)]

pub mod operators;

#[cfg(feature = "identify")]
mod chain;
#[cfg(feature = "identify")]
pub mod compensate;
#[cfg(feature = "identify")]
pub mod effects;
#[cfg(feature = "identify")]
mod error;
#[cfg(feature = "identify")]
mod estimates;
#[cfg(feature = "identify")]
pub mod excitation;
#[cfg(feature = "identify")]
pub mod explain;
#[cfg(feature = "identify")]
mod fit;
#[cfg(feature = "identify")]
pub mod identify;
#[cfg(feature = "identify")]
mod intersample;
#[cfg(feature = "identify")]
pub mod linear;
#[cfg(feature = "identify")]
mod model;
#[cfg(feature = "identify")]
pub mod monitor;
#[cfg(feature = "identify")]
mod optimize;
#[cfg(feature = "identify")]
mod parallel;
#[cfg(feature = "identify")]
mod progress;
#[cfg(feature = "identify")]
mod record;
#[cfg(feature = "identify")]
pub mod rivals;
#[cfg(feature = "identify")]
mod settings;
#[cfg(feature = "identify")]
mod simulation_error;
#[cfg(feature = "identify")]
mod spectrum;
#[cfg(feature = "identify")]
mod uncertainty;

#[cfg(feature = "identify")]
pub use error::{Error, ErrorKind};
#[cfg(feature = "identify")]
pub use estimates::{EffectEstimates, Estimate, EstimatedNoise, Estimates};
#[cfg(feature = "identify")]
pub use intersample::{Hold, Intersample, LoopStep};
#[cfg(feature = "identify")]
pub use model::{Hysteresis, Model, ModelState};
#[cfg(feature = "identify")]
pub use progress::{Progress, Report};
#[cfg(feature = "identify")]
pub use record::{Channel, Experiment, Record, TimeAxis};
#[cfg(feature = "identify")]
pub use simulation_error::SimulationError;
#[cfg(feature = "identify")]
pub use uncertainty::Prediction;

/// A dense matrix of `f64`, stored by columns; signals are (samples, channels).
#[cfg(feature = "identify")]
pub type Matrix = nalgebra::DMatrix<f64>;

/// The code of README is compiled with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
pub struct Readme;
