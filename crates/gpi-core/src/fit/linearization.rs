//! The model linearized around a point, gathered into normal equations.

use crate::chain::adjoint::descent;
use crate::chain::point::{Freedom, Layout, Point};
use crate::chain::stream::{Rows, Stream};
use crate::fit::minimize::FitOptions;
use crate::fit::representatives::{representatives, streamed};
use crate::linear::NormalEquations;
use crate::{Error, Matrix, Record};
use nalgebra::DVector;
use std::sync::mpsc::sync_channel;

/// How residuals count.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weighting {
    /// A factor for each output, which brings outputs of different units to one scale.
    pub outputs: Vec<f64>,
    /// Where Huber's loss turns from square to linear, in each output's unit; infinite for least
    /// squares.
    pub turns: Vec<f64>,
}

impl Weighting {
    /// Plain least squares.
    pub(crate) fn equal(outputs: usize) -> Self {
        Self { outputs: vec![1.0; outputs], turns: vec![f64::INFINITY; outputs] }
    }

    /// The factor of a residual's square, and the loss it adds to the cost.
    pub(crate) fn of(&self, output: usize, residual: f64) -> (f64, f64) {
        let (scale, turn) = (self.outputs[output].powi(2), self.turns[output]);
        let size = residual.abs();
        if size <= turn {
            (scale, scale * size * size)
        } else {
            (scale * turn / size, scale * turn * (2.0 * size - turn))
        }
    }
}

impl Weighting {
    /// The sum of the losses of residuals (samples, outputs) of each experiment.
    pub(crate) fn cost(&self, residuals: &[Matrix], record: &Record) -> f64 {
        let runs = residuals.iter().zip(record.experiments());
        let scored = runs.flat_map(|(residual, experiment)| experiment.scored_rows(residual));
        let losses = scored.map(|rows| {
            let outputs = rows.column_iter().enumerate();
            outputs
                .map(|(output, column)| column.iter().map(|&e| self.of(output, e).1).sum::<f64>())
                .sum::<f64>()
        });
        losses.sum()
    }

    /// Mean second derivative of the loss over the mean weight of the reweighted squares, which stand
    /// in for it in the normal equations: 1 for least squares.
    pub(crate) fn curvature(&self, residuals: &[Matrix], record: &Record) -> f64 {
        let (mut inside, mut weights) = (0.0, 0.0);
        for (residual, experiment) in residuals.iter().zip(record.experiments()) {
            for scored in experiment.scored_rows(residual) {
                for (output, column) in scored.column_iter().enumerate() {
                    let turn = self.turns[output];
                    inside += column.iter().filter(|value| value.abs() <= turn).count() as f64;
                    weights +=
                        column.iter().map(|value| (turn / value.abs()).min(1.0)).sum::<f64>();
                }
            }
        }
        if weights > 0.0 { inside / weights } else { 1.0 }
    }

    /// Turns residuals (samples, outputs) into what enters the gradient: scaled, and clipped where the loss is
    /// linear.
    pub(crate) fn apply(&self, residual: &mut Matrix) {
        for (output, mut column) in residual.column_iter_mut().enumerate() {
            let (scale, turn) = (self.outputs[output], self.turns[output]);
            column.apply(|value| *value = scale * value.clamp(-turn, turn));
        }
    }
}

/// Normal equations for steps away from a [`Point`].
#[derive(Clone)]
pub(crate) struct Linearization {
    pub equations: NormalEquations,
    pub layout: Layout,
    /// Sum of the losses.
    pub cost: f64,
    /// How many steps ago the curvature was worked out, where it is that of a few experiments.
    age: Option<usize>,
}

impl Linearization {
    /// Streams the record through the model and its derivatives. Where all of its derivatives would take long,
    /// the curvature is that of a few experiments; the gradient is always that of the whole record.
    pub(crate) fn new(
        point: &Point,
        record: &Record,
        freedom: Freedom,
        weighting: &Weighting,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let layout = Layout::new(point, freedom);
        let few = representatives(point, record, layout.len);
        let mut gathered = Gathered::new(layout.len);
        for (index, experiment, memory) in streamed(few.as_ref(), record) {
            check()?;
            let stream = Stream::new(point, &layout, freedom.derivatives, experiment, index)?;
            gather(stream.with_memory(memory), check, |rows| gathered.add(rows, weighting))?;
        }
        let Gathered { mut equations, mut cost } = gathered;
        let age = few.is_some().then_some(0);
        if let Some(few) = few {
            few.extend(&mut equations.gram, &layout, record);
            let (descent, whole) = descent(point, &layout, freedom, weighting, record, check)?;
            equations.rhs.set_column(0, &descent);
            cost = whole;
        }
        Ok(Self { equations, cost, layout, age })
    }

    /// A step on: where the curvature is that of a few experiments, it is kept for a while, with what the
    /// gradients at both ends of the step say of it.
    pub(crate) fn moved(
        &self,
        step: &DVector<f64>,
        point: &Point,
        record: &Record,
        options: &FitOptions,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        const OLDEST: usize = 12;
        let FitOptions { freedom, weighting, .. } = options;
        let Some(age) = self.age.filter(|&age| age < OLDEST) else {
            return Self::new(point, record, *freedom, weighting, check);
        };
        let (descent, cost) = descent(point, &self.layout, *freedom, weighting, record, check)?;
        let mut moved = Self { cost, age: Some(age + 1), ..self.clone() };
        moved.learn(step, &(self.descent() - &descent));
        moved.equations.rhs.set_column(0, &descent);
        Ok(moved)
    }

    /// Makes the curvature along a step that of the change of the gradient (Broyden, Fletcher, Goldfarb and Shanno,
    /// damped as Powell does where it would not stay positive).
    fn learn(&mut self, step: &DVector<f64>, change: &DVector<f64>) {
        const LEAST: f64 = 0.2;
        let gram = &mut self.equations.gram;
        let expected = &*gram * step;
        let (found, power) = (step.dot(change), step.dot(&expected));
        if power <= 0.0 {
            return;
        }
        let trust =
            if found >= LEAST * power { 1.0 } else { (1.0 - LEAST) * power / (power - found) };
        let change = trust * change + (1.0 - trust) * &expected;
        gram.ger(-1.0 / power, &expected, &expected, 1.0);
        gram.ger(1.0 / step.dot(&change), &change, &change, 1.0);
    }

    /// Whether the curvature is that of a few experiments.
    pub(crate) fn is_of_few(&self) -> bool {
        self.age.is_some()
    }

    /// Whether the curvature is that of an earlier point.
    pub(crate) fn is_old(&self) -> bool {
        self.age.is_some_and(|age| age > 0)
    }

    /// Half the steepest descent of the cost.
    pub(crate) fn descent(&self) -> DVector<f64> {
        self.equations.rhs.column(0).into_owned()
    }

    /// By how much the cost falls with a step if the model were linear.
    pub(crate) fn predicted(&self, step: &DVector<f64>) -> f64 {
        2.0 * step.dot(&self.descent()) - (&self.equations.gram * step).dot(step)
    }
}

/// Streams an experiment on this thread and gathers its blocks of rows on another one.
pub(crate) fn gather(
    mut stream: Stream,
    check: &mut dyn FnMut() -> Result<(), Error>,
    mut add: impl FnMut(Rows) + Send,
) -> Result<(), Error> {
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<Rows>(4);
        let gathering = scope.spawn(move || receive.iter().for_each(&mut add));
        let streamed = stream.run(&mut |rows| {
            check()?;
            // only a panic ends the other thread early, and joining it tells
            let _ = send.send(rows);
            Ok(())
        });
        drop(send);
        gathering.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        streamed
    })
}

/// Rows gathered so far.
struct Gathered {
    equations: NormalEquations,
    cost: f64,
}

impl Gathered {
    fn new(unknowns: usize) -> Self {
        Self { equations: NormalEquations::zeros(unknowns, 1), cost: 0.0 }
    }

    /// Adds a block.
    fn add(&mut self, rows: Rows, weighting: &Weighting) {
        for (output, mut regressor) in rows.regressors.into_iter().enumerate() {
            let mut target = rows.residuals.row(output).into_owned();
            for (mut row, value) in regressor.column_iter_mut().zip(target.iter_mut()) {
                let (weight, loss) = weighting.of(output, *value);
                self.cost += loss;
                row *= weight.sqrt();
                *value *= weight.sqrt();
            }
            let target = Matrix::from_row_slice(1, target.len(), target.as_slice());
            self.equations.add(&regressor, &target);
        }
    }
}
