//! Another measured column that leaks in.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Candidate, Effect, Moment, Quantity, Situation, Stage, Units};
use crate::Record;

/// `y += g L x`: a measured column x (a temperature, a neighbouring axis) leaks in, at once or through a
/// first-order lag L of unit gain and time constant T. A column that only repeats an input is none.
///
/// (E13) in the documentation's theory.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Covariate {
    /// The output that it adds to.
    pub output: usize,
    /// Whether it moves the stage, before the output stage, and not only the reading.
    #[serde(default)]
    pub moves_stage: bool,
    /// The column's place among the record's covariates.
    pub column: usize,
    /// Its name.
    pub label: String,
    /// g, in the output's unit per unit of the column.
    pub gain: f64,
    /// T in seconds; 0 is at once.
    pub time_constant: f64,
    /// A change of g that moves the output by a thousandth of its span.
    pub step: f64,
}

impl Covariate {
    pub(super) const NAME: &'static str = "covariate";
    pub(super) const WHAT: &'static str =
        "another measured column leaks in, possibly through a lag";
    pub(super) const STAGE: Stage = Stage::Added;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::Unique;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &[];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let shortest = 1.0 / situation.record.rate();
        let longest = 0.3 * situation.duration();
        let lags = std::iter::once(0.0)
            .chain(
                (0..8)
                    .map(|i| 2.0 * shortest * (longest / shortest / 2.0).powf(f64::from(i) / 7.0)),
            )
            .collect::<Vec<_>>();
        let mut found = Vec::new();
        for (column, channel) in situation.record.covariates().iter().enumerate() {
            let ranges = situation.record.experiments().iter().map(|e| {
                let values = e.covariates.column(column);
                (values.min(), values.max())
            });
            let (low, high) = ranges
                .fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
            if high <= low || follows_an_input(situation.record, column) {
                continue;
            }
            for output in situation.outputs() {
                for &time_constant in &lags {
                    let label = channel.name.clone();
                    let step = 1e-3 * situation.span(output) / (high - low);
                    let block = Self {
                        output,
                        moves_stage: false,
                        column,
                        label,
                        gain: 0.0,
                        time_constant,
                        step,
                    };
                    found.push(Candidate::linear(block, [0]));
                }
            }
        }
        found
    }
}

/// Whether a column says no more than an input does: a reference that the input was made from, a monitor of it.
fn follows_an_input(record: &Record, column: usize) -> bool {
    /// Of the column's squares about its mean, what no multiple of the input explains.
    const LEFT: f64 = 1e-3;
    (0..record.inputs().len()).any(|input| {
        let (mut samples, mut sums) = (0.0, [0.0; 5]);
        for experiment in record.experiments() {
            let (u, x) = (experiment.input.column(input), experiment.covariates.column(column));
            samples += u.len() as f64;
            let own = [u.sum(), x.sum(), u.norm_squared(), x.norm_squared(), u.dot(&x)];
            sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
        }
        let [u, x, uu, xx, ux] = sums;
        let (uu, xx, ux) = (uu - u * u / samples, xx - x * x / samples, ux - u * x / samples);
        uu * xx - ux * ux < LEFT * uu * xx
    })
}

impl Block for Covariate {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        if self.moves_stage { Stage::Displaced } else { Self::STAGE }
    }

    fn elsewhere(&self) -> Option<Effect> {
        Some(Self { moves_stage: !self.moves_stage, ..self.clone() }.into())
    }

    fn channel(&self) -> usize {
        self.output
    }

    fn values(&self) -> Vec<f64> {
        if self.time_constant > 0.0 { vec![self.gain, self.time_constant] } else { vec![self.gain] }
    }

    fn set(&mut self, values: &[f64]) {
        self.gain = values[0];
        if let Some(&time) = values.get(1) {
            self.time_constant = time;
        }
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let time = (0.3 * self.time_constant, 3.0 * self.time_constant);
        vec![(f64::NEG_INFINITY, f64::INFINITY), time][..self.values().len()].to_vec()
    }

    fn steps(&self) -> Vec<f64> {
        vec![self.step, 1e-4 * self.time_constant][..self.values().len()].to_vec()
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let unit = Units::ratio(units.output, &self.label);
        let gain = Quantity::new(format!("gain of {}", self.label), unit, self.gain);
        let mut quantities = vec![gain];
        if self.time_constant > 0.0 {
            quantities.push(Quantity::new("time_constant", "s", self.time_constant));
        }
        quantities
    }

    /// The lagged column.
    fn rest(&self, _: f64, moment: Moment) -> Vec<f64> {
        vec![moment.covariates.get(self.column).copied().unwrap_or(0.0)]
    }

    fn add(&self, state: &mut [f64], moment: Moment) -> f64 {
        let value = moment.covariates.get(self.column).copied().unwrap_or(0.0);
        if self.time_constant > 0.0 {
            let pole = (-1.0 / (self.time_constant * moment.rate)).exp();
            state[0] = pole * state[0] + (1.0 - pole) * value;
        } else {
            state[0] = value;
        }
        self.gain * state[0]
    }
}
