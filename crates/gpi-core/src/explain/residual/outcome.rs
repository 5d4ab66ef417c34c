//! The result of a residual test, and the effects that it points to.

use crate::effects::CATALOGUE;

/// One test of a residual.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualTest {
    /// Such as `whiteness`.
    pub name: &'static str,
    /// The output it looks at.
    pub output: usize,
    /// What is compared with the threshold.
    pub statistic: f64,
    /// The value that the statistic must not exceed.
    ///
    /// It belongs to the significance level, see [`Significance::level`], or is one of practical size: for
    /// `prediction` it is the part of the variance that the input may predict; `outliers` allows two; for `whiteness`
    /// it is a hundredth of the residual's variance in its correlations wherever that is more than noise gives.
    pub threshold: f64,
    /// How probable the statistic is in noise. None where the threshold is one of practical size: the residual may then
    /// differ from noise beyond doubt and pass, since the difference is too small to matter.
    pub significance: Option<Significance>,
    /// What it points to when it fails.
    pub points_to: String,
}

/// How probable a statistic is where the residual has no structure, and how improbable it must be to fail the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Significance {
    /// The probability, at most, that a residual without structure gives a statistic this large or larger; all
    /// regressors or lines of this one test are allowed for, the other tests are not.
    pub p_value: f64,
    /// The significance level, `p(threshold)`: the test fails if the p-value is below it. It is a hundredth over the
    /// number of tests of all outputs; for the statistics t of `mean`, `level-to-level`, `higher-order` and all
    /// dependences at most the probability of four standard errors.
    pub level: f64,
}

impl Significance {
    /// Of a statistic and its threshold, from the tail probability, a falling function.
    pub(super) fn new(tail: impl Fn(f64) -> f64, statistic: f64, threshold: f64) -> Self {
        Self { p_value: tail(statistic).min(1.0), level: tail(threshold).min(1.0) }
    }
}

impl ResidualTest {
    /// Whether the residual shows nothing here: `p_value >= level`, or `statistic <= threshold` where the threshold is
    /// one of practical size. Both say the same where there is a p-value, since the level is that of the threshold.
    ///
    /// ```
    /// use gpi_core::explain::{ResidualTest, Significance};
    /// let test = ResidualTest {
    ///     name: "mean", output: 0, statistic: 3.5, threshold: 4.0,
    ///     significance: Some(Significance { p_value: 5e-4, level: 6e-5 }), points_to: String::new(),
    /// };
    /// assert!(test.passed()); // rare by itself, but not among all tests of a record
    /// ```
    pub fn passed(&self) -> bool {
        match self.significance {
            Some(Significance { p_value, level }) => p_value >= level,
            None => self.statistic <= self.threshold,
        }
    }
}

/// Name of the test of autocorrelation.
pub(in crate::explain) const WHITENESS: &str = "whiteness";

/// Name of the test of what the input predicts.
pub(in crate::explain) const PREDICTION: &str = "prediction";

/// Tests of every output.
pub(super) const NAMES: [&str; 14] = [
    "mean",
    WHITENESS,
    "lines",
    "past-input",
    "past-intermediate",
    "level",
    "speed",
    "direction",
    "amplitude",
    "trend",
    PREDICTION,
    "level-to-level",
    "higher-order",
    "outliers",
];

/// Names of the tests that show a dependence on the input or on time: more than autocorrelated noise.
pub(in crate::explain) const STRUCTURE: [&str; 12] = [
    "mean",
    "lines",
    "past-input",
    "past-intermediate",
    "level",
    "speed",
    "direction",
    "amplitude",
    "trend",
    PREDICTION,
    "level-to-level",
    "higher-order",
];

/// The effects that a test points to, and what else it may mean.
pub(super) fn points_to(test: &str, otherwise: &str) -> String {
    let effects = CATALOGUE.iter().filter(|entry| entry.shown_by.contains(&test));
    let meanings = effects.map(|entry| entry.name).chain(Some(otherwise).filter(|s| !s.is_empty()));
    meanings.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_are_shown_by_tests_that_exist() {
        for entry in CATALOGUE {
            for test in entry.shown_by {
                assert!(NAMES.contains(test), "{}: {test}", entry.name);
            }
        }
        assert_eq!(points_to("lines", ""), "periodic-disturbance");
        assert_eq!(points_to("higher-order", "many small effects"), "many small effects");
    }
}
