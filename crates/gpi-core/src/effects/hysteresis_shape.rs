//! Minor loops that are not congruent.

use super::{Block, Candidate, Quantity, Situation, Stage, Units};

/// Plays read through curves: `v = sum_i p_i F_i (1 + q(F_i / s, r_i / R))` with
/// `q(f, r) = sum_m sum_l c_ml f^m r^l`, m = 1, 2 and l = 0 .. 3.
///
/// Sums of curves of plays are the Preisach operators (its density over the half-plane of thresholds is
/// the curves' second derivative), whose minor loops change with their place. The declared hysteresis
/// is q = 0.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HysteresisShape {
    /// The input whose hysteresis it is.
    pub input: usize,
    /// c_ml, `[m][l]` one row after the other.
    pub coefficients: Vec<f64>,
    /// s, half the span of the plays' input.
    pub scale: f64,
    /// R, half-width of the widest play.
    pub widest: f64,
}

const POWERS: usize = 2;
const WIDTHS: usize = 4;

impl HysteresisShape {
    pub(super) const NAME: &'static str = "hysteresis-shape";
    pub(super) const WHAT: &'static str =
        "minor loops are not congruent: outside the Prandtl-Ishlinskii class";
    pub(super) const STAGE: Stage = Stage::Plays;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let block = |input: usize| {
            let (low, high) = Situation::range(situation.drives, input);
            let (scale, widest) = (0.5 * (high - low), situation.widest[input]);
            Self { input, coefficients: vec![0.0; POWERS * WIDTHS], scale, widest }
        };
        let usable = |block: &Self| block.scale > 0.0 && block.widest > 0.0;
        let blocks = situation.inputs().map(block).filter(usable);
        blocks.map(|block| Candidate::linear(block, 0..POWERS * WIDTHS)).collect()
    }
}

impl Block for HysteresisShape {
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
        self.coefficients.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.coefficients.copy_from_slice(values);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-4; self.coefficients.len()]
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let name = |place: usize| format!("curve[{}][{}]", 1 + place / WIDTHS, place % WIDTHS);
        let values = self.coefficients.iter().enumerate();
        values.map(|(place, &value)| Quantity::new(name(place), "", value)).collect()
    }

    fn read(&self, half_width: f64, place: f64) -> (f64, f64) {
        let (f, r) = (place / self.scale, half_width / self.widest);
        let (mut curve, mut derivative) = (0.0, 0.0);
        for (m, row) in self.coefficients.chunks_exact(WIDTHS).enumerate() {
            let by_width = row.iter().rev().fold(0.0, |sum, c| sum * r + c);
            let power = f.powi(1 + m as i32);
            curve += by_width * power;
            derivative += (2 + m) as f64 * by_width * power;
        }
        (place * (1.0 + curve), 1.0 + derivative)
    }

    fn reads(&self) -> bool {
        true
    }
}
