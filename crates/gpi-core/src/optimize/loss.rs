//! How residuals count.

use crate::Matrix;
use nalgebra::DMatrixView;

/// Squares or Huber's loss of scaled residuals. For an output of scale s and turn t, a residual e costs
///
/// ```text
/// s^2 e^2             for |e| <= t
/// s^2 t (2 |e| - t)   beyond
/// ```
///
/// In normal equations the loss is that of weighted squares, with weight `s^2 min(1, t / |e|)`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Loss {
    /// A factor for each output, which brings outputs of different units to one scale.
    pub scales: Vec<f64>,
    /// Where the loss turns from square to linear, in each output's unit; infinite for least squares.
    pub turns: Vec<f64>,
}

impl Loss {
    /// Plain least squares.
    pub(crate) fn squares(outputs: usize) -> Self {
        Self { scales: vec![1.0; outputs], turns: vec![f64::INFINITY; outputs] }
    }

    /// The weight of a residual's square in normal equations, and the loss that it adds to the cost.
    pub(crate) fn of(&self, output: usize, residual: f64) -> (f64, f64) {
        let (scale, turn) = (self.scales[output].powi(2), self.turns[output]);
        let size = residual.abs();
        if size <= turn {
            (scale, scale * size * size)
        } else {
            (scale * turn / size, scale * turn * (2.0 * size - turn))
        }
    }

    /// The sum of the losses of residuals, each a block (samples, outputs).
    pub(crate) fn cost<'a>(&self, residuals: impl Iterator<Item = DMatrixView<'a, f64>>) -> f64 {
        let of = |rows: DMatrixView<f64>| -> f64 {
            let outputs = rows.column_iter().enumerate();
            outputs.map(|(o, column)| column.iter().map(|&e| self.of(o, e).1).sum::<f64>()).sum()
        };
        residuals.map(of).sum()
    }

    /// The mean second derivative of the loss over the mean weight that stands in for it in the normal equations:
    /// 1 for least squares.
    pub(crate) fn curvature<'a>(
        &self,
        residuals: impl Iterator<Item = DMatrixView<'a, f64>>,
    ) -> f64 {
        let (mut inside, mut weights) = (0.0, 0.0);
        for rows in residuals {
            for (column, turn) in rows.column_iter().zip(&self.turns) {
                inside += column.iter().filter(|value| value.abs() <= *turn).count() as f64;
                weights += column.iter().map(|value| (turn / value.abs()).min(1.0)).sum::<f64>();
            }
        }
        if weights > 0.0 { inside / weights } else { 1.0 }
    }

    /// Turns residuals (samples, outputs) into what enters the gradient: scaled, and clipped where the loss is
    /// linear.
    pub(crate) fn apply(&self, residuals: &mut Matrix) {
        for (output, mut column) in residuals.column_iter_mut().enumerate() {
            let (scale, turn) = (self.scales[output], self.turns[output]);
            column.apply(|value| *value = scale * value.clamp(-turn, turn));
        }
    }
}
