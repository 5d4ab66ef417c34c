//! The quadratic model of a cost.

use crate::linear::Arrow;
use nalgebra::DVector;

/// Around a point x, `cost(x + s) = cost - 2 descent' s + s' gram s`, with `gram = J' W J` and
/// `descent = J' W e`: J the derivatives of the model's outputs, W the weights of the loss, e the residuals.
#[derive(Clone, Debug)]
pub(crate) struct Linearization {
    /// The Gauss-Newton approximation of half the cost's Hessian matrix.
    pub gram: Arrow,
    /// Half the steepest descent of the cost.
    pub descent: DVector<f64>,
    pub cost: f64,
    /// Where `gram` is an estimate from a part of the residuals: the number of steps since it was computed.
    pub age: Option<usize>,
}

impl Linearization {
    /// Whether `gram` is an estimate from a part of the residuals.
    pub(crate) fn is_approximate(&self) -> bool {
        self.age.is_some()
    }

    /// Whether `gram` belongs to an earlier point.
    pub(super) fn is_old(&self) -> bool {
        self.age.is_some_and(|age| age > 0)
    }

    /// By how much the model lets the cost fall with a step.
    pub(super) fn predicted(&self, step: &DVector<f64>) -> f64 {
        2.0 * step.dot(&self.descent) - self.gram.times(step).dot(step)
    }

    /// The model after a step to a point of known gradient and cost: the curvature is kept, and along the step it
    /// is made that of the gradient's change.
    ///
    /// This is the update of Broyden, Fletcher, Goldfarb and Shanno, damped as M. J. D. Powell proposed (1978):
    /// where the change of the gradient shows less than the part `least` of the expected curvature, it is mixed with
    /// the expected one, so that the matrix stays positive definite.
    pub(super) fn updated(
        &self,
        step: &DVector<f64>,
        (descent, cost): (DVector<f64>, f64),
        least: f64,
    ) -> Self {
        let mut gram = self.gram.to_dense();
        let change = &self.descent - &descent;
        let expected = &gram * step;
        let (found, power) = (step.dot(&change), step.dot(&expected));
        if power > 0.0 {
            let trust =
                if found >= least * power { 1.0 } else { (1.0 - least) * power / (power - found) };
            let change = trust * change + (1.0 - trust) * &expected;
            gram.ger(-1.0 / power, &expected, &expected, 1.0);
            gram.ger(1.0 / step.dot(&change), &change, &change, 1.0);
        }
        Self { gram: gram.into(), descent, cost, age: self.age.map(|age| age + 1) }
    }
}
