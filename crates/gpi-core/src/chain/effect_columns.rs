//! What effects contribute to the output: their derivatives from differences, and what a probe would add.
//!
//! The derivative of the output y (samples, outputs) by value c_j of an effect is taken as
//!
//! ```text
//! dy/dc_j = (y(c + h_j e_j) - y(c)) / h_j,      h_j = Block::steps[j]
//! ```
//!
//! The output is linear in most values of effects, so that a difference over
//! [`Block::steps`](crate::effects::Block::steps) is exact up to rounding, about `2e-16 |y| / h_j`. In a value in which
//! it is not linear (a dead time, a rate limit, a half-width of backlash, a frequency) the error is `h_j/2 d2y/dc_j^2`,
//! small because h_j is far below the value. Each column costs the simulation from the effect's stage on
//! ([`super::free_run`]); a signal that is added behind everything costs the difference of two signals only.
//!
//! Plays read through curves, loops and parallel sections have derivatives of their own. For a candidate curve, the
//! column is the response to the exact change of v: with the derivative `s(k) = dv/dc_j` it is
//! `(y(v + h_j s) - y(v)) / h_j`, exact where everything behind v is linear.

use super::free_run::Signals;
use super::point::{Past, Point};
use crate::effects::{Added, Effect, Place, PlayCurves, Stage};
use crate::parallel::install;
use crate::{Error, Experiment, Matrix};
use rayon::prelude::*;

impl Point {
    /// Adds one signal, so many times.
    fn add_one(&self, added: &dyn Added, experiment: &Experiment, times: f64, output: &mut Matrix) {
        let covariates = &experiment.covariates;
        self.stages().add_one(added, &mut Vec::new(), covariates, times, output);
    }

    /// The signal that an effect adds to the reading as it is, whatever the rest of the model does.
    fn apart<'a>(&self, effect: &'a Effect) -> Option<&'a dyn Added> {
        effect.place().added().filter(|added| !added.moves_stage() || !self.senses())
    }

    /// What the output gains by one more effect, `y(with) - y(without)` (samples, outputs); `here` is the output without it.
    /// A finite difference over the probe's own value: linear in it only where the output is.
    pub(crate) fn gained_by(
        &self,
        effect: &Effect,
        known: &Signals,
        here: &Matrix,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Matrix, Error> {
        if let Some(added) = self.apart(effect) {
            let mut gained = Matrix::zeros(here.nrows(), here.ncols());
            self.add_one(added, experiment, 1.0, &mut gained);
            return Ok(gained);
        }
        let point = self.with_effect(effect.clone());
        point.gain_from(effect.stage(), (known, here), experiment, index)
    }

    /// Derivatives of the output by the values of every effect whose own do not stream along, `[effect][value]`, and at last by the places
    /// of the readings in their gaps: each (samples, outputs), from differences.
    pub(crate) fn effect_columns(
        &self,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Vec<Vec<Matrix>>, Error> {
        let streams = |effect: &Effect| {
            matches!(effect.place(), Place::Curves(_) | Place::Loops(_) | Place::Parallel(_))
        };
        let runs = |effect: &Effect| !streams(effect) && self.apart(effect).is_none();
        let (known, here) = if self.effects.iter().any(runs) {
            let known = self.signals(experiment, index)?;
            let here = self.output(&known, index);
            (known, here)
        } else {
            // an added signal has derivatives of its own alone
            let here = Matrix::zeros(experiment.input.nrows(), self.dynamics.outputs());
            (Signals::none(), here)
        };
        let of = |(place, effect): (usize, &Effect)| {
            if streams(effect) {
                return Ok(Vec::new());
            }
            self.columns_of(place, &known, &here, experiment, index)
        };
        let of_effects = || self.effects.par_iter().enumerate().map(of);
        let mut columns: Vec<Vec<Matrix>> = install(|| of_effects().collect::<Result<_, _>>())?;
        columns.push(self.gap_columns(&known, &here, experiment, index)?);
        Ok(columns)
    }

    /// Derivatives of the output by the place s of each reading in its gap, where that is unknown. Until the gap first closes, the reading
    /// is `x(0) + s b`, so that the difference is exact.
    fn gap_columns(
        &self,
        known: &Signals,
        here: &Matrix,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Vec<Matrix>, Error> {
        /// A part of the half-width, far above the rounding of x.
        const STEP: f64 = 1e-4;
        let column = |output: usize| {
            let mut moved = self.clone();
            let side = &mut moved.pasts[index].gaps[output];
            let step = if *side > 0.0 { -STEP } else { STEP };
            *side += step;
            Ok(moved.gain_from(Stage::Output, (known, here), experiment, index)? / step)
        };
        if !self.pasts[index].has_unknown_state {
            return Ok(Vec::new());
        }
        self.gapped().into_iter().map(column).collect()
    }

    /// The same of one effect whose derivatives do not stream along, or of a curve that is a candidate; `here` is the output. Where the
    /// effect's signal is added to the reading as it is, neither `known` nor the values of `here` are used.
    pub(crate) fn columns_of(
        &self,
        place: usize,
        known: &Signals,
        here: &Matrix,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Vec<Matrix>, Error> {
        let effect = &self.effects[place];
        let Some(block) = effect.block() else { return Ok(Vec::new()) };
        let (steps, values) = (block.steps(), block.values());
        if let Place::Curves(curves) = effect.place() {
            let input = curves.input();
            let slopes = self.reading_slopes_of(curves, &known.drive, &self.pasts[index]);
            let column = |(step, slope): (f64, nalgebra::RowDVector<f64>)| {
                let mut moved = known.clone();
                moved.intermediate.column_mut(input).axpy(step, &slope.transpose(), 1.0);
                Ok(self.gain_from(Stage::Dynamics, (&moved, here), experiment, index)? / step)
            };
            let rows = slopes.row_iter().map(nalgebra::Matrix::into_owned);
            let pairs: Vec<_> = steps.into_iter().zip(rows).collect();
            return install(|| pairs.into_par_iter().map(column).collect());
        }
        let column = |(number, step): (usize, f64)| {
            let mut values = values.clone();
            values[number] += step;
            let mut moved = self.clone();
            moved.effects[place].set(&values);
            let apart = self.apart(&moved.effects[place]).zip(self.apart(effect));
            if let Some((changed, own)) = apart {
                let mut column = Matrix::zeros(here.nrows(), here.ncols());
                self.add_one(changed, experiment, 1.0 / step, &mut column);
                self.add_one(own, experiment, -1.0 / step, &mut column);
                return Ok(column);
            }
            Ok(moved.gain_from(effect.stage(), (known, here), experiment, index)? / step)
        };
        install(|| steps.into_par_iter().enumerate().map(column).collect())
    }

    /// Derivatives of v by the values of all curves through which plays are read, (values, samples) each.
    pub(crate) fn reading_slopes(&self, drive: &Matrix, past: &Past) -> Vec<Matrix> {
        self.play_curves().map(|curves| self.reading_slopes_of(curves, drive, past)).collect()
    }

    /// The same of one effect.
    fn reading_slopes_of(&self, curves: &dyn PlayCurves, drive: &Matrix, past: &Past) -> Matrix {
        let input = curves.input();
        let start = past.plays.as_ref().map(|plays| &plays[input][..]);
        let drive: Vec<f64> = drive.column(input).iter().copied().collect();
        self.channels[input].reading_slopes(start, self.plays(input), &drive, curves)
    }
}
