//! The model linearized around a point, gathered into normal equations.

use super::point::{Freedom, Layout, Point};
use super::stream::{Rows, Stream};
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
}

impl Linearization {
    /// Streams the record through the model and its derivatives.
    pub(crate) fn new(
        point: &Point,
        record: &Record,
        freedom: Freedom,
        weighting: &Weighting,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let layout = Layout::new(point, freedom);
        let mut gathered = Gathered::new(layout.len);
        for (index, experiment) in record.experiments().iter().enumerate() {
            check()?;
            let stream = Stream::new(point, &layout, freedom.derivatives, experiment, index)?;
            gather(stream, check, |rows| gathered.add(rows, weighting))?;
        }
        Ok(Self { equations: gathered.equations, cost: gathered.cost, layout })
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
