//! Isolated wrong samples.
//!
//! Samples that differ from their neighbours by far more than the noise, (E14) in the documentation's theory.
//! The fit limits their influence by Huber's loss; here they are only counted.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Finding, Quantity, Stage, Units};

/// Isolated samples that differ from their neighbours by far more than the noise.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outliers {
    /// Their number.
    pub count: usize,
    /// The number of all samples.
    pub samples: usize,
    /// Root mean square of their errors, in the output's unit.
    pub size: f64,
}

impl Outliers {
    pub(super) const NAME: &'static str = "outliers";
    pub(super) const WHAT: &'static str = "isolated wrong samples";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["outlier", "spikes", "spike", "wrong samples", "glitches", "dropouts"];
    pub(super) const STAGE: Stage = Stage::Noise;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["outliers"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;
}

impl Finding for Outliers {
    fn output(&self) -> Option<usize> {
        None
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        vec![
            Quantity::new("count", "", self.count as f64),
            Quantity::new("share", "", self.count as f64 / self.samples.max(1) as f64),
            Quantity::new("size", units.output, self.size),
        ]
    }
}
