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

/// How much an input moves at each of its values.
///
/// The path of an input is `sum_k |u(k) - u(k-1)|` over the scored samples. Each step counts for the samples at its two
/// ends, so that nothing is counted where no sample lies. Rests add nothing.
pub(super) struct Path {
    low: f64,
    high: f64,
    bins: Vec<f64>,
    total: f64,
}

impl Path {
    pub(super) fn of(record: &Record, input: usize) -> Self {
        let runs = || scored(record, |e| &e.input, input);
        let (low, high) = extremes(runs().flatten());
        let mut path = Self { low, high, bins: vec![0.0; BINS], total: 0.0 };
        for mut run in runs() {
            let Some(mut last) = run.next() else { continue };
            for value in run {
                let step = (value - last).abs();
                for end in [last, value] {
                    let bin = path.bin(end);
                    path.bins[bin] += step;
                }
                path.total += 2.0 * step;
                last = value;
            }
        }
        path
    }

    /// Number of the bin of a value; 0 if the input does not move.
    fn bin(&self, value: f64) -> usize {
        ((value - self.low) / self.width()).max(0.0).min((BINS - 1) as f64) as usize
    }

    fn width(&self) -> f64 {
        (self.high - self.low) / BINS as f64
    }

    /// Largest minus smallest value.
    pub(super) fn span(&self) -> f64 {
        self.high - self.low
    }

    /// The part of the path on the side of `threshold` that lies away from zero.
    pub(super) fn behind(&self, threshold: f64) -> f64 {
        let is_outside =
            if threshold > 0.0 { threshold >= self.high } else { threshold <= self.low };
        if is_outside || self.total == 0.0 {
            return 0.0;
        }
        let bin = self.bin(threshold);
        let behind = if threshold > 0.0 { &self.bins[bin..] } else { &self.bins[..=bin] };
        behind.iter().sum::<f64>() / self.total
    }

    /// The values of the input below and above which less than a part of its path lies.
    pub(super) fn visited(&self, part: f64) -> (f64, f64) {
        if self.total == 0.0 {
            return (self.low, self.high);
        }
        let few = part * self.total;
        let bins = |bins: &mut dyn Iterator<Item = &f64>| {
            let mut sum = 0.0;
            let is_few = |own: &&f64| {
                sum += **own;
                sum <= few
            };
            bins.take_while(is_few).count() as f64 * self.width()
        };
        (self.low + bins(&mut self.bins.iter()), self.high - bins(&mut self.bins.iter().rev()))
    }
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
        let (low, high) = Path::of(&record(&u, 0), 0).visited(0.01);
        assert!(low < -9.5 && high > 9.5, "{low} {high}");
        u[100] = 12.0;
        let path = Path::of(&record(&u, 0), 0);
        let (_, high) = path.visited(0.02);
        assert!(high < 11.0, "{high}");
        // two steps of about 10 among 2000 of 0.6 on average
        assert!((0.005..0.02).contains(&path.behind(11.0)), "{}", path.behind(11.0));
        assert_eq!((path.behind(12.0), path.behind(-11.0)), (0.0, 0.0));
        assert!((0.4..0.6).contains(&path.behind(1e-9)));
        // what is not scored is not visited
        u[100] = 0.0;
        u[..100].fill(30.0);
        assert!(Path::of(&record(&u, 101), 0).visited(0.01).1 < 11.0);
    }

    #[test]
    fn levels_are_visited_and_rests_add_nothing() {
        let mut u = vec![0.0; 5000];
        for k in 100..200 {
            u[k] = f64::from(u8::from(k % 10 < 5));
        }
        assert_eq!(Path::of(&record(&u, 0), 0).visited(0.01), (0.0, 1.0));
        assert_eq!(Path::of(&record(&[2.0; 10], 0), 0).visited(0.01), (2.0, 2.0));
    }
}
