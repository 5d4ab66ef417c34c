//! The operators over long records, at a cost that hardly grows with their number of plays or deadzones.

pub(super) mod bank;
mod curve;
mod knots;
mod lanes;
mod ranked;
pub(super) mod threads;
mod turning_points;
pub(super) mod zones;
