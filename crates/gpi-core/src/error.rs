//! The error type of the library. Every message states what is wrong, where, the numbers, and what to do.

use crate::Matrix;
use crate::operators::OperatorError;

/// The cause of an [`Error`]; the command line maps it to its exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// A parameter is out of its range.
    Parameter,
    /// The data cannot be used for the requested computation.
    Data,
    /// The data are usable, but a numerical result is not.
    Numerical,
}

/// Errors of the library.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is out of its range.
    #[error("`{name}` = {value}: {requirement}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// The given value.
        value: String,
        /// The requirement that the value violates.
        requirement: String,
    },

    /// An operator rejects its parameters.
    #[error(transparent)]
    Operator(#[from] OperatorError),

    /// NaN or infinite samples.
    #[error(
        "column `{column}` has {count} NaN or infinite samples, the first in row {row}; \
         repair or cut out these rows"
    )]
    NotFinite {
        /// The column's name.
        column: String,
        /// The first row with such a sample, from 0.
        row: usize,
        /// Number of such samples.
        count: usize,
    },

    /// Arrays that belong together differ in size.
    #[error("`{left}` has {left_size} {what}, but `{right}` has {right_size}; they must be equal")]
    Mismatch {
        /// Name of the counted elements, in the plural.
        what: &'static str,
        /// Name of the first array.
        left: String,
        /// Its count.
        left_size: usize,
        /// Name of the second array.
        right: String,
        /// Its count.
        right_size: usize,
    },

    /// Not enough samples for the number of unknowns.
    #[error(
        "{samples} usable samples, but {needed} are needed ({purpose}); \
         record more samples or reduce what is estimated"
    )]
    TooFewSamples {
        /// Number of usable samples.
        samples: usize,
        /// Number of samples needed.
        needed: usize,
        /// The purpose for which they are needed.
        purpose: String,
    },

    /// A column is constant.
    #[error("column `{column}` is constant at {value}; a system cannot be identified from it")]
    Constant {
        /// The column's name.
        column: String,
        /// Its value.
        value: f64,
    },

    /// The input is not persistently exciting of the order that the requested number of taps needs.
    #[error(
        "{taps} taps have {unknowns} unknowns, but the input is persistently exciting of order {rank} only; \
         use at most {supported} taps or excite more frequencies"
    )]
    Excitation {
        /// The requested number of taps.
        taps: usize,
        /// Unknowns of the regression: taps times inputs.
        unknowns: usize,
        /// Numerical rank of the regressor, the order of persistent excitation.
        rank: usize,
        /// The largest number of taps for which the excitation suffices.
        supported: usize,
    },

    /// The output does not depend on the input.
    #[error(
        "the output does not respond to the input: the impulse response of {taps} taps, estimated from {samples} samples, \
         is zero; check that the columns belong together and that the input moves where the output is scored"
    )]
    NoResponse {
        /// Taps of the impulse response.
        taps: usize,
        /// Scored samples.
        samples: usize,
    },

    /// Time stamps decrease or repeat.
    #[error(
        "time stamps do not increase at {count} of the rows, first from {before} s in row {row} to \
         {after} s in the next; sort or cut the record there"
    )]
    TimeNotIncreasing {
        /// Row before the first step that does not increase, from 0.
        row: usize,
        /// Its time in s.
        before: f64,
        /// The time of the next row in s.
        after: f64,
        /// Number of such steps.
        count: usize,
    },

    /// A text from a file that no honest name is like.
    #[error(
        "{what} `{text}` {reason}, which is not permitted in a name; rename the column or correct the file"
    )]
    Name {
        /// What the text is, with its article.
        what: String,
        /// Its beginning, with the refused characters escaped.
        text: String,
        /// The problem, with the character.
        reason: String,
    },

    /// Samples are missing.
    #[error(
        "the time stamps have {count} gaps, the first of {gap} s after row {row} (t = {time} s, \
         median step {step} s); resample the record or cut it there"
    )]
    TimeGap {
        /// Row before the first gap, from 0.
        row: usize,
        /// Its time in s.
        time: f64,
        /// The step across the gap in s.
        gap: f64,
        /// The median step in s.
        step: f64,
        /// Number of gaps.
        count: usize,
    },

    /// The sampling is not uniform.
    #[error(
        "the sampling is not uniform: steps from {shortest} s to {longest} s, median {median} s \
         (first deviation after row {row}); resample the record to a fixed rate"
    )]
    TimeNotUniform {
        /// Row before the first deviating step, from 0.
        row: usize,
        /// The shortest step in s.
        shortest: f64,
        /// The longest step in s.
        longest: f64,
        /// The median step in s.
        median: f64,
    },

    /// A state space has a pole on or outside the unit circle.
    #[error("the linear model is unstable: a pole of modulus {modulus}; {remedy}")]
    Unstable {
        /// The largest modulus of a pole.
        modulus: f64,
        /// The remedy.
        remedy: &'static str,
    },

    /// A linear model has no stable inverse.
    #[error(
        "the linear model has a zero on the unit circle (distance {distance} at {frequency} rad per \
         sample, tolerance {tolerance}); its inverse does not exist: invert the DC gain only (`quasi_static`), or identify with another `order`"
    )]
    ZeroOnUnitCircle {
        /// Distance of the zero from the unit circle.
        distance: f64,
        /// Angle of the zero in rad per sample.
        frequency: f64,
        /// The smallest accepted distance.
        tolerance: f64,
    },

    /// A simulated output is not finite.
    #[error(
        "the simulated output is not finite from sample {sample} on; the largest pole of the linear model has \
         modulus {modulus}: check the model's numbers and the input's unit"
    )]
    Diverged {
        /// The first sample that is not finite, from 0.
        sample: usize,
        /// The spectral radius of G; the model is unstable if it is above 1.
        modulus: f64,
    },

    /// The caller's progress function requested a stop.
    #[error("stopped on request")]
    Interrupted,

    /// A decomposition did not converge.
    #[error("the {decomposition} did not converge on a {rows} x {columns} matrix")]
    NotConverged {
        /// Name of the decomposition.
        decomposition: &'static str,
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },

    /// The schema of a file is unknown to this version.
    #[error("schema `{found}` is not known; this version reads `{expected}`")]
    Schema {
        /// The schema in the file.
        found: String,
        /// The schema that this version reads.
        expected: &'static str,
    },

    /// A model file cannot be read.
    #[error("not a model file: {reason}")]
    ModelFile {
        /// The problem.
        reason: String,
    },
}

impl Error {
    /// The cause of the error.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Parameter { .. } | Self::Operator(_) => ErrorKind::Parameter,
            Self::Unstable { .. }
            | Self::ZeroOnUnitCircle { .. }
            | Self::NotConverged { .. }
            | Self::Diverged { .. } => ErrorKind::Numerical,
            _ => ErrorKind::Data,
        }
    }

    /// A parameter out of its range.
    pub(crate) fn parameter(
        name: &'static str,
        value: impl ToString,
        requirement: impl Into<String>,
    ) -> Self {
        Self::Parameter { name, value: value.to_string(), requirement: requirement.into() }
    }

    /// The result of one candidate of a search: its failure, such as an impulse response of rank 0 or a decomposition that
    /// did not converge, drops the candidate. Only an interruption ends the search.
    pub(crate) fn unless_interrupted<T>(result: Result<T, Self>) -> Result<Result<T, Self>, Self> {
        match result {
            Err(Self::Interrupted) => Err(Self::Interrupted),
            other => Ok(other),
        }
    }

    /// Rejects a value that violates a requirement.
    pub(crate) fn require(
        holds: bool,
        name: &'static str,
        value: impl ToString,
        requirement: impl Into<String>,
    ) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::parameter(name, value, requirement)) }
    }

    /// Rejects a value that is not a positive finite number.
    pub(crate) fn require_positive(
        name: &'static str,
        value: f64,
        requirement: &str,
    ) -> Result<(), Self> {
        Self::require(value.is_finite() && value > 0.0, name, value, requirement)
    }

    /// Rejects a matrix with NaN or infinite elements.
    pub(crate) fn require_finite(name: &'static str, matrix: &Matrix) -> Result<(), Self> {
        let is_other = |value: &&f64| !value.is_finite();
        // counted first: a count vectorizes, a search does not
        if matrix.as_slice().iter().filter(is_other).count() > 0
            && let Some(value) = matrix.iter().find(is_other)
        {
            return Err(Self::parameter(name, value, "every element must be finite"));
        }
        Ok(())
    }

    /// Rejects fewer samples than `needed` for a purpose.
    pub(crate) fn require_samples(
        samples: usize,
        needed: usize,
        purpose: impl Into<String>,
    ) -> Result<(), Self> {
        if samples >= needed {
            return Ok(());
        }
        Err(Self::TooFewSamples { samples, needed, purpose: purpose.into() })
    }

    /// Rejects arrays of different size.
    pub(crate) fn require_equal(
        what: &'static str,
        (left, left_size): (&str, usize),
        (right, right_size): (&str, usize),
    ) -> Result<(), Self> {
        if left_size == right_size {
            return Ok(());
        }
        let (left, right) = (left.to_owned(), right.to_owned());
        Err(Self::Mismatch { what, left, left_size, right, right_size })
    }
}
