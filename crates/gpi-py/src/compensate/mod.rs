//! Drives that make the outputs follow a reference.

mod compensation;
mod compensator;

pub(crate) use compensation::{Compensation, compensate, read_limits, read_start};
pub(crate) use compensator::Compensator;

use pyo3::prelude::*;

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Compensator>()?;
    module.add_class::<Compensation>()
}
