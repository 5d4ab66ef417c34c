//! What happens between two samples, where a loop is closed around the linear dynamics.

use crate::Error;

/// How v runs from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// Constant: `v(t) = v(k)`, zero-order hold. That of a converter which sends the input to the actuator.
    #[default]
    Zero,
    /// Straight: `v(t) = v(k) + (t/h - k) (v(k+1) - v(k))`, first-order hold. For an input that was measured.
    First,
}

/// How the loops of a model are computed between two samples: in so many steps, at the displacement that G has there.
///
/// With one step a sample, a force acts half a sample late on average. Where the dynamics move far within a sample, that is too
/// late: a mode of the angular frequency w that is sampled every h has `w h / substeps` radians a step. With more steps,
/// each begins at its middle.
///
/// The samples of G itself do not depend on it: without loops, a model has the same output for any value. Equations: (T13)
/// of docs/theory.md.
///
/// ```
/// use gpi_core::{Hold, Intersample};
/// let fine = Intersample { substeps: 4, hold: Hold::First };
/// assert!(fine != Intersample::default());
/// assert_eq!(Intersample::default().substeps, 1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intersample {
    /// Steps from one sample to the next, at least 1.
    pub substeps: usize,
    /// What v does meanwhile. It makes no difference where there is one step a sample.
    pub hold: Hold,
}

impl Default for Intersample {
    fn default() -> Self {
        Self { substeps: 1, hold: Hold::Zero }
    }
}

impl Intersample {
    /// Whether the loops behind a sample depend on v at the next one.
    pub(crate) fn looks_ahead(self) -> bool {
        self.substeps > 1 && self.hold == Hold::First
    }

    /// Whether there is one step a sample.
    pub(crate) fn is_plain(self) -> bool {
        self.substeps == 1
    }

    /// Whether model files leave it out.
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    pub(crate) fn validate(self) -> Result<(), Error> {
        /// More would only cost time.
        const MOST: usize = 64;
        if (1..=MOST).contains(&self.substeps) {
            return Ok(());
        }
        let requirement = format!("must be 1 to {MOST}");
        Err(Error::parameter("substeps", self.substeps, requirement))
    }
}

/// One loop in one step from a sample to the next: what it sees, and what it drives.
///
/// ```text
/// z = states x + inputs v + next v+ + earlier w,      x+ = A x + B v + sum over all loops and steps of drives law(z)
/// ```
///
/// x are the states of G behind its dead time at the sample, v what leaves the dead time there, and v+ what leaves it at the next sample. w are
/// the results of all loops in the steps before, in their order. A loop that sees an output adds to z what sections in parallel with G
/// make of it. See [`Model::loop_steps`](crate::Model::loop_steps).
#[derive(Clone, Debug, PartialEq)]
pub struct LoopStep {
    /// By the states of G.
    pub states: Vec<f64>,
    /// By the inputs of G.
    pub inputs: Vec<f64>,
    /// By the inputs of G at the next sample.
    pub next: Vec<f64>,
    /// By the results of all loops in the steps before.
    pub earlier: Vec<f64>,
    /// What a result of one adds to the states at the next sample.
    pub drives: Vec<f64>,
}
