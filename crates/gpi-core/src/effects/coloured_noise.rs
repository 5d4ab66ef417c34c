//! Autocorrelated noise.
//!
//! `e(k) = sum_i a_i e(k-i) + w(k)`, w white, (E15) in the documentation's theory: the residual e depends on
//! its own past (an autoregressive process), and on nothing else. It is looked for last, when nothing else
//! explains the residual.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Finding, Quantity, Stage, Units};

/// The noise is autoregressive: `e(k) = sum_i a_i e(k-i) + w(k)`, w white.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ColouredNoise {
    /// The output whose noise it is.
    pub output: usize,
    /// a_1, a_2, ..
    pub coefficients: Vec<f64>,
    /// Standard deviation of w, in the output's unit.
    pub innovation: f64,
    /// Standard deviation of e.
    pub deviation: f64,
}

impl ColouredNoise {
    pub(super) const NAME: &'static str = "coloured-noise";
    pub(super) const WHAT: &'static str = "the noise has memory";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["colored-noise", "coloured noise", "noise", "autocorrelated noise", "autocorrelation"];
    pub(super) const STAGE: Stage = Stage::Noise;
    pub(super) const DRIVEN: bool = false;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["whiteness"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = true;
    pub(super) const IS_EXPANSION: bool = false;
}

impl Finding for ColouredNoise {
    fn output(&self) -> Option<usize> {
        Some(self.output)
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let mut quantities = vec![
            Quantity::new("innovation", units.output, self.innovation),
            Quantity::new("deviation", units.output, self.deviation),
        ];
        for (i, &a) in self.coefficients.iter().enumerate() {
            quantities.push(Quantity::new(format!("a[{}]", i + 1), "", a));
        }
        quantities
    }
}
