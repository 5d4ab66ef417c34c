//! Slow change that the input does not drive.

use super::{Added, Block, Moment, Proposal, Quantity, Situation, Stage, Units, knots};

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

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let duration = situation.duration();
        let block = |output, knots: usize| {
            let (changes, span) = (vec![0.0; knots - 1], situation.span(output));
            Proposal::linear(
                Self { output, moves_stage: false, changes, duration, span },
                0..knots - 1,
            )
        };
        let blocks = |output| [2, 3, 5, 9, 17, 33].map(|knots| block(output, knots));
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
