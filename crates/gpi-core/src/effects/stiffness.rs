//! A resonance that moves with amplitude.

use super::{Block, Candidate, Quantity, Situation, Stage, Units};

/// `x+ = A x + B v + sum_m e_m (y/s)^m s`, m = 2 and 3: a restoring force that is not in proportion to the
/// displacement acts where v acts, inside the mechanical loop.
///
/// A cubic term alone is Duffing's oscillator; a square term makes the two directions differ.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Stiffness {
    /// The output whose displacement acts back.
    pub output: usize,
    /// e_2 by states of G, then e_3; states of its dead time, which come first, are not driven.
    pub drives: Vec<f64>,
    /// s, half the span of the displacement.
    pub scale: f64,
}

impl Stiffness {
    pub(super) const NAME: &'static str = "stiffness";
    pub(super) const WHAT: &'static str =
        "the resonance moves with amplitude: nonlinearity inside the mechanical loop";
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let order = situation.order;
        // A lag has no resonance to move.
        if order < 2 || situation.outputs().len() > 1 {
            return Vec::new();
        }
        let block = |output| {
            let scale = 0.5 * situation.span(output);
            Self { output, drives: vec![0.0; 2 * order], scale }
        };
        let usable = |block: &Self| block.scale > 0.0;
        let blocks = situation.outputs().map(block).filter(usable);
        blocks
            .flat_map(|block| {
                [order..2 * order, 0..2 * order]
                    .map(|places| Candidate::linear(block.clone(), places))
            })
            .collect()
    }
}

impl Block for Stiffness {
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
        self.drives.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.drives.copy_from_slice(values);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-6; self.drives.len()]
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let states = self.drives.len() / 2;
        let name = |i: usize| format!("drive[{}][{}]", 2 + i / states, i % states);
        let values = self.drives.iter().enumerate();
        values.map(|(i, &value)| Quantity::new(name(i), "", value)).collect()
    }

    fn feedback(&self, displacement: f64) -> Vec<(f64, f64)> {
        let y = displacement / self.scale;
        let (square, cube) = (y * y * self.scale, y * y * y * self.scale);
        let (by_square, by_cube) = (2.0 * y, 3.0 * y * y);
        let (e2, e3) = self.drives.split_at(self.drives.len() / 2);
        let drive = |(a, b): (&f64, &f64)| (a * square + b * cube, a * by_square + b * by_cube);
        e2.iter().zip(e3).map(drive).collect()
    }
}
