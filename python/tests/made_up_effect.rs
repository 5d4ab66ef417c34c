//! Periodic error of a laser interferometer.
//!
//! `y = x + a sin(2 pi x / p) + b cos(2 pi x / p)`: polarizations that mix and detectors of unequal gain move the
//! reading periodically with the displacement x. The period p is half the wavelength where the beam travels to
//! the mirror and back once, a quarter where it does so twice.
//!
//! `test_made_up_effect.py` adds this file and one line to a copy of the catalogue. The library does not have it.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Moment, OutputStage, Proposal, Quantity, Situation, Slope, Stage, Units};
use std::f64::consts::TAU;

/// Wavelength of a helium-neon laser in air, in um.
const WAVELENGTH: f64 = 0.6328;

/// The reading has a periodic error: `y = x + a sin(2 pi x / p) + b cos(2 pi x / p)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MadeUpEffect {
    /// The output that the interferometer reads.
    pub output: usize,
    /// p, in the output's unit.
    pub period: f64,
    /// a, in the output's unit.
    pub sine: f64,
    /// b, in the output's unit.
    pub cosine: f64,
}

impl MadeUpEffect {
    pub(super) const NAME: &'static str = "made-up-effect";
    pub(super) const WHAT: &'static str = "the periodic error of an interferometer";
    pub(super) const SYNONYMS: &'static [&'static str] = &["cyclic error"];
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["level"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// Both periods of each output that is measured in um and moves by two periods or more.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let in_micrometres = |&output: &usize| situation.record.outputs()[output].unit == "um";
        let block =
            |output, part| Self { output, period: part * WAVELENGTH, sine: 0.0, cosine: 0.0 };
        let blocks = situation.outputs().filter(in_micrometres);
        let blocks = blocks.flat_map(|output| [0.5, 0.25].map(|part| block(output, part)));
        let moves = |block: &Self| situation.span(block.output) > 2.0 * block.period;
        blocks.filter(moves).map(Proposal::linear_in_all).collect()
    }
}

impl Block for MadeUpEffect {
    fn values(&self) -> Vec<f64> {
        vec![self.sine, self.cosine]
    }

    fn set(&mut self, values: &[f64]) {
        (self.sine, self.cosine) = (values[0], values[1]);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-2 * self.period; 2]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let named = [("sine", self.sine), ("cosine", self.cosine)];
        named.map(|(name, value)| Quantity::new(name, units.output, value)).to_vec()
    }

    fn flaw(&self) -> Option<String> {
        (self.period <= 0.0).then(|| format!("a period of {}; it must be positive", self.period))
    }

    /// The reading must grow with the displacement.
    fn is_plausible(&self, _: f64) -> bool {
        TAU * self.sine.hypot(self.cosine) < self.period
    }
}

impl OutputStage for MadeUpEffect {
    fn output(&self) -> usize {
        self.output
    }

    fn sense(&self, _: &mut [f64], displacement: f64, _: Moment) -> (f64, Slope) {
        let (sine, cosine) = (TAU * displacement / self.period).sin_cos();
        let slope = 1.0 + TAU / self.period * (self.sine * cosine - self.cosine * sine);
        (displacement + self.sine * sine + self.cosine * cosine, Slope::Times(slope))
    }
}
