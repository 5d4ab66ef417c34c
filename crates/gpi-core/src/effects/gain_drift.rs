//! Sensitivity that changes slowly.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Candidate, Moment, Quantity, Situation, Slope, Stage, Units, knots};

/// `y = x (1 + g(t))`, g a slow function of time: a smooth curve through evenly spaced knots, the first
/// of which is 0 (the gain at the start is the model's).
///
/// (E9) in the documentation's theory.
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
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::SlowInTime;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Rests;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["trend"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let duration = situation.duration();
        let block = |output, knots: usize| {
            let block = Self { output, changes: vec![0.0; knots - 1], duration };
            Candidate::linear(block, 0..knots - 1)
        };
        let blocks = |output| [2, 3, 5, 9, 17, 33].map(|knots| block(output, knots));
        situation.outputs().flat_map(blocks).collect()
    }

    fn gain(&self, time: f64) -> f64 {
        1.0 + knots::at(&self.changes, self.duration, time)
    }
}

impl Block for GainDrift {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        Self::STAGE
    }

    fn channel(&self) -> usize {
        self.output
    }

    fn values(&self) -> Vec<f64> {
        self.changes.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.changes.copy_from_slice(values);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-3; self.changes.len()]
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let time = |i: usize| self.duration * (i + 1) as f64 / self.changes.len() as f64;
        let change = |(i, &value): (usize, &f64)| {
            Quantity::new(format!("gain_change[{:.4} s]", time(i)), "", value)
        };
        self.changes.iter().enumerate().map(change).collect()
    }

    fn sense(&self, _: &mut [f64], output: f64, moment: Moment) -> (f64, Slope) {
        let gain = self.gain(moment.time);
        (gain * output, Slope::Times(gain))
    }
}
