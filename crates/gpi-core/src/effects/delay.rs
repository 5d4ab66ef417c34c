//! A delay of the input beyond the dead time of the linear model.
//!
//! `u_d(t) = u(t - T)`, (E1) in the documentation's theory. u is linearly interpolated between samples: with
//! `T = (n + f)` samples, n whole and `0 <= f < 1`, `u_d(k) = (1 - f) u(k - n) + f u(k - n - 1)`.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, InputStage, Proposal, Quantity, Situation, Stage, Units};

/// The drive is the input of T seconds before: `u_d(t) = u(t - T)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Delay {
    /// The input that is delayed.
    pub input: usize,
    /// T times the sampling rate.
    pub samples: f64,
}

/// The longest delay in samples. A longer one should be removed from the record.
const LONGEST: f64 = 100.0;

impl Delay {
    pub(super) const NAME: &'static str = "delay";
    pub(super) const WHAT: &'static str = "dead time beyond the linear model's";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["dead time", "dead-time", "latency", "lag", "transport delay"];
    pub(super) const STAGE: Stage = Stage::Input;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Contained;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Speeds;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["past-input"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let delays =
            |input| [1.0, 2.0, 4.0, 8.0].map(|samples| Proposal::finite(Self { input, samples }));
        situation.inputs().flat_map(delays).collect()
    }
}

impl Block for Delay {
    fn values(&self) -> Vec<f64> {
        vec![self.samples]
    }

    fn set(&mut self, values: &[f64]) {
        self.samples = values[0];
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(0.0, LONGEST)]
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-4]
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        vec![Quantity::strength("delay", "samples", self.samples)]
    }

    fn flaw(&self) -> Option<String> {
        let is_held = (0.0..=LONGEST).contains(&self.samples);
        (!is_held)
            .then(|| format!("a delay of {} samples; it must be 0 to {LONGEST}", self.samples))
    }
}

impl InputStage for Delay {
    fn input(&self) -> usize {
        self.input
    }

    /// The latest inputs, the newest first.
    fn rest(&self, first: f64) -> Vec<f64> {
        vec![first; LONGEST as usize + 2]
    }

    fn late(&self) -> f64 {
        self.samples
    }

    fn drive(&self, state: &mut [f64], input: f64, _: f64) -> f64 {
        let needed = self.samples as usize + 2;
        let state = &mut state[..needed];
        state.rotate_right(1);
        state[0] = input;
        let right = self.samples.fract();
        (1.0 - right) * state[needed - 2] + right * state[needed - 1]
    }
}
