//! An identification from the first step to the last one.

use crate::fit::preparation::Prepared;
use crate::identify::identification::{Identification, IdentifyOptions};
use crate::identify::long_record::compare;
use crate::identify::procedure::{Compared, prepare};
use crate::identify::settings::TapPolicy;
use crate::progress::{Overall, Progress, ProgressSettings};
use crate::{Error, Record, linear};

/// Identifies a model from a record.
///
/// A record whose input has a low order of persistent excitation (a sine, say) supports no dynamics beyond a gain and
/// a delay; the delay is then the one that fits best. Otherwise G has the order that the information
/// criterion prefers, and the rounds go on until nothing is gained.
///
/// # Errors
/// A constant input or output, more taps than the order of persistent excitation or the samples allow, parameters out
/// of range, [`Error::Interrupted`] when `progress` returned false.
pub fn identify(
    record: &Record,
    options: &IdentifyOptions,
    progress: Progress,
) -> Result<Identification, Error> {
    let ProgressSettings { light, structures, identified, last, .. } = ProgressSettings::usual()?;
    let mut overall = Overall::new(progress, light, identified, structures);
    let mut prepared = prepare(record, options)?;
    let found = compare(&mut prepared, options, None, &mut |report| overall.take(report))?;
    overall.part(1.0, last * light);
    let found = finish(&prepared, found, &mut |report| overall.take(report))?;
    overall.finish();
    Ok(found)
}

/// The best structure's model, and the results of the steps that led to it.
fn finish(
    prepared: &Prepared,
    found: Compared,
    progress: Progress,
) -> Result<Identification, Error> {
    let Compared { chosen, mut refined, candidates, quasi_static, stages, supported, .. } = found;
    let ((taps, singular_values, reflected, rounds), supported_taps) = (stages, supported);
    refined.drop_undetermined(prepared, progress)?;
    let refinement = refined.finish(prepared, progress)?;
    let mut notes = prepared.notes.clone();
    let dynamics = &refinement.bands.point.dynamics;
    if quasi_static && supported_taps <= TapPolicy::default().gain_and_delay {
        let lag = if dynamics.order() > 0 { " and a lag" } else { "" };
        notes.push(format!(
            "each input is persistently exciting of order {supported_taps} only, enough for a gain and a delay: the \
             linear part is a delay of {} samples{lag}",
            dynamics.delay
        ));
    }
    let first = |taps| linear::estimate(&prepared.record.pieces(taps)?, taps, 0.0);
    let fir = taps.map(first).transpose()?;
    let point = &refinement.bands.point;
    let model = point.to_model(prepared.given, &prepared.record, &prepared.means)?;
    let estimates = refinement.estimates(&model)?;
    Ok(Identification {
        model: model.with_estimates(estimates),
        candidates,
        chosen,
        fir,
        singular_values,
        reflected,
        supported_taps,
        delay: quasi_static.then_some(dynamics.delay),
        rounds,
        warmups: prepared.record.experiments().iter().map(|e| e.warmup).collect(),
        notes,
        refinement,
    })
}
