//! Errors of the operators' constructors and states.

use core::fmt;

/// A parameter or a state that an operator rejects; `parameter` is its name in the constructor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum OperatorError {
    /// Two arrays that belong together differ in length.
    LengthMismatch {
        /// Name of the array with the wrong length.
        parameter: &'static str,
        /// Its length.
        length: usize,
        /// The required length.
        expected: usize,
    },
    /// An element is NaN or infinite.
    NotFinite {
        /// Name of the array.
        parameter: &'static str,
        /// Position of the element, from 0.
        index: usize,
    },
    /// An element is negative, but must not be.
    Negative {
        /// Name of the array.
        parameter: &'static str,
        /// Position of the element, from 0.
        index: usize,
    },
    /// A number must be positive, but is zero.
    Zero {
        /// Its name.
        parameter: &'static str,
    },
    /// The operator has no inverse: its output does not increase with its input.
    NotRising {
        /// Name of the array of weights.
        parameter: &'static str,
        /// Position of the last half-width or threshold that contributes to the slope, from 0.
        index: usize,
        /// The slope: change of the output per change of the input.
        slope: f64,
    },
    /// The operator has no inverse: the directional deadzone maps many inputs to the same output.
    Directional,
    /// Limits that leave no interval for the drive.
    Limits {
        /// The lower limit.
        lower: f64,
        /// The upper limit.
        upper: f64,
    },
    /// A state that no input leads to: two plays differ by more than their half-widths do.
    OutOfPlace {
        /// Position of the play in ascending order of half-widths, from 0.
        index: usize,
        /// Absolute difference between its output and that of the next narrower play.
        distance: f64,
        /// Difference of the two half-widths, the largest possible value of `distance`.
        most: f64,
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
            Self::Zero { parameter } => write!(f, "`{parameter}` is zero; it must be positive"),
            Self::NotRising { parameter, index, slope } => write!(
                f,
                "`{parameter}`: the elements up to index {index} sum to a slope of {slope:e}, but an inverse needs \
                 a positive slope; a bank of plays needs an element at zero, and in a bank of stops a linear \
                 part must be left when all stops slide"
            ),
            Self::Directional => f.write_str(
                "the deadzone convention `reading` = directional maps many inputs to the same output; only one-sided \
                 deadzones have an inverse",
            ),
            Self::Limits { lower, upper } => write!(
                f,
                "`limits` = {lower}, {upper}: the lower limit must be below the upper limit, and the envelope must \
                 increase somewhere between them"
            ),
            Self::OutOfPlace { index, distance, most } => write!(
                f,
                "the output of play {index} differs by {distance} from that of the next narrower play, but no input \
                 leads to a difference above {most}; pass the state that the operator returned"
            ),
        }
    }
}

impl core::error::Error for OperatorError {}

/// Rejects an array with a NaN or an infinity.
pub(super) fn require_finite<T: super::Sample>(
    parameter: &'static str,
    values: &[T],
) -> Result<(), OperatorError> {
    match values.iter().position(|value| !value.finite()) {
        Some(index) => Err(OperatorError::NotFinite { parameter, index }),
        None => Ok(()),
    }
}

/// Rejects an array with a negative element.
pub(super) fn require_not_negative<T: super::Sample>(
    parameter: &'static str,
    values: &[T],
) -> Result<(), OperatorError> {
    match values.iter().position(|&value| value < T::ZERO) {
        Some(index) => Err(OperatorError::Negative { parameter, index }),
        None => Ok(()),
    }
}

/// Rejects an array of another length than `expected`.
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
