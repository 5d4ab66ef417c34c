//! Hysteresis and linear dynamics in turn, until nothing is gained.

use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::Grid;
use crate::fit::RefineOptions;
use crate::fit::joint::fit_options;
use crate::fit::minimize::fit;
use crate::fit::preparation::{Prepared, rescale};
use crate::identify::identification::Round;
use crate::identify::realization::{self, Dynamics};
use crate::identify::settings::IdentifySettings;
use crate::linear::{self, Fir};
use crate::progress::{Progress, report};
use crate::{Error, Record};

/// Taps of the FIR estimates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Taps {
    pub count: usize,
    /// As many as the record can afford, should the slowest pole need them.
    pub largest: usize,
}

/// Where the joint refinement starts from.
pub(crate) struct Seed {
    pub point: Point,
    /// The paper's first stage, u to y.
    pub fir: Fir,
    /// ERA's singular values in the best round.
    pub singular_values: Vec<f64>,
    pub reflected: usize,
    pub rounds: Vec<Round>,
}

/// Hysteresis and dynamics in turn.
pub(crate) fn seed(
    prepared: &mut Prepared,
    half_widths: &Grid,
    taps: &mut Taps,
    order: Option<usize>,
    settings: &IdentifySettings,
    progress: Progress,
) -> Result<Seed, Error> {
    let policy = &settings.alternation;
    let mut current = dynamics_of(&prepared.record, taps, order, settings, progress)?;
    let fir = linear::estimate(&prepared.record.pieces(taps.count)?, taps.count, 0.0)?;
    let mut rounds = Vec::new();
    let mut point = prepared.point(current.sections()?);
    let linear_alone = prepared.free_run(&mut point)?;
    let mut options = fit_options(prepared, &RefineOptions::default(), policy.steps);
    options.freedom.identity = false;
    // The weights need not make up for an error of G's zeros.
    options.freedom.dynamics = DynamicsFreedom::Numerator;
    options.gain = policy.gain;
    rescale(&mut point);
    let mut best = (linear_alone, point.clone(), current.clone());
    for round in 0..policy.rounds {
        report(progress, "rounds", round as f64 / policy.rounds as f64)?;
        if round > 0 {
            let driven = prepared.driven(&point);
            let found = driven
                .and_then(|driven| dynamics_of(&driven, taps, order, settings, progress))
                .and_then(|found| Ok((found.sections()?, found)));
            // v of this round allows no realization: the best round so far stands
            let Ok((sections, found)) = Error::unless_interrupted(found)? else { break };
            point.replace_dynamics(sections);
            current = found;
        }
        rescale(&mut point);
        prepared.place(&mut point, half_widths)?;
        let fitted = fit(point.clone(), &prepared.record, &options, "hysteresis", progress);
        let Ok(fitted) = Error::unless_interrupted(fitted)? else { break };
        point = fitted.point;
        let rms = (fitted.linearization.cost / prepared.values()).sqrt();
        rounds.push(Round { rms, order: current.refit.system.order(), taps: taps.count });
        let least = best.0;
        if rms < least {
            best = (rms, point.clone(), current.clone());
        }
        let stalled = rms > (1.0 - policy.small) * least;
        if stalled && round == 0 {
            prepared.notes.push(format!(
                "hysteresis at the input hardly lowers the error: training error {rms:.4e} with it, \
                 {least:.4e} without"
            ));
        }
        let silent = |c: &Parameters| c.weights.iter().all(|&weight| weight == 0.0);
        if stalled || point.channels.iter().any(silent) {
            // In the latter case y does not depend on an input, so that v is zero.
            break;
        }
    }
    let (_, point, Dynamics { singular_values, reflected, .. }) = best;
    if reflected > 0 {
        prepared.notes.push(format!(
            "{reflected} poles of the realization were unstable and reflected into the unit circle"
        ));
    }
    Ok(Seed { point, fir, singular_values, reflected, rounds })
}

/// G of a record whose input is v, with as many taps as its slowest pole needs.
pub(crate) fn dynamics_of(
    record: &Record,
    taps: &mut Taps,
    order: Option<usize>,
    settings: &IdentifySettings,
    progress: Progress,
) -> Result<Dynamics, Error> {
    let mut check = || report(progress, "dynamics", 0.0);
    let record = &record.pieces(taps.largest)?;
    let found = realization::estimate(record, taps.count, settings, order, &mut check)?;
    // taps until the slowest pole has decayed
    let radius = found.refit.system.spectral_radius()?;
    let needed = (settings.taps.decayed.ln() / radius.ln()) as usize;
    if needed > taps.count + taps.count / settings.taps.tolerance && taps.count < taps.largest {
        taps.count = needed.min(taps.largest);
        let longer = realization::estimate(record, taps.count, settings, order, &mut check);
        return Ok(Error::unless_interrupted(longer)?.unwrap_or(found));
    }
    Ok(found)
}
