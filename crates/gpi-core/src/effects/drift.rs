//! Slow change that the input does not drive.
//!
//! `y += d(t)`, (E11) in the documentation's theory; d is a smooth curve through evenly spaced knots (see
//! `knots`). Its first value is 0, because the model has an offset.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Added, Block, Moment, Proposal, Quantity, Situation, Stage, Units, knots};

/// The output drifts: `y += d(t)` with a smooth curve d through knots.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drift {
    /// The output that drifts.
    pub output: usize,
    /// Whether it is a disturbance at the plant's output, before the sensor.
    #[serde(default)]
    pub moves_stage: bool,
    /// d at the second knot, the third, .., in the output's unit.
    pub changes: Vec<f64>,
    /// Seconds from the first knot to the last.
    pub duration: f64,
    /// The span of the output, which scales the steps.
    pub span: f64,
}

impl Drift {
    pub(super) const NAME: &'static str = "drift";
    pub(super) const WHAT: &'static str = "slow change that the input does not drive";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["thermal drift", "thermal", "trend", "offset drift", "wander", "baseline"];
    pub(super) const STAGE: Stage = Stage::Added;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::SlowInTime;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Rests;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["mean", "trend"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let duration = situation.duration();
        let block = |output, later: usize| {
            let (changes, span) = (vec![0.0; later], situation.span(output));
            Proposal::linear_in_all(Self { output, moves_stage: false, changes, duration, span })
        };
        let blocks = |output| knots::COUNTS.map(|later| block(output, later));
        situation.outputs().flat_map(blocks).collect()
    }
}

impl Block for Drift {
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
        vec![1e-3 * self.span; self.changes.len()]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        knots::quantities("drift", units.output, &self.changes, self.duration)
    }

    fn flaw(&self) -> Option<String> {
        positive(&[("duration", self.duration), ("span", self.span)])
    }
}

impl Added for Drift {
    fn output(&self) -> usize {
        self.output
    }

    fn moves_stage(&self) -> bool {
        self.moves_stage
    }

    fn set_moves_stage(&mut self, moves_stage: bool) {
        self.moves_stage = moves_stage;
    }

    fn add(&self, _: &mut [f64], moment: Moment) -> f64 {
        knots::at(&self.changes, self.duration, moment.time)
    }
}
