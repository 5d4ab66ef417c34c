//! How residuals count.

use super::whitening::Autoregression;
use crate::Matrix;
use nalgebra::DMatrixView;
use std::borrow::Cow;

/// Squares or Huber's loss of scaled residuals. For an output of scale s and turn t, a residual e costs
///
/// ```text
/// s^2 e^2             for |e| <= t
/// s^2 t (2 |e| - t)   beyond
/// ```
///
/// In normal equations the loss is that of weighted squares, with weight `s^2 min(1, t / |e|)`.
///
/// Where the noise of an output has a memory, e is what the residual's past does not predict (see
/// [`whitening`](super::whitening)).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Loss {
    /// A factor for each output, which brings outputs of different units to one scale.
    pub scales: Vec<f64>,
    /// Where the loss turns from square to linear, in each output's unit; infinite for least squares.
    pub turns: Vec<f64>,
    /// The memory of each output's noise.
    pub noise: Vec<Autoregression>,
}

impl Loss {
    /// Plain least squares.
    pub(crate) fn squares(outputs: usize) -> Self {
        let (scales, turns) = (vec![1.0; outputs], vec![f64::INFINITY; outputs]);
        Self { scales, turns, noise: vec![Autoregression::new(&[]); outputs] }
    }

    /// The same loss for noise without a memory.
    pub(crate) fn of_white_noise(&self) -> Self {
        Self { noise: vec![Autoregression::new(&[]); self.noise.len()], ..self.clone() }
    }

    /// Whether no output's noise has a memory.
    pub(crate) fn is_white(&self) -> bool {
        self.noise.iter().all(Autoregression::is_white)
    }

    /// What counts of a run of residuals of an output: themselves, or what their past does not predict.
    pub(crate) fn errors<'a>(&self, output: usize, run: &'a [f64]) -> Cow<'a, [f64]> {
        let noise = &self.noise[output];
        let mut run = Cow::Borrowed(run);
        if !noise.is_white() {
            noise.whiten(run.to_mut());
        }
        run
    }

    /// The same of all residuals (samples, outputs) of each experiment, as if it were one run.
    pub(crate) fn all_errors(&self, residuals: &[Matrix]) -> Vec<Matrix> {
        let mut errors = residuals.to_vec();
        for experiment in &mut errors {
            for (mut column, noise) in experiment.column_iter_mut().zip(&self.noise) {
                noise.whiten(column.as_mut_slice());
            }
        }
        errors
    }

    /// Turns a run of residuals of an output into what enters the gradient by them, and returns the loss.
    pub(crate) fn weigh(&self, output: usize, run: &mut [f64]) -> f64 {
        let noise = &self.noise[output];
        noise.whiten(run);
        let mut cost = 0.0;
        for value in run.iter_mut() {
            let (weight, own) = self.of(output, *value);
            cost += own;
            *value *= weight;
        }
        noise.whiten_adjoint(run);
        cost
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

    /// The sum of the losses of residuals, each a run (samples, outputs). It is infinite where they are no numbers, so that a model that
    /// diverges is worse than any other one.
    pub(crate) fn cost<'a>(&self, residuals: impl Iterator<Item = DMatrixView<'a, f64>>) -> f64 {
        let of = |rows: DMatrixView<f64>| -> f64 {
            let outputs = rows.column_iter().enumerate();
            let loss = |o: usize, run: &[f64]| -> f64 {
                self.errors(o, run).iter().map(|&e| self.of(o, e).1).sum()
            };
            outputs.map(|(o, column)| loss(o, column.as_slice())).sum()
        };
        let sum: f64 = residuals.map(of).sum();
        if sum.is_nan() { f64::INFINITY } else { sum }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;

    #[test]
    fn what_diverges_is_worse_than_all_else() {
        let of = |last: f64| {
            let residual = Matrix::from_column_slice(3, 1, &[1.0, 2.0, last]);
            Loss::squares(1).cost(std::iter::once(residual.rows(0, 3)))
        };
        assert_eq!(of(2.0), 9.0);
        assert_eq!([of(f64::NAN), of(f64::INFINITY)], [f64::INFINITY; 2]);
    }
}
