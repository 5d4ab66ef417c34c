//! The closed loop: score candidates, fit the best few jointly, keep what the held-out data confirm.

use super::concurrently::concurrently;
use super::grid::enriched;
use super::lags::Before;
use super::ranking::Ranked;
use super::score::Base;
use super::trial::{LEAST, Rejected, Trial, is_confirmed};
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::effects::{CATALOGUE, Entry};
use crate::fit::minimize::{FitOptions, fit};
use crate::fit::preparation::Prepared;
use crate::fit::refine::{RefineOptions, Refined, settings};
use crate::fit::representatives::representatives;
use crate::identify::NoiseFloor;
use crate::progress::{Progress, report};
use crate::spectrum::is_one_sine;
use crate::{Error, Record};

/// A round of the search.
#[derive(Clone)]
pub(crate) struct Round {
    pub trial: Trial,
    pub others: Vec<Rejected>,
    /// Effects that an earlier round had taken and that this one made superfluous.
    pub dropped: Vec<&'static str>,
}

pub(crate) struct Search<'a> {
    pub prepared: Prepared<'a>,
    /// The prepared record as it was measured, wrong samples included.
    pub measured: Record,
    /// Where what the training holds out is scored.
    pub test: Record,
    pub options: FitOptions,
    pub allowed: Vec<&'static Entry>,
    /// Whether a mode that G lacks is an effect; else it is an order that G was not given.
    pub order_is_given: bool,
    /// Whether the record is one cycle that repeats.
    pub is_one_sine: bool,
    /// Which grids may move and become finer.
    pub moving: RefineOptions,
    /// Whether the grids were placed anew since the latest effect.
    pub is_rich: bool,
    /// What was found before slow lags were taken out of G.
    pub before: Option<Before>,
    pub point: Point,
    pub cost: f64,
    pub rounds: Vec<Round>,
    /// Isolated wrong samples, `[experiment][output]`.
    pub wrong: Vec<Vec<Vec<usize>>>,
    /// What was tried in the last round and not taken.
    pub last: Vec<Rejected>,
}

impl<'a> Search<'a> {
    /// Goes on from a refined base model.
    pub(crate) fn new(
        prepared: Prepared<'a>,
        refined: &Refined,
        allowed: Vec<&'static Entry>,
        order_is_given: bool,
        measured: Record,
        moving: RefineOptions,
    ) -> Result<Self, Error> {
        /// Levenberg-Marquardt steps of a trial.
        const STEPS: usize = 12;
        let mut options = settings(&prepared, &RefineOptions::default(), STEPS);
        options.loss.scales.clone_from(&refined.options.loss.scales);
        options.gain = 1e-5;
        Ok(Self {
            test: super::blocks::complement(&prepared.record)?,
            is_one_sine: is_one_sine(&prepared.record),
            prepared,
            options,
            allowed,
            order_is_given,
            moving,
            is_rich: false,
            before: None,
            point: refined.fitted.point.clone(),
            cost: refined.fitted.linearization.cost,
            rounds: Vec::new(),
            wrong: Vec::new(),
            measured,
            last: Vec::new(),
        })
    }

    /// Adds effects until nothing more is confirmed.
    pub(crate) fn run(&mut self, progress: Progress) -> Result<(), Error> {
        const ROUNDS: usize = 12;
        for _ in 0..ROUNDS {
            if !self.round(progress)? && !self.shed_lags(progress)? {
                break;
            }
        }
        self.prefer_driven(progress)
    }

    /// One round: takes the best effect, if any is confirmed; says whether the model became another.
    fn round(&mut self, progress: Progress) -> Result<bool, Error> {
        /// Families that are fitted; the score test's best are rarely wrong.
        const FITTED: usize = 4;
        /// Part of the residual's squares.
        const STRONG: f64 = 0.6;
        /// Where no family promises this much, no fit would reach what an effect has to gain.
        const HOPELESS: f64 = 0.5 * LEAST;
        /// Far from the noise, what a misfit leaves looks like many effects a little: there an effect must
        /// take this part of the squares, and not much less of those that are held out.
        const SUBSTANTIAL: f64 = 0.3;
        const HELD_OUT: f64 = 0.2;
        /// Squares over those of the noise.
        const NEAR: f64 = 2.25;
        /// Effects with a signature that no misfit has.
        const SIGNED: [&str; 2] = ["periodic-disturbance", "covariate"];
        let mut ranked = self.ranked(progress)?;
        // A strong candidate is looked at first: the grid would bend to what it explains.
        let most = ranked.iter().map(|one| one.score.gain).fold(0.0, f64::max);
        if most < STRONG && !self.is_rich && self.enrich(progress)? {
            ranked = self.ranked(progress)?;
        }
        if ranked.iter().all(|one| one.score.gain < HOPELESS) {
            self.last.clear();
            return Ok(false);
        }
        let before = self.held_out(&self.point)?;
        ranked.truncate(FITTED);
        let mut trials = self.trials(ranked, progress)?;
        // what is explained, less what so many parameters would by chance
        trials.sort_by(|a, b| (b.deviance - b.chance).total_cmp(&(a.deviance - a.chance)));
        let floor = self.floor()?;
        let sum = |squares: &[f64]| squares.iter().sum::<f64>();
        let is_acceptable = |trial: &Trial| {
            let takes = |part: f64, after: f64, before: f64| after < (1.0 - part) * before;
            let is_substantial = takes(SUBSTANTIAL, trial.cost, self.cost)
                && takes(HELD_OUT, sum(&trial.held_out), sum(&before));
            let name = trial.entry.name;
            let is_weighty = is_substantial
                || self.is_named(trial.entry)
                || trial.cost < NEAR * floor
                || SIGNED.contains(&name);
            let is_more = trial.is_driven && trial.deviance > trial.chance;
            is_more && is_weighty && is_confirmed(&before, &trial.held_out)
        };
        let most = trials.iter().position(is_acceptable);
        // of those that explain the same, one that a thing could be
        let taken = most.map(|most| {
            let best = &trials[most];
            let as_much = |trial: &Trial| trial.deviance > best.deviance - best.chance;
            let is_better = |trial: &Trial| {
                as_much(trial) && is_acceptable(trial) && self.is_plausible(&trial.point)
            };
            trials.iter().position(is_better).unwrap_or(most)
        });
        let Some(taken) = taken else {
            self.last = trials.iter().map(|trial| self.reject(trial, None, &before)).collect();
            return Ok(false);
        };
        let taken = trials.remove(taken);
        let others = trials.iter().map(|trial| self.reject(trial, Some(&taken), &before)).collect();
        self.point = taken.point.clone();
        self.cost = taken.cost;
        if taken.entry.name == "linear-dynamics" && !self.order_is_given {
            self.absorb_modes();
        }
        self.rounds.push(Round { trial: taken, others, dropped: Vec::new() });
        self.repair()?;
        // the grids were placed before this effect was known
        self.is_rich = false;
        self.rearrange(progress)?;
        self.backward(progress)?;
        Ok(true)
    }

    /// Fits candidates; where fits take long, only those that may come near the best so far.
    fn trials(&self, ranked: Vec<Ranked>, progress: Progress) -> Result<Vec<Trial>, Error> {
        /// Part of what the best has gained that a score test must promise: it promises too little, but not
        /// by more.
        const NEAR: f64 = 0.5;
        let record = &self.prepared.record;
        let unknowns = Table::new(&self.point, self.options.freedom).len;
        if representatives(&self.point, record, unknowns).is_none() {
            return concurrently(ranked, progress, |one, progress| self.trial(one, progress));
        }
        let mut trials: Vec<Trial> = Vec::new();
        for one in ranked {
            let promised = -self.prepared.values() * (1.0 - one.score.gain).max(1e-300).ln();
            let best = trials.iter().map(|trial| trial.deviance).fold(0.0, f64::max);
            if promised >= NEAR * best {
                trials.push(self.trial(one, progress)?);
            }
        }
        Ok(trials)
    }

    /// Moves half-widths and thresholds, and takes finer grids as long as they pay: what the declared model
    /// itself can explain is no effect. Says whether the model became better.
    fn enrich(&mut self, progress: Progress) -> Result<bool, Error> {
        /// Times that plays and deadzones are added.
        const ROUNDS: usize = 6;
        /// The part of the residual's squares below which a round is the last.
        const SMALL: f64 = 0.02;
        self.is_rich = true;
        if !self.moving.half_widths && !self.moving.thresholds {
            return Ok(false);
        }
        let values = self.prepared.values();
        let mut gained = false;
        for round in 0..ROUNDS {
            report(progress, "finer grid", round as f64 / ROUNDS as f64)?;
            let (point, added) = enriched(&self.base()?, &self.prepared, &self.moving)?;
            if added == 0 && round > 0 {
                break;
            }
            let (point, cost) = self.on_moving_grids(point, progress)?;
            let deviance = values * (self.cost / cost.max(f64::MIN_POSITIVE)).ln();
            if deviance < 2.0 * added as f64 * values.ln() {
                break;
            }
            (self.point, self.cost) = (point, cost);
            gained = true;
            if deviance < SMALL * values {
                break;
            }
        }
        Ok(gained)
    }

    /// The squares that noise alone would leave.
    fn floor(&self) -> Result<f64, Error> {
        let record = &self.prepared.record;
        let noise = NoiseFloor::estimate(record, &self.point.residuals(record)?);
        let weights = &self.options.loss.scales;
        let squares = noise.rms.iter().zip(weights).map(|(rms, weight)| (rms * weight).powi(2));
        Ok(squares.sum::<f64>() * record.scored() as f64)
    }

    fn base(&self) -> Result<Base<'_>, Error> {
        let Self { point, prepared, options, .. } = self;
        Base::new(point, &prepared.record, options.freedom, &options.loss)
    }

    /// All that is free, grids that were not given included.
    pub(super) fn moving_grids(&self) -> FitOptions {
        let options = settings(&self.prepared, &self.moving, self.options.steps);
        FitOptions { loss: self.options.loss.clone(), gain: 1e-3, ..options }
    }

    /// A point fitted with grids that move, plays and deadzones without use left out; and its cost.
    fn on_moving_grids(&self, point: Point, progress: Progress) -> Result<(Point, f64), Error> {
        const STILL: usize = 6;
        const STEPS: usize = 12;
        let mut options = FitOptions { steps: STEPS, ..self.moving_grids() };
        let record = &self.prepared.record;
        // new weights first: with all that moves at once, the kinks at which plays turn stop the fit early
        let still = FitOptions { steps: STILL, gain: 1e-3, ..self.options.clone() };
        let point = fit(point, record, &still, "refinement", progress)?.point;
        let mut fitted = fit(point, record, &options, "refinement", progress)?;
        if fitted.point.drop_unused() {
            options.steps = STEPS / 3;
            fitted = fit(fitted.point, record, &options, "refinement", progress)?;
        }
        Ok((fitted.point, fitted.linearization.cost))
    }

    /// Adds an effect that the user asks for, whatever it gains.
    pub(crate) fn force(&mut self, entry: &'static Entry, progress: Progress) -> Result<(), Error> {
        if self.point.effects.iter().any(|effect| effect.name() == entry.name) {
            return Ok(());
        }
        let Some(best) = self.scored_beside(&self.point, &[entry], progress)?.into_iter().next()
        else {
            let requirement = "the record shows nothing to place it by; leave it out";
            return Err(Error::parameter("require", entry.name, requirement));
        };
        let trial = self.trial(best, progress)?;
        (self.point, self.cost) = (trial.point.clone(), trial.cost);
        self.rounds.push(Round { trial, others: Vec::new(), dropped: Vec::new() });
        self.repair()
    }
}

/// The entries that `names` allow, all when there are none.
pub(crate) fn allowed(
    parameter: &'static str,
    names: Option<&[String]>,
) -> Result<Vec<&'static Entry>, Error> {
    let Some(names) = names else { return Ok(CATALOGUE.iter().collect()) };
    let find = |name: &String| {
        CATALOGUE.iter().find(|entry| entry.name == name).ok_or_else(|| {
            let known: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
            Error::parameter(parameter, name, format!("one of {}", known.join(", ")))
        })
    };
    names.iter().map(find).collect()
}
