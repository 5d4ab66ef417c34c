//! Plays or stops, and stops with deadzones or without.

use crate::Error;
use crate::chain::hysteresis::Elements;
use crate::fit::Grid;
use crate::fit::joint::Refined;
use crate::fit::minimize::fit;
use crate::fit::preparation::{Prepared, rescale};
use crate::identify::criterion::criterion;
use crate::identify::identification::{Candidate, IdentifyOptions, Quick};
use crate::identify::procedure::{Compared, compare_elements};
use crate::identify::quasi_static;
use crate::identify::settings::StructurePolicy;
use crate::identify::structure::short_fit;
use crate::linear::Sections;
use crate::progress::Progress;

/// Seeds and compares structures.
///
/// Where nothing else is asked for, stops are compared as well if they promise more than the best plays, or if the samples are few.
pub(super) fn compare_on_all(
    prepared: &mut Prepared,
    options: &IdentifyOptions,
    quick: Option<Quick>,
    progress: Progress,
) -> Result<Compared, Error> {
    let policy = StructurePolicy::default();
    if options.elements == Some(Elements::Stops) {
        return compare_stops(prepared, options, quick, &policy, progress);
    }
    let plays = compare_elements(prepared, options, quick, progress)?;
    if options.elements.is_some()
        || !plays.is_crowded && !promises_more(&plays.refined, prepared, &policy, progress)?
    {
        return Ok(plays);
    }
    let (channels, notes) = (prepared.channels.clone(), prepared.notes.len());
    let stops =
        Error::unless_interrupted(compare_stops(prepared, options, quick, &policy, progress))?;
    match stops {
        Ok(stops) if are_better(&stops, &plays, prepared, &policy) => {
            Ok(Compared { of_plays: Some(cost(&stops) / cost(&plays)), ..stops })
        }
        _ => {
            prepared.channels = channels;
            prepared.notes.truncate(notes);
            Ok(plays)
        }
    }
}

/// Structures of stops, without deadzones unless these are asked for or leave much less: friction does not depend on the displacement
/// itself, and where a force passes a gap, many deadzones would follow it on this record and fail on another one. A force that
/// saturates with the displacement, such as a magnetic field, needs them.
fn compare_stops(
    prepared: &mut Prepared,
    options: &IdentifyOptions,
    quick: Option<Quick>,
    policy: &StructurePolicy,
    progress: Progress,
) -> Result<Compared, Error> {
    for channel in &mut prepared.channels {
        channel.elements = Elements::Stops;
    }
    let are_asked = quick.map_or(options.thresholds.is_some(), |quick| !quick.fewer[1]);
    if are_asked {
        return compare_elements(prepared, options, quick, progress);
    }
    let (channels, notes) = (prepared.channels.clone(), prepared.notes.len());
    for channel in &mut prepared.channels {
        channel.thresholds.truncate(1);
        channel.slopes.truncate(1);
    }
    let none = IdentifyOptions { thresholds: Some(Grid::Count(0)), ..options.clone() };
    let straight = compare_elements(prepared, &none, quick, progress);
    let straight = Error::unless_interrupted(straight)?;
    let straight_channels = std::mem::replace(&mut prepared.channels, channels);
    let straight_notes = prepared.notes.split_off(notes);
    let bent = Error::unless_interrupted(compare_elements(prepared, options, quick, progress))?;
    match (straight, bent) {
        (Ok(straight), Ok(bent)) if cost(&bent) < policy.of_deadzones * cost(&straight) => Ok(bent),
        (Ok(straight), _) => {
            prepared.channels = straight_channels;
            prepared.notes.truncate(notes);
            prepared.notes.extend(straight_notes);
            Ok(straight)
        }
        (Err(_), bent) => bent,
    }
}

/// The cost of the best candidate.
fn cost(found: &Compared) -> f64 {
    found.refined.fitted.linearization.cost
}

/// Whether stops leave much less than plays, by the criterion of the structures with the penalty of the smaller residual.
fn are_better(
    stops: &Compared,
    plays: &Compared,
    prepared: &Prepared,
    policy: &StructurePolicy,
) -> bool {
    let values = prepared.values();
    let [stops, plays] = [stops, plays].map(|found| &found.candidates[found.chosen]);
    let closer = if stops.rms < plays.rms { stops } else { plays };
    let samples = closer.used / closer.parameters.max(1) as f64;
    let of = |candidate: &Candidate| criterion(candidate, samples, values);
    of(stops) < of(plays) + values * policy.of_stops.ln()
}

/// Whether stops leave less than the plays before the same dynamics, before these without their dead time, or before a
/// gain alone: with stops, the output needs no dynamics to lead the input.
fn promises_more(
    plays: &Refined,
    prepared: &Prepared,
    policy: &StructurePolicy,
    progress: Progress,
) -> Result<bool, Error> {
    let own = &plays.fitted.point;
    let options = short_fit(prepared, policy);
    let mut prompt = own.dynamics.clone();
    prompt.delay = 0;
    let gain = Sections::delayed_gain(&quasi_static::gain(prepared)?, 0);
    let weights: Vec<f64> = own.channels.iter().map(|c| c.weights.iter().sum()).collect();
    let unit = vec![1.0; weights.len()];
    let mut tried = vec![(own.dynamics.clone(), weights.clone()), (prompt, weights), (gain, unit)];
    tried.dedup();
    for (dynamics, weights) in tried {
        let mut point = prepared.point(dynamics);
        point.offsets.clone_from(&own.offsets);
        for (channel, weight) in point.channels.iter_mut().zip(weights) {
            channel.elements = Elements::Stops;
            channel.weights[0] = weight;
        }
        rescale(&mut point);
        prepared.settle(&mut point);
        let fitted = fit(point, &prepared.record, &options, "stops", progress);
        let Ok(fitted) = Error::unless_interrupted(fitted)? else { continue };
        if fitted.linearization.cost < policy.of_stops * plays.fitted.linearization.cost {
            return Ok(true);
        }
    }
    Ok(false)
}
