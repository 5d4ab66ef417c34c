//! One experiment streamed through the chain and through all of its derivatives, block by block.
//!
//! [`Forward`] simulates a block of samples and records what its derivatives need as a [`Trace`]. [`Tangents`] then
//! takes all unknowns through the same block. The two work at the same time on two threads, the simulation some blocks
//! ahead, where the experiment is long enough to pay for a thread. [`super::adjoint`] needs the traces of all blocks,
//! from the last to the first.

use super::forward::{Forward, hats};
use super::group::Group;
use super::injections::Signals;
use super::point::Point;
use super::sensitivity::Derivatives;
use super::table::Table;
use super::tangents::{Tangents, Trace};
use crate::{Error, Experiment, Matrix};
use std::ops::Range;
use std::sync::mpsc::sync_channel;

/// Blocks of an experiment that pay for another thread, whose start takes as long as a part of a block. By hand.
const PARALLEL: usize = 8;

/// Blocks by which the simulation may be ahead: their traces stay in the cache. By hand.
const AHEAD: usize = 2;

/// Residuals and derivatives of a block of scored samples of one experiment.
pub(crate) struct Rows {
    /// For each output, (unknowns, samples).
    pub regressors: Vec<Matrix>,
    /// Measured minus simulated, (outputs, samples).
    pub residuals: Matrix,
    /// Samples of these before which samples of the experiment are left out.
    pub begins: Vec<usize>,
}

/// Streams one experiment and hands its rows on block by block.
pub(crate) struct Stream<'a> {
    forward: Forward<'a>,
    behind: Behind<'a>,
}

/// What makes derivatives of traces.
struct Behind<'a> {
    point: &'a Point,
    experiment: &'a Experiment,
    index: usize,
    tangents: Tangents<'a>,
    unknowns: usize,
    /// Derivatives by the values of effects, `[effect][value]`, then by the places in the gaps.
    effects: Vec<Vec<Matrix>>,
    /// Where the unknowns of the offsets stand, and those of each effect and of the gaps.
    offset_unknowns: usize,
    effect_unknowns: Vec<Range<usize>>,
    /// The sample from which on derivatives are taken along.
    tangents_from: usize,
}

impl<'a> Stream<'a> {
    pub(crate) fn new(
        point: &'a Point,
        table: &Table,
        wanted: Derivatives,
        experiment: &'a Experiment,
        index: usize,
    ) -> Result<Self, Error> {
        let signals = Signals::new(point, wanted);
        let behind = Behind {
            tangents: Tangents::new(point, table, signals, experiment, index),
            unknowns: table.len,
            effects: point.effect_columns(experiment, index)?,
            offset_unknowns: table.range(Group::Offsets { experiment: index }).start,
            effect_unknowns: (0..point.effects.len())
                .map(|place| Group::Effect { place })
                .chain([Group::Gaps { experiment: index }])
                .map(|group| table.range(group))
                .collect(),
            tangents_from: 0,
            point,
            experiment,
            index,
        };
        Ok(Self { forward: Forward::new(point, wanted, experiment, index), behind })
    }

    /// Takes derivatives along from so many samples before the first scored one only: what they were before
    /// has decayed. The simulation itself runs from the first sample, so that the residuals are exact. The derivatives of
    /// v keep their whole history too; only their responses in G, loops and output stage are cut, in whole blocks.
    pub(crate) fn with_memory(mut self, samples: usize) -> Self {
        let first = self.behind.experiment.scored_runs().next().map_or(0, |run| run.start);
        self.behind.tangents_from = first.saturating_sub(samples);
        self
    }

    /// Whether the experiment is too short to pay for another thread.
    pub(crate) fn is_short(&self) -> bool {
        self.forward.scored_blocks().len() < PARALLEL
    }

    /// Hands the rows of all scored samples on.
    pub(crate) fn run(
        &mut self,
        consume: &mut dyn FnMut(Rows) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let is_short = self.is_short();
        let Self { forward, behind } = self;
        let mut traces = forward.scored_blocks().map(|first| forward.pass(first));
        if is_short {
            return behind.run(&mut traces, consume);
        }
        std::thread::scope(|scope| {
            let (send, receive) = sync_channel(AHEAD);
            // the receiver is gone where `consume` has failed
            let ahead = scope.spawn(move || traces.try_for_each(|trace| send.send(trace).ok()));
            let done = behind.run(&mut receive.into_iter(), consume);
            if let Err(panic) = ahead.join() {
                std::panic::resume_unwind(panic);
            }
            done
        })
    }

    /// The traces of all blocks, and the residuals (outputs, scored samples) of each.
    pub(crate) fn traces(&mut self) -> Vec<(Trace, Matrix)> {
        self.forward.blocks().map(|first| self.forward.pass(first)).collect()
    }

    /// What the traces hold.
    pub(crate) fn signals(&self) -> &Signals {
        self.behind.tangents.signals()
    }

    /// Calls `each` with the derivatives of what is added behind the output stage, and by the values of effects
    /// whose own do not stream along.
    pub(crate) fn added(&self, output: usize, k: usize, each: impl FnMut(usize, f64)) {
        self.behind.added(output, k, each);
    }
}

impl Behind<'_> {
    /// Hands the rows of all scored samples of some traces on.
    fn run(
        &mut self,
        traces: &mut dyn Iterator<Item = (Trace, Matrix)>,
        consume: &mut dyn FnMut(Rows) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut next = None;
        for (trace, residuals) in traces {
            if trace.samples.end <= self.tangents_from {
                continue;
            }
            let rows = || Matrix::zeros(self.unknowns, trace.scored.len());
            let mut regressors: Vec<Matrix> =
                (0..self.point.dynamics.outputs()).map(|_| rows()).collect();
            self.tangents.run(&trace, &mut regressors);
            if trace.scored.is_empty() {
                continue;
            }
            for (output, regressor) in regressors.iter_mut().enumerate() {
                for (mut row, k) in regressor.column_iter_mut().zip(&trace.scored) {
                    let k = trace.samples.start + k;
                    self.added(output, k, |unknown, derivative| row[unknown] = derivative);
                }
            }
            let begins = begins(&trace, &mut next);
            consume(Rows { regressors, residuals, begins })?;
        }
        Ok(())
    }

    fn added(&self, output: usize, k: usize, mut each: impl FnMut(usize, f64)) {
        let knots = self.point.offsets[self.index].nrows();
        let first = self.offset_unknowns + output * knots;
        for (knot, weight) in hats(k, self.experiment.input.nrows(), knots) {
            each(first + knot, weight);
        }
        for (columns, unknowns) in self.effects.iter().zip(&self.effect_unknowns) {
            for (column, unknown) in columns.iter().zip(unknowns.clone()) {
                each(unknown, column[(k, output)]);
            }
        }
    }
}

/// The scored samples of a block that do not follow on the scored sample before them; `next` is the sample behind the
/// latest scored one.
fn begins(trace: &Trace, next: &mut Option<usize>) -> Vec<usize> {
    let is_new = |(_, k): &(usize, &usize)| {
        let sample = trace.samples.start + **k;
        next.replace(sample + 1) != Some(sample)
    };
    trace.scored.iter().enumerate().filter(is_new).map(|(place, _)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::point::{DynamicsFreedom, Freedom};
    use crate::effects::{Drives, InnerLoop, Law, Sees, Stiffness};
    use crate::fit::preparation::Prepared;
    use crate::linear::StateSpace;
    use crate::operators::{Deadzones, Gpi, PlayBank, Reading};
    use crate::optimize::Bounds;
    use crate::{Channel, Model, Record};
    use nalgebra::DVector;

    /// Poles at 0.9995 and 0.9, with a spring and a damping that depend on the displacement and its speed, around which something goes
    /// from the first sample on.
    fn slow() -> (Model, Record) {
        let linear = StateSpace::new(
            Matrix::from_row_slice(2, 2, &[1.8995, 1.0, -0.89955, 0.0]),
            Matrix::from_column_slice(2, 1, &[2e-4, 3e-4]),
            Matrix::from_row_slice(1, 2, &[1.0, 0.0]),
            Matrix::zeros(1, 1),
        );
        let zones = Deadzones::new(vec![0.0, 0.4], vec![1.0, 0.3], Reading::OneSided);
        let plays = PlayBank::new(vec![0.0, 0.3], vec![0.8, 0.4]).unwrap();
        let (sees, force) = (Sees::Output(0), |force| Drives::Input { input: 0, force, states: 2 });
        let cubic = Law::Power { exponent: 3, scale: 2.0 };
        let loops = vec![
            InnerLoop { sees: sees.clone(), law: cubic, drives: force(0.02) },
            InnerLoop { sees: sees.clone(), law: Law::Damping { scale: 0.2 }, drives: force(0.03) },
            InnerLoop {
                sees,
                law: Law::Power { exponent: 2, scale: 2.0 },
                drives: Drives::States(vec![-2e-6, 1e-6]),
            },
        ];
        let (u, y) = (vec![Channel::new("u", "")], vec![Channel::new("y", "")]);
        let hysteresis = vec![Gpi::new(zones.unwrap(), plays)];
        let model = Model::new(100.0, u.clone(), y.clone(), hysteresis, linear.unwrap(), vec![0.0]);
        let model = model.and_then(|model| model.with_effects(vec![Stiffness { loops }.into()]));
        let run = Experiment {
            input: Matrix::from_fn(500, 1, |k, _| 1.0 + (0.05 * k as f64 + 1.0).sin()),
            output: Matrix::from_fn(500, 1, |k, _| 1.5 - 0.001 * k as f64),
            covariates: Matrix::zeros(500, 0),
            warmup: 0,
            held_out: vec![],
        };
        (model.unwrap(), Record::new(vec![run], 100.0, u, y, vec![]).unwrap())
    }

    /// What is before the end of a warm-up is before the first sample, or in the record.
    #[test]
    fn derivatives_of_a_slow_plant_that_begins_in_motion_are_those_of_differences() {
        let (model, record) = slow();
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::scoring_all(&record, channels).unwrap();
        for (growth, warmup) in [(1.0, 0), (1.01, 0), (1.01, 20)] {
            let mut point = prepared.point_of(&model).unwrap();
            point.dynamics.sections.iter_mut().for_each(|section| section.growth = growth);
            point.dynamics.held = vec![None];
            point.pasts[0].state.iter_mut().zip([0.7, -0.65]).for_each(|(x, own)| *x = own);
            let mut run = prepared.record.experiments()[0].clone();
            run.warmup = warmup;
            compare(&point, &prepared.record.with_experiments(vec![run]).unwrap());
        }
    }

    /// All columns in both forms of the table with central differences of the simulation.
    fn compare(point: &Point, record: &Record) {
        let derivatives = Derivatives { thresholds: true, half_widths: true, starts: true };
        let freedom = Freedom {
            weights: true,
            offsets: true,
            derivatives,
            states: true,
            identity: true,
            dynamics: DynamicsFreedom::Everything,
        };
        let plain = Table::new(point, freedom);
        let solved = plain.clone().for_solver(point, &Bounds::none(plain.len));
        assert!(solved.pairs().len() == 4 && solved.has_whole_states());
        for table in [plain, solved] {
            let experiment = &record.experiments()[0];
            let mut found = Matrix::zeros(0, table.len);
            let mut stream = Stream::new(point, &table, derivatives, experiment, 0).unwrap();
            let mut add = |rows: Rows| {
                let (first, count) = (found.nrows(), rows.residuals.ncols());
                found.resize_vertically_mut(first + count, 0.0);
                found.rows_mut(first, count).copy_from(&rows.regressors[0].transpose());
                Ok(())
            };
            stream.run(&mut add).unwrap();
            let names = table.names(point, record);
            for unknown in point.bounds(&table, record, freedom).estimated() {
                let column = found.column(unknown);
                let size = (1e-5 / column.amax()).min(1e-4);
                let mut step = DVector::zeros(table.len);
                let mut moved = |by: f64| {
                    step[unknown] = by;
                    let mut moved = point.moved(&step, &table);
                    if table.has_whole_states() {
                        moved.keep_whole_states(point, record);
                    }
                    let residuals = moved.residuals(record).unwrap().remove(0);
                    residuals.rows(experiment.warmup, found.nrows()).into_owned()
                };
                let difference = (moved(-size) - moved(size)) / (2.0 * size);
                let error = (difference - column).amax() / column.amax();
                assert!(error < 1e-4, "{}: {error}", names[unknown]);
            }
        }
    }
}
