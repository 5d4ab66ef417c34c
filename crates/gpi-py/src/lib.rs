//! The compiled module of the Python package `gpi_hammerstein`: thin bindings of `gpi_core`, one file
//! or folder a core module.

mod arrays;
mod calls;
mod channels;
mod compensate;
mod errors;
mod excitation;
mod explain;
mod figures;
mod identify;
mod linear;
mod model;
mod monitor;
mod operators;
mod plotting;
mod progress;
mod record;
mod rivals;
mod signs;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    operators::register(module)?;
    linear::register(module)?;
    progress::register(module)?;
    record::register(module)?;
    model::register(module)?;
    compensate::register(module)?;
    monitor::register(module)?;
    identify::register(module)?;
    explain::register(module)?;
    rivals::register(module)?;
    signs::register(module)?;
    excitation::register(module)
}
