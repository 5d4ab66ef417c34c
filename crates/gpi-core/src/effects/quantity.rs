//! Named numbers with units, which describe an effect in reports and results.

/// A number that describes an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Such as `time_constant[0]`.
    pub name: String,
    /// Its unit, empty for a pure number.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Whether zero means that what it describes is absent: gains, coefficients, amplitudes, sizes.
    pub zero_is_absence: bool,
}

impl Quantity {
    pub(crate) fn new(name: impl Into<String>, unit: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), unit: unit.into(), value, zero_is_absence: false }
    }

    /// A number of which zero means absence.
    pub(crate) fn strength(name: impl Into<String>, unit: impl Into<String>, value: f64) -> Self {
        Self { zero_is_absence: true, ..Self::new(name, unit, value) }
    }
}

/// The units of an effect's input and output channels, and how one is converted into the other.
#[derive(Clone, Copy, Debug)]
pub struct Units<'a> {
    /// The input's.
    pub input: &'a str,
    /// The output's.
    pub output: &'a str,
    /// The change of the output with the input when its direction has just been reversed, in steady state: the stiffness of
    /// stops that all move.
    pub stiffness: f64,
}

impl Units<'_> {
    /// `a/b` for two units, either of which may be unknown.
    pub(crate) fn ratio(above: &str, below: &str) -> String {
        match (above, below) {
            (_, "") => String::new(),
            ("", below) => format!("1/{below}"),
            (above, below) if above == below => String::new(),
            (above, below) => format!("{above}/{below}"),
        }
    }
}
