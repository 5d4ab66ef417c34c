//! The dynamics of a plant that is slower than the impulse response that a record affords.
//!
//! An impulse response that ends before its slowest lag has decayed gives ERA wrong poles. Time constants on a geometric grid
//! take their place: of all pairs, the one is chosen that leaves the least squares with
//!
//! ```text
//! G(z) = D + C_1 (1 - p_1) / (z - p_1) + C_2 (1 - p_2) / (z - p_2),    p_i = exp(-1 / T_i)
//! ```
//!
//! C_1, C_2 and D (outputs, inputs) by least squares on y, with u in place of v. Two lags in a row are such a sum. Where an order is
//! given, there are as many lags as it has for each input, one or two. Of a record of many stretches of scored samples, the longest
//! ones take part.

use crate::chain::point::Point;
use crate::fit::memory::Memory;
use crate::fit::preparation::{Prepared, rescale};
use crate::identify::realization::{Refit, refit};
use crate::identify::settings::SlowPolicy;
use crate::linear::{Sections, StateSpace};
use crate::progress::{Progress, report};
use crate::{Error, Experiment, Matrix, Record};
use std::cmp::Reverse;

/// The best pair of lags of a plant that is linear otherwise, or as many as a given order has; `None` where it has others, where the
/// plant is not slow by these lags, or where neither a first estimate of it is slow nor a single lag leaves a smaller error. Where
/// one does, the estimate is wrong.
pub(super) fn seed(
    estimate: &Point,
    order: Option<usize>,
    prepared: &Prepared,
    policy: &SlowPolicy,
    progress: Progress,
) -> Result<Option<Point>, Error> {
    let memory = Memory::of(&prepared.record);
    let inputs = prepared.record.inputs().len();
    let is_pair = order.is_none_or(|order| order == 2 * inputs);
    if prepared.record.longest() < memory.enough() || !(is_pair || order == Some(inputs)) {
        return Ok(None);
    }
    let is_slow = memory.is_slow_plant(estimate, prepared)?;
    let SlowPolicy { shortest, longest, ratio, stretches, .. } = *policy;
    let longest = longest * prepared.record.longest() as f64;
    let constants: Vec<f64> =
        std::iter::successors(Some(shortest), |constant| Some(ratio * constant))
            .take_while(|&constant| constant <= longest)
            .collect();
    let record = longest_of(&prepared.record, stretches)?;
    let singles: Vec<_> = constants.iter().map(|&constant| vec![constant]).collect();
    let asks_singles = !(is_slow && is_pair);
    let single = asks_singles.then(|| best_of(&record, &singles, progress)).transpose()?.flatten();
    if !is_slow {
        let rms = prepared.free_run(&mut estimate.clone())?;
        if single.as_ref().is_none_or(|single| single.rms >= rms) {
            return Ok(None);
        }
    }
    let with_slower = |(place, &first): (usize, &f64)| -> Vec<Vec<f64>> {
        constants[place + 1..].iter().map(|&second| vec![first, second]).collect()
    };
    let pairs: Vec<_> = constants.iter().enumerate().flat_map(with_slower).collect();
    let best = if is_pair { best_of(&record, &pairs, progress)? } else { single };
    let Some(best) = best else { return Ok(None) };
    let mut point = prepared.point(Sections::from_state_space(&best.system, 0)?);
    if !memory.is_slow_plant(&point, prepared)? {
        return Ok(None);
    }
    prepared.free_run(&mut point)?;
    rescale(&mut point);
    Ok(Some(point))
}

/// The lags that leave the least squares, if any can be fitted.
fn best_of(
    record: &Record,
    constants: &[Vec<f64>],
    progress: Progress,
) -> Result<Option<Refit>, Error> {
    let size = (record.outputs().len(), record.inputs().len());
    let mut best: Option<Refit> = None;
    for (place, own) in constants.iter().enumerate() {
        report(progress, "slow lags", place as f64 / constants.len() as f64)?;
        let Ok(found) = refit(record, lags(own, size)?) else { continue };
        if best.as_ref().is_none_or(|best| found.rms < best.rms) {
            best = Some(found);
        }
    }
    Ok(best)
}

/// So many stretches of scored samples, the longest ones.
fn longest_of(record: &Record, count: usize) -> Result<Record, Error> {
    let record = record.pieces(0)?;
    let mut lengths: Vec<usize> = record.experiments().iter().map(Experiment::scored).collect();
    lengths.sort_by_key(|&length| Reverse(length));
    let least = lengths.get(count - 1).copied().unwrap_or(0);
    let is_long = |experiment: &&Experiment| experiment.scored() >= least;
    record.with_experiments(record.experiments().iter().filter(is_long).cloned().collect())
}

/// A lag of every time constant (in samples) for each input, of DC gain one.
fn lags(constants: &[f64], (outputs, inputs): (usize, usize)) -> Result<StateSpace, Error> {
    let order = constants.len() * inputs;
    let pole = |state: usize| (-1.0 / constants[state / inputs]).exp();
    let a = Matrix::from_fn(order, order, |i, j| if i == j { pole(i) } else { 0.0 });
    let b = Matrix::from_fn(
        order,
        inputs,
        |i, input| if i % inputs == input { 1.0 - pole(i) } else { 0.0 },
    );
    StateSpace::new(a, b, Matrix::zeros(outputs, order), Matrix::zeros(outputs, inputs))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;
    use crate::fit::Grid;
    use crate::fit::memory::time_constant;
    use crate::identify::IdentifyOptions;
    use crate::identify::procedure::prepare;

    /// The time constants that are found for a stage with so much of its gain at once and two lags in a row, which begins in
    /// motion, with many levels of the input.
    fn found(at_once: f64, constants: [f64; 2], order: Option<usize>) -> Option<Vec<f64>> {
        let level = |k: usize| ((k / 150) as f64 * 2.399).sin();
        let (mut first, mut second) = (0.3, -0.2);
        let (mut u, mut y) = (Vec::new(), Vec::new());
        for k in 0..6000 {
            u.push(level(k));
            y.push(3.0 * (at_once * level(k) + (1.0 - at_once) * second) + 0.7);
            second += (first - second) / constants[1];
            first += (level(k) - first) / constants[0];
        }
        let column = |values| Matrix::from_vec(6000, 1, values);
        let run = Experiment::new(column(u), column(y));
        let channel = |name| vec![Channel::new(name, "")];
        let record = Record::new(vec![run], 1000.0, channel("u"), channel("y"), vec![]).unwrap();
        let options = IdentifyOptions {
            half_widths: Some(Grid::Count(1)),
            thresholds: Some(Grid::Count(0)),
            ..IdentifyOptions::default()
        };
        let prepared = prepare(&record, &options).unwrap();
        let system = lags(&constants, (1, 1)).unwrap();
        let estimate = refit(&prepared.record, system).unwrap().system;
        let estimate = prepared.point(Sections::from_state_space(&estimate, 0).unwrap());
        let point = seed(&estimate, order, &prepared, &SlowPolicy::default(), &mut |_| true);
        let point = point.unwrap()?;
        let mut constants: Vec<f64> = point.dynamics.poles().iter().map(time_constant).collect();
        constants.sort_by(f64::total_cmp);
        Some(constants)
    }

    #[test]
    fn both_lags_of_a_slow_plant_are_on_the_grid_next_to_the_true_ones() {
        for order in [None, Some(2)] {
            let constants = found(0.0, [900.0, 300.0], order).unwrap();
            assert_eq!(constants.len(), 2);
            assert!((200.0..450.0).contains(&constants[0]), "{constants:?}");
            assert!((600.0..1350.0).contains(&constants[1]), "{constants:?}");
        }
    }

    #[test]
    fn a_given_order_has_as_many_lags() {
        let constants = found(0.0, [900.0, 1.0], Some(1)).unwrap();
        assert_eq!(constants.len(), 1);
        assert!((600.0..1350.0).contains(&constants[0]), "{constants:?}");
        assert_eq!(found(0.0, [900.0, 300.0], Some(3)), None);
    }

    #[test]
    fn a_stage_that_moves_at_once_is_not_a_slow_plant() {
        assert_eq!(found(0.7, [900.0, 300.0], None), None);
        assert_eq!(found(0.0, [6.0, 3.0], None), None);
    }
}
