//! Half-widths that grow with speed.

use super::{Block, Candidate, Quantity, Situation, Stage, Units};

/// `r(k) = r (1 + a |du/dt|) + b |du/dt|` for every play of half-width r > 0: loops open with speed, in
/// proportion to the half-width, by the same width, or both.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RateDependence {
    /// The input whose hysteresis it is.
    pub input: usize,
    /// a, in seconds per unit of the input.
    pub relative: f64,
    /// b, in seconds.
    pub absolute: f64,
    /// The speed that brings a or b to bear, in the input's unit per second: where steps are counted
    /// from.
    pub speed: f64,
    /// Half-width of the widest play.
    pub widest: f64,
}

impl RateDependence {
    pub(super) const NAME: &'static str = "rate-dependence";
    pub(super) const WHAT: &'static str = "half-widths grow with the rate of the input";
    pub(super) const STAGE: Stage = Stage::Plays;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let rate = situation.record.rate();
        let block = |input: usize| {
            let steps = situation.steps(input);
            let squares: f64 = steps.iter().map(|step| step * step).sum();
            let speed = rate * (squares / steps.len().max(1) as f64).sqrt();
            let widest = situation.widest[input];
            Self { input, relative: 0.0, absolute: 0.0, speed, widest }
        };
        let usable = |block: &Self| block.speed > 0.0 && block.widest > 0.0;
        let blocks = situation.inputs().map(block).filter(usable);
        blocks
            .flat_map(|block| {
                [vec![0], vec![1], vec![0, 1]]
                    .map(|places| Candidate::linear(block.clone(), places))
            })
            .collect()
    }
}

impl Block for RateDependence {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        Self::STAGE
    }

    fn channel(&self) -> usize {
        self.input
    }

    fn values(&self) -> Vec<f64> {
        vec![self.relative, self.absolute]
    }

    fn set(&mut self, values: &[f64]) {
        (self.relative, self.absolute) = (values[0], values[1]);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-4 / self.speed, 1e-4 * self.widest / self.speed]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let unit =
            if units.input.is_empty() { "s".to_owned() } else { format!("s/{}", units.input) };
        vec![
            Quantity::new("relative_growth", unit, self.relative),
            Quantity::new("absolute_growth", "s", self.absolute),
        ]
    }

    fn width(&self, half_width: f64, speed: f64) -> (f64, f64) {
        if half_width == 0.0 {
            return (0.0, 1.0);
        }
        let factor = 1.0 + self.relative * speed;
        let width = half_width * factor + self.absolute * speed;
        // a growth of either sign may be tried, a negative width has no meaning
        if width > 0.0 { (width, factor) } else { (0.0, 0.0) }
    }
}
