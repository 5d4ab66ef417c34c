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
    /// The value that the statistic must not exceed. It does so with a probability of a hundredth over the
    /// number of tests (of all outputs) where there is nothing.
    ///
    /// It is raised where that would be of no practical size: for `whiteness` to a hundredth of the
    /// residual's variance in its correlations; for the statistics t of `mean`, `level-to-level`,
    /// `higher-order` and all dependences, whose regressors share the probability, to 4; for `prediction` it is the
    /// part of the variance that the input may predict. `outliers` allows two.
    pub threshold: f64,
    /// The probability, at most, that a residual without structure gives a statistic this large or larger; all
    /// regressors or lines of this one test are allowed for, the other tests are not.
    pub p_value: f64,
    /// What it points to when it fails.
    pub points_to: String,
}

impl ResidualTest {
    /// Whether the residual shows nothing here: `statistic <= threshold`.
    ///
    /// ```
    /// use gpi_core::explain::ResidualTest;
    /// let test = ResidualTest {
    ///     name: "mean", output: 0, statistic: 3.5, threshold: 4.0, p_value: 5e-4, points_to: String::new(),
    /// };
    /// assert!(test.passed()); // rare by itself, but not among all tests of a record
    /// ```
    pub fn passed(&self) -> bool {
        self.statistic <= self.threshold
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
