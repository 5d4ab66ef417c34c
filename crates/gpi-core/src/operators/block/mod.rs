//! Block kernels for long records, at a cost that hardly grows with the number of plays or deadzones.

pub(super) mod bank;
mod curve;
mod knots;
mod lanes;
mod ranked;
pub(super) mod threads;
mod turning_points;
pub(super) mod zones;
