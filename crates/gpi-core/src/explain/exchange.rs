//! Slow functions of time, compared with what could stand in their place.
//!
//! They are flexible enough to follow much of what the input drives, but they do not predict another experiment. That is
//! why an effect that the input drives and that explains as much is preferred, and not the other way round. Two slow
//! functions of time that act at different places of the chain can explain a part of each other's effect.
//!
//! A driven rival is fitted twice, and the better fit counts: with everything free at once, and with grids and dynamics held first,
//! because the rest of the model was fitted beside the slow function and may be nearly right. The last fit of both rivals has the same
//! number of steps. What is lost with the rival is counted on the training squares J of N values
//! and on the held-out squares T of M values, as twice the loss of the log-likelihood of white Gaussian noise:
//!
//! ```text
//! lost = N ln(J_rival / J) + M ln(T_rival / T)
//! ```
//!
//! | rival | replaces the slow function where |
//! |---|---|
//! | a driven effect with a law of its own | `lost` < what the slow function must gain, `T_rival < f T`, plausible values, and what the slow function gained less `lost` is significant |
//! | another slow function with q more unknowns | `lost + q ln N < -2 ln L`, L the number of looks ([`super::judgement`]) |
//!
//! A driven rival that has replaced a slow function is an addition, after which other effects may be superfluous ([`super::revision`]).
//!
//! The number of knots was chosen beside a model that did not fit yet. In both rivals, every second knot is therefore removed
//! as long as that lowers the BIC. Superfluous knots would count as unknowns.

use super::judgement::is_superfluous;
use super::ranking::{Ranked, scored_beside};
use super::revision::drop_superfluous;
use super::state::{Addition, SearchState, Trial};
use super::threshold::Significance;
use super::trial::{ANY, measured, plausible_part, start, threshold};
use crate::Error;
use crate::Progress;
use crate::chain::point::{DynamicsFreedom, Freedom, Point};
use crate::chain::sensitivity::Derivatives;
use crate::effects::{CATALOGUE, Entry, Signature};
use crate::fit::minimize::{FitOptions, Fitted};
use crate::progress::as_trial;

/// Replaces a slow function of time, which can fit much, by an effect that the input drives and that explains as much;
/// says whether there was any.
pub(super) fn prefer_driven(state: &mut SearchState, progress: Progress) -> Result<bool, Error> {
    let mut is_replaced = false;
    let is_slow = |entry: &Entry| entry.signature == Signature::SlowInTime;
    // an expansion in many terms is as flexible as the slow function
    let is_rival = |own: &&Entry| own.driven && !is_slow(own) && !own.is_expansion;
    let driven: Vec<&'static Entry> =
        state.setup.allowed.iter().copied().filter(is_rival).collect();
    // from the end of the chain
    for slow in CATALOGUE.iter().rev().filter(|entry| is_slow(entry)) {
        let place = state.point.effects.iter().position(|effect| effect.name() == slow.name);
        let Some(place) = place else { continue };
        let without = state.point.without_effect(place);
        let best = scored_beside(state, &without, &driven, progress)?.into_iter().next();
        let Some(Ranked { entry, score, .. }) = best else { continue };
        let named = state.additions.iter().find(|addition| addition.trial.entry.name == slow.name);
        let Some(deviance) = named.map(|own| own.trial.deviance) else { continue };
        let gain = score.gain;
        let threshold = settle(state, slow, state.setup.unknowns(&without), deviance, progress)?;
        let start = start(state, &without, score)?;
        let options = longer(state, reach(state, threshold));
        let fitted = as_trial(progress, ("exchange", entry.name), (0, 1), |progress| {
            let placed = state.fit(start.clone(), &held(&options), entry.name, progress)?;
            let placed = state.fit(placed.point, &options, entry.name, progress)?;
            let at_once = state.fit(start, &options, entry.name, progress)?;
            let is_better = placed.linearization.cost < at_once.linearization.cost;
            let fitted = if is_better { placed } else { at_once };
            match plausible_part(state, &fitted.point, entry) {
                Some(part) => state.fit(part, &options, entry.name, progress),
                None => Ok(fitted),
            }
        })?;
        if fitted.linearization.cost > options.goal {
            continue;
        }
        let trial = measured(state, &without, entry, fitted, options, gain, progress)?;
        let held_out = state.held_out(&state.point)?;
        let lost = lost(state, &trial, &held_out);
        // what the slow function had gained, less what is lost with it
        let trial = Trial { deviance: deviance - lost, ..trial };
        let factor = state.setup.policy.revision.driven_instead;
        if trial.is_driven
            && trial.deviance > trial.threshold
            && state.is_plausible(&trial.point)
            && is_superfluous(lost, threshold, [&held_out, &trial.held_out], factor)
        {
            let dropped = vec![slow.name];
            state.add(Addition { dropped, ..Addition::alone(trial) })?;
            // the grids were placed, and the effect's terms counted, beside the slow function
            state.is_rich = false;
            is_replaced = true;
            // others may have made up for what the slow function did not do
            drop_superfluous(state, progress)?;
        }
    }
    Ok(is_replaced)
}

/// The fit of a point with a slow function of time, of which every second knot is removed as long as that lowers the BIC.
fn settled(
    state: &SearchState,
    point: Point,
    slow: &'static Entry,
    goal: f64,
    progress: Progress,
) -> Result<Fitted, Error> {
    let options = longer(state, goal);
    let fit = |start: Point, progress: Progress| {
        as_trial(progress, ("exchange", slow.name), (0, 1), |progress| {
            state.fit(start, &options, slow.name, progress)
        })
    };
    let values = state.prepared.values();
    let information = |fitted: &Fitted| {
        let price = state.setup.unknowns(&fitted.point) as f64 * values.ln();
        values * fitted.linearization.cost.ln() + price
    };
    let mut best = fit(point, progress)?;
    if goal > ANY && best.linearization.cost > goal {
        return Ok(best);
    }
    while let Some(coarser) = coarser(&best.point, slow) {
        let fitted = fit(coarser, progress)?;
        if information(&fitted) > information(&best) {
            break;
        }
        best = fitted;
    }
    Ok(best)
}

/// A point whose slow function of time has every second of its knots.
fn coarser(point: &Point, slow: &Entry) -> Option<Point> {
    let place = point.effects.iter().position(|one| one.name() == slow.name)?;
    Some(point.without_effect(place).with_effect(point.effects[place].coarser()?))
}

/// Options of both fits that are compared. They have the same step limit, because a fit that ends at its limit is not at its
/// minimum. Squares above `goal` are not asked for.
fn longer(state: &SearchState, goal: f64) -> FitOptions {
    let steps = state.setup.policy.revision.longer * state.setup.options.steps;
    FitOptions { steps, goal, ..state.setup.options.clone() }
}

/// Options of a fit of a rival before all is free. The rest was fitted beside the slow function, and is nearly right: freed at once, it
/// would follow what the rival does not do yet.
fn held(options: &FitOptions) -> FitOptions {
    let freedom = Freedom {
        derivatives: Derivatives::default(),
        states: false,
        identity: false,
        dynamics: DynamicsFreedom::Nothing,
        ..options.freedom
    };
    FitOptions { freedom, goal: ANY, ..options.clone() }
}

/// The training squares with which a rival loses twice a threshold. The factor leaves room for a rival whose held-out blocks are better,
/// which counts as well. By hand.
fn reach(state: &SearchState, threshold: f64) -> f64 {
    state.cost * (2.0 * threshold / state.prepared.values()).exp()
}

/// Settles the slow function of time of the present model. Returns what it must gain there: the residual of a fit that ended
/// early is autocorrelated, and its threshold is too high.
fn settle(
    state: &mut SearchState,
    slow: &'static Entry,
    without: usize,
    deviance: f64,
    progress: Progress,
) -> Result<f64, Error> {
    let fitted = settled(state, state.point.clone(), slow, ANY, progress)?;
    (state.point, state.cost) = (fitted.point.clone(), fitted.linearization.cost);
    let significance = Significance {
        values: state.prepared.values(),
        added: state.setup.unknowns(&state.point) - without,
        is_long: state.setup.is_long(&state.point),
        is_more: false,
    };
    threshold(state, fitted, longer(state, ANY), significance, deviance, progress)
}

/// The deviance lost with a trial, on the training data and on what is held out.
fn lost(state: &SearchState, trial: &Trial, held_out: &[f64]) -> f64 {
    let [before, after] = [held_out, &trial.held_out].map(|blocks| blocks.iter().sum::<f64>());
    state.prepared.values() * (trial.cost / state.cost).ln()
        + state.setup.held_out_values() * (after / before).ln()
}

/// Replaces a slow function of time by one that acts elsewhere where that explains more, now that the rest is known.
pub(super) fn exchange_slow(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    let is_slow = |entry: &Entry| entry.signature == Signature::SlowInTime;
    for place in 0..state.point.effects.len() {
        let own = state.point.effects[place].entry();
        let is_other = |entry: &&Entry| is_slow(entry) && !state.has(entry);
        let others: Vec<&'static Entry> =
            state.setup.allowed.iter().copied().filter(is_other).collect();
        if !is_slow(own) || others.is_empty() {
            continue;
        }
        let without = state.point.without_effect(place);
        let best = scored_beside(state, &without, &others, progress)?.into_iter().next();
        let Some(Ranked { entry, score, .. }) = best else { continue };
        let gain = score.gain;
        let start = start(state, &without, score)?;
        let unknowns = |point| state.setup.unknowns(point) as f64;
        let price = |point| (unknowns(point) - unknowns(&without)) * state.prepared.values().ln();
        let options = longer(state, reach(state, price(&state.point)));
        let fitted = settled(state, start, entry, options.goal, progress)?;
        if fitted.linearization.cost > options.goal {
            continue;
        }
        let more = price(&fitted.point) - price(&state.point);
        let trial = measured(state, &without, entry, fitted, options, gain, progress)?;
        let held_out = state.held_out(&state.point)?;
        let lost = lost(state, &trial, &held_out) + more;
        if -lost > 2.0 * state.setup.policy.judgement.looks.ln() {
            let dropped = vec![own.name];
            state.add(Addition { dropped, ..Addition::alone(trial) })?;
        }
    }
    Ok(())
}
