//! The one error type of the identification: what is wrong, where, both numbers, and what to do.

use crate::operators::OperatorError;

/// Who has to act on an [`Error`]; the command line maps it to its exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The call is wrong: a parameter is out of its range.
    Parameter,
    /// The data cannot be used for what was asked.
    Data,
    /// The data are usable, but the numbers they lead to are not.
    Numerical,
}

/// Why something was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is out of its range.
    #[error("`{name}` = {value}: {requirement}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// What it must be.
        requirement: String,
    },

    /// An operator refuses its parameters.
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
        /// The first such row, from 0.
        row: usize,
        /// How many there are.
        count: usize,
    },

    /// Arrays that belong together differ in size.
    #[error("`{left}` has {left_size} {what}, but `{right}` has {right_size}; they must be equal")]
    Mismatch {
        /// What is counted, in the plural.
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
         record longer or ask for less"
    )]
    TooFewSamples {
        /// Samples that can be used.
        samples: usize,
        /// Samples that are needed.
        needed: usize,
        /// What they are needed for.
        purpose: String,
    },

    /// A column never changes.
    #[error("column `{column}` is constant at {value}; a system cannot be identified from it")]
    Constant {
        /// The column's name.
        column: String,
        /// Its value.
        value: f64,
    },

    /// The input does not excite the taps that were asked for.
    #[error(
        "the input excites {rank} of the {unknowns} unknowns of {taps} taps; \
         ask for at most {supported} taps or excite more frequencies"
    )]
    Excitation {
        /// Taps that were asked for.
        taps: usize,
        /// Unknowns of the regression: taps times inputs.
        unknowns: usize,
        /// Numerical rank of the regressor.
        rank: usize,
        /// The largest number of taps that the input excites.
        supported: usize,
    },

    /// The clock runs backwards or stands still.
    #[error(
        "time stamps do not increase at {count} of the rows, first from {before} s in row {row} to \
         {after} s in the next; sort or cut the record there"
    )]
    TimeNotIncreasing {
        /// Row before the first step that does not increase, from 0.
        row: usize,
        /// Its time.
        before: f64,
        /// The time of the next row.
        after: f64,
        /// How many such steps there are.
        count: usize,
    },

    /// Samples are missing.
    #[error(
        "the time stamps have {count} gaps, the first of {gap} s after row {row} (t = {time} s, \
         usual step {step} s); resample the record or cut it there"
    )]
    TimeGap {
        /// Row before the first gap, from 0.
        row: usize,
        /// Its time.
        time: f64,
        /// The step across the gap.
        gap: f64,
        /// The usual step.
        step: f64,
        /// How many gaps there are.
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
        /// The shortest step.
        shortest: f64,
        /// The longest step.
        longest: f64,
        /// The median step.
        median: f64,
    },

    /// A state space has a pole on or outside the unit circle.
    #[error("the linear model is unstable: a pole of modulus {modulus}; {remedy}")]
    Unstable {
        /// The largest modulus of a pole.
        modulus: f64,
        /// What to do about it.
        remedy: &'static str,
    },

    /// A system cannot be run backwards.
    #[error(
        "the linear model has a zero on the unit circle (distance {distance} at {frequency} rad per \
         sample, tolerance {tolerance}); its inverse does not exist there: leave the dynamics alone \
         (`quasi_static`), or identify with another `order`"
    )]
    ZeroOnUnitCircle {
        /// Distance of the zero from the circle.
        distance: f64,
        /// Angle of the zero.
        frequency: f64,
        /// The least distance that is accepted.
        tolerance: f64,
    },

    /// The caller's progress function asked to stop.
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

    /// A file is of a schema that this version does not know.
    #[error("schema `{found}` is not known; this version reads `{expected}`")]
    Schema {
        /// The schema in the file.
        found: String,
        /// The schema that is read.
        expected: &'static str,
    },

    /// A model file cannot be understood.
    #[error("not a model file: {reason}")]
    ModelFile {
        /// What is wrong.
        reason: String,
    },
}

impl Error {
    /// Who has to act.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Parameter { .. } | Self::Operator(_) => ErrorKind::Parameter,
            Self::Unstable { .. } | Self::ZeroOnUnitCircle { .. } | Self::NotConverged { .. } => {
                ErrorKind::Numerical
            }
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

    /// Refuses arrays of different size.
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
