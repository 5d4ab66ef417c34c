//! What a monitor tells of a change.

use super::lines::Line;
use super::moved::Watched;
use super::watch::Found;

/// What has changed, by how much, and since when.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// What has changed.
    pub watched: Watched,
    /// Number of the output in whose residual it is seen.
    pub output: usize,
    /// Offset and line: in the output's unit (a line's amplitude). Resonance: in Hz. All others: as a part of the former
    /// value.
    pub size: f64,
    /// The standard deviation of `size`, from the noise alone; `None` where it is not known.
    pub std: Option<f64>,
    /// Seconds of data before the change began, to the precision of the windows that show it.
    pub since: f64,
    /// The probability that this quantity has changed, and not another one in its place.
    pub confidence: f64,
    /// Other quantities that may have changed in its place, each with a probability of at least 0.05.
    pub instead: Vec<Watched>,
}

impl Change {
    /// What the tests of an output's residual found, `since` in seconds. A resonance is found as a part of its frequency.
    pub(super) fn of(found: Found, output: usize, since: f64) -> Self {
        let scale = match found.watched {
            Watched::Resonance { frequency } => frequency,
            _ => 1.0,
        };
        Self {
            size: scale * found.size,
            std: Some(scale * found.std).filter(|std| std.is_finite()),
            since,
            confidence: found.confidence,
            watched: found.watched,
            instead: found.instead,
            output,
        }
    }

    /// A sine in an output's residual, at a sampling rate in Hz.
    pub(super) fn of_line(line: Line, output: usize, rate: f64, since: f64) -> Self {
        Self {
            watched: Watched::Line { frequency: line.frequency * rate },
            output,
            size: line.amplitude,
            std: None,
            since,
            confidence: 1.0,
            instead: Vec::new(),
        }
    }
}
