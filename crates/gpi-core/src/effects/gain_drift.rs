//! Sensitivity that changes slowly with time.
//!
//! `y = x (1 + g(t))`, (E9) in the documentation's theory; g is a smooth curve through evenly spaced knots
//! (see `knots`). Its first value is 0, because the play weights hold the gain at the start.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{
    Block, Moment, OutputStage, Proposal, Quantity, Situation, Slope, Stage, Units, knots,
};

/// The sensitivity changes slowly: `y = x (1 + g(t))` with a smooth curve g through knots.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GainDrift {
    /// The output whose sensitivity changes.
    pub output: usize,
    /// g at the second knot, the third, ..
    pub changes: Vec<f64>,
    /// Seconds from the first knot to the last.
    pub duration: f64,
}

impl GainDrift {
    pub(super) const NAME: &'static str = "gain-drift";
    pub(super) const WHAT: &'static str = "sensitivity changes slowly with time";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["sensitivity drift", "gain change", "sensitivity", "scale drift"];
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::SlowInTime;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Rests;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["trend"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let duration = situation.duration();
        let block = |output, later| Self { output, changes: vec![0.0; later], duration };
        let blocks =
            |output| knots::COUNTS.map(|later| Proposal::linear_in_all(block(output, later)));
        situation.outputs().flat_map(blocks).collect()
    }
}

impl Block for GainDrift {
    fn values(&self) -> Vec<f64> {
        self.changes.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.changes.copy_from_slice(values);
    }

    fn coarsen(&mut self) -> bool {
        knots::coarsen(&mut self.changes)
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-3; self.changes.len()]
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        knots::quantities("gain_change", "", &self.changes, self.duration)
    }

    fn flaw(&self) -> Option<String> {
        positive(&[("duration", self.duration)])
    }
}

impl OutputStage for GainDrift {
    fn output(&self) -> usize {
        self.output
    }

    fn sense(&self, _: &mut [f64], output: f64, moment: Moment) -> (f64, Slope) {
        let gain = 1.0 + knots::at(&self.changes, self.duration, moment.time);
        (gain * output, Slope::Times(gain))
    }
}
