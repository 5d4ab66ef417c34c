//! A sensor's curve.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Candidate, Moment, Quantity, Situation, Slope, Stage, Units};

/// `y = x + s sum_m c_m ((x - m) / s)^m`, m = 2 ..: a static curve after G, its slope carried by the plays.
///
/// (E8) in the documentation's theory.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OutputNonlinearity {
    /// The output that is read through the curve.
    pub output: usize,
    /// c_2, c_3, ..
    pub coefficients: Vec<f64>,
    /// The middle of the displacement.
    pub middle: f64,
    /// s, half its span.
    pub scale: f64,
}

impl OutputNonlinearity {
    pub(super) const NAME: &'static str = "output-nonlinearity";
    pub(super) const WHAT: &'static str = "a static curve after the dynamics: the sensor's";
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["level"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let block = |output, terms: usize| {
            let (low, high) = Situation::range(situation.displacements, output);
            let (middle, scale) = (0.5 * (low + high), 0.5 * (high - low));
            Self { output, coefficients: vec![0.0; terms], middle, scale }
        };
        let blocks =
            situation.outputs().flat_map(|output| [2, 4].map(|terms| block(output, terms)));
        let usable = |block: &Self| block.scale > 0.0;
        let candidate = |block: Self| {
            let terms = block.coefficients.len();
            Candidate::linear(block, 0..terms)
        };
        blocks.filter(usable).map(candidate).collect()
    }
}

impl Block for OutputNonlinearity {
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
        self.coefficients.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.coefficients.copy_from_slice(values);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-4; self.coefficients.len()]
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let term = |(i, c): (usize, &f64)| {
            Quantity::new(format!("curve[{}]", i + 2), units.output, c * self.scale)
        };
        self.coefficients.iter().enumerate().map(term).collect()
    }

    fn sense(&self, _: &mut [f64], output: f64, _: Moment) -> (f64, Slope) {
        let x = (output - self.middle) / self.scale;
        // Horner's scheme for sum c_m x^(m-2) and its derivative
        let (sum, slope) = self
            .coefficients
            .iter()
            .rev()
            .fold((0.0, 0.0), |(sum, slope), c| (sum * x + c, slope * x + sum));
        let value = output + self.scale * x * x * sum;
        (value, Slope::Times(1.0 + 2.0 * x * sum + x * x * slope))
    }
}
