//! Why an operator cannot be built or started.

use core::fmt;

/// A parameter or state that an operator refuses; `parameter` is its name in the constructor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum OperatorError {
    /// Two arrays that belong together differ in length.
    LengthMismatch {
        /// Name of the array whose length is wrong.
        parameter: &'static str,
        /// Its length.
        length: usize,
        /// The length it must have.
        expected: usize,
    },
    /// An element is NaN or infinite.
    NotFinite {
        /// Name of the array.
        parameter: &'static str,
        /// Position of the element, from 0.
        index: usize,
    },
    /// A half-width is negative.
    Negative {
        /// Name of the array.
        parameter: &'static str,
        /// Position of the element, from 0.
        index: usize,
    },
}

impl fmt::Display for OperatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::LengthMismatch { parameter, length, expected } => {
                write!(f, "`{parameter}` has {length} elements, but {expected} are needed")
            }
            Self::NotFinite { parameter, index } => {
                write!(f, "`{parameter}`[{index}] is not a finite number; replace or remove it")
            }
            Self::Negative { parameter, index } => {
                write!(f, "`{parameter}`[{index}] is negative; it must be zero or positive")
            }
        }
    }
}

impl core::error::Error for OperatorError {}

/// Refuses an array with a NaN or an infinity.
pub(super) fn require_finite<T: super::Sample>(
    parameter: &'static str,
    values: &[T],
) -> Result<(), OperatorError> {
    match values.iter().position(|value| !value.finite()) {
        Some(index) => Err(OperatorError::NotFinite { parameter, index }),
        None => Ok(()),
    }
}

/// Refuses an array that is longer or shorter than its partner.
pub(super) fn require_length(
    parameter: &'static str,
    length: usize,
    expected: usize,
) -> Result<(), OperatorError> {
    if length == expected {
        Ok(())
    } else {
        Err(OperatorError::LengthMismatch { parameter, length, expected })
    }
}
