//! A point run free over a record, and the model that it is.
//!
//! The chain is `u -> drive -> v -> displacement -> output`, and [`Signals`] keeps the signal at each joint. A change
//! at a stage leaves everything before it as it was, so that the output of a changed point is computed from that joint
//! on:
//!
//! | change at | starts from | computes |
//! |---|---|---|
//! | [`Stage::Input`] | u | drive, v, displacement, output |
//! | [`Stage::Plays`] | drive | v, displacement, output |
//! | [`Stage::Dynamics`] | v | displacement, output |
//! | [`Stage::Output`] | displacement and what is added to it | output |
//! | what is added | displacement | what is added, output |
//!
//! A free run depends on the input and on the initial state only, never on the measured output. The displacement begins
//! in the steady state of v(0); at the end of the warm-up the unknown part of the initial state is added to x. The dead
//! time of L samples drives G by `v(max(k - L, 0))`.

use super::forward::hats;
use super::loops::loops_of;
use super::motion::Motion;
use super::plays::Plays;
use super::point::{Past, Point};
use super::stages::Stages;
use crate::chain::hysteresis::Parameters;
use crate::effects::{InnerLoop, PlayCurves, Stage};
use crate::linear::{Section, Sections};
use crate::parallel::install;
use crate::{Error, Experiment, Matrix, Model, Record};
use nalgebra::{DVector, RowDVector};
use rayon::prelude::*;

impl Point {
    /// Other dynamics, which were in steady state before the record.
    pub(crate) fn replace_dynamics(&mut self, dynamics: Sections) {
        self.splice_states(0..self.dynamics.order(), &vec![0.0; dynamics.order()]);
        self.dynamics = dynamics;
    }

    /// The same with a section of G that contributes nothing to the output.
    pub(crate) fn without_output_of(&self, section: usize) -> Self {
        let mut point = self.clone();
        let before: usize = point.dynamics.sections[..section].iter().map(Section::order).sum();
        let own = &mut point.dynamics.sections[section];
        own.b.fill(0.0);
        let order = own.order();
        point.splice_states(before..before + order, &vec![0.0; order]);
        point
    }

    /// The stages before the hysteresis and after the dynamics.
    pub(crate) fn stages(&self) -> Stages<'_> {
        Stages { effects: &self.effects, rate: self.rate, first: 0 }
    }

    /// The plays of an input at rest, with the effects on them.
    pub(crate) fn plays(&self, input: usize) -> Plays<'_> {
        self.channels[input].plays(&self.effects, input, self.rate)
    }

    /// The drive (samples, inputs) that reaches the hysteresis.
    pub(crate) fn drive(&self, experiment: &Experiment) -> Matrix {
        let mut drive = experiment.input.clone();
        let stages = self.stages();
        stages.drive(&mut stages.memories(), &mut drive);
        drive
    }

    /// The intermediate signals v (samples, inputs) of a drive.
    pub(crate) fn intermediate(&self, drive: &Matrix, past: &Past) -> Matrix {
        let mut v = drive.clone();
        let columns = v.as_mut_slice().chunks_exact_mut(drive.nrows());
        for ((input, channel), column) in self.channels.iter().enumerate().zip(columns) {
            let start = past.plays.as_ref().map(|plays| &plays[input][..]);
            channel.apply(start, self.plays(input), column);
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
        let mut motion = Motion::new(self);
        // behind the dead time of G
        let (samples, delay) = (v.nrows(), self.dynamics.delay);
        let late =
            Matrix::from_fn(v.ncols(), samples, |input, k| v[(k.saturating_sub(delay), input)]);
        let at = |k: usize| late.column(k.min(samples - 1)).data.into_slice();
        motion.stand(at(0));
        let jump = past.has_unknown_state.then_some((experiment.warmup, past.state.as_slice()));
        if self.loops().next().is_none() {
            return Ok(motion.respond(&late, jump).transpose());
        }
        let mut displacement = Matrix::zeros(samples, self.dynamics.outputs());
        for k in 0..samples {
            if let Some((_, jump)) = jump.filter(|(at, _)| *at == k) {
                motion.state.iter_mut().zip(jump).for_each(|(x, own)| *x += own);
            }
            motion.observe(at(k));
            for (output, y) in motion.displacement.iter().enumerate() {
                displacement[(k, output)] = *y;
            }
            motion.advance(at(k), at(k + 1));
        }
        Ok(displacement)
    }

    /// The state at the end of the warm-up of an experiment, before an unknown part is added.
    fn arrival(&self, experiment: &Experiment, index: usize) -> DVector<f64> {
        let count = experiment.warmup + 1;
        let begin = Experiment {
            input: experiment.input.rows(0, count).into_owned(),
            output: experiment.output.rows(0, count).into_owned(),
            covariates: experiment.covariates.rows(0, count).into_owned(),
            warmup: 0,
            held_out: Vec::new(),
        };
        let v = self.intermediate(&self.drive(&begin), &self.pasts[index]).transpose();
        let at = |k: usize| v.column(k.saturating_sub(self.dynamics.delay)).data.into_slice();
        let mut motion = Motion::new(self);
        motion.stand(at(0));
        (0..experiment.warmup).for_each(|k| motion.advance(at(k), at(k + 1)));
        DVector::from_vec(motion.state)
    }

    /// Keeps the initial states of all experiments as they are in a point of the same structure from which a step has led here. A change of
    /// what the steady state has become at the end of the warm-up is subtracted from the unknown part.
    pub(crate) fn keep_whole_states(&mut self, before: &Self, record: &Record) {
        for (index, experiment) in record.experiments().iter().enumerate() {
            if self.pasts[index].has_unknown_state {
                let change = before.arrival(experiment, index) - self.arrival(experiment, index);
                self.pasts[index].state += change;
            }
        }
    }

    /// The loops that effects close around G.
    pub(crate) fn loops(&self) -> impl Iterator<Item = &InnerLoop> {
        loops_of(&self.effects)
    }

    /// The curves through which plays are read.
    pub(crate) fn play_curves(&self) -> impl Iterator<Item = &dyn PlayCurves> {
        self.effects.iter().filter_map(|effect| effect.place().play_curves())
    }

    /// Whether the model has an output stage.
    pub(crate) fn senses(&self) -> bool {
        self.output_stages().next().is_some()
    }

    /// The signals along the chain.
    pub(crate) fn signals(&self, experiment: &Experiment, index: usize) -> Result<Signals, Error> {
        let past = &self.pasts[index];
        let drive = self.drive(experiment);
        let intermediate = self.intermediate(&drive, past);
        let displacement = self.displacement(&intermediate, experiment, past)?;
        let added = self.added(experiment);
        Ok(Signals { drive, intermediate, displacement, added })
    }

    /// What effects add before the output stage and after it, each (samples, outputs).
    pub(super) fn added(&self, experiment: &Experiment) -> [Matrix; 2] {
        let stages = self.stages();
        [true, false].map(|moves_stage| {
            let mut added = Matrix::zeros(experiment.input.nrows(), self.dynamics.outputs());
            stages.add(&mut stages.memories(), moves_stage, &experiment.covariates, &mut added);
            added
        })
    }

    /// The output (samples, outputs) without its offsets, of a displacement and of what is added before and after the output stage.
    fn reading(
        &self,
        mut displacement: Matrix,
        [before, after]: &[Matrix; 2],
        index: usize,
    ) -> Matrix {
        let stages = self.stages();
        displacement += before;
        let side = |output: usize| self.pasts[index].side(output);
        stages.sense(&mut stages.memories(), &side, &mut displacement);
        displacement + after
    }

    /// The output (samples, outputs) of an experiment without its offsets.
    pub(crate) fn output(&self, signals: &Signals, index: usize) -> Matrix {
        self.reading(signals.displacement.clone(), &signals.added, index)
    }

    /// The output (samples, outputs) without its offsets, from the stage on at which `known` ends.
    pub(crate) fn output_from(
        &self,
        stage: Stage,
        known: &Signals,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Matrix, Error> {
        let displacement = self.displacement_from(stage, known, experiment, index)?;
        if matches!(stage, Stage::Displaced | Stage::Added) {
            return Ok(self.reading(displacement, &self.added(experiment), index));
        }
        Ok(self.reading(displacement, &known.added, index))
    }

    /// The displacement (samples, outputs), from the stage on at which `known` ends.
    fn displacement_from(
        &self,
        stage: Stage,
        known: &Signals,
        experiment: &Experiment,
        index: usize,
    ) -> Result<Matrix, Error> {
        let past = &self.pasts[index];
        let v = match stage {
            Stage::Input => self.intermediate(&self.drive(experiment), past),
            Stage::Plays => self.intermediate(&known.drive, past),
            Stage::Dynamics => return self.displacement(&known.intermediate, experiment, past),
            _ => return Ok(known.displacement.clone()),
        };
        self.displacement(&v, experiment, past)
    }

    /// What the output gains by a change of this point at a stage: its output less that of the point whose signals are `known`
    /// and whose output is `here`. Without an output stage, that is the change of the displacement.
    pub(crate) fn gain_from(
        &self,
        stage: Stage,
        (known, here): (&Signals, &Matrix),
        experiment: &Experiment,
        index: usize,
    ) -> Result<Matrix, Error> {
        if self.senses() || stage > Stage::Dynamics {
            return Ok(self.output_from(stage, known, experiment, index)? - here);
        }
        Ok(self.displacement_from(stage, known, experiment, index)? - &known.displacement)
    }

    /// Measured minus simulated outputs of each experiment, (samples, outputs), warm-ups included.
    pub(crate) fn residuals(&self, record: &Record) -> Result<Vec<Matrix>, Error> {
        let runs = record.experiments().par_iter().zip(&self.offsets).enumerate();
        let residual = |(index, (experiment, offsets)): (usize, (&Experiment, &Matrix))| {
            let samples = experiment.input.nrows();
            let known = self.signals(experiment, index)?;
            let mut residual = &experiment.output - self.output(&known, index);
            for k in 0..samples {
                for (knot, weight) in hats(k, samples, offsets.nrows()) {
                    let mut row = residual.row_mut(k);
                    row -= weight * offsets.row(knot);
                }
            }
            Ok(residual)
        };
        install(|| runs.map(residual).collect())
    }

    /// The mean additive term of each output, experiments counted by their scored samples: the mean over the whole length of
    /// an experiment, warm-up and held-out samples included.
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
        let model = model.with_effects(self.blocks())?;
        let has_loops = self.loops().next().is_some();
        if has_loops { model.with_intersample(self.intersample) } else { Ok(model) }
    }
}

impl Signals {
    /// Of no samples, where none are asked for.
    pub(crate) fn none() -> Self {
        let none = || Matrix::zeros(0, 0);
        Self { drive: none(), intermediate: none(), displacement: none(), added: [none(), none()] }
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
    /// What effects add before the output stage and after it.
    pub added: [Matrix; 2],
}
