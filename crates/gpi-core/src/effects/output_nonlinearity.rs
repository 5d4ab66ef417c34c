//! A static curve after G, such as that of the sensor.
//!
//! `y = x + s sum_m c_m ((x - m_0) / s)^m`, m = 2, 3, .., (E8) in the documentation's theory, with the middle
//! m_0 and half the span s of the displacement x. There is no term of degree 1, because the play weights hold
//! that gain. A sensor that clips reads no more than its highest and no less than its lowest value:
//! `y = min(max(y, lowest), highest)`, where it has them.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Moment, OutputStage, Proposal, Quantity, Situation, Slope, Stage, Units};

/// The reading is a polynomial of the displacement: `y = x + s sum_m c_m ((x - m_0) / s)^m`, m = 2, 3, .., between the ends of the
/// sensor's range, where it has any. All values are without the output's offset.
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
    /// The lowest reading of a sensor that clips.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lowest: Option<f64>,
    /// The highest reading of a sensor that clips.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub highest: Option<f64>,
}

impl OutputNonlinearity {
    pub(super) const NAME: &'static str = "output-nonlinearity";
    pub(super) const WHAT: &'static str =
        "a static curve after the dynamics, such as that of a sensor";
    pub(super) const SYNONYMS: &'static [&'static str] = &[
        "sensor curve",
        "sensor nonlinearity",
        "sensor-nonlinearity",
        "sensor clipping",
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
            let coefficients = vec![0.0; terms];
            Self { output, coefficients, middle, scale, lowest: None, highest: None }
        };
        let blocks =
            situation.outputs().flat_map(|output| [2, 4].map(|terms| block(output, terms)));
        blocks.filter(|block| block.scale > 0.0).map(Proposal::linear_in_all).collect()
    }
}

impl Block for OutputNonlinearity {
    fn values(&self) -> Vec<f64> {
        self.coefficients.iter().copied().chain(self.lowest).chain(self.highest).collect()
    }

    fn set(&mut self, values: &[f64]) {
        let (coefficients, ends) = values.split_at(self.coefficients.len());
        self.coefficients.copy_from_slice(coefficients);
        let range = [&mut self.lowest, &mut self.highest].into_iter().flatten();
        range.zip(ends).for_each(|(own, end)| *own = *end);
    }

    fn steps(&self) -> Vec<f64> {
        let ends = [self.lowest, self.highest].into_iter().flatten();
        let curve = self.coefficients.iter().map(|_| 1e-4);
        curve.chain(ends.map(|_| 1e-4 * self.scale)).collect()
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let term = |(i, c): (usize, &f64)| {
            Quantity::strength(format!("curve[{}]", i + 2), units.output, c * self.scale)
        };
        let ends = [("lowest", self.lowest), ("highest", self.highest)];
        let end = |(name, value): (&str, Option<f64>)| {
            value.map(|value| Quantity::new(name, units.output, value))
        };
        let curve = self.coefficients.iter().enumerate().map(term);
        curve.chain(ends.into_iter().filter_map(end)).collect()
    }

    fn flaw(&self) -> Option<String> {
        let is_empty = |(lowest, highest): &(f64, f64)| lowest >= highest;
        let empty = self.lowest.zip(self.highest).filter(is_empty);
        positive(&[("scale", self.scale)]).or_else(|| {
            let (lowest, highest) = empty?;
            Some(format!("a range from {lowest} to {highest}; it must end above where it begins"))
        })
    }
}

impl OutputStage for OutputNonlinearity {
    fn output(&self) -> usize {
        self.output
    }

    fn range(&self) -> [f64; 2] {
        [self.lowest.unwrap_or(f64::NEG_INFINITY), self.highest.unwrap_or(f64::INFINITY)]
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
        let [lowest, highest] = self.range();
        if value < lowest {
            (lowest, Slope::Times(0.0))
        } else if value > highest {
            (highest, Slope::Times(0.0))
        } else {
            (value, Slope::Times(1.0 + 2.0 * x * sum + x * x * slope))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clipping() -> OutputNonlinearity {
        OutputNonlinearity {
            output: 0,
            coefficients: vec![0.1],
            middle: 1.0,
            scale: 2.0,
            lowest: Some(-3.0),
            highest: None,
        }
    }

    #[test]
    fn a_sensor_that_clips_reads_no_less_than_its_lowest_value() {
        let moment = Moment { time: 0.0, rate: 1.0, covariates: &[] };
        let read = |sensor: &OutputNonlinearity, x: f64| sensor.sense(&mut [], x, moment).0;
        let mut sensor = clipping();
        assert_eq!(read(&sensor, 5.0), 5.0 + 2.0 * 0.1 * 4.0);
        assert_eq!(read(&sensor, -9.0), -3.0);
        assert_eq!(sensor.values(), [0.1, -3.0]);
        sensor.highest = Some(4.0);
        sensor.set(&[0.05, -2.0, 5.0]);
        assert_eq!((sensor.lowest, sensor.highest), (Some(-2.0), Some(5.0)));
        assert_eq!([read(&sensor, 9.0), read(&sensor, -9.0)], [5.0, -2.0]);
        assert_eq!(sensor.flaw(), None);
        assert!(OutputNonlinearity { highest: Some(-2.0), ..sensor }.flaw().is_some());
    }
}
