//! Which effects are not named while the model is far from the noise on what is held out.
//!
//! A drift, a creep, a gap or a sensor's curve is a small part of the output of a stage, and once it is modelled the
//! error is near the noise. One that is a large part of the output, in a model that is still far from the noise, stands
//! for a structure that the model lacks: an integrator, friction, another hysteresis. The size is what is left of the
//! effect's contribution c after a gain a of the output m of the rest of the model and an offset b, which the rest can take:
//!
//! `size = min over a, b of rms(c - a m - b) / std(y)`.
//!
//! The following effects are not named at all while the model is far from the noise:
//!
//! - half-widths of plays that depend on speed, because they correct a hysteresis that is itself wrong;
//! - effects of the output stage, such as a sensor's curve, because they depend on the position, as every misfit of the
//!   hysteresis does, unless it is a gap that a force passes which leaves no more than a part of the squares of the best model without it;
//! - a limit of the input's speed that the input exceeds a few times only, because such a limit explains any error of the
//!   response to a jump, whatever its cause;
//! - a loop around dynamics whose output integrates the input, because it makes up for the integrator that G lacks, unless it leaves no more
//!   than a part of the squares of the balance of forces ([`crate::explain::force_balance`]);
//! - a slow function of time, because it can follow any slow error, unless it leaves no more than a part of the squares of the best model
//!   without it and the output does not integrate the input: an integral of errors is slow;
//! - creep, and limits of states, unless they leave no more than a part of the squares of the best model without them, as in all of
//!   these cases but that of a limit also of the held-out squares: these show little of a limit that is reached now and then;
//! - a hysteretic force in such a loop that leaves more than a part of the squares of the best model without it, because it
//!   resembles a hysteresis before the dynamics, unless it is dry friction that the balance of forces of the samples that move shows.
//!
//! Lines and measured columns are not asked, because no misfit resembles them, nor are modes, other loops and shapes of
//! hysteresis loops, which may well be a large part. A shape of hysteresis loops is not named if the output integrates the input: small
//! errors of v add up to a large one.

use super::contribution::contribution;
use super::is_shown_by_motion;
use crate::chain::point::Point;
use crate::effects::{FreeOrder, Place, Signature};
use crate::explain::force_balance::balance;
use crate::explain::refusal::Refusal;
use crate::explain::state::SearchState;
use crate::{Error, Experiment, Progress, Record};

/// Why an effect whose model is far from the noise on what is held out is not named: it is large, or acts too rarely.
pub(super) fn doubt(
    state: &SearchState,
    point: &Point,
    place: usize,
    progress: Progress,
) -> Result<Option<Refusal>, Error> {
    let entry = point.effects[place].entry();
    let of = point.effects[place].place();
    let is_asked = matches!(
        of,
        Place::Input(_)
            | Place::Widths(_)
            | Place::Parallel(_)
            | Place::Loops(_)
            | Place::Output(_)
            | Place::Added(_)
    );
    if let Place::Curves(_) = of {
        let adds_up = state.adds_up_forces(point)?;
        return Ok(adds_up.then_some(Refusal::ResemblesMisfit));
    }
    if !is_asked || entry.signature == Signature::Unique || entry.free_order == FreeOrder::JoinsG {
        return Ok(None);
    }
    let policy = &state.setup.policy.examination;
    let limits = point.effects[place].limits();
    let mut leaves = |part: f64| {
        let (without, cost) = state.best_without(place, progress)?;
        let held_out = |point| Ok::<f64, Error>(state.held_out(point)?.iter().sum());
        let most = part.max(policy.left_at_most);
        let is_weak = state.cost > part * cost;
        // a limit is reached now and then, and the held-out blocks may show little of it
        Ok::<bool, Error>(is_weak || !limits && held_out(point)? > most * held_out(&without)?)
    };
    if state.is_near(point)? {
        Ok(None)
    } else if exceedances(&of, &state.prepared.record).is_some_and(|n| n < policy.exceedances) {
        Ok(Some(Refusal::TooRare))
    } else if let Place::Output(own) = of
        && own.is_pinched()
    {
        Ok(leaves(policy.left_at_most)?.then_some(Refusal::ResemblesMisfit))
    } else if matches!(of, Place::Widths(_) | Place::Output(_)) {
        Ok(Some(Refusal::ResemblesMisfit))
    } else if let Place::Loops(own) = of {
        if state.integrates()? {
            let (record, balanced) = (&state.prepared.record, &state.setup.policy.balance);
            let found = balance(record, point.dynamics.delay, own.loops(), balanced);
            let is_explained = found.is_some_and(|own| 1.0 - own.explained <= policy.left);
            Ok((!is_explained).then_some(Refusal::Integrates))
        } else if limits {
            Ok(leaves(policy.left_at_most)?.then_some(Refusal::Insubstantial))
        } else {
            let is_weak = own.loops().iter().any(|inner| inner.law.is_dissipative())
                && !is_shown_by_motion(state, point, own.loops())
                && leaves(policy.left)?;
            Ok(is_weak.then_some(Refusal::ResemblesMisfit))
        }
    } else if size(state, point, place)? > policy.large {
        Ok(Some(Refusal::TooLarge))
    } else if entry.signature == Signature::SlowInTime {
        let follows = state.integrates()? || leaves(policy.left_by_slow)?;
        Ok(follows.then_some(Refusal::FollowsTheRest))
    } else if let Place::Parallel(_) = of {
        Ok(leaves(policy.left_at_most)?.then_some(Refusal::Insubstantial))
    } else {
        Ok(None)
    }
}

/// How many times the input is faster than an input stage passes unchanged, for one sample or several in a row; `None`
/// for what has no such limit.
fn exceedances(place: &Place, record: &Record) -> Option<usize> {
    let Place::Input(stage) = place else { return None };
    let most = stage.fastest() / record.rate();
    let of = |experiment: &Experiment| {
        let column = experiment.input.column(stage.input());
        let pairs = column.iter().zip(column.iter().skip(1));
        let is_faster: Vec<bool> = pairs.map(|(a, b)| (b - a).abs() > most).collect();
        is_faster.chunk_by(|a, b| a == b).filter(|run| run[0]).count()
    };
    most.is_finite().then(|| record.experiments().iter().map(of).sum())
}

/// The largest size over the outputs.
fn size(state: &SearchState, point: &Point, place: usize) -> Result<f64, Error> {
    let without = point.without_effect(place);
    let record = &state.prepared.record;
    let outputs = record.outputs().len();
    // of (1, c, m, y): sums of products
    let mut sums = vec![nalgebra::Matrix4::<f64>::zeros(); outputs];
    for (index, experiment) in record.experiments().iter().enumerate() {
        let known = point.signals(experiment, index)?;
        let (c, m) = contribution(point, &without, &known, experiment, index)?;
        for k in experiment.scored_runs().flatten() {
            for (output, sum) in sums.iter_mut().enumerate() {
                let at = (k, output);
                let row = nalgebra::Vector4::new(1.0, c[at], m[at], experiment.output[at]);
                *sum += row * row.transpose();
            }
        }
    }
    let of = |sum: &nalgebra::Matrix4<f64>| {
        let n = sum[(0, 0)];
        let covariance = |i: usize, j: usize| sum[(i, j)] / n - sum[(0, i)] * sum[(0, j)] / (n * n);
        let rest = covariance(2, 2).max(f64::MIN_POSITIVE);
        let own = covariance(1, 1) - covariance(1, 2).powi(2) / rest;
        (own.max(0.0) / covariance(3, 3).max(f64::MIN_POSITIVE)).sqrt()
    };
    Ok(sums.iter().map(of).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{AmplifierSlew, Effect};
    use crate::{Channel, Matrix};

    #[test]
    fn jumps_exceed_a_limit_once_each() {
        // three steps of 5, one of them over two samples, and slopes of 1 between
        let u = vec![0.0, 5.0, 5.0, 6.0, 1.0, 1.0, 2.0, 7.0, 12.0, 13.0];
        let (u, y) = (Matrix::from_vec(10, 1, u.clone()), Matrix::from_vec(10, 1, u));
        let channels = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
        let run = Experiment::new(u, y);
        let record = Record::new(vec![run.clone(), run], 10.0, channels.0, channels.1, vec![]);
        let record = record.unwrap();
        let count = |limit| {
            let slew = Effect::from(AmplifierSlew { input: 0, limit });
            exceedances(&slew.place(), &record)
        };
        assert_eq!(count(20.0), Some(6));
        assert_eq!(count(51.0), Some(0));
    }
}
