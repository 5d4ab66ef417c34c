//! Where the signals of a record move.

use crate::{Experiment, Matrix, Record};

/// Number of bins in which the path of an input is counted.
const BINS: usize = 1000;

/// The runs of consecutive scored samples of one channel.
pub(super) fn scored<'a>(
    record: &'a Record,
    signal: impl Fn(&'a Experiment) -> &'a Matrix + Copy + 'a,
    channel: usize,
) -> impl Iterator<Item = impl Iterator<Item = f64> + 'a> + 'a {
    record.experiments().iter().flat_map(move |experiment| {
        let values = signal(experiment).column(channel);
        experiment.scored_runs().map(move |run| run.map(move |k| values[k]))
    })
}

/// The smallest and the largest value.
pub(super) fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    values.fold(none, |(low, high), value| (low.min(value), high.max(value)))
}

/// The values of an input below and above which a part of its path lies.
///
/// The path is `sum_k |u(k) - u(k-1)|` over the scored samples. Each step counts for the samples at its two ends, so that
/// nothing is counted where no sample lies. Rests add nothing.
pub(super) fn visited(record: &Record, input: usize, part: f64) -> (f64, f64) {
    let runs = || scored(record, |e| &e.input, input);
    let (low, high) = extremes(runs().flatten());
    let width = (high - low) / BINS as f64;
    if width.is_nan() || width <= 0.0 {
        return (low, high);
    }
    let bin = |value: f64| (((value - low) / width) as usize).min(BINS - 1);
    let mut path = vec![0.0; BINS];
    for mut run in runs() {
        let Some(mut last) = run.next() else { continue };
        for value in run {
            path[bin(last)] += (value - last).abs();
            path[bin(value)] += (value - last).abs();
            last = value;
        }
    }
    let few = part * path.iter().sum::<f64>();
    let bins = |path: &mut dyn Iterator<Item = &f64>| {
        let mut sum = 0.0;
        let is_few = |own: &&f64| {
            sum += **own;
            sum <= few
        };
        path.take_while(is_few).count() as f64
    };
    (low + width * bins(&mut path.iter()), high - width * bins(&mut path.iter().rev()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    fn record(u: &[f64], warmup: usize) -> Record {
        let input = Matrix::from_column_slice(u.len(), 1, u);
        let run = Experiment { warmup, ..Experiment::new(input.clone(), input) };
        let channel = |name| vec![Channel::new(name, "")];
        Record::new(vec![run], 1.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    #[test]
    fn a_short_visit_is_not_counted() {
        let sweep = |k: usize| 10.0 * (0.1 * k as f64).sin();
        let mut u: Vec<f64> = (0..2000).map(sweep).collect();
        let (low, high) = visited(&record(&u, 0), 0, 0.01);
        assert!(low < -9.5 && high > 9.5, "{low} {high}");
        u[100] = 12.0;
        let (_, high) = visited(&record(&u, 0), 0, 0.02);
        assert!(high < 11.0, "{high}");
        // what is not scored is not visited
        u[100] = 0.0;
        u[..100].fill(30.0);
        assert!(visited(&record(&u, 101), 0, 0.01).1 < 11.0);
    }

    #[test]
    fn levels_are_visited_and_rests_add_nothing() {
        let mut u = vec![0.0; 5000];
        for k in 100..200 {
            u[k] = f64::from(u8::from(k % 10 < 5));
        }
        assert_eq!(visited(&record(&u, 0), 0, 0.01), (0.0, 1.0));
        assert_eq!(visited(&record(&[2.0; 10], 0), 0, 0.01), (2.0, 2.0));
    }
}
