//! Hysteresis and linear dynamics in turn, until nothing is gained.

use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::Grid;
use crate::fit::RefineOptions;
use crate::fit::joint::fit_options;
use crate::fit::minimize::fit;
use crate::fit::preparation::{Prepared, rescale};
use crate::identify::identification::Round;
use crate::identify::realization::{Dynamics, Response};
use crate::identify::settings::IdentifySettings;
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
    /// Taps of the paper's first stage, u to y.
    pub taps: usize,
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
    let mut estimate = DynamicsEstimate::new(&prepared.record, taps, settings)?;
    let mut current = estimate.of_order(order, taps, progress)?;
    let first_taps = taps.count;
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
            let found = prepared
                .driven(&point)
                .and_then(|driven| DynamicsEstimate::new(&driven, taps, settings))
                .and_then(|mut estimate| estimate.of_order(order, taps, progress))
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
    Ok(Seed { point, taps: first_taps, singular_values, reflected, rounds })
}

/// G of a record whose input is v, of one order after the other from the same impulse response.
pub(crate) struct DynamicsEstimate<'a> {
    record: Record,
    response: Response,
    settings: &'a IdentifySettings,
}

impl<'a> DynamicsEstimate<'a> {
    /// Estimates the impulse response.
    pub(crate) fn new(
        record: &Record,
        taps: &Taps,
        settings: &'a IdentifySettings,
    ) -> Result<Self, Error> {
        let record = record.pieces(taps.largest)?;
        let response = Response::estimate(&record, taps.count, settings)?;
        Ok(Self { record, response, settings })
    }

    /// G of an order, or of the best one, with as many taps as its slowest pole needs.
    pub(crate) fn of_order(
        &mut self,
        order: Option<usize>,
        taps: &mut Taps,
        progress: Progress,
    ) -> Result<Dynamics, Error> {
        let Self { record, response, settings } = self;
        let mut check = || report(progress, "dynamics", 0.0);
        check()?;
        let policy = &settings.realization;
        let found = response.realize(record, order, policy, &mut check)?;
        // taps until the slowest pole has decayed
        let radius = found.refit.system.spectral_radius()?;
        let needed = (settings.taps.decayed.ln() / radius.ln()) as usize;
        let tolerated = response.taps() + response.taps() / settings.taps.tolerance;
        if needed <= tolerated || response.taps() >= taps.largest {
            return Ok(found);
        }
        taps.count = needed.min(taps.largest);
        let longer = Response::estimate(record, taps.count, settings).and_then(|longer| {
            let found = longer.realize(record, order, policy, &mut check)?;
            Ok((longer, found))
        });
        Ok(match Error::unless_interrupted(longer)? {
            Ok((longer, better)) => {
                *response = longer;
                better
            }
            Err(_) => found,
        })
    }
}
