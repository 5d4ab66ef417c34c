//! A static curve after G, such as that of the sensor.
//!
//! `y = x + s sum_m c_m ((x - m_0) / s)^m`, m = 2, 3, .., (E8) in the documentation's theory, with the middle
//! m_0 and half the span s of the displacement x. There is no term of degree 1, because the play weights hold
//! that gain.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Moment, OutputStage, Proposal, Quantity, Situation, Slope, Stage, Units};

/// The reading is a polynomial of the displacement: `y = x + s sum_m c_m ((x - m_0) / s)^m`, m = 2, 3, ..
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OutputNonlinearity {
    /// The output that is read through the curve.
    pub output: usize,
    /// c_2, c_3, ..
    pub coefficients: Vec<f64>,
    /// m_0, the middle of the displacement.
    pub middle: f64,
    /// s, half its span.
    pub scale: f64,
}

impl OutputNonlinearity {
    pub(super) const NAME: &'static str = "output-nonlinearity";
    pub(super) const WHAT: &'static str =
        "a static curve after the dynamics, such as that of a sensor";
    pub(super) const SYNONYMS: &'static [&'static str] = &[
        "sensor curve",
        "sensor nonlinearity",
        "sensor-nonlinearity",
        "nonlinearity",
        "static curve",
    ];
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["level"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        let block = |output, terms: usize| {
            let (low, high) = Situation::range(situation.displacements, output);
            let (middle, scale) = (0.5 * (low + high), 0.5 * (high - low));
            Self { output, coefficients: vec![0.0; terms], middle, scale }
        };
        let blocks =
            situation.outputs().flat_map(|output| [2, 4].map(|terms| block(output, terms)));
        blocks.filter(|block| block.scale > 0.0).map(Proposal::linear_in_all).collect()
    }
}

impl Block for OutputNonlinearity {
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
            Quantity::strength(format!("curve[{}]", i + 2), units.output, c * self.scale)
        };
        self.coefficients.iter().enumerate().map(term).collect()
    }

    fn flaw(&self) -> Option<String> {
        positive(&[("scale", self.scale)])
    }
}

impl OutputStage for OutputNonlinearity {
    fn output(&self) -> usize {
        self.output
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
