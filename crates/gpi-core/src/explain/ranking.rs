//! Which effects the score test finds most promising.

use super::score::{Base, Score, scores};
use super::search::Search;
use crate::Error;
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::effects::{Entry, Proposal};
use crate::fit::representatives::representatives;
use crate::progress::{Progress, report};

/// The best candidate of a family.
pub(super) struct Ranked {
    pub entry: &'static Entry,
    pub score: Score,
    /// By how much its deviance exceeds what its parameters cost.
    pub worth: f64,
}

impl Search<'_> {
    /// The best candidate of each family that promises something, the most promising first.
    pub(super) fn ranked(&self, progress: Progress) -> Result<Vec<Ranked>, Error> {
        /// A family that promises less than this part of the best one's need not be fitted.
        const FAR_BEHIND: f64 = 0.2;
        let mut best = self.scored_beside(&self.point, &self.allowed, progress)?;
        let most = best.first().map_or(0.0, |first| first.worth);
        best.retain(|one| one.worth > 0.0 && one.worth > FAR_BEHIND * most);
        Ok(best)
    }

    /// The best candidate of each family beside a point, the most promising first.
    pub(super) fn scored_beside(
        &self,
        point: &Point,
        families: &[&'static Entry],
        progress: Progress,
    ) -> Result<Vec<Ranked>, Error> {
        /// What deadzones, plays and G take the shape of where one cycle repeats, for that cycle alone.
        const ONE_CYCLE: [&str; 5] = [
            "linear-dynamics",
            "rate-dependence",
            "hysteresis-shape",
            "output-nonlinearity",
            "stiffness",
        ];
        let Self { prepared, options, .. } = self;
        let record = &prepared.record;
        let unknowns = Table::new(point, options.freedom).len;
        let few = representatives(point, record, unknowns);
        let alone = few.map(|few| few.alone(point, record)).transpose()?;
        let (point, record) = alone.as_ref().map_or((point, record), |(p, r)| (p, r));
        let base = Base::new(point, record, options.freedom, &options.loss)?;
        let values = (record.scored() * record.outputs().len()) as f64;
        let present = |entry: &Entry| point.effects.iter().any(|e| e.name() == entry.name);
        // G of any order takes a delay for itself
        let of_use = |entry: &Entry| entry.name != "delay" || self.order_is_given;
        let is_told = |entry: &Entry| !self.is_one_sine || !ONE_CYCLE.contains(&entry.name);
        let usable =
            |entry: &&&Entry| of_use(entry) && is_told(entry) && (entry.repeats || !present(entry));
        let (mut entries, mut candidates) = (Vec::new(), Vec::new());
        for &entry in families.iter().filter(usable) {
            let found = base.situation(entry.proposals);
            // before and behind the output stage is the same where there is none
            let elsewhere = found.iter().filter_map(Proposal::elsewhere).filter(|_| point.senses());
            candidates.extend(elsewhere.collect::<Vec<_>>());
            candidates.extend(found);
            entries.resize(candidates.len(), entry);
        }
        let mut check = |done| report(progress, "score test", done);
        let mut best = Vec::new();
        let scores = scores(&base, &candidates, &mut check)?;
        let is_slow: Vec<bool> = (0..scores.len()).map(|i| is_slow(&scores, i)).collect();
        let scored = entries.into_iter().zip(scores).zip(is_slow);
        for ((entry, score), is_slow) in scored {
            if SLOW.contains(&entry.name) && !is_slow {
                continue;
            }
            let deviance = -values * (1.0 - score.gain).max(1e-300).ln();
            let worth = deviance - score.columns as f64 * values.ln();
            keep_best(&mut best, Ranked { entry, score, worth });
        }
        best.sort_by(|a: &Ranked, b| b.worth.total_cmp(&a.worth));
        Ok(best)
    }
}

/// Functions of time that are slow, with more and more knots.
pub(super) const SLOW: [&str; 2] = ["drift", "gain-drift"];

/// Whether a function of time explains most of what it does with a quarter of its knots, as the score two
/// places before tells: else it follows something that is not slow.
fn is_slow(scores: &[Score], place: usize) -> bool {
    const MOST: f64 = 0.75;
    let knots = |score: &Score| score.start.values().len();
    let score = &scores[place];
    let coarser = place.checked_sub(2).map(|place| &scores[place]);
    let coarser = coarser.filter(|coarser| 4 * knots(coarser) == knots(score));
    coarser.is_none_or(|coarser| coarser.gain > MOST * score.gain)
}

fn keep_best(best: &mut Vec<Ranked>, one: Ranked) {
    match best.iter_mut().find(|known| known.entry.name == one.entry.name) {
        Some(known) if known.worth < one.worth => *known = one,
        Some(_) => {}
        None => best.push(one),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::GainDrift;

    #[test]
    fn what_needs_all_its_knots_is_not_slow() {
        let score = |knots: usize, gain: f64| Score {
            start: GainDrift { output: 0, changes: vec![0.0; knots], duration: 1.0 }.into(),
            zero: None,
            gain,
            columns: knots,
        };
        let of = |gains: [f64; 6]| {
            let ladder = [1, 2, 4, 8, 16, 32].into_iter().zip(gains);
            let scores: Vec<Score> = ladder.map(|(knots, gain)| score(knots, gain)).collect();
            (0..6).map(|place| is_slow(&scores, place)).collect::<Vec<_>>()
        };
        assert_eq!(of([0.54, 0.79, 0.81, 0.94, 0.95, 0.95]), [true, true, false, true, true, true]);
        assert_eq!(of([0.0, 0.01, 0.05, 0.17, 0.36, 0.42])[2..], [false; 4]);
    }
}
