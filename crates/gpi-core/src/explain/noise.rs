//! Effects of the noise: isolated wrong samples, and memory.

use super::residual::{ResidualTest, STRUCTURE};
use super::search::Search;
use crate::effects::{ColouredNoise, Effect, Outliers};
use crate::identify::colour::Colour;
use crate::identify::{NoiseFloor, NoiseMethod};
use crate::{Error, Matrix, Record};

/// What is wrong with the noise, when everything else is explained.
pub(crate) fn effects(
    search: &Search,
    residuals: &[Matrix],
    tests: &[ResidualTest],
    floor: &NoiseFloor,
) -> Result<Vec<Effect>, Error> {
    let mut found = Vec::new();
    found.extend(outliers(search));
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
fn outliers(search: &Search) -> Option<Effect> {
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
    // samples that stand apart where the input jumps are what the model makes of a jump
    (count >= FEWEST && 2 * driven < count).then(|| Outliers { count, samples, size }.into())
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
    const LEAST: f64 = 0.1;
    let colour = Colour::of(residuals, &search.prepared.record);
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
    if own > loudest {
        return Ok(None);
    }
    let falls = |before: f64, after: f64| after < (1.0 - LEAST) * before;
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

#[cfg(test)]
mod tests {
    use super::*;

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
