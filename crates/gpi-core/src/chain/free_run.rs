//! A point run free over the record, stage by stage, and the model that it is.

use crate::chain::hysteresis::{Beside, Parameters};
use crate::chain::motion::Motion;
use crate::chain::point::{Past, Point};
use crate::chain::stream::hats;
use crate::effects::{Added, ClosedLoops, Effect, InnerLoop, Moment, Place, PlayCurves, Stage};
use crate::linear::Sections;
use crate::{Error, Experiment, Matrix, Model, Record};
use nalgebra::RowDVector;
use rayon::prelude::*;

impl Point {
    /// Other dynamics, which stood still before the record.
    pub(crate) fn replace_dynamics(&mut self, dynamics: Sections) {
        self.splice_states(0..self.dynamics.order(), &vec![0.0; dynamics.order()]);
        self.dynamics = dynamics;
    }

    /// Effects on the plays of an input.
    pub(crate) fn beside(&self, input: usize) -> Beside<'_> {
        let widths = self.effects.iter().filter_map(|effect| effect.place().play_widths());
        let widths = widths.filter(|own| own.input() == input);
        let curves = self.play_curves().filter(|own| own.input() == input);
        Beside::new(widths, curves, self.rate)
    }

    /// The drive (samples, inputs) that reaches the hysteresis.
    pub(crate) fn drive(&self, experiment: &Experiment) -> Matrix {
        let mut drive = experiment.input.clone();
        for effect in self.effects.iter().filter_map(|effect| effect.place().input_stage()) {
            let mut column = drive.column_mut(effect.input());
            let mut state = effect.rest(column[0]);
            for value in column.iter_mut() {
                *value = effect.drive(&mut state, *value, self.rate);
            }
        }
        drive
    }

    pub(crate) fn moment<'a>(&self, k: usize, covariates: &'a [f64]) -> Moment<'a> {
        Moment { time: k as f64 / self.rate, rate: self.rate, covariates }
    }

    /// The intermediate signals v (samples, inputs) of a drive.
    pub(crate) fn intermediate(&self, drive: &Matrix, past: &Past) -> Matrix {
        let mut v = drive.clone();
        let columns = v.as_mut_slice().chunks_exact_mut(drive.nrows());
        for ((input, channel), column) in self.channels.iter().enumerate().zip(columns) {
            let start = past.plays.as_ref().map(|plays| &plays[input][..]);
            channel.apply(start, self.beside(input), column);
        }
        v
    }

    /// What the dynamics make of v, (samples, outputs), before the output stage.
    pub(crate) fn displacement(
        &self,
        v: &Matrix,
        experiment: &Experiment,
        past: &Past,
    ) -> Result<Matrix, Error> {
        let mut displacement = Matrix::zeros(v.nrows(), self.dynamics.outputs());
        let mut motion = Motion::new(self);
        let mut now: Vec<f64> = v.row(0).iter().copied().collect();
        motion.stand(&now);
        for k in 0..v.nrows() {
            if k == experiment.warmup && past.moving {
                motion.state.iter_mut().zip(past.state.iter()).for_each(|(x, own)| *x += own);
            }
            let at = k.saturating_sub(self.dynamics.delay);
            now.iter_mut().zip(v.row(at).iter()).for_each(|(now, v)| *now = *v);
            motion.observe(&now);
            for (output, y) in motion.displacement.iter().enumerate() {
                displacement[(k, output)] = *y;
            }
            motion.advance(&now);
        }
        Ok(displacement)
    }

    /// The loops that effects close around G.
    pub(crate) fn loops(&self) -> impl Iterator<Item = &InnerLoop> {
        let closed = self.effects.iter().filter_map(|effect| effect.place().closed_loops());
        closed.flat_map(ClosedLoops::loops)
    }

    /// The curves through which plays are read.
    pub(crate) fn play_curves(&self) -> impl Iterator<Item = &dyn PlayCurves> {
        self.effects.iter().filter_map(|effect| effect.place().play_curves())
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
        self.channels[input].reading_slopes(start, self.beside(input), &drive, curves)
    }

    /// Takes a displacement (samples, outputs) through the output stage.
    pub(crate) fn sense(&self, displacement: &mut Matrix) {
        for effect in self.output_stages() {
            let mut column = displacement.column_mut(effect.output());
            let mut state = effect.rest(column[0]);
            for (k, value) in column.iter_mut().enumerate() {
                *value = effect.sense(&mut state, *value, self.moment(k, &[])).0;
            }
        }
    }

    /// Adds what the input does not drive, to the displacement or to the reading.
    pub(crate) fn add(&self, stage: Stage, experiment: &Experiment, output: &mut Matrix) {
        for effect in self.effects.iter().filter(|effect| effect.stage() == stage) {
            if let Place::Added(own) = effect.place() {
                self.add_one(own, experiment, 1.0, output);
            }
        }
    }

    /// Adds one signal, so many times.
    fn add_one(&self, added: &dyn Added, experiment: &Experiment, times: f64, output: &mut Matrix) {
        let rows = experiment.covariates.transpose();
        let covariates = |k: usize| {
            let width = rows.nrows();
            &rows.as_slice()[k * width..(k + 1) * width]
        };
        let mut state = added.rest(self.moment(0, covariates(0)));
        for (k, value) in output.column_mut(added.output()).iter_mut().enumerate() {
            *value += times * added.add(&mut state, self.moment(k, covariates(k)));
        }
    }

    /// Whether the model has an output stage.
    pub(crate) fn senses(&self) -> bool {
        self.output_stages().next().is_some()
    }

    /// The signal that an effect adds to the reading as it is, whatever the rest of the model does.
    fn apart<'a>(&self, effect: &'a Effect) -> Option<&'a dyn Added> {
        effect.place().added().filter(|added| !added.moves_stage() || !self.senses())
    }

    /// What the output gains by a block beside this point's own; `here` is the output.
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
        Ok(point.output_from(effect.stage(), known, experiment, index)? - here)
    }

    /// The signals along the chain.
    pub(crate) fn signals(&self, experiment: &Experiment, index: usize) -> Result<Signals, Error> {
        let past = &self.pasts[index];
        let drive = self.drive(experiment);
        let intermediate = self.intermediate(&drive, past);
        let displacement = self.displacement(&intermediate, experiment, past)?;
        Ok(Signals { drive, intermediate, displacement })
    }

    /// The output (samples, outputs) without its offsets, from the stage on at which `known` ends.
    pub(crate) fn output_from(
        &self,
        stage: Stage,
        known: &Signals,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Matrix, Error> {
        let past = &self.pasts[index];
        let mut output = match stage {
            Stage::Input => {
                let v = self.intermediate(&self.drive(experiment), past);
                self.displacement(&v, experiment, past)?
            }
            Stage::Plays => {
                let v = self.intermediate(&known.drive, past);
                self.displacement(&v, experiment, past)?
            }
            Stage::Dynamics => self.displacement(&known.intermediate, experiment, past)?,
            _ => known.displacement.clone(),
        };
        self.add(Stage::Displaced, experiment, &mut output);
        self.sense(&mut output);
        self.add(Stage::Added, experiment, &mut output);
        Ok(output)
    }

    /// Derivatives of the output by the values of every effect whose own do not stream along: `[effect][value]`,
    /// (samples, outputs), from differences.
    pub(crate) fn effect_columns(
        &self,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Vec<Vec<Matrix>>, Error> {
        let streams =
            |effect: &Effect| matches!(effect.place(), Place::Curves(_) | Place::Loops(_));
        if self.effects.iter().all(streams) {
            return Ok(vec![Vec::new(); self.effects.len()]);
        }
        let known = self.signals(experiment, index)?;
        let here = self.output_from(Stage::Added, &known, experiment, index)?;
        let of = |(place, effect): (usize, &Effect)| {
            if streams(effect) {
                return Ok(Vec::new());
            }
            self.columns_of(place, &known, &here, experiment, index)
        };
        self.effects.iter().enumerate().map(of).collect()
    }

    /// The same of one effect; `here` is the output.
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
        if let Place::Parallel(_) = effect.place() {
            return Ok(Vec::new());
        }
        let steps = block.steps();
        if let Place::Curves(curves) = effect.place() {
            let input = curves.input();
            let slopes = self.reading_slopes_of(curves, &known.drive, &self.pasts[index]);
            let column = |(step, slope): (f64, nalgebra::RowDVector<f64>)| {
                let mut moved = known.clone();
                moved.intermediate.column_mut(input).axpy(step, &slope.transpose(), 1.0);
                let there = self.output_from(Stage::Dynamics, &moved, experiment, index)?;
                Ok((there - here) / step)
            };
            let rows = slopes.row_iter().map(nalgebra::Matrix::into_owned);
            return steps.into_iter().zip(rows).map(column).collect();
        }
        let column = |(number, step): (usize, f64)| {
            let mut values = block.values();
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
            let there = moved.output_from(effect.stage(), known, experiment, index)?;
            Ok((there - here) / step)
        };
        steps.into_iter().enumerate().map(column).collect()
    }

    /// Measured minus simulated outputs of each experiment, (samples, outputs), warm-ups included.
    pub(crate) fn residuals(&self, record: &Record) -> Result<Vec<Matrix>, Error> {
        let runs = record.experiments().par_iter().zip(&self.offsets).enumerate();
        runs.map(|(index, (experiment, offsets))| {
            let samples = experiment.input.nrows();
            let known = self.signals(experiment, index)?;
            let output = self.output_from(Stage::Added, &known, experiment, index)?;
            let mut residual = &experiment.output - output;
            for k in 0..samples {
                for (knot, weight) in hats(k, samples, offsets.nrows()) {
                    let mut row = residual.row_mut(k);
                    row -= weight * offsets.row(knot);
                }
            }
            Ok(residual)
        })
        .collect()
    }

    /// The mean additive term of each output, experiments counted by their scored samples.
    pub(crate) fn mean_offsets(&self, record: &Record) -> RowDVector<f64> {
        let scored = record.scored() as f64;
        let parts = record.experiments().iter().zip(&self.offsets).map(|(e, knots)| {
            // the mean of a piecewise linear function: the end knots count half
            let n = knots.nrows();
            let weight = |knot: usize| if knot == 0 || knot + 1 == n { 0.5 } else { 1.0 };
            let total: f64 = (0..n).map(weight).sum();
            let rows = (0..n).map(|knot| knots.row(knot) * (weight(knot) / total));
            rows.fold(RowDVector::zeros(knots.ncols()), |sum, row| sum + row)
                * (e.scored() as f64 / scored)
        });
        parts.fold(RowDVector::zeros(self.dynamics.outputs()), |sum, part| sum + part)
    }

    /// The model, with the channels of the record `given`; `means` were taken from its outputs.
    pub(crate) fn to_model(
        &self,
        given: &Record,
        record: &Record,
        means: &[f64],
    ) -> Result<Model, Error> {
        let hysteresis: Result<_, _> = self.channels.iter().map(Parameters::to_operator).collect();
        let (inputs, outputs) = (given.inputs().to_vec(), given.outputs().to_vec());
        let rest = self.mean_offsets(record);
        let offsets = means.iter().zip(rest.iter()).map(|(mean, rest)| mean + rest);
        let linear = self.dynamics.to_state_space()?;
        let model =
            Model::new(given.rate(), inputs, outputs, hysteresis?, linear, offsets.collect())?;
        model.with_effects(self.blocks())
    }
}

/// Signals along the chain, each (samples, channels).
#[derive(Clone)]
pub(crate) struct Signals {
    /// The input as it reaches the hysteresis.
    pub drive: Matrix,
    /// v.
    pub intermediate: Matrix,
    /// What the dynamics make of it.
    pub displacement: Matrix,
}
