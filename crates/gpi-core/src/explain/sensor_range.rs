//! The declared model of a stage whose sensor clips.
//!
//! A sensor at the end of its range repeats one value while the stage moves on. Plays and deadzones bend to follow that, and no small
//! step leads from there to the stage. The declared model is therefore identified once more, with the samples at which the output stands at
//! a limit left out, and the range of the sensor is added to it: a fit to all samples begins there. Where the model reaches beyond the
//! range, it agrees with such a sample; where it does not, it errs.

use super::outside::{limits, within_limits};
use super::policy::OutsidePolicy;
use super::ranking::Ranked;
use super::score::Score;
use super::state::SearchState;
use crate::chain::point::Point;
use crate::effects::OutputNonlinearity;
use crate::identify::long_record::compare;
use crate::identify::procedure::prepare;
use crate::identify::{IdentifyOptions, Quick};
use crate::progress::Progress;
use crate::{Error, Experiment, Matrix, Record};

/// The declared model of a record of one output, of which a part stands at a limit, with the sensor's range; `None` of other records,
/// and where the rest of the samples shows no model. The outputs of the model are without `means`, those of the record are not.
pub(super) fn clipping(
    record: &Record,
    means: &[f64],
    options: (&IdentifyOptions, Quick),
    policy: &OutsidePolicy,
    progress: Progress,
) -> Result<Option<Point>, Error> {
    if record.outputs().len() > 1 {
        return Ok(None);
    }
    let ends = limits(record, 0, policy)?;
    if ends.is_empty() {
        return Ok(None);
    }
    let found = identified(record, options, policy, progress);
    let Ok((mut point, mean)) = Error::unless_interrupted(found)? else { return Ok(None) };
    for offsets in &mut point.offsets {
        offsets.add_scalar_mut(mean - means[0]);
    }
    let zero = means[0] + point.offsets[0][(0, 0)];
    let end = |of_lowest: bool| {
        let mut own = ends.iter().filter(|(_, is_lowest)| *is_lowest == of_lowest);
        own.next().map(|(value, _)| value - zero)
    };
    let outputs = || record.experiments().iter().map(|run| run.output.column(0));
    let highest = outputs().map(|column| column.max()).fold(f64::NEG_INFINITY, f64::max) - zero;
    let lowest = outputs().map(|column| column.min()).fold(f64::INFINITY, f64::min) - zero;
    let range = OutputNonlinearity {
        output: 0,
        coefficients: Vec::new(),
        middle: 0.5 * (lowest + highest),
        scale: 0.5 * (highest - lowest),
        lowest: end(true),
        highest: end(false),
    };
    Ok(Some(point.with_effect(range.into())))
}

/// The declared model of the samples within the limits, and the mean of the output that it is without.
fn identified(
    record: &Record,
    (options, quick): (&IdentifyOptions, Quick),
    policy: &OutsidePolicy,
    progress: Progress,
) -> Result<(Point, f64), Error> {
    let within = within_limits(record, policy)?;
    let mut prepared = prepare(&within, options)?;
    let mut refined = compare(&mut prepared, options, Some(quick), progress)?.refined;
    refined.drop_undetermined(&prepared, progress)?;
    Ok((refined.fitted.point, prepared.means[0]))
}

/// The model of a sensor that clips as a candidate; `None` where there is none, or the present model has effects already.
pub(super) fn candidate(state: &SearchState) -> Result<Option<Ranked>, Error> {
    let Some(start) = state.setup.clipping.as_ref() else { return Ok(None) };
    let Some(effect) = start.effects.last() else { return Ok(None) };
    let entry = effect.entry();
    let is_allowed = state.setup.allowed.iter().any(|allowed| allowed.name == entry.name);
    let is_refused = state.refused.iter().any(|rejected| rejected.effect == entry.name);
    if !is_allowed || is_refused || !state.point.effects.is_empty() {
        return Ok(None);
    }
    let start = from_equilibrium(start.clone(), &state.prepared.record)?;
    let gain = 1.0 - state.training_squares(&start)? / state.cost;
    let columns = effect.values().len();
    let score = Score { start: effect.clone(), zero: None, gain, columns };
    Ok(Some(Ranked { entry, score, worth: gain, start: Some(start), others: Vec::new() }))
}

/// A point whose experiments begin at equilibrium where that leaves smaller squares than the state found. The samples of an experiment
/// that begins at a limit hardly depend on its initial state. The fit to the other samples may make that state arbitrarily large, and a
/// fit to all samples would not make it small again.
fn from_equilibrium(mut point: Point, record: &Record) -> Result<Point, Error> {
    let mut still = point.clone();
    still.pasts.iter_mut().for_each(|past| past.state.fill(0.0));
    let squares = |residual: &Matrix, run: &Experiment| -> f64 {
        run.scored_runs().flatten().map(|k| residual[(k, 0)].powi(2)).sum()
    };
    let residuals = point.residuals(record)?.into_iter().zip(still.residuals(record)?);
    let known = residuals.zip(record.experiments());
    for (past, ((found, still), run)) in point.pasts.iter_mut().zip(known) {
        if squares(&still, run) < squares(&found, run) {
            past.state.fill(0.0);
            past.has_unknown_state = false;
        }
    }
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;
    use crate::chain::plain::plain;

    #[test]
    fn a_state_that_makes_the_error_larger_is_that_of_equilibrium() {
        let point = |state: f64| {
            let mut lag = plain(&[0.0, 0.3], &[1.0, -0.7], Vec::new());
            lag.pasts[0].has_unknown_state = true;
            lag.pasts[0].state.fill(state);
            lag
        };
        let u = Matrix::from_fn(200, 1, |k, _| (0.2 * k as f64).sin());
        let begins = |state: f64| {
            let channel = |name| vec![Channel::new(name, "")];
            let zeros = Experiment::new(u.clone(), Matrix::zeros(200, 1));
            let of = |runs| Record::new(runs, 1e3, channel("u"), channel("y"), vec![]).unwrap();
            // minus what the model makes of the input
            let residual = point(state).residuals(&of(vec![zeros])).unwrap().remove(0);
            of(vec![Experiment::new(u.clone(), -residual)])
        };
        let settled = |found: f64, record: &Record| {
            let past = from_equilibrium(point(found), record).unwrap().pasts.remove(0);
            (past.state[0], past.has_unknown_state)
        };
        assert_eq!(settled(1e6, &begins(0.0)), (0.0, false));
        assert_eq!(settled(1e6, &begins(2.0)), (0.0, false));
        assert_eq!(settled(1.9, &begins(2.0)), (1.9, true));
    }
}
