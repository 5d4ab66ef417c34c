//! What a solver asks of a problem.

use super::Linearization;
use nalgebra::DVector;

/// Called between pieces of work; its error ends the work.
pub(crate) type Check<'a, E> = &'a mut dyn FnMut() -> Result<(), E>;

/// What a step may be, elementwise: `lower <= step <= upper` with `lower <= 0 <= upper`. An unknown that is held
/// has both bounds at zero.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
    pub lower: DVector<f64>,
    pub upper: DVector<f64>,
}

impl Bounds {
    /// No bound on any of the unknowns.
    pub(crate) fn none(unknowns: usize) -> Self {
        let upper = DVector::from_element(unknowns, f64::INFINITY);
        Self { lower: -&upper, upper }
    }

    /// The unknowns that may move.
    pub(crate) fn estimated(&self) -> Vec<usize> {
        self.select(|low, high| low < high)
    }

    /// The unknowns that may move in both directions: neither held nor at a bound.
    pub(crate) fn free(&self) -> Vec<usize> {
        self.select(|low, high| low < 0.0 && high > 0.0)
    }

    fn select(&self, wanted: impl Fn(f64, f64) -> bool) -> Vec<usize> {
        (0..self.lower.len()).filter(|&i| wanted(self.lower[i], self.upper[i])).collect()
    }
}

/// A sum of losses of residuals that depends on a point.
pub(crate) trait LeastSquares {
    /// The unknowns, and whatever else belongs to them.
    type Point: Clone;
    /// Why an evaluation failed, or was interrupted.
    type Error;

    /// The cost of a point.
    fn evaluate(&self, point: &Self::Point) -> Result<f64, Self::Error>;

    /// The quadratic model of the cost around a point.
    fn linearize(
        &self,
        point: &Self::Point,
        check: Check<Self::Error>,
    ) -> Result<Linearization, Self::Error>;

    /// Half the steepest descent of the cost, and the cost: asked for where the curvature of
    /// [`LeastSquares::linearize`] is approximate, so that it is kept for several steps.
    fn gradient(
        &self,
        point: &Self::Point,
        check: Check<Self::Error>,
    ) -> Result<(DVector<f64>, f64), Self::Error> {
        self.linearize(point, check).map(|found| (found.descent, found.cost))
    }

    /// What a step away from a point may be.
    fn bounds(&self, point: &Self::Point) -> Bounds;

    /// The point one step away.
    fn step(&self, point: &Self::Point, step: &DVector<f64>) -> Self::Point;

    /// Whether the residuals are linear in an unknown while all others are kept: its step needs no damping.
    fn is_linear(&self, unknown: usize) -> bool;

    /// A cost that consists of rounding errors alone.
    fn rounding(&self) -> f64;
}
