//! Names and units of channels.

use crate::errors::{parameter, to_python};
use gpi_core::{Channel, Error};
use pyo3::prelude::*;
use pyo3::types::PyString;

/// A name or a unit; half a surrogate pair, which has no UTF-8 form, is a data error.
pub(crate) struct Label(String);

impl<'py> FromPyObject<'_, 'py> for Label {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let text = object.cast::<PyString>()?;
        text.to_str().map(|text| Self(text.to_owned())).map_err(|_| {
            let reason = "contains half a surrogate pair".to_owned();
            let text = text.to_string_lossy().into_owned();
            to_python(Error::Name { what: "the name or unit".to_owned(), text, reason })
        })
    }
}

/// `count` channels with these names and units; `letter` with its number is the default name.
pub(crate) fn channels(
    letter: &str,
    count: usize,
    names: Option<Vec<Label>>,
    units: Option<Vec<Label>>,
) -> PyResult<Vec<Channel>> {
    let default = |index: usize| {
        Label(if count == 1 { letter.to_owned() } else { format!("{letter}{}", index + 1) })
    };
    let names = names.unwrap_or_else(|| (0..count).map(default).collect());
    let units = units.unwrap_or_else(|| (0..count).map(|_| Label(String::new())).collect());
    for (what, length) in [("names", names.len()), ("units", units.len())] {
        if length != count {
            let message = format!("{length} {what} for `{letter}`, but it has {count} columns");
            return Err(parameter(message));
        }
    }
    Ok(names.into_iter().zip(units).map(|(name, unit)| Channel::new(name.0, unit.0)).collect())
}

/// The name of each channel.
pub(crate) fn names(channels: &[Channel]) -> Vec<String> {
    channels.iter().map(|channel| channel.name.clone()).collect()
}

/// The unit of each channel, empty where unknown.
pub(crate) fn units(channels: &[Channel]) -> Vec<String> {
    channels.iter().map(|channel| channel.unit.clone()).collect()
}

/// All channels with their units, for `__repr__`.
pub(crate) fn label(channels: &[Channel]) -> String {
    channels.iter().map(Channel::label).collect::<Vec<_>>().join(", ")
}
