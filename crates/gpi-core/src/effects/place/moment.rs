//! The time of a sample.

/// The time of one sample, and the other columns that were measured then.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Seconds since the first sample.
    pub time: f64,
    /// Sampling rate in Hz.
    pub rate: f64,
    /// The other measured columns.
    pub covariates: &'a [f64],
}
