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
    /// Other candidates of the effect that promise nearly as much, whose fits may end elsewhere.
    pub others: Vec<Score>,
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
    let mut all = Vec::new();
    let scores = scores(&base, &candidates, &mut check)?;
    let policy = &state.setup.policy.ranking;
    let is_slow: Vec<bool> = (0..scores.len()).map(|i| is_slow(&scores, i, policy)).collect();
    for ((entry, score), is_slow) in entries.into_iter().zip(scores).zip(is_slow) {
        if entry.signature == Signature::SlowInTime && !is_slow {
            continue;
        }
        let deviance = promised(values, score.gain);
        let worth = deviance - score.columns as f64 * values.ln();
        all.push(Ranked { entry, score, worth, start: None, others: Vec::new() });
    }
    all.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    Ok(best_of_each(all, policy))
}

/// The first candidate of each effect, with those behind it that promise nearly as much. A fit that is linear in the values of the
/// effect ends where it ends from any of them, so that only effects with a law of their own have others.
fn best_of_each(all: Vec<Ranked>, policy: &RankingPolicy) -> Vec<Ranked> {
    let mut best: Vec<Ranked> = Vec::new();
    for one in all {
        let Some(known) = best.iter_mut().find(|known| known.entry.name == one.entry.name) else {
            best.push(one);
            continue;
        };
        let has_law = one.score.start.values().len() > one.score.columns;
        let is_near = one.score.gain > policy.other * known.score.gain;
        if has_law && is_near && known.others.len() < policy.others {
            known.others.push(one.score);
        }
    }
    best
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{CATALOGUE, Effect, GainDrift, RateDependence, SpeedLaw};

    fn candidate(start: Effect, columns: usize, gain: f64) -> Ranked {
        let entry = CATALOGUE.iter().find(|entry| entry.name == start.name()).unwrap();
        let score = Score { start, zero: None, gain, columns };
        Ranked { entry, score, worth: 1000.0 * gain, start: None, others: Vec::new() }
    }

    #[test]
    fn an_effect_with_a_law_of_its_own_has_other_candidates_near_the_best_one() {
        let law = |exponent: f64, gain: f64| {
            let law = Some(SpeedLaw { exponent, knee: 1.0, lag: 0.0 });
            let block = RateDependence {
                input: 0,
                relative: 0.0,
                absolute: 0.0,
                law,
                speed: 1.0,
                widest: 1.0,
            };
            candidate(block.into(), 2, gain)
        };
        let knots = |count: usize, gain: f64| {
            let changes = vec![0.0; count];
            candidate(GainDrift { output: 0, changes, duration: 1.0 }.into(), count, gain)
        };
        let all = vec![
            law(0.4, 0.5),
            knots(4, 0.45),
            law(0.0, 0.4),
            knots(2, 0.4),
            law(-1.0, 0.3),
            law(0.5, 0.28),
            law(1.0, 0.1),
        ];
        let policy = RankingPolicy { others: 2, other: 0.5, ..RankingPolicy::default() };
        let best = best_of_each(all, &policy);
        let names: Vec<&str> = best.iter().map(|one| one.entry.name).collect();
        assert_eq!(names, ["rate-dependence", "gain-drift"]);
        let gains = |one: &Ranked| one.others.iter().map(|other| other.gain).collect::<Vec<_>>();
        assert_eq!(gains(&best[0]), [0.4, 0.3]);
        assert!(gains(&best[1]).is_empty(), "linear in all of its values");
    }

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
