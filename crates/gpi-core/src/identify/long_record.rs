//! Structures of a long record: compared on stretches of it, then fitted to all of it.
//!
//! Where the stretches show too little, all steps see the whole record.

use crate::Error;
use crate::chain::point::Point;
use crate::fit::excerpt::excerpt;
use crate::fit::joint::joint;
use crate::fit::preparation::Prepared;
use crate::identify::elements::compare_on_all;
use crate::identify::identification::{IdentifyOptions, Quick};
use crate::identify::procedure::{Compared, prepare};
use crate::identify::structure::refine_options;
use crate::progress::Progress;

/// Seeds and compares structures.
///
/// Those of a long record are compared on stretches of it, and the best one is fitted to all of it.
pub(crate) fn compare(
    prepared: &mut Prepared,
    options: &IdentifyOptions,
    quick: Option<Quick>,
    progress: Progress,
) -> Result<Compared, Error> {
    let Some(stretches) = excerpt(prepared.given, &prepared.settings.excerpt)? else {
        return compare_on_all(prepared, options, quick, progress);
    };
    let compared = prepare(&stretches, options).and_then(|mut part| {
        compare_on_all(&mut part, options, quick, progress).map(|compared| (part, compared))
    });
    // stretches that show too little, such as an impulse response of rank 0, leave the whole record to try
    let Ok((part, mut compared)) = Error::unless_interrupted(compared)? else {
        return compare_on_all(prepared, options, quick, progress);
    };
    let point = carried(&compared.refined.fitted.point, &part, prepared);
    let refine = refine_options(options);
    prepared.settings = prepared.settings.clone().of_long_record();
    compared.refined = joint(point, prepared, &refine, f64::INFINITY, quick.is_some(), progress)?;
    prepared.notes.push(format!(
        "the structures were compared on {} of {} samples, in stretches that are spread over the record; the best one was \
         then fitted to all samples",
        stretches.scored(),
        prepared.record.scored()
    ));
    Ok(compared)
}

/// A point of stretches of a record as one of the whole record, whose initial states are still to be fitted.
fn carried(point: &Point, part: &Prepared, whole: &Prepared) -> Point {
    let mut carried = whole.point(point.dynamics.clone());
    carried.channels.clone_from(&point.channels);
    whole.settle(&mut carried);
    let count = point.offsets.len() as f64;
    let means = part.means.iter().zip(&whole.means);
    for (output, (own, other)) in means.enumerate() {
        let average = point.offsets.iter().map(|offsets| offsets[(0, output)]).sum::<f64>() / count;
        for offsets in &mut carried.offsets {
            offsets.column_mut(output).fill(average + own - other);
        }
    }
    carried
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::{Operator, PlayBank};
    use crate::{Channel, Experiment, Matrix, Record};

    /// Three plays before a lag with noise, driven by a sum of sines, in motion from the first sample.
    fn record(samples: usize) -> Record {
        let phase = |f: f64, k: usize| (std::f64::consts::TAU * f * k as f64).sin();
        let drive =
            |k: usize| 5.0 * phase(0.0031, k + 70) + 3.0 * phase(0.0173, k) + phase(0.11, k);
        let u: Vec<f64> = (0..samples).map(drive).collect();
        let plays = PlayBank::new(vec![0.0, 1.0, 2.5], vec![1.0, 0.5, 0.3]).unwrap();
        let mut state = plays.settled(u[0]);
        let v: Vec<f64> = u.iter().map(|&u| plays.step(&mut state, u)).collect();
        let (mut state, mut y, mut seed) = (v[0], Vec::new(), 1_u64);
        for value in v {
            state += 0.3 * (value - state);
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            y.push(state + 0.02 * ((seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0));
        }
        let run = Experiment::new(Matrix::from_vec(samples, 1, u), Matrix::from_vec(samples, 1, y));
        let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
        Record::new(vec![run], 1000.0, u, y, vec![]).unwrap()
    }

    #[test]
    fn stretches_lead_to_the_same_model() {
        let record = record(12_000);
        let options = IdentifyOptions::default();
        let found = |long: usize| {
            let mut prepared = prepare(&record, &options).unwrap();
            prepared.settings.excerpt.long = long;
            prepared.settings.excerpt.samples = 6000;
            prepared.settings.excerpt.shortest = 1500;
            let compared = compare(&mut prepared, &options, None, &mut |_| true).unwrap();
            let is_told = prepared.notes.iter().any(|note| note.contains("were compared on"));
            (compared.refined.fitted, is_told)
        };
        let ((all, _), (some, is_told)) = (found(20_000), found(10_000));
        assert!(is_told);
        assert_eq!(some.point.dynamics.order(), all.point.dynamics.order());
        assert!(some.linearization.cost < 1.05 * all.linearization.cost);
    }
}
