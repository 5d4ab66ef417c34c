//! The compiled module of the Python package `gpi_hammerstein`: thin bindings of `gpi_core`, one file
//! a core module.

mod arrays;
mod compensate;
mod compensator;
mod errors;
mod excitation;
mod explain;
mod fir;
mod identification;
mod identify;
mod inverse_hysteresis;
mod model;
mod noncausal_fir;
mod operators;
mod plotting;
mod record;
mod refine;
mod residual;
mod state_space;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::register(module)?;
    operators::register(module)?;
    inverse_hysteresis::register(module)?;
    fir::register(module)?;
    state_space::register(module)?;
    noncausal_fir::register(module)?;
    record::register(module)?;
    model::register(module)?;
    compensator::register(module)?;
    compensate::register(module)?;
    identification::register(module)?;
    identify::register(module)?;
    refine::register(module)?;
    explain::register(module)?;
    residual::register(module)?;
    excitation::register(module)
}
