//! Effects of the noise: isolated wrong samples, and memory.

use super::residual::{ResidualTest, STRUCTURE};
use super::search::Search;
use super::trial::LEAST;
use crate::effects::{ColouredNoise, Effect, Outliers};
use crate::identify::{NoiseFloor, NoiseMethod};
use crate::uncertainty::noise_model::NoiseModel;
use crate::{Error, Matrix, Record};

/// What is wrong with the noise, when everything else is explained.
pub(crate) fn effects(
    search: &Search,
    residuals: &[Matrix],
    tests: &[ResidualTest],
    floor: &NoiseFloor,
) -> Result<Vec<Effect>, Error> {
    let mut found = Vec::new();
    found.extend(outliers(search, residuals));
    for output in 0..search.measured.outputs().len() {
        let fails = |test: &ResidualTest| {
            test.output == output && STRUCTURE.contains(&test.name) && !test.passed()
        };
        if !tests.iter().any(fails) {
            found.extend(memory(search, residuals, output, floor)?);
        }
    }
    Ok(found)
}

/// The samples that were found wrong, by what they were changed.
fn outliers(search: &Search, residuals: &[Matrix]) -> Option<Effect> {
    /// Fewer may be chance, or the way a record was cut.
    const FEWEST: usize = 3;
    let (mut count, mut driven, mut squares) = (0, 0, 0.0);
    let measured = &search.measured;
    let pairs = measured.experiments().iter().zip(search.prepared.record.experiments());
    for ((given, mended), places) in pairs.zip(&search.wrong) {
        let after_jumps = after_jumps(&given.input);
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
    // samples that stand apart where the input jumps are what the model makes of a jump
    let stand_apart = count >= FEWEST && 2 * driven < count && squares > LEAST * (left + squares);
    stand_apart.then(|| Outliers { count, samples, size }.into())
}

/// Whether an input jumped at a sample or up to seven before: by more than 99 % of its changes.
fn after_jumps(input: &Matrix) -> Vec<bool> {
    const SHORTLY: usize = 8;
    const NEARLY_ALL: f64 = 0.99;
    let samples = input.nrows();
    let mut after = vec![false; samples];
    for column in input.column_iter() {
        let change = |k: usize| (column[k] - column[k - 1]).abs();
        let mut changes: Vec<f64> = (1..samples).map(change).collect();
        changes.sort_by(f64::total_cmp);
        let last = changes.len().saturating_sub(1) as f64;
        let Some(&usual) = changes.get((NEARLY_ALL * last) as usize) else { continue };
        for k in (1..samples).filter(|&k| change(k) > usual) {
            after[k..(k + SHORTLY).min(samples)].fill(true);
        }
    }
    after
}

/// Noise with memory, if its past predicts it: on the training data, and on what is held out; and if it is
/// there when nothing moves, as far as the record shows that.
fn memory(
    search: &Search,
    residuals: &[Matrix],
    output: usize,
    floor: &NoiseFloor,
) -> Result<Option<Effect>, Error> {
    /// A residual so many times larger than the noise at rest is the actuator's. Slow noise shows in part
    /// only while the input rests.
    const LOUDER: f64 = 2.5;
    /// Where the input never rests, a residual of so large a part of the span is no sensor's noise.
    const LOUD: f64 = 0.02;
    /// The part by which the standard deviation must fall.
    const FALL: f64 = 0.1;
    /// Fourth moment over the square of the second: 3 for noise of any colour, more for what comes in bursts
    /// as the actuator moves.
    const BURSTS: f64 = 3.8;
    let colour = NoiseModel::of(residuals, &search.prepared.record);
    let filter = &colour.coefficients[output];
    if filter.is_empty() {
        return Ok(None);
    }
    let (own, innovation) = one_step(residuals, &search.prepared.record, output, filter);
    let (held_out, predicted) = one_step(residuals, &search.test, output, filter);
    let outputs = search.prepared.record.experiments().iter().map(|e| e.output.column(output));
    let span = outputs.map(|column| column.max() - column.min()).fold(0.0, f64::max);
    let loudest = match floor.method {
        NoiseMethod::HighFrequencyResidual => LOUD * span,
        _ => LOUDER * floor.rms[output],
    };
    if own > loudest || kurtosis(residuals, &search.prepared.record, output) > BURSTS {
        return Ok(None);
    }
    let falls = |before: f64, after: f64| after < (1.0 - FALL) * before;
    let block = ColouredNoise { output, coefficients: filter.clone(), innovation, deviation: own };
    Ok((falls(own, innovation) && falls(held_out, predicted)).then(|| block.into()))
}

/// Standard deviations of a residual and of what its past does not predict.
fn one_step(residuals: &[Matrix], record: &Record, output: usize, filter: &[f64]) -> (f64, f64) {
    let (mut own, mut left, mut count) = (0.0, 0.0, 0.0);
    for (residual, experiment) in residuals.iter().zip(record.experiments()) {
        let column = residual.column(output);
        for k in experiment.scored_runs().flatten().filter(|&k| k >= filter.len()) {
            let predicted: f64 = filter.iter().zip(1..).map(|(a, lag)| a * column[k - lag]).sum();
            own += column[k] * column[k];
            left += (column[k] - predicted).powi(2);
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
    fn samples_shortly_after_an_input_jumps_are_known() {
        let input = Matrix::from_fn(1000, 1, |k, _| if k < 400 { 0.0 } else { 5.0 });
        let after = after_jumps(&input);
        let places: Vec<usize> = (0..1000).filter(|&k| after[k]).collect();
        assert_eq!(places, (400..408).collect::<Vec<_>>());
        // nothing moves: nothing jumps
        assert!(!after_jumps(&Matrix::zeros(50, 2)).contains(&true));
    }
}
