//! The uncertainty of an estimate: covariance, standard deviations, the noise and its model, wrong samples.

mod bands;
pub(crate) mod covariance;
pub(crate) mod eigen;
mod elimination;
pub(crate) mod noise_floor;
pub(crate) mod noise_model;
pub(crate) mod outliers;
mod prediction;
mod prior;
pub(crate) mod settings;

pub use bands::{Bands, PoleDeviations, ResponseDeviation};
pub use noise_floor::{NoiseFloor, NoiseMethod};
pub use prediction::Prediction;
