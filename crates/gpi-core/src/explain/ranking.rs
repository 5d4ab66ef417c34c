//! Which effects the score test finds most promising.
//!
//! A candidate whose q columns would take the part gamma of the squares of N values ([`super::score`]) has the deviance
//! `-N ln(1 - gamma)`, because the deviance is `N ln(J_before / J_after)`. Its worth is what exceeds the price of q
//! parameters in the BIC (G. Schwarz, 1978):
//!
//! ```text
//! worth = -N ln(1 - gamma) - q ln N
//! ```
//!
//! Each effect is represented by its candidate of largest worth; effects of no worth, or of less than a part of the
//! best one's, are not fitted.
//!
//! A slow function of time is offered with a growing number of knots, each twice as many as the one before. More knots
//! follow faster variations, whatever causes them. A candidate of n knots counts only if that of n / 4 knots, two
//! places before it, reaches a part of its gain: most of what it explains is then slow on the scale of four of its
//! knots. The coarsest candidates have no such condition.
//!
//! On a long record, sensitivities of representative experiments stand for all, and N is the number of their values.

use super::base::Base;
use super::policy::RankingPolicy;
use super::score::{Score, scores};
use super::state::SearchState;
use crate::Error;
use crate::chain::point::Point;
use crate::effects::{Entry, FreeOrder, Proposal, Signature};
use crate::fit::representatives::representatives;
use crate::progress::{Progress, report};

/// The best candidate of an effect.
pub(super) struct Ranked {
    /// The effect.
    pub entry: &'static Entry,
    /// What the candidate promises.
    pub score: Score,
    /// By how much its deviance exceeds the price of its parameters in the BIC.
    pub worth: f64,
    /// The model to begin at, where that is not the present model with the effect.
    pub start: Option<Point>,
}

/// The best candidate of each effect that promises something, the most promising first.
pub(super) fn ranked(state: &SearchState, progress: Progress) -> Result<Vec<Ranked>, Error> {
    let mut best = scored_beside(state, &state.point, &state.setup.allowed, progress)?;
    let most = best.first().map_or(0.0, |first| first.worth);
    let far_behind = state.setup.policy.ranking.far_behind;
    best.retain(|one| one.worth > 0.0 && one.worth > far_behind * most);
    Ok(best)
}

/// The best candidate of each effect when it is added to a point, the most promising first.
pub(super) fn scored_beside(
    state: &SearchState,
    point: &Point,
    effects: &[&'static Entry],
    progress: Progress,
) -> Result<Vec<Ranked>, Error> {
    let (record, options) = (&state.prepared.record, &state.setup.options);
    let few = representatives(point, record, state.setup.unknowns(point));
    let alone = few.map(|few| few.alone(point, record)).transpose()?;
    let (point, record) = alone.as_ref().map_or((point, record), |(p, r)| (p, r));
    let base = Base::new(point, record, options.freedom, &options.loss)?;
    let values = (record.scored() * record.outputs().len()) as f64;
    let is_present = |entry: &Entry| point.effects.iter().any(|e| e.name() == entry.name);
    let is_refused =
        |entry: &Entry| state.refused.iter().any(|rejected| rejected.effect == entry.name);
    let usable = |entry: &&&Entry| {
        !is_refused(entry)
            && (entry.free_order != FreeOrder::Contained || state.setup.order_is_given)
            && (entry.signature != Signature::ShapeOfCycle || !state.setup.is_one_sine)
            && (entry.repeats || !is_present(entry))
    };
    let (mut entries, mut candidates) = (Vec::new(), Vec::new());
    for &entry in effects.iter().filter(usable) {
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
    let policy = &state.setup.policy.ranking;
    let is_slow: Vec<bool> = (0..scores.len()).map(|i| is_slow(&scores, i, policy)).collect();
    for ((entry, score), is_slow) in entries.into_iter().zip(scores).zip(is_slow) {
        if entry.signature == Signature::SlowInTime && !is_slow {
            continue;
        }
        let deviance = promised(values, score.gain);
        let worth = deviance - score.columns as f64 * values.ln();
        keep_best(&mut best, Ranked { entry, score, worth, start: None });
    }
    best.sort_by(|a: &Ranked, b| b.worth.total_cmp(&a.worth));
    Ok(best)
}

/// The deviance of taking a part of the squares of so many values.
pub(super) fn promised(values: f64, gain: f64) -> f64 {
    -values * (1.0 - gain).max(1e-300).ln()
}

/// Whether a function of time explains most of what it does with fewer knots, as the score two places before says.
/// Otherwise it follows something that is not slow.
fn is_slow(scores: &[Score], place: usize, policy: &RankingPolicy) -> bool {
    let knots = |score: &Score| score.start.values().len();
    let score = &scores[place];
    let coarser = place.checked_sub(2).map(|place| &scores[place]);
    let coarser = coarser.filter(|coarser| policy.coarser * knots(coarser) == knots(score));
    coarser.is_none_or(|coarser| coarser.gain > policy.slow * score.gain)
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
            (0..6)
                .map(|place| is_slow(&scores, place, &RankingPolicy::default()))
                .collect::<Vec<_>>()
        };
        assert_eq!(of([0.54, 0.79, 0.81, 0.94, 0.95, 0.95]), [true, true, false, true, true, true]);
        assert_eq!(of([0.0, 0.01, 0.05, 0.17, 0.36, 0.42])[2..], [false; 4]);
    }
}
