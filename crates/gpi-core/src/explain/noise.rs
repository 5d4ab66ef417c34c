//! Effects of the noise: isolated wrong samples, and autocorrelation.
//!
//! *Wrong samples* are those that `uncertainty::outliers` finds. They are named if there are several, if fewer than a
//! part of them follow a jump of the input within a few samples (else the model errs at jumps), and if their squares
//! are a part of all: `sum_wrong c^2 > least (|e|^2 + sum_wrong c^2)`, where c is by how much a sample was changed.
//!
//! *Autocorrelated noise* is an autoregression of the residual e of an output,
//!
//! ```text
//! e(k) = sum_i a_i e(k - i) + w(k),      s_e = rms(e),      s_w = rms(w),
//! ```
//!
//! with coefficients from the training data ([`NoiseModel`]: Levinson and Durbin's recursion, order by the BIC). A
//! model that lacks hysteresis or friction leaves an autocorrelated residual as well. It is called noise only if
//!
//! - no test of structure fails;
//! - no effect that the input drives explained more and was refused because no machine can have it: whatever the cause is, what such
//!   an effect explains depends on the input;
//! - the output does not integrate the input: the error of a simulation is there the sum of all small forces that no model
//!   knows, which is predicted by its past as noise with a long memory is;
//! - s_w < (1 - p) s_e on the training data and, with the same a_i, on the held-out blocks;
//! - s_w is near the noise floor, because the fast part of coloured noise is in its innovations;
//! - s_e is near the noise floor, too, if the model has an effect that is a truncated expansion: the terms that it lacks
//!   leave a residual that follows the motion, in ways that no test need see;
//! - s_e is near the noise at rest, or a small part of the output's span where the input never rests;
//! - the kurtosis `mean(e^4) / mean(e^2)^2` is near 3, that of a stationary Gaussian process of any autocorrelation: an
//!   error that comes in bursts while the stage moves has more. The same is asked of the part e - w that the past predicts, because the
//!   white noise of the sensor hides such bursts in e.

use super::policy::NoisePolicy;
use super::residual::{ResidualTest, STRUCTURE};
use super::state::SearchState;
use crate::effects::{ColouredNoise, Effect, Outliers};
use crate::identify::{NoiseFloor, NoiseMethod};
use crate::uncertainty::noise_model::NoiseModel;
use crate::{Matrix, Record};

/// What the noise is besides white, once everything else is explained.
pub(super) fn effects(
    state: &SearchState,
    residuals: &[Matrix],
    tests: &[ResidualTest],
    floor: &NoiseFloor,
) -> Vec<Effect> {
    let mut found = Vec::new();
    found.extend(outliers(state, residuals));
    for output in 0..state.setup.measured.outputs().len() {
        let fails = |test: &ResidualTest| {
            test.output == output && STRUCTURE.contains(&test.name) && !test.passed()
        };
        if !tests.iter().any(fails) {
            let noise = memory(state, residuals, output, floor);
            let noise = noise.filter(|noise| is_alone(state, residuals, noise, floor));
            found.extend(noise.map(Effect::from));
        }
    }
    found
}

/// The samples that were found wrong, and by how much they were changed.
fn outliers(state: &SearchState, residuals: &[Matrix]) -> Option<Effect> {
    let policy = &state.setup.policy.noise;
    let (mut count, mut driven, mut squares) = (0, 0, 0.0);
    let measured = &state.setup.measured;
    let pairs = measured.experiments().iter().zip(state.prepared.record.experiments());
    for ((given, mended), places) in pairs.zip(&state.wrong) {
        let after_jumps = after_jumps(&given.input, policy);
        for (output, places) in places.iter().enumerate() {
            for &k in places {
                count += 1;
                driven += usize::from(after_jumps[k]);
                squares += (given.output[(k, output)] - mended.output[(k, output)]).powi(2);
            }
        }
    }
    let samples = measured.samples();
    let size = (squares / count.max(1) as f64).sqrt();
    let left: f64 = residuals.iter().map(Matrix::norm_squared).sum();
    // where most follow a jump of the input, it is the model that errs at jumps
    let stand_apart = count >= policy.fewest
        && (driven as f64) < policy.after_jumps * count as f64
        && squares > state.setup.policy.judgement.least * (left + squares);
    stand_apart.then(|| Outliers { count, samples, size }.into())
}

/// Whether an input jumped at a sample or shortly before: by more than nearly all of its changes.
fn after_jumps(input: &Matrix, policy: &NoisePolicy) -> Vec<bool> {
    let samples = input.nrows();
    let mut after = vec![false; samples];
    for column in input.column_iter() {
        let change = |k: usize| (column[k] - column[k - 1]).abs();
        let mut changes: Vec<f64> = (1..samples).map(change).collect();
        changes.sort_by(f64::total_cmp);
        let last = changes.len().saturating_sub(1) as f64;
        let Some(&usual) = changes.get((policy.no_jumps * last) as usize) else { continue };
        for k in (1..samples).filter(|&k| change(k) > usual) {
            after[k..(k + policy.shortly).min(samples)].fill(true);
        }
    }
    after
}

/// Autocorrelated noise that most of a residual may be: its past predicts it on the training data and on what is held out, and
/// the noise is also there when nothing moves, as far as the record shows that.
pub(super) fn memory(
    state: &SearchState,
    residuals: &[Matrix],
    output: usize,
    floor: &NoiseFloor,
) -> Option<ColouredNoise> {
    let policy = &state.setup.policy.noise;
    let falls = |before: f64, after: f64| after < (1.0 - policy.predicted) * before;
    let follows_input = state
        .rms(&state.point)
        .is_ok_and(|[_, held_out]| falls(held_out, state.surpassing.impossible));
    if follows_input || matches!(state.integrates(), Ok(true)) {
        return None;
    }
    let colour = NoiseModel::of(residuals, &state.prepared.record);
    let filter = &colour.coefficients[output];
    if filter.is_empty() {
        return None;
    }
    let (own, innovation) = one_step(residuals, &state.prepared.record, output, filter);
    let (held_out, predicted) = one_step(residuals, &state.setup.test, output, filter);
    let outputs = state.prepared.record.experiments().iter().map(|e| e.output.column(output));
    let span = outputs.map(|column| column.max() - column.min()).fold(0.0, f64::max);
    let loudest = match floor.method {
        NoiseMethod::HighFrequencyResidual => policy.loud * span,
        _ => policy.louder * floor.rms[output],
    };
    // what is predictable from its past alone leaves innovations that are as fast as the noise
    let is_fast = innovation > policy.innovation * floor.rms[output];
    let is_noise = !is_fast && own <= loudest;
    let is_predicted = falls(own, innovation) && falls(held_out, predicted);
    let noise = ColouredNoise { output, coefficients: filter.clone(), innovation, deviation: own };
    (is_noise && is_predicted).then_some(noise)
}

/// Whether autocorrelated noise is all of a residual that no test of structure finds fault with: it does not come in bursts, and it
/// is no remainder of an expansion.
pub(super) fn is_alone(
    state: &SearchState,
    residuals: &[Matrix],
    noise: &ColouredNoise,
    floor: &NoiseFloor,
) -> bool {
    let policy = &state.setup.policy.noise;
    let is_expanded = state.point.effects.iter().any(|effect| effect.entry().is_expansion);
    let is_remainder = is_expanded && noise.deviation > policy.innovation * floor.rms[noise.output];
    let record = &state.prepared.record;
    let is_steady =
        |residuals: &[Matrix]| kurtosis(residuals, record, noise.output) <= policy.kurtosis;
    !is_remainder && is_steady(residuals) && is_steady(&predictable(residuals, &noise.coefficients))
}

/// The part of each residual that its own past predicts, `sum_i a_i e(k - i)` for all columns.
fn predictable(residuals: &[Matrix], coefficients: &[f64]) -> Vec<Matrix> {
    let of = |residual: &Matrix| {
        Matrix::from_fn(residual.nrows(), residual.ncols(), |k, column| {
            let past = coefficients.iter().zip((0..k).rev());
            past.map(|(a, before)| a * residual[(before, column)]).sum()
        })
    };
    residuals.iter().map(of).collect()
}

/// Standard deviations of a residual and of what its past does not predict.
fn one_step(residuals: &[Matrix], record: &Record, output: usize, filter: &[f64]) -> (f64, f64) {
    let (mut own, mut left, mut count) = (0.0, 0.0, 0.0);
    let pairs = residuals.iter().zip(predictable(residuals, filter));
    for ((residual, predicted), experiment) in pairs.zip(record.experiments()) {
        for k in experiment.scored_runs().flatten().filter(|&k| k >= filter.len()) {
            let at = (k, output);
            own += residual[at] * residual[at];
            left += (residual[at] - predicted[at]).powi(2);
            count += 1.0;
        }
    }
    let deviation = |sum: f64| (sum / f64::max(count, 1.0)).sqrt();
    (deviation(own), deviation(left))
}

/// Fourth moment of a residual over the square of the second.
fn kurtosis(residuals: &[Matrix], record: &Record, output: usize) -> f64 {
    let (mut second, mut fourth, mut count) = (0.0, 0.0, 0.0);
    for (residual, experiment) in residuals.iter().zip(record.experiments()) {
        for k in experiment.scored_runs().flatten() {
            let square = residual[(k, output)].powi(2);
            second += square;
            fourth += square * square;
            count += 1.0;
        }
    }
    fourth * count / (second * second).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_that_comes_and_goes_has_bursts() {
        let nothing = |columns| Matrix::zeros(1000, columns);
        let (input, output, covariates) = (nothing(1), nothing(1), nothing(0));
        let run = crate::Experiment { input, output, covariates, warmup: 0, held_out: vec![] };
        let channel = || vec![crate::Channel::new("a", "")];
        let record = Record::new(vec![run], 1.0, channel(), channel(), vec![]).unwrap();
        let of = |size: fn(usize) -> f64| {
            let sine = |k: usize| (0.3 * k as f64).sin();
            kurtosis(&[Matrix::from_fn(1000, 1, |k, _| size(k) * sine(k))], &record, 0)
        };
        assert!((of(|_| 2.0) - 1.5).abs() < 0.01);
        let quarter = |k: usize| if k < 250 { 1.0 } else { 0.0 };
        assert!((of(quarter) - 6.0).abs() < 0.1);
    }

    #[test]
    fn white_noise_does_not_hide_bursts_that_the_past_predicts() {
        // a slow sine in a tenth of the record, beside noise from a counter
        let noise = |k: usize| ((k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64;
        let own = |k: usize| if k % 1000 < 100 { 0.6 * (0.06 * k as f64).sin() } else { 0.0 };
        let residual =
            Matrix::from_fn(10_000, 1, |k, _| noise(k) / f64::from(1 << 24) - 0.5 + own(k));
        let coefficients = vec![0.1; 10];
        let colour = ColouredNoise { output: 0, coefficients, innovation: 1.0, deviation: 1.0 };
        let (input, output, covariates) =
            (residual.clone(), residual.clone(), Matrix::zeros(10_000, 0));
        let run = crate::Experiment { input, output, covariates, warmup: 0, held_out: vec![] };
        let channel = || vec![crate::Channel::new("a", "")];
        let record = Record::new(vec![run], 1.0, channel(), channel(), vec![]).unwrap();
        let residuals = [residual];
        let most = NoisePolicy::default().kurtosis;
        assert!(kurtosis(&residuals, &record, 0) < most);
        let bursts = predictable(&residuals, &colour.coefficients);
        assert!(kurtosis(&bursts, &record, 0) > most);
        // the mean of the ten samples before
        let before: f64 = (40..50).map(|k| residuals[0][(k, 0)]).sum();
        assert!((bursts[0][(50, 0)] - 0.1 * before).abs() < 1e-12);
    }

    #[test]
    fn samples_shortly_after_an_input_jumps_are_known() {
        let input = Matrix::from_fn(1000, 1, |k, _| if k < 400 { 0.0 } else { 5.0 });
        let policy = NoisePolicy::default();
        let after = after_jumps(&input, &policy);
        let places: Vec<usize> = (0..1000).filter(|&k| after[k]).collect();
        assert_eq!(places, (400..408).collect::<Vec<_>>());
        // nothing moves: nothing jumps
        assert!(!after_jumps(&Matrix::zeros(50, 2), &policy).contains(&true));
    }
}
