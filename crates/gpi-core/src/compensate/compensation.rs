//! What is asked of a compensation, and what it answers.

use super::expected::ExpectedError;
use super::start::Start;
use crate::{Matrix, SimulationError};

/// Limits of the drive, and options of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct CompensateOptions {
    /// Lower and upper limit of the drive of each input, in its unit. A single pair holds for all inputs, an empty list
    /// means no limits.
    pub limits: Vec<(f64, f64)>,
    /// Largest slope of the drive, in units of the input per second.
    pub slew: f64,
    /// Whether only the DC gain of G is inverted, which needs no preview.
    pub quasi_static: bool,
    /// Number of samples by which the drive may begin before the reference; as many as G needs if `None`.
    pub preview: Option<usize>,
    /// Largest number of passes after the first. Each adds the remaining simulation error to the signal that is inverted.
    pub passes: usize,
    /// Where the stage stands before the drive begins. If `None`, at rest at the first value of the drive, raised from zero
    /// once, its past unknown.
    pub start: Option<Start>,
}

impl Default for CompensateOptions {
    fn default() -> Self {
        Self {
            limits: vec![],
            slew: f64::INFINITY,
            quasi_static: false,
            preview: None,
            passes: 20,
            start: None,
        }
    }
}

/// A drive, and the output that the model predicts for it.
#[derive(Clone, Debug)]
pub struct Compensation {
    /// u, (lead + samples, inputs).
    pub drive: Matrix,
    /// The reference, (lead + samples, outputs); during the lead, constant at its first value or at the output of
    /// [`CompensateOptions::start`].
    pub reference: Matrix,
    /// The outputs of the model for `drive`, without the effects that the input does not drive, (lead + samples, outputs).
    pub predicted: Matrix,
    /// The same for a drive that is a static curve of the reference: the one that comes nearest to `drive`.
    pub static_curve: Matrix,
    /// Number of samples by which the drive begins before the reference.
    pub lead: usize,
    /// The error `reference - predicted` behind the lead: what the inversion leaves.
    pub error: SimulationError,
    /// The error `reference - static_curve` behind the lead.
    pub error_static_curve: SimulationError,
    /// The error of the true output that is to be expected behind the lead.
    pub expected_error: ExpectedError,
    /// Root mean square error after each pass, over all outputs.
    pub passes: Vec<f64>,
    /// Number of samples at which a drive is at one of its `limits`, or at the end of the interval in which the envelope
    /// increases.
    pub out_of_reach: usize,
    /// Number of samples at which the slope of a drive was limited to `slew`.
    pub too_fast: usize,
    /// The effects that the drive compensates.
    pub compensated: Vec<&'static str>,
    /// The effects that it does not compensate, each with the reason.
    pub left: Vec<(&'static str, &'static str)>,
}
