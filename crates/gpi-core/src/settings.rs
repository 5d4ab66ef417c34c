//! Structs of documented settings that refuse nonsense.

use crate::Error;
use std::ops::RangeInclusive;

/// A part of something.
pub(crate) const PART: RangeInclusive<f64> = 0.0..=1.0;
/// At least one, or a factor that must not shrink what it is applied to.
pub(crate) const FROM_ONE: RangeInclusive<f64> = 1.0..=1e12;
/// Any positive size.
pub(crate) const POSITIVE: RangeInclusive<f64> = f64::MIN_POSITIVE..=1e12;

/// What a policy is made of.
pub(crate) trait Setting {
    /// Whether every number lies in a range.
    fn lies_in(&self, range: &RangeInclusive<f64>) -> bool;
}

impl Setting for f64 {
    fn lies_in(&self, range: &RangeInclusive<f64>) -> bool {
        range.contains(self)
    }
}

impl Setting for usize {
    fn lies_in(&self, range: &RangeInclusive<f64>) -> bool {
        range.contains(&(*self as f64))
    }
}

impl<T: Setting, const N: usize> Setting for [T; N] {
    fn lies_in(&self, range: &RangeInclusive<f64>) -> bool {
        self.iter().all(|value| value.lies_in(range))
    }
}

/// Refuses a value outside the range in which it means something.
pub(crate) fn require<T: Setting + std::fmt::Debug>(
    name: &'static str,
    value: &T,
    range: &RangeInclusive<f64>,
) -> Result<(), Error> {
    if value.lies_in(range) {
        return Ok(());
    }
    let requirement = format!("must lie between {} and {}", range.start(), range.end());
    Err(Error::parameter(name, format!("{value:?}"), requirement))
}

/// Declares a struct of settings: each field with its type, its default and the range in which it means something.
macro_rules! settings {
    ($($(#[$about:meta])* struct $name:ident {
        $($(#[$meaning:meta])* $field:ident: $kind:ty = $value:expr, $range:expr;)*
    })*) => {$(
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq)]
        pub(crate) struct $name {
            $($(#[$meaning])* pub $field: $kind,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $value,)* }
            }
        }

        impl $name {
            /// Refuses settings that mean nothing.
            pub(crate) fn validate(&self) -> Result<(), Error> {
                $(crate::settings::require(stringify!($field), &self.$field, &$range)?;)*
                Ok(())
            }
        }
    )*};
}
pub(crate) use settings;
