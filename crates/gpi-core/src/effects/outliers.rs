//! Isolated wrong samples.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Candidate, Quantity, Situation, Stage, Units};

/// Samples that stand apart from their neighbours by far more than the noise; the fit counts them by
/// Huber's loss.
///
/// (E14) in the documentation's theory.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outliers {
    /// How many there are.
    pub count: usize,
    /// Of how many samples.
    pub samples: usize,
    /// Root mean square of what they are off by, in the output's unit.
    pub size: f64,
}

impl Outliers {
    pub(super) const NAME: &'static str = "outliers";
    pub(super) const WHAT: &'static str = "isolated wrong samples";
    pub(super) const STAGE: Stage = Stage::Noise;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["outliers"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;

    /// None: they are counted in the residual.
    pub(super) fn candidates(_: &Situation) -> Vec<Candidate> {
        Vec::new()
    }
}

impl Block for Outliers {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        Self::STAGE
    }

    fn channel(&self) -> usize {
        0
    }

    fn values(&self) -> Vec<f64> {
        Vec::new()
    }

    fn set(&mut self, _: &[f64]) {}

    fn steps(&self) -> Vec<f64> {
        Vec::new()
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        vec![
            Quantity::new("count", "", self.count as f64),
            Quantity::new("share", "", self.count as f64 / self.samples.max(1) as f64),
            Quantity::new("size", units.output, self.size),
        ]
    }
}
