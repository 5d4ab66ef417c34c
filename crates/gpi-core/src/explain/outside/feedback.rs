//! Whether the input is computed from the output.
//!
//! Without feedback, past outputs contain nothing about the next input that past inputs do not contain: the output's own
//! disturbances do not reach the input. The step of the input is predicted from its own past alone, and with past outputs
//! (Granger 1969), on folds that neither regression was fitted to. With s and s_y the squares of the two, the statistics are
//! the part `1 - s_y / s` that past outputs take, and the mean of the folds' differences over its standard error.
//!
//! The past of the inputs must be longer than the memory of a spectrum that ends below the Nyquist frequency: modes that
//! ring keep older inputs in the output, and with few past inputs they predict a multisine in open loop. Such a mirror with
//! three piezos has the part 0.16 with 20 past inputs and 0.01 with 160. A stage under feedback has 0.47 with either, and
//! fifty other records of known truth at most 0.06.

use crate::Record;
use crate::explain::policy::OutsidePolicy;
use crate::rivals::RivalPolicy;
use crate::rivals::regression::{Features, Sums};

/// Past inputs, then past outputs; samples whose past is older than the experiment have none.
struct Past<'a> {
    record: &'a Record,
    inputs: usize,
    outputs: usize,
}

impl<'a> Past<'a> {
    /// As many past inputs as the samples can determine.
    fn of(record: &'a Record, rivals: &RivalPolicy, policy: &OutsidePolicy) -> Self {
        let samples = record.scored().min(rivals.most_samples) / rivals.for_each;
        let of_outputs = policy.past_outputs * record.outputs().len();
        // a constant is determined too
        let most = samples.saturating_sub(of_outputs + 1) / record.inputs().len();
        Self { record, inputs: policy.past_inputs.min(most), outputs: policy.past_outputs }
    }

    fn of_inputs(&self) -> usize {
        self.inputs * self.record.inputs().len()
    }

    fn is_known(&self, k: usize) -> bool {
        k >= self.inputs.max(self.outputs)
    }
}

impl Features for Past<'_> {
    fn count(&self) -> usize {
        self.of_inputs() + self.outputs * self.record.outputs().len()
    }

    fn fill(&self, experiment: usize, k: usize, row: &mut [f64]) {
        if !self.is_known(k) {
            return row.fill(0.0);
        }
        let experiment = &self.record.experiments()[experiment];
        let mut values = row.iter_mut();
        for (signal, lags) in [(&experiment.input, self.inputs), (&experiment.output, self.outputs)]
        {
            for column in signal.column_iter() {
                for (value, lag) in values.by_ref().take(lags).zip(1..) {
                    *value = column[k - lag];
                }
            }
        }
    }
}

/// The inputs that past outputs predict.
pub(super) fn inputs(record: &Record, rivals: &RivalPolicy, policy: &OutsidePolicy) -> Vec<usize> {
    let is_fed_back = |input: &usize| {
        predicted(record, *input, rivals, policy)
            .is_some_and(|(part, t)| part > policy.predicted && t > policy.sure)
    };
    (0..record.inputs().len()).filter(is_fed_back).collect()
}

/// The part of the squares that past outputs take, and how sure it is.
fn predicted(
    record: &Record,
    input: usize,
    rivals: &RivalPolicy,
    policy: &OutsidePolicy,
) -> Option<(f64, f64)> {
    let features = Past::of(record, rivals, policy);
    let step = |experiment: usize, k: usize, values: &mut [f64]| {
        let column = record.experiments()[experiment].input.column(input);
        values[0] = if features.is_known(k) { column[k] - column[k - 1] } else { 0.0 };
    };
    let sums = Sums::of(&features, record, 1, step, rivals);
    let own = sums.cross_validated(features.of_inputs(), 0.0)?;
    let with = sums.cross_validated(features.count(), 0.0)?;
    // an input that its own past determines is known without the output
    if own.score() < policy.least_news * record.scored() as f64 {
        return None;
    }
    let gains: Vec<f64> = own.squares.iter().zip(&with.squares).map(|(a, b)| a - b).collect();
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    Some((1.0 - with.score() / own.score(), mean / (variance / n).sqrt().max(f64::MIN_POSITIVE)))
}

/// What it means for the estimate.
pub(super) fn note(input: &str) -> String {
    format!(
        "Past outputs help to predict the input {input}, so that the input seems to depend on the output, as in a closed \
         loop. If this is so, the model is biased, because the controller feeds disturbances of the output back to the \
         input. Repeat the experiment in open loop."
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::outside::plants::{noise, slow_input, stage};
    use std::f64::consts::{PI, TAU};

    #[test]
    fn only_a_closed_loop_feeds_back() {
        let (rivals, policy) = (RivalPolicy::default(), OutsidePolicy::default());
        let reference = slow_input(6000);
        let mut e = noise(4);
        let disturbance: Vec<f64> = (0..6000).map(|_| 0.02 * e()).collect();
        for (gain, expected) in [(0.0, vec![]), (2.0, vec![0])] {
            let (mut u, mut y) = (vec![0.0], vec![0.0]);
            for k in 1..6000 {
                // a controller with a low gain that also lets the reference through
                u.push(reference[k] + gain * (reference[k] - y[k - 1]));
                y.push(0.8 * y[k - 1] + 0.2 * u[k - 1] + disturbance[k]);
            }
            assert_eq!(inputs(&stage(&u, &y), &rivals, &policy), expected, "gain {gain}");
        }
    }

    #[test]
    fn modes_that_ring_do_not_feed_back_a_multisine() {
        // 480 lines of a period of 1024 samples, and three modes that ring for hundreds of samples
        let (samples, period) = (6000, 1024_usize);
        let mut phase = noise(3);
        let phases: Vec<f64> = (1..=480).map(|_| PI * phase()).collect();
        let line = |n: usize, k: usize| TAU * (n * (k % period) % period) as f64 / period as f64;
        let sum =
            |k: usize| -> f64 { (1..).zip(&phases).map(|(n, p)| (line(n, k) + p).cos()).sum() };
        let u: Vec<f64> = (0..samples).map(|k| 0.03 * sum(k)).collect();
        let mut e = noise(5);
        let mut y: Vec<f64> = (0..samples).map(|_| 0.2 * e()).collect();
        for mode in 0..3 {
            let angle = PI * (0.1 + 0.425 * f64::from(mode));
            let radius = (-0.002 * angle).exp();
            let (mut last, mut before) = (0.0, 0.0);
            for k in 1..samples {
                let next = 2.0 * radius * angle.cos() * last - radius * radius * before + u[k - 1];
                (before, last) = (last, next);
                y[k] += next * angle.sin() * angle.sqrt();
            }
        }
        let record = stage(&u, &y);
        let (rivals, policy) = (RivalPolicy::default(), OutsidePolicy::default());
        let short = OutsidePolicy { past_inputs: 20, ..policy.clone() };
        assert_eq!(inputs(&record, &rivals, &short), vec![0], "the plant is a trap");
        assert_eq!(inputs(&record, &rivals, &policy), Vec::<usize>::new());
    }

    #[test]
    fn an_input_without_news_says_nothing() {
        let u: Vec<f64> = (0..6000).map(|k| (0.01 * f64::from(k)).sin()).collect();
        let mut e = noise(6);
        let y: Vec<f64> = u.iter().map(|u| u + 0.1 * e()).collect();
        let none: Vec<usize> = Vec::new();
        let found = inputs(&stage(&u, &y), &RivalPolicy::default(), &OutsidePolicy::default());
        assert_eq!(found, none);
    }
}
