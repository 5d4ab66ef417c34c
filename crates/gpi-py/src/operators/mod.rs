//! Deadzones, plays, their cascade and its inverse.

mod by_channel;
mod deadzones;
mod gpi;
mod inverse_gpi;
mod play_bank;
mod states;

pub(crate) use by_channel::by_channel;
pub(crate) use deadzones::read_reading;
pub(crate) use gpi::Gpi;
pub(crate) use inverse_gpi::InverseGpi;
pub(crate) use states::{read_inverse_state, read_state, write_inverse_state, write_state};

use pyo3::prelude::*;

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<play_bank::PlayBank>()?;
    module.add_class::<deadzones::Deadzones>()?;
    module.add_class::<Gpi>()?;
    module.add_class::<InverseGpi>()
}
