//! Mechanical play (backlash) after G.
//!
//! `y(k) = max(x(k) - b, min(x(k) + b, y(k-1)))`, (E10) in the documentation's theory: the output follows the
//! displacement x only while the gap of width 2 b is closed. It is the play operator of half-width b.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Moment, OutputStage, Proposal, Quantity, Situation, Slope, Stage, Units};
use crate::operators::play;

/// The output follows only while the gap is closed: `y(k) = max(x(k) - b, min(x(k) + b, y(k-1)))`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Backlash {
    /// The output behind the gap.
    pub output: usize,
    /// b, half the gap, in the output's unit.
    pub half_width: f64,
}

impl Backlash {
    pub(super) const NAME: &'static str = "backlash";
    pub(super) const WHAT: &'static str = "mechanical play after the dynamics";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["gap", "dead play", "lost motion", "free play", "clearance"];
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["direction"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// Half-widths between a ten-thousandth and a fifth of the span.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        const COUNT: usize = 12;
        let blocks = |output| {
            let span = situation.span(output);
            (0..COUNT).map(move |i| {
                let fraction = 1e-4 * 2000.0_f64.powf(i as f64 / (COUNT - 1) as f64);
                Proposal::finite(Self { output, half_width: fraction * span })
            })
        };
        situation.outputs().flat_map(blocks).collect()
    }
}

impl Block for Backlash {
    fn values(&self) -> Vec<f64> {
        vec![self.half_width]
    }

    fn set(&mut self, values: &[f64]) {
        self.half_width = values[0];
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(0.3 * self.half_width, 3.0 * self.half_width)]
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-5 * self.half_width]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        vec![Quantity::strength("gap", units.output, 2.0 * self.half_width)]
    }

    fn flaw(&self) -> Option<String> {
        positive(&[("half_width", self.half_width)])
    }
}

impl OutputStage for Backlash {
    fn output(&self) -> usize {
        self.output
    }

    /// The latest output; at first the end of the gap that is nearest to zero.
    fn rest(&self, first: f64) -> Vec<f64> {
        vec![play(self.half_width, first, 0.0)]
    }

    fn sense(&self, state: &mut [f64], output: f64, _: Moment) -> (f64, Slope) {
        let before = state[0];
        state[0] = play(self.half_width, output, before);
        let slope = if state[0] == before { Slope::Held } else { Slope::Times(1.0) };
        (state[0], slope)
    }
}
