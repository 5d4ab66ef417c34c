//! The compiled module of the Python package `gpi_hammerstein`: thin bindings of `gpi_core`, one file
//! a core module.

mod arrays;
mod errors;
mod excitation;
mod identify;
mod linear;
mod model;
mod operators;
mod record;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    operators::register(module)?;
    linear::register(module)?;
    record::register(module)?;
    model::register(module)?;
    identify::register(module)?;
    excitation::register(module)
}
