//! The steps of an identification: excitation, start values, structures, model.
//!
//! 1. The order of persistent excitation is the largest m for which the Gram matrix of m lagged inputs (m times inputs,
//!    square) is regular. With m <= 4 the record supports a gain and a delay only; `quasi_static` then fits the hysteresis
//!    before each delay.
//! 2. Otherwise `alternation` estimates G as a FIR of up to m taps (samples >= 4 taps times inputs), realizes it by
//!    Ho and Kalman's method (ERA), fits the hysteresis before it, and repeats this with v in place of u.
//! 3. `structure` refines candidates jointly, from many plays and deadzones to few, then orders of G, each from the best
//!    one so far; `criterion` compares them by a BIC for autocorrelated residuals.
//!    A plant that is slow or integrates its input is also started from lags (`slow_plant`) or from its rate (`integrating_plant`).
//! 4. The best one is simplified, and its uncertainty is computed.
//!
//! Of a long record, steps 2 and 3 see stretches only, see [`long_record`](super::long_record).
//!
//! Source of 1 to 2: K. F. Aljanaideh et al., whose chain starts with u -> y and inverts G to see v; here v is the
//! hysteresis' own output, so that no noise is run through an inverse.

use crate::chain::bounds::range;
use crate::chain::hysteresis::Parameters;
use crate::fit::Grid;
use crate::fit::joint::Refined;
use crate::fit::preparation::Prepared;
use crate::identify::alternation::{self, Taps};
use crate::identify::identification::{Candidate, IdentifyOptions, Quick, Round};
use crate::identify::integrating_plant;
use crate::identify::quasi_static;
use crate::identify::settings::{AlternationPolicy, IdentifySettings};
use crate::identify::slow_plant;
use crate::identify::structure::StructureSearch;
use crate::linear::excitation_limit;
use crate::progress::{Progress, report};
use crate::{Error, Record};

/// The structures that were compared on a prepared record.
pub(crate) struct Compared {
    /// The place of the best candidate.
    pub chosen: usize,
    pub refined: Refined,
    pub candidates: Vec<Candidate>,
    /// Where stops were taken although plays were compared: the part of the squares of plays that they leave.
    pub of_plays: Option<f64>,
    /// Whether the samples are few for the parameters of the best candidate.
    pub(super) is_crowded: bool,
    pub(super) quasi_static: bool,
    pub(super) stages: (Option<usize>, Vec<f64>, usize, Vec<Round>),
    pub(super) supported: usize,
}

/// Makes a record ready, on the given or usual grids.
pub(crate) fn prepare<'a>(
    record: &'a Record,
    options: &IdentifyOptions,
) -> Result<Prepared<'a>, Error> {
    record.require_moving()?;
    Prepared::new(record, channels(record, options)?)
}

/// Seeds and compares structures of the elements that the prepared channels have.
pub(super) fn compare_elements(
    prepared: &mut Prepared,
    options: &IdentifyOptions,
    quick: Option<Quick>,
    progress: Progress,
) -> Result<Compared, Error> {
    let settings = &IdentifySettings::default();
    settings.validate()?;
    let policy = &settings.taps;
    let record = prepared.given;
    let inputs = record.inputs().len();
    let supported = excitation_limit(record)?;
    if options.taps == Some(0) {
        return Err(Error::parameter("taps", 0, "at least one tap is needed"));
    }
    if let Some(taps) = options.taps
        && taps > supported
    {
        let (unknowns, rank) = (taps * inputs, supported * inputs);
        return Err(Error::Excitation { taps, unknowns, rank, supported });
    }
    report(progress, "excitation", 1.0)?;
    let longest = record.experiments().iter().map(crate::Experiment::scored).max().unwrap_or(0);
    let affordable = (longest / (policy.samples * inputs)).max(1);
    let grid = half_widths(options);
    let sizes = prepared.channels.iter().map(|c| c.half_widths.len() + c.slopes.len() - 1);
    let needed = sizes.sum::<usize>() + record.outputs().len();
    if record.scored() < needed {
        let purpose = "plays, deadzones and offsets".to_owned();
        return Err(Error::TooFewSamples { samples: record.scored(), needed, purpose });
    }
    let taps = options.taps.unwrap_or(supported.min(affordable));
    let largest = (policy.unknowns / inputs).min(policy.most).min(supported).min(affordable);
    let count = options.taps.unwrap_or(largest.min(policy.first));
    let mut few = Taps { count, largest: options.taps.unwrap_or(largest) };
    let has_dynamics = options.delay.is_none() && taps > policy.gain_and_delay;
    let seed = has_dynamics
        .then(|| alternation::seed(prepared, &grid, &mut few, options.order, settings, progress));
    let seed = match seed.map(Error::unless_interrupted).transpose()? {
        Some(Ok(seed)) => Some(seed),
        // no realization of any order: a gain with a delay is left to try, unless dynamics are asked for
        Some(Err(error)) if options.order.is_some() || options.taps.is_some() => return Err(error),
        Some(Err(_)) | None => None,
    };
    let Some(seed) = seed else {
        if let Some(order) = options.order {
            let requirement = format!(
                "the input supports {} taps, which is a gain and a delay; leave the order out",
                supported.min(affordable)
            );
            return Err(Error::parameter("order", order, requirement));
        }
        let (points, rounds) =
            quasi_static::seeds(prepared, options.delay, &settings.quasi_static, progress)?;
        let mut search = StructureSearch::new(prepared, &settings.structure, options, None);
        // A rich hysteresis hides a sample of delay, so its neighbours are tried with a simple one.
        for point in &points {
            search.climb(point, progress)?;
        }
        if options.delay.is_none() {
            search.lag(progress)?;
        }
        enrich(&mut search, quick, progress)?;
        let stages = (None, Vec::new(), 0, rounds);
        return compared(search, true, stages, supported);
    };
    let mut search = StructureSearch::new(prepared, &settings.structure, options, quick);
    search.climb(&seed.point, progress)?;
    if options.order.is_none() {
        search.orders(&mut few, settings, progress)?;
    }
    if options.order.is_none() && search.shows_nothing_fast() {
        // All poles are slow and the rest is flat: a gain with a delay takes the place of G.
        let (points, _) = quasi_static::seeds(prepared, None, &settings.quasi_static, progress)?;
        for point in &points {
            search.climb(point, progress)?;
        }
    } else if options.order.is_none() {
        search.shed(progress)?;
    }
    let slow = slow_plant::seed(&seed.point, options.order, prepared, &settings.slow, progress);
    if let Some(seed) = Error::unless_interrupted(slow)?.ok().flatten() {
        search.slow(&seed, progress)?;
        if options.order.is_none() {
            search.orders(&mut few, settings, progress)?;
        }
    }
    if let Some(best) = search.best() {
        let start = (&grid, few);
        let integrated =
            integrating_plant::seed(&best, start, options, prepared, settings, progress);
        if let Some(seed) = Error::unless_interrupted(integrated)?.ok().flatten() {
            search.begin_at(seed, progress)?;
            if options.order.is_none() {
                search.shed(progress)?;
            }
        }
    }
    if let Some(best) = search.best() {
        search.without_plays(&best, progress)?;
    }
    enrich(&mut search, quick, progress)?;
    let stages = (Some(seed.taps), seed.singular_values, seed.reflected, seed.rounds);
    compared(search, false, stages, supported)
}

/// Tries the plays of a dense grid, unless this is a quick comparison: so many plays can take the place of an effect.
fn enrich(
    search: &mut StructureSearch,
    quick: Option<Quick>,
    progress: Progress,
) -> Result<(), Error> {
    if quick.is_some() { Ok(()) } else { search.enrich(progress) }
}

fn compared(
    search: StructureSearch,
    quasi_static: bool,
    stages: (Option<usize>, Vec<f64>, usize, Vec<Round>),
    supported: usize,
) -> Result<Compared, Error> {
    let (failure, is_crowded) = (search.failure(), search.is_crowded());
    let Some((chosen, refined, candidates)) = search.finish() else {
        // all candidates failed: the first one's reason is that of the data
        return Err(failure.unwrap_or_else(|| {
            Error::parameter("half_widths", "none", "at least one structure is tried")
        }));
    };
    let of_plays = None;
    Ok(Compared {
        chosen,
        refined,
        candidates,
        of_plays,
        is_crowded,
        quasi_static,
        stages,
        supported,
    })
}

/// The half-widths that are given, or as many as usual.
fn half_widths(options: &IdentifyOptions) -> Grid {
    let usual = AlternationPolicy::default().half_widths;
    options.half_widths.clone().unwrap_or(Grid::Count(usual))
}

/// The hysteresis that the rounds start from: the identity on the given or usual grids.
fn channels(record: &Record, options: &IdentifyOptions) -> Result<Vec<Parameters>, Error> {
    let half_widths = half_widths(options);
    let usual = AlternationPolicy::default().thresholds;
    let thresholds = options.thresholds.clone().unwrap_or(Grid::Count(usual));
    let elements = options.elements.unwrap_or_default();
    let channel = |input| {
        let (low, high) = range(record, input);
        let zones = thresholds.thresholds((low, high))?;
        let plays = half_widths.half_widths(high - low)?;
        Ok(Parameters { elements, ..Parameters::identity(options.reading, zones, plays) })
    };
    (0..record.inputs().len()).map(channel).collect()
}
