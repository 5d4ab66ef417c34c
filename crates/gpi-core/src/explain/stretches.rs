//! The last fit of a stage that integrates forces: in stretches of its record.
//!
//! Where the output integrates the input, a simulation adds up all that no model knows of the forces, as a random walk does. The error
//! at the end of a long record is mostly such a sum, and a fit of the whole record turns every parameter until their
//! changes follow it: the friction becomes too small, the damping too large, and the input seems to act late. In stretches of a few time constants of
//! the speed, each from an initial state of its own, the sum begins anew, so that the error is mostly that of the forces themselves.
//!
//! The fit begins at the balance of forces ([`super::force_balance`]). The break-away distance of friction is long there, and becomes shorter in the
//! fit; from a short one, a fit ends at one of many local minima. It is made in short stretches first, then in longer ones. The initial
//! state and the offset of the whole record are fitted last, with all else held.
//!
//! Source: the multiple-shooting method of H. G. Bock, *Recent advances in parameteridentification techniques for O.D.E.*, 1983, without its
//! conditions that the stretches meet.

use super::balance_start::{Straight, best, proposals};
use super::force_balance::balance;
use super::policy::StretchPolicy;
use super::state::SearchState;
use crate::chain::point::{Past, Point};
use crate::effects::{Effect, Law};
use crate::fit::RefineOptions;
use crate::fit::initial_state::settled;
use crate::fit::joint::fit_options;
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::Prepared;
use crate::fit::problem::scored;
use crate::optimize::Loss;
use crate::progress::{Progress, report};
use crate::{Error, Experiment, Matrix, Record};
use std::ops::Range;

/// What the progress calls these fits.
const PHASE: &str = "refinement";

/// The model of a stage that integrates the forces of one effect, fitted in stretches, and what was free. `None` in these cases:
///
/// - The output does not integrate the input.
/// - The model is near the noise. A fit of the whole record is the best one there.
/// - The model has plays, deadzones, functions of time, or more than one effect with forces.
/// - The record is too short for stretches.
/// - The model so far, which was fitted to the whole record, leaves less of the same stretches.
pub(super) fn in_stretches(
    state: &SearchState,
    progress: Progress,
) -> Result<Option<(Fitted, FitOptions)>, Error> {
    if !state.adds_up_forces(&state.point)? {
        return Ok(None);
    }
    let Some((start, time_constant)) = begin(state) else { return Ok(None) };
    let policy = &state.setup.policy.stretches;
    let Some(lengths) = lengths(state.prepared.record.longest(), time_constant, policy) else {
        return Ok(None);
    };
    let (mut point, mut last) = (start.clone(), None);
    for length in lengths {
        let stretched = Stretched::new(&state.prepared, length, policy)?;
        let options = options(state, &stretched.prepared);
        let own = stretched.settled(&point, &options, progress)?;
        let fitted = fit(own, &stretched.prepared.record, &options, PHASE, progress)?;
        let Point { pasts, offsets, .. } = start.clone();
        point = Point { pasts, offsets, ..fitted.point.clone() };
        last = Some((stretched, options, fitted));
    }
    let Some((stretched, options_of_stretches, fitted)) = last else { return Ok(None) };
    let record = &stretched.prepared.record;
    let of_whole = stretched.settled(&state.point, &options_of_stretches, progress)?;
    let cost = options_of_stretches.loss.cost(scored(&of_whole.residuals(record)?, record));
    if cost <= fitted.linearization.cost {
        return Ok(None);
    }
    let record = &state.prepared.record;
    let options = options(state, &state.prepared);
    let point = settled(point, record, &options, PHASE, progress)?;
    let mut check = || report(progress, PHASE, 1.0);
    let fitted = fitted.at(point, record, &options, &mut check)?;
    Ok(Some((fitted, options)))
}

/// The held-out squares that two models leave in stretches of ten time constants of the speed; `None` where the record is too short for any.
pub(super) fn held_out(
    state: &SearchState,
    points: [&Point; 2],
    time_constant: f64,
    progress: Progress,
) -> Result<Option<[f64; 2]>, Error> {
    let (longest, policy) = (state.prepared.record.longest(), &state.setup.policy.stretches);
    let lengths = lengths(longest, time_constant, policy);
    let Some(&length) = lengths.as_deref().and_then(<[usize]>::last) else { return Ok(None) };
    let stretched = Stretched::new(&state.prepared, length, policy)?;
    let options = options(state, &stretched.prepared);
    let mut squares = [0.0; 2];
    for (squares, point) in squares.iter_mut().zip(points) {
        let own = stretched.settled(point, &options, progress)?;
        let residuals = own.residuals(&stretched.prepared.record)?;
        *squares = stretched.squares(&residuals, &state.setup.test, &options.loss)?;
    }
    Ok(Some(squares))
}

/// Everything free but grids.
fn options(state: &SearchState, prepared: &Prepared) -> FitOptions {
    let policy = &state.setup.policy;
    let mut own = fit_options(prepared, &RefineOptions::default(), policy.stretches.steps);
    own.loss.clone_from(&state.setup.options.loss);
    own.gain *= policy.fits.coarser;
    own
}

/// The model at the balance of forces with the loops of the model, and the time constant of the speed in samples.
fn begin(state: &SearchState) -> Option<(Point, f64)> {
    let record = &state.prepared.record;
    let is_single = record.inputs().len() == 1 && record.outputs().len() == 1;
    let closed = |effect: &Effect| effect.place().closed_loops().is_some();
    let place = state.point.effects.iter().position(closed)?;
    let effect = &state.point.effects[place];
    let others = state.point.without_effect(place);
    // a function of time has its values at the times of the whole record
    let is_driven = others.effects.iter().all(|one| one.entry().driven && !closed(one));
    let channel = &others.channels[0];
    let is_straight = channel.half_widths == [0.0] && channel.thresholds == [0.0];
    if !is_single || !is_driven || !is_straight || state.point.offsets[0].nrows() != 1 {
        return None;
    }
    let straight = Straight::of(state, &others)?;
    let (delay, policy) = (straight.delay(), &state.setup.policy.balance);
    let linear = straight.dynamics(&balance(record, delay, &[], policy)?)?;
    let mut proposals = proposals(record, &linear, effect.entry());
    proposals.retain(|one| laws(&one.block) == laws(effect));
    let (own, effect) = best(record, delay, proposals, policy)?;
    let (point, _) = straight.at_balance(state, &own, effect)?;
    Some((point, own.time_constant()))
}

/// The kinds of the laws of its loops.
fn laws(effect: &Effect) -> Vec<std::mem::Discriminant<Law>> {
    let loops = effect.place().closed_loops().map_or(&[][..], |closed| closed.loops());
    loops.iter().map(|inner| std::mem::discriminant(&inner.law)).collect()
}

/// The lengths of stretches in samples, short ones first; `None` where the record is too short for any.
fn lengths(longest: usize, time_constant: f64, policy: &StretchPolicy) -> Option<Vec<usize>> {
    let fewest = longest / policy.most;
    let length = |times: &f64| ((times * time_constant) as usize).max(fewest);
    let mut found: Vec<usize> = policy.time_constants.iter().map(length).collect();
    found.retain(|own| *own > 0 && policy.least * own <= longest);
    found.dedup();
    (!found.is_empty()).then_some(found)
}

/// A record in stretches, each an experiment of its own.
struct Stretched<'a> {
    prepared: Prepared<'a>,
    /// The experiment that each stretch is a part of, and its samples.
    of: Vec<(usize, Range<usize>)>,
    /// Steps of fits of initial states alone.
    settling_steps: usize,
}

impl<'a> Stretched<'a> {
    /// Stretches of at least this length, those of an experiment of nearly equal length. Those without scored samples are left out.
    fn new(whole: &Prepared<'a>, length: usize, policy: &StretchPolicy) -> Result<Self, Error> {
        let mut of = Vec::new();
        for (index, experiment) in whole.record.experiments().iter().enumerate() {
            let rows = experiment.input.nrows();
            let parts = (rows / length).max(1);
            let bounds = |part: usize| part * rows / parts..(part + 1) * rows / parts;
            let all = (0..parts).map(|part| (index, bounds(part)));
            of.extend(all.filter(|(_, own)| experiment.stretch(own.clone()).scored() > 0));
        }
        let settling_steps = policy.settling_steps;
        let mut own = Self { prepared: whole.clone(), of, settling_steps };
        let stretch = |(index, at): &(usize, Range<usize>)| {
            whole.record.experiments()[*index].stretch(at.clone())
        };
        own.prepared.record =
            whole.record.with_experiments(own.of.iter().map(stretch).collect())?;
        let is_unknown = |unknown: &[bool]| -> Vec<bool> {
            own.of.iter().map(|(index, at)| unknown[*index] || at.start > 0).collect()
        };
        own.prepared.has_unknown_plays = is_unknown(&whole.has_unknown_plays);
        own.prepared.has_unknown_state = is_unknown(&whole.has_unknown_state);
        Ok(own)
    }

    /// The squares of residuals in samples that another record of the same experiments scores.
    fn squares(&self, residuals: &[Matrix], other: &Record, loss: &Loss) -> Result<f64, Error> {
        let stretches = self.of.iter().zip(residuals);
        let all = stretches
            .map(|((index, at), own)| (other.experiments()[*index].stretch(at.clone()), own));
        let (scoring, residuals): (Vec<Experiment>, Vec<Matrix>) = all
            .filter(|(scoring, _)| scoring.scored() > 0)
            .map(|(scoring, own)| (scoring, own.clone()))
            .unzip();
        let other = other.with_experiments(scoring)?;
        Ok(loss.cost(scored(&residuals, &other)))
    }

    /// A model of the whole record with the initial state and offset of each stretch that fit best.
    fn settled(
        &self,
        whole: &Point,
        options: &FitOptions,
        progress: Progress,
    ) -> Result<Point, Error> {
        let options = FitOptions { steps: self.settling_steps, ..options.clone() };
        settled(self.point(whole), &self.prepared.record, &options, PHASE, progress)
    }

    /// The same with initial states inside the record that are yet to be fitted.
    fn point(&self, whole: &Point) -> Point {
        let mut point = whole.clone();
        let past = |(index, at): &(usize, Range<usize>)| {
            let own = &whole.pasts[*index];
            if at.start == 0 {
                return own.clone();
            }
            let rest = Past::rest(own.state.len(), own.gaps.len());
            Past { has_unknown_state: true, ..rest }
        };
        point.pasts = self.of.iter().map(past).collect();
        point.offsets = self.of.iter().map(|(index, _)| whole.offsets[*index].clone()).collect();
        self.prepared.settle(&mut point);
        point
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    #[test]
    fn stretches_score_the_same_samples_and_begin_anew() {
        let column = |first: usize| Matrix::from_fn(100, 1, |k, _| (first + k) as f64 + 1.0);
        let run =
            |first| Experiment { warmup: 30, ..Experiment::new(column(first), column(first)) };
        let first = Experiment { held_out: vec![40..45, 60..70], ..run(0) };
        let end = 90..95;
        let second = Experiment { held_out: vec![end], ..run(500) };
        let channel = |name| vec![Channel::new(name, "")];
        let record =
            Record::new(vec![first, second], 1.0, channel("u"), channel("y"), vec![]).unwrap();
        let whole = Prepared::scoring_all(&record, vec![]).unwrap();
        let stretched = Stretched::new(&whole, 25, &StretchPolicy::default()).unwrap();
        // the first quarter of both experiments is in the warm-up
        let of: Vec<(usize, usize)> =
            stretched.of.iter().map(|(index, at)| (*index, at.start)).collect();
        assert_eq!(of, [(0, 25), (0, 50), (0, 75), (1, 25), (1, 50), (1, 75)]);
        let own = &stretched.prepared.record;
        assert_eq!(own.scored(), record.scored());
        let experiments = own.experiments();
        assert_eq!(experiments[0].warmup, 5);
        assert_eq!(experiments[0].held_out.first(), Some(&(15..20)));
        assert_eq!(experiments[1].held_out.first(), Some(&(10..20)));
        assert_eq!(experiments[3].input[(0, 0)], 526.0);
        assert!(stretched.prepared.has_unknown_state.iter().all(|unknown| *unknown));
        // twenty held-out samples in three stretches
        let residuals = vec![Matrix::from_element(25, 1, 2.0); 6];
        let test = record.held_out_part().unwrap();
        let squares = stretched.squares(&residuals, &test, &Loss::squares(1)).unwrap();
        assert_eq!(squares, 20.0 * 4.0);
    }

    #[test]
    fn lengths_follow_the_time_constant_within_the_record() {
        let policy = StretchPolicy::default();
        assert_eq!(lengths(10_000, 200.0, &policy), Some(vec![1000, 2000]));
        // not more than twenty stretches, and not fewer than three
        assert_eq!(lengths(10_000, 10.0, &policy), Some(vec![500]));
        assert_eq!(lengths(10_000, 600.0, &policy), Some(vec![3000]));
        assert_eq!(lengths(10_000, 700.0, &policy), None);
    }
}
