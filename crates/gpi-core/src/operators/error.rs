//! Why an operator cannot be built or started.

use core::fmt;

/// A parameter or state that an operator refuses; `parameter` is its name in the constructor.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Without an inverse: the output does not rise where the input does.
    NotRising {
        /// Name of the array whose weights do not suffice.
        parameter: &'static str,
        /// Position of the last half-width or threshold that counts there, from 0.
        index: usize,
        /// Output over input there.
        slope: f64,
    },
    /// Without an inverse: the directional deadzone gives the same output for many inputs.
    Directional,
    /// Limits between which nothing can be driven.
    Limits {
        /// The lower one.
        lower: f64,
        /// The upper one.
        upper: f64,
    },
    /// Plays further apart than their half-widths let any input bring them.
    OutOfPlace {
        /// Position of the play, from 0, in the order of half-widths.
        index: usize,
        /// How far it is from the next narrower play.
        distance: f64,
        /// By how much its half-width is larger.
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
            Self::NotRising { parameter, index, slope } => write!(
                f,
                "`{parameter}` up to number {index} sum to a slope of {slope:e}; an inverse needs a positive \
                 one, so fit with weights that are not negative and with an element at zero"
            ),
            Self::Directional => f.write_str(
                "`reading` = directional gives one output for many inputs; only one-sided deadzones have an inverse",
            ),
            Self::Limits { lower, upper } => write!(
                f,
                "`limits` = {lower}, {upper}: the lower one must be below the upper one, and the envelope must \
                 rise somewhere between them"
            ),
            Self::OutOfPlace { index, distance, most } => write!(
                f,
                "play {index} stands {distance} from the next narrower one, but no input brings them further \
                 apart than {most}; give the state that the operator returned"
            ),
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
