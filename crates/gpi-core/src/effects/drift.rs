//! Slow change that the input does not drive.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Candidate, Effect, Moment, Quantity, Situation, Stage, Units, knots};

/// `y += d(t)`, d a slow function of time: a smooth curve through evenly spaced knots, the first of which
/// is 0 (the offset at the start is the model's).
///
/// (E11) in the documentation's theory.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drift {
    /// The output that drifts.
    pub output: usize,
    /// Whether it moves the stage, before the output stage, and not only the reading.
    #[serde(default)]
    pub moves_stage: bool,
    /// d at the second knot, the third, .., in the output's unit.
    pub changes: Vec<f64>,
    /// Seconds from the first knot to the last.
    pub duration: f64,
    /// The span of the output, which steps are counted from.
    pub span: f64,
}

impl Drift {
    pub(super) const NAME: &'static str = "drift";
    pub(super) const WHAT: &'static str = "slow change that the input does not drive";
    pub(super) const STAGE: Stage = Stage::Added;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::SlowInTime;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Rests;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["mean", "trend"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let duration = situation.duration();
        let block = |output, knots: usize| {
            let (changes, span) = (vec![0.0; knots - 1], situation.span(output));
            Candidate::linear(
                Self { output, moves_stage: false, changes, duration, span },
                0..knots - 1,
            )
        };
        let blocks = |output| [2, 3, 5, 9, 17, 33].map(|knots| block(output, knots));
        situation.outputs().flat_map(blocks).collect()
    }
}

impl Block for Drift {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        if self.moves_stage { Stage::Displaced } else { Self::STAGE }
    }

    fn elsewhere(&self) -> Option<Effect> {
        Some(Self { moves_stage: !self.moves_stage, ..self.clone() }.into())
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
        vec![1e-3 * self.span; self.changes.len()]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let time = |i: usize| self.duration * (i + 1) as f64 / self.changes.len() as f64;
        let change = |(i, &value): (usize, &f64)| {
            Quantity::new(format!("drift[{:.4} s]", time(i)), units.output, value)
        };
        self.changes.iter().enumerate().map(change).collect()
    }

    fn add(&self, _: &mut [f64], moment: Moment) -> f64 {
        knots::at(&self.changes, self.duration, moment.time)
    }
}
