//! Names and units of channels.

use crate::errors::parameter;
use gpi_core::Channel;
use pyo3::prelude::*;

/// `count` channels with these names and units; `letter` with its number is the default name.
pub(crate) fn channels(
    letter: &str,
    count: usize,
    names: Option<Vec<String>>,
    units: Option<Vec<String>>,
) -> PyResult<Vec<Channel>> {
    let default = |index: usize| {
        if count == 1 { letter.to_owned() } else { format!("{letter}{}", index + 1) }
    };
    let names = names.unwrap_or_else(|| (0..count).map(default).collect());
    let units = units.unwrap_or_else(|| vec![String::new(); count]);
    for (what, length) in [("names", names.len()), ("units", units.len())] {
        if length != count {
            let message = format!("{length} {what} for `{letter}`, but it has {count} columns");
            return Err(parameter(message));
        }
    }
    Ok(names.into_iter().zip(units).map(|(name, unit)| Channel::new(name, unit)).collect())
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
