//! The differentiable signal chain of the estimator.

pub(crate) mod adjoint;
pub(crate) mod bounds;
mod effect_columns;
pub(crate) mod free_run;
pub(crate) mod hysteresis;
pub(crate) mod injections;
mod lanes;
#[cfg(test)]
pub(crate) mod looped;
mod loops;
mod model;
mod motion;
mod names;
mod placement;
mod plays;
pub(crate) mod point;
mod sensing;
pub(crate) mod sensitivity;
mod stages;
pub(crate) mod stream;
pub(crate) mod table;
pub(crate) mod tangents;
mod tiles;
