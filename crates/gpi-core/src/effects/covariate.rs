//! Another measured column that leaks in.
//!
//! `y += g L x`, (E13) in the documentation's theory: a measured column x (a temperature, a neighbouring
//! axis) is added, either directly or through a first-order lag L of unit gain and time constant T,
//! `x_L(k) = z x_L(k-1) + (1 - z) x(k)`, `z = exp(-Ts / T)`.
//!
//! The record shows no past of x: `x_L(-1) = x(0) + s`. The start s is estimated with g and T, within the range that x has in
//! the record, is the same in all of its experiments, and belongs to that record alone.
//!
//! A column that only repeats an input or an output is not proposed: it is the reference of a loop, or another sensor of the
//! same signal, and no disturbance.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Added, Block, Moment, Proposal, Quantity, Situation, Stage, Units};
use crate::{Experiment, Record};
use nalgebra::DVectorView;

/// Another measured column x is added: `y += g L x`, L a first-order lag of unit gain or none.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Covariate {
    /// The output to which it is added.
    pub output: usize,
    /// Whether it is a disturbance at the plant's output, before the sensor.
    #[serde(default)]
    pub moves_stage: bool,
    /// The column's index among the record's covariates.
    pub column: usize,
    /// Its name.
    pub label: String,
    /// g, in the output's unit per unit of the column.
    pub gain: f64,
    /// T in seconds; 0 means without a lag.
    pub time_constant: f64,
    /// A change of g that moves the output by a thousandth of its span.
    pub step: f64,
    /// s, by which the lag differs from x(0) before the record, in the column's unit.
    #[serde(default)]
    pub start: f64,
    /// Largest less smallest x of the record, which bounds s; 0 holds s.
    #[serde(default)]
    pub range: f64,
}

impl Covariate {
    pub(super) const NAME: &'static str = "covariate";
    pub(super) const WHAT: &'static str =
        "another measured column influences the output, possibly with a lag";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["temperature", "disturbance column", "crosstalk", "cross-talk", "leak", "neighbour axis"];
    pub(super) const STAGE: Stage = Stage::Added;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::Unique;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Nothing;
    pub(super) const SHOWN_BY: &'static [&'static str] = &[];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// How many values are estimated: a column without a lag has no start, and one whose range is unknown is held.
    fn count(&self) -> usize {
        if self.time_constant <= 0.0 {
            1
        } else if self.range <= 0.0 {
            2
        } else {
            3
        }
    }

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
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
            if high <= low || follows_a_channel(situation.record, column) {
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
                        start: 0.0,
                        range: high - low,
                    };
                    found.push(Proposal::linear(block, [0]));
                }
            }
        }
        found
    }
}

/// Whether a column only repeats an input (a reference from which it was made, or a monitor of it) or an output (the
/// reference that a control loop makes it follow, or a second sensor).
fn follows_a_channel(record: &Record, column: usize) -> bool {
    let follows =
        |channel: &dyn Fn(&Experiment) -> DVectorView<f64>| follows(record, column, channel);
    let (inputs, outputs) = (record.inputs().len(), record.outputs().len());
    (0..inputs).any(|input| follows(&|e| e.input.column(input)))
        || (0..outputs).any(|output| follows(&|e| e.output.column(output)))
}

/// Whether a straight line turns a channel into a column.
fn follows(
    record: &Record,
    column: usize,
    channel: &dyn Fn(&Experiment) -> DVectorView<f64>,
) -> bool {
    /// Largest part of the column's variance that the channel leaves unexplained.
    const LEFT: f64 = 1e-3;
    let (mut samples, mut sums) = (0.0, [0.0; 5]);
    for experiment in record.experiments() {
        let (u, x) = (channel(experiment), experiment.covariates.column(column));
        samples += u.len() as f64;
        let own = [u.sum(), x.sum(), u.norm_squared(), x.norm_squared(), u.dot(&x)];
        sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
    }
    let [u, x, uu, xx, ux] = sums;
    let (uu, xx, ux) = (uu - u * u / samples, xx - x * x / samples, ux - u * x / samples);
    uu * xx - ux * ux < LEFT * uu * xx
}

impl Block for Covariate {
    fn values(&self) -> Vec<f64> {
        let all = [self.gain, self.time_constant, self.start];
        all[..self.count()].to_vec()
    }

    fn set(&mut self, values: &[f64]) {
        self.gain = values[0];
        if let Some(&time) = values.get(1) {
            self.time_constant = time;
        }
        if let Some(&start) = values.get(2) {
            self.start = start;
        }
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let time = (0.3 * self.time_constant, 3.0 * self.time_constant);
        let start = (-self.range, self.range);
        vec![(f64::NEG_INFINITY, f64::INFINITY), time, start][..self.count()].to_vec()
    }

    fn steps(&self) -> Vec<f64> {
        vec![self.step, 1e-4 * self.time_constant, 1e-3 * self.range][..self.count()].to_vec()
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let unit = Units::ratio(units.output, &self.label);
        let gain = Quantity::strength(format!("gain of {}", self.label), unit, self.gain);
        let mut quantities = vec![gain];
        if self.time_constant > 0.0 {
            quantities.push(Quantity::new("time_constant", "s", self.time_constant));
        }
        if self.count() > 2 {
            quantities.push(Quantity::new(
                format!("start of {}", self.label),
                &self.label,
                self.start,
            ));
        }
        quantities
    }

    fn flaw(&self) -> Option<String> {
        let lag = self.time_constant;
        (lag < 0.0).then(|| format!("its time constant of {lag} s must not be negative"))
    }

    fn forget_start(&mut self) {
        self.start = 0.0;
    }
}

impl Added for Covariate {
    fn output(&self) -> usize {
        self.output
    }

    fn moves_stage(&self) -> bool {
        self.moves_stage
    }

    fn set_moves_stage(&mut self, moves_stage: bool) {
        self.moves_stage = moves_stage;
    }

    fn column(&self) -> Option<(usize, &str)> {
        Some((self.column, &self.label))
    }

    /// The column behind the lag before the record.
    fn rest(&self, moment: Moment) -> Vec<f64> {
        vec![moment.covariates.get(self.column).copied().unwrap_or(0.0) + self.start]
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
