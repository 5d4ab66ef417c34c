//! The amplifier's slew limit.
//!
//! `u_s(k) = u_s(k-1) + clamp(u(k) - u_s(k-1), -s Ts, s Ts)`, (E2) in the documentation's theory, with the
//! limit s and the sampling interval Ts: the drive follows the input, but never faster than s.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, InputStage, Proposal, Quantity, Situation, Stage, Units};

/// The drive cannot change faster than s: `|du_s/dt| <= s`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AmplifierSlew {
    /// The input that the amplifier drives.
    pub input: usize,
    /// s, in the input's unit per second.
    pub limit: f64,
}

impl AmplifierSlew {
    pub(super) const NAME: &'static str = "amplifier-slew";
    pub(super) const WHAT: &'static str = "the drive cannot change faster than a limit";
    pub(super) const SYNONYMS: &'static [&'static str] = &[
        "slew",
        "slew rate",
        "slew-rate",
        "slew limit",
        "amplifier",
        "current limit",
        "rate limit",
    ];
    pub(super) const STAGE: Stage = Stage::Input;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Speeds;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["speed"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// Limits at quantiles of the record's steps: an amplifier that is slower than most of the steps is seen
    /// without a search.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        const QUANTILES: [f64; 10] = [0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.9995];
        let rate = situation.record.rate();
        let limits = |input| {
            let steps = situation.steps(input);
            let mut limits: Vec<f64> = QUANTILES
                .iter()
                .filter_map(|q| steps.get((q * steps.len() as f64) as usize).copied())
                .collect();
            limits.dedup();
            let largest = steps.last().copied().unwrap_or(0.0);
            limits.retain(|&limit| limit < largest);
            limits.into_iter().map(move |step| Proposal::finite(Self { input, limit: step * rate }))
        };
        situation.inputs().flat_map(limits).collect()
    }
}

impl Block for AmplifierSlew {
    fn values(&self) -> Vec<f64> {
        vec![self.limit]
    }

    fn set(&mut self, values: &[f64]) {
        self.limit = values[0];
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(0.5 * self.limit, 2.0 * self.limit)]
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-5 * self.limit]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let unit =
            if units.input.is_empty() { String::new() } else { format!("{}/s", units.input) };
        vec![Quantity::new("slew_limit", unit, self.limit)]
    }

    fn flaw(&self) -> Option<String> {
        positive(&[("limit", self.limit)])
    }
}

impl InputStage for AmplifierSlew {
    fn input(&self) -> usize {
        self.input
    }

    /// The latest drive.
    fn rest(&self, first: f64) -> Vec<f64> {
        vec![first]
    }

    fn fastest(&self) -> f64 {
        self.limit
    }

    fn drive(&self, state: &mut [f64], input: f64, rate: f64) -> f64 {
        let reach = self.limit / rate;
        state[0] += (input - state[0]).clamp(-reach, reach);
        state[0]
    }
}
