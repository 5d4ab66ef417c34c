//! When changes began, and how large they are.
//!
//! Changes S that are there until block e began at blocks a_i. The residual is then
//!
//! ```text
//! r(k) = sum_{i in S} d_i phi_i(k) [k behind a_i] + noise
//! ```
//!
//! and `J(a)` the sum of squares that the regression leaves. Each onset in turn minimises J with the others held, until none
//! moves any more. Sums of blocks are kept cumulatively, so that those of a segment between two onsets are a difference.

use crate::operators::{Merge, Moments, Regression};

type Sums = Moments<Vec<f64>>;

/// Passes over the onsets at most: they move together only where changes overlap.
const PASSES: usize = 4;

/// The least probability of a change that is told as one that may stand in the place of another.
const LEAST: f64 = 0.05;

/// The sums of all blocks so far.
#[derive(Clone, Debug)]
pub(super) struct History {
    /// Sums from the first block up to each block.
    until: Vec<Sums>,
    /// Blocks that are counted together.
    together: usize,
    /// Those that wait for the others of their group.
    waiting: usize,
    all: Sums,
    most: usize,
}

/// A change: its onset in blocks, size, and standard deviation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sized {
    pub onset: usize,
    pub size: f64,
    pub std: f64,
    /// The probability that it, and not another change in its place, explains the residual.
    pub confidence: f64,
    /// The others that may stand in its place.
    pub instead: Vec<usize>,
}

impl History {
    pub(super) fn new(empty: &Sums, most: usize) -> Self {
        Self { until: vec![empty.clone()], together: 1, waiting: 0, all: empty.clone(), most }
    }

    /// Counts one block.
    pub(super) fn push(&mut self, block: &Sums) {
        self.all = self.all.merged(block);
        self.waiting += 1;
        if self.waiting < self.together {
            return;
        }
        self.waiting = 0;
        self.until.push(self.all.clone());
        if self.until.len() > self.most {
            self.until = self.until.iter().step_by(2).cloned().collect();
            self.together *= 2;
        }
    }

    /// Empties the sums of all blocks so far; their number is kept.
    pub(super) fn forget(&mut self) {
        self.all = self.between(0, 0);
        self.until.fill(self.all.clone());
    }

    /// What lies between two places of `until`.
    fn between(&self, from: usize, to: usize) -> Sums {
        self.until[to].without(&self.until[from])
    }

    /// The last place that does not lie behind a block.
    fn place(&self, block: usize) -> usize {
        (block / self.together).min(self.until.len() - 1)
    }

    /// The regression on changes that began at places of `until`, between two places.
    fn regression(
        &self,
        began: &[(usize, usize)],
        (from, end): (usize, usize),
        count: usize,
    ) -> Regression<Vec<f64>> {
        let inside = began.iter().map(|&(_, place)| place.clamp(from, end));
        let mut edges: Vec<usize> = inside.chain([from, end]).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut sums = self.between(0, 0);
        for ends in edges.windows(2) {
            let is_there = |i| began.iter().any(|&(own, place)| own == i && place <= ends[0]);
            sums = sums.merged(&self.between(ends[0], ends[1]).with_only(count, is_there));
        }
        let mut regression = sums.regression(count);
        began.iter().for_each(|&(i, _)| {
            regression.enter(i);
        });
        regression
    }

    /// The changes of a set with the places at which they began.
    fn onsets(&self, set: &[usize], end: usize, count: usize) -> Vec<(usize, usize)> {
        let mut began: Vec<(usize, usize)> = set.iter().map(|&i| (i, 0)).collect();
        let at = |began: &[(usize, usize)]| self.regression(began, (0, end), count).left();
        let together = |place: usize| -> Vec<_> { set.iter().map(|&i| (i, place)).collect() };
        if let Some(best) = (0..end).min_by(|&a, &b| at(&together(a)).total_cmp(&at(&together(b))))
        {
            began = together(best);
        }
        for _ in 0..PASSES {
            let before = began.clone();
            for own in 0..began.len() {
                let moved = |place: usize| {
                    let mut there = began.clone();
                    there[own].1 = place;
                    at(&there)
                };
                let costs: Vec<f64> = (0..end).map(moved).collect();
                let best = (0..end).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
                began[own].1 = best.unwrap_or(0);
            }
            if began == before || set.len() < 2 {
                break;
            }
        }
        began
    }

    /// The changes of a set (in its order) that were there until a block.
    pub(super) fn sized(
        &self,
        set: &[usize],
        until: usize,
        count: usize,
        noise: f64,
    ) -> Vec<Sized> {
        let end = self.place(until);
        let began = self.onsets(set, end, count);
        let regression = self.regression(&began, (0, end), count);
        let samples = self.between(0, end).samples.max(1.0);
        let variance = (regression.left() / samples).max(noise * noise);
        let sized = |(own, &(change, place)): (usize, &(usize, usize))| {
            let size = regression.change(change);
            let deviation = regression.deviation(change, true).abs() / variance.sqrt();
            let spread = self.spread(&began, (place, end), count, noise);
            let instead = |other: usize| {
                let mut there = began.clone();
                there[own].0 = other;
                let more = self.regression(&there, (0, end), count).left() - regression.left();
                (other, (-0.5 * more / spread).min(0.0).exp())
            };
            let others: Vec<(usize, f64)> =
                (0..count).filter(|i| !set.contains(i)).map(instead).collect();
            let all = 1.0 + others.iter().map(|(_, weight)| weight).sum::<f64>();
            Sized {
                onset: place * self.together,
                size,
                std: if deviation > 0.0 { (size / deviation).abs() } else { f64::INFINITY },
                confidence: 1.0 / all,
                instead: (others.iter().filter(|(_, weight)| weight / all > LEAST))
                    .map(|&(other, _)| other)
                    .collect(),
            }
        };
        began.iter().enumerate().map(sized).collect()
    }

    /// The variance that a difference of two sums of squares has to exceed: that of the noise, and what changes leave besides
    /// because they are not linear, which is not independent from sample to sample but, roughly, from block to block.
    fn spread(
        &self,
        began: &[(usize, usize)],
        ends: (usize, usize),
        count: usize,
        noise: f64,
    ) -> f64 {
        let samples = self.between(ends.0, ends.1).samples.max(1.0);
        let left = self.regression(began, ends, count).left() / samples;
        let blocks = ((ends.1 - ends.0) * self.together).max(1) as f64;
        noise.powi(2) + (left - noise.powi(2)).max(0.0) * samples / blocks
    }

    /// The onset of a change of the noise that was there until a block, in blocks, and the noise's standard deviation since then:
    /// the place at which two variances are most likely.
    pub(super) fn noise(&self, until: usize, count: usize) -> (usize, f64) {
        let end = self.place(until);
        let piece = |from: usize, to: usize| {
            let sums = self.between(from, to);
            (sums.regression(count).left(), sums.samples)
        };
        let cost = |place: usize| -> f64 {
            let pieces = [piece(0, place), piece(place, end)];
            pieces.iter().filter(|(_, n)| *n > 0.0).map(|(j, n)| n * (j / n).ln()).sum()
        };
        let place = (0..end).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(0);
        let (left, samples) = piece(place, end);
        (place * self.together, (left / samples.max(1.0)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of 50 samples: an offset from block 40 on, a gain from block 70 on.
    fn history(most: usize) -> History {
        let empty = Sums::like(&vec![0.0; 6]);
        let mut history = History::new(&empty, most);
        for block in 0..100 {
            let mut sums = empty.clone();
            for k in 0..50 {
                let t = f64::from(50 * block + k);
                let phi = [1.0, (0.11 * t).sin()];
                let offset = if block >= 40 { 0.3 } else { 0.0 };
                let gain = if block >= 70 { -0.2 } else { 0.0 };
                let noise = 0.1 * (12.9898 * t * t).sin();
                sums.add(&phi, &[], offset + gain * phi[1] + noise, 0.0);
            }
            history.push(&sums);
        }
        history
    }

    #[test]
    fn onsets_and_sizes_are_found() {
        let found = history(1000).sized(&[0, 1], 100, 2, 0.05);
        assert!((found[0].size - 0.3).abs() < 3.0 * found[0].std + 0.005, "{found:?}");
        assert!((found[1].size + 0.2).abs() < 3.0 * found[1].std + 0.005, "{found:?}");
        assert_eq!([found[0].onset, found[1].onset], [40, 70]);
        assert!(found.iter().all(|one| one.confidence > 0.99));
    }

    #[test]
    fn the_onset_of_more_noise_is_found() {
        let empty = Sums::like(&vec![0.0; 6]);
        let mut history = History::new(&empty, 1000);
        for block in 0..60 {
            let mut sums = empty.clone();
            for k in 0..50 {
                let t = f64::from(50 * block + k);
                let size = if block >= 45 { 0.2 } else { 0.1 };
                sums.add(&[1.0, (0.11 * t).sin()], &[], size * (12.9898 * t * t).sin(), 0.0);
            }
            history.push(&sums);
        }
        let (onset, noise) = history.noise(60, 2);
        assert_eq!(onset, 45);
        assert!((noise - 0.2 / 2.0_f64.sqrt()).abs() < 0.01, "{noise}");
    }

    #[test]
    fn a_long_history_is_coarser() {
        let found = history(33).sized(&[0, 1], 100, 2, 0.05);
        assert_eq!([found[0].onset, found[1].onset], [40, 68]);
    }
}
