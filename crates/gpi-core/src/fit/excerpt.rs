//! Stretches of a long record, on which structures are compared.
//!
//! Dozens of structures are fitted before one is chosen, and far fewer samples than those of a long record tell them apart.
//! The chosen one is then fitted to the whole record.
//!
//! A stretch must show whole loops. With L = low + (high - low) / 4 and U = high - (high - low) / 4 of an input, a swing is
//! a passage from below L to above U and back. N samples with n swings of the input that swings least have the period N / n.
//! A stretch has 20 periods, so that its plays lose their unknown initial state in a small part of it; where two such
//! stretches are more samples than wanted, it has half of the wanted samples, which must be 4 periods at least.
//!
//! Stretches with the largest and the smallest value of each input come first: they decide where deadzones and plays are
//! placed. The others are spread evenly over the record. Neighbours become one stretch.

use crate::chain::bounds::range;
use crate::fit::settings::ExcerptSettings;
use crate::{Error, Experiment, Record};
use std::ops::Range;

/// The golden ratio's fraction: its multiples are spread evenly.
const SPREAD: f64 = 0.618_033_988_749_895;

/// Some stretches of a long record, each as an experiment; `None` of a record that is not long, or whose input is so slow
/// that few samples show no loops.
///
/// # Errors
/// As for [`Record::new`].
pub(crate) fn excerpt(
    record: &Record,
    settings: &ExcerptSettings,
) -> Result<Option<Record>, Error> {
    if record.scored() <= settings.long {
        return Ok(None);
    }
    let Some(length) = length(record, settings) else { return Ok(None) };
    let tiles: Vec<Tile> =
        (0..).zip(record.experiments()).flat_map(|(i, e)| tiled(i, e, length)).collect();
    let mut chosen = vec![false; tiles.len()];
    let mut taken = 0;
    let mut take = |place: usize| {
        if !std::mem::replace(&mut chosen[place], true) {
            taken += tiles[place].scored(record);
        }
        taken < settings.samples
    };
    let mut spread: Vec<usize> = (0..tiles.len()).collect();
    spread.sort_by(|a, b| (*a as f64 * SPREAD).fract().total_cmp(&(*b as f64 * SPREAD).fract()));
    let _ = extremes(record, &tiles).into_iter().chain(spread).all(&mut take);
    let chosen =
        tiles.into_iter().zip(chosen).filter_map(|(tile, is_chosen)| is_chosen.then_some(tile));
    let stretch = |tile: Tile| record.experiments()[tile.experiment].stretch(tile.samples);
    record.with_experiments(joined(chosen).into_iter().map(stretch).collect()).map(Some)
}

/// A stretch of an experiment.
struct Tile {
    experiment: usize,
    samples: Range<usize>,
}

impl Tile {
    fn scored(&self, record: &Record) -> usize {
        let runs = record.experiments()[self.experiment].scored_runs();
        let common = |run: Range<usize>| {
            run.end.min(self.samples.end).saturating_sub(run.start.max(self.samples.start))
        };
        runs.map(common).sum()
    }
}

/// The samples of a stretch, where the input swings fast enough for one.
fn length(record: &Record, settings: &ExcerptSettings) -> Option<usize> {
    let swings = (0..record.inputs().len()).map(|input| swings(record, input)).min()?;
    let period = record.samples() as f64 / swings.max(1) as f64;
    let most = settings.samples as f64 / 2.0;
    let length = (settings.swings * period).max(settings.shortest as f64).min(most);
    (swings > 0 && length >= settings.fewest_swings * period).then_some(length as usize)
}

/// How often an input passes from its lowest to its highest quarter and back.
fn swings(record: &Record, input: usize) -> usize {
    let (low, high) = range(record, input);
    let quarter = (high - low) / 4.0;
    let passages = record.experiments().iter().map(|experiment| {
        let mut is_high = None;
        let mut count = 0;
        for &u in experiment.input.column(input).iter() {
            let now = if u > high - quarter {
                true
            } else if u < low + quarter {
                false
            } else {
                continue;
            };
            count += usize::from(is_high.is_some_and(|before| before != now));
            is_high = Some(now);
        }
        count
    });
    passages.sum::<usize>() / 2
}

/// An experiment cut into stretches that have scored samples.
fn tiled(experiment: usize, whole: &Experiment, length: usize) -> Vec<Tile> {
    let rows = whole.input.nrows();
    let count = (rows / length).max(1);
    let tile = |i: usize| Tile { experiment, samples: i * rows / count..(i + 1) * rows / count };
    let is_scored = |tile: &Tile| {
        whole.scored_runs().any(|run| run.start < tile.samples.end && run.end > tile.samples.start)
    };
    (0..count).map(tile).filter(is_scored).collect()
}

/// The places of the stretches with the largest and the smallest value of each input.
fn extremes(record: &Record, tiles: &[Tile]) -> Vec<usize> {
    let mut places = Vec::new();
    for input in 0..record.inputs().len() {
        let bounds = |tile: &Tile| {
            let rows = tile.samples.clone();
            let values = record.experiments()[tile.experiment].input.column(input);
            let values = values.rows(rows.start, rows.len()).into_owned();
            (values.min(), values.max())
        };
        let bounds: Vec<(f64, f64)> = tiles.iter().map(bounds).collect();
        let all = || 0..tiles.len();
        places.extend(all().min_by(|&i, &j| bounds[i].0.total_cmp(&bounds[j].0)));
        places.extend(all().max_by(|&i, &j| bounds[i].1.total_cmp(&bounds[j].1)));
    }
    places
}

/// Neighbours of one experiment made one stretch.
fn joined(tiles: impl Iterator<Item = Tile>) -> Vec<Tile> {
    let mut joined: Vec<Tile> = Vec::new();
    for tile in tiles {
        match joined.last_mut() {
            Some(last)
                if last.experiment == tile.experiment && last.samples.end == tile.samples.start =>
            {
                last.samples.end = tile.samples.end;
            }
            _ => joined.push(tile),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Matrix};

    /// Sines of a period, one experiment each; the output is the time.
    fn record(lengths: &[usize], period: f64) -> Record {
        let run = |&samples: &usize| {
            let input = Matrix::from_fn(samples, 1, |k, _| {
                (std::f64::consts::TAU * k as f64 / period).sin()
            });
            Experiment::new(input, Matrix::from_fn(samples, 1, |k, _| k as f64))
        };
        let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
        Record::new(lengths.iter().map(run).collect(), 1000.0, u, y, vec![]).unwrap()
    }

    fn settings() -> ExcerptSettings {
        ExcerptSettings { long: 10_000, samples: 4000, shortest: 500, ..Default::default() }
    }

    #[test]
    fn a_long_record_is_sampled_and_a_short_one_is_not() {
        assert_eq!(excerpt(&record(&[10_000], 50.0), &settings()).unwrap(), None);
        let some = excerpt(&record(&[30_000], 50.0), &settings()).unwrap().unwrap();
        assert!((4000..5000).contains(&some.scored()), "{}", some.scored());
        let times: Vec<f64> = some.experiments().iter().map(|e| e.output[(0, 0)]).collect();
        assert!(
            times.len() > 1 && times.is_sorted() && times[times.len() - 1] > 15_000.0,
            "{times:?}"
        );
    }

    #[test]
    fn a_slow_input_is_not_sampled() {
        assert_eq!(excerpt(&record(&[30_000], 600.0), &settings()).unwrap(), None);
        assert!(excerpt(&record(&[30_000], 400.0), &settings()).unwrap().is_some());
    }

    #[test]
    fn the_extremes_are_shown_and_what_is_held_out_is_not() {
        let mut experiments = record(&[30_000, 30_000], 50.0).experiments().to_vec();
        experiments[1].output.add_scalar_mut(30_000.0);
        experiments[1].input[(17_017, 0)] = 1.9;
        experiments[1].input[(29_999, 0)] = -1.9;
        experiments[1].held_out = vec![16_000..17_020, 29_000..29_990];
        let whole = record(&[1000], 50.0).with_experiments(experiments).unwrap();
        let some = excerpt(&whole, &settings()).unwrap().unwrap();
        assert_eq!(range(&some, 0), (-1.9, 1.9));
        let held = [46_000.0..47_020.0, 59_000.0..59_990.0];
        for experiment in some.experiments() {
            for rows in experiment.scored_rows(&experiment.output) {
                assert!(rows.iter().all(|time| !held.iter().any(|held| held.contains(time))));
            }
        }
    }

    #[test]
    fn short_experiments_are_taken_whole() {
        let some = excerpt(&record(&[400; 100], 50.0), &settings()).unwrap().unwrap();
        assert!(some.experiments().iter().all(|e| e.input.nrows() == 400));
        assert_eq!(some.experiments().len(), 10);
    }
}
