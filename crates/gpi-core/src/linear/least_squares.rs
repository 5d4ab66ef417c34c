//! Least squares from normal equations, with bounds on the unknowns.

use super::arrow::{Arrow, ArrowSolver};
use crate::Matrix;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::DVector;

type Vector = DVector<f64>;

/// Relative increases of the diagonal of the Gram matrix, of which the smallest is taken that makes it positive definite: far below what
/// data determine. The first is above the rounding error of most sums of squares. That of a decomposition grows with the number of
/// unknowns that depend on each other.
const REGULARIZATIONS: [f64; 3] = [1e-14, 1e-12, 1e-10];

/// A gradient below this fraction of the largest right side counts as zero: above its rounding error, so that rounding
/// does not free an unknown at its bound.
const SLACK: f64 = 1e-12;

/// Exchanges of whole sets of unknowns that may leave as many at a wrong place as before, until one at a time is exchanged.
const PATIENCE: usize = 10;

/// Exchanges for each unknown, before the active set method is used: more would be a cycle of rounding errors.
const EXCHANGES: usize = 3;

/// The normal equations `gram x = rhs` of a least squares problem, accumulated without storing its regressor.
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    /// `A^T A` for the regressor A, (unknowns, unknowns).
    pub gram: Matrix,
    /// `A^T y` for the targets y, (unknowns, targets).
    pub rhs: Matrix,
    /// Sum of squares of each target.
    pub squares: Vector,
}

impl NormalEquations {
    /// A problem without equations.
    pub(crate) fn zeros(unknowns: usize, targets: usize) -> Self {
        Self {
            gram: Matrix::zeros(unknowns, unknowns),
            rhs: Matrix::zeros(unknowns, targets),
            squares: DVector::zeros(targets),
        }
    }

    /// Adds a block of equations: `regressor` is (unknowns, rows), `targets` (targets, rows).
    pub(crate) fn add(&mut self, regressor: &Matrix, targets: &Matrix) {
        add_squares(&mut self.gram, regressor);
        self.rhs.gemm(1.0, regressor, &targets.transpose(), 1.0);
        for (sum, row) in self.squares.iter_mut().zip(targets.row_iter()) {
            *sum += row.norm_squared();
        }
    }

    /// Sum of squared residuals of each target at `x`.
    pub(crate) fn residual_squares(&self, x: &Matrix) -> Vector {
        DVector::from_fn(self.squares.len(), |target, _| {
            let x = x.column(target);
            let fitted = (&self.gram * x).dot(&x);
            (self.squares[target] - 2.0 * x.dot(&self.rhs.column(target)) + fitted).max(0.0)
        })
    }
}

/// Adds `factor factor^T`: computes the lower triangle and copies it to the upper one.
fn add_squares(gram: &mut Matrix, factor: &Matrix) {
    let (unknowns, rows) = factor.shape();
    let view = MatRef::from_column_major_slice(factor.as_slice(), unknowns, rows);
    triangular::matmul(
        MatMut::from_column_major_slice_mut(gram.as_mut_slice(), unknowns, unknowns),
        BlockStructure::TriangularLower,
        Accum::Add,
        view,
        BlockStructure::Rectangular,
        view.transpose(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    gram.fill_upper_triangle_with_lower_triangle();
}

/// Minimizes `x^T gram x - 2 x^T rhs` over `lower <= x <= upper`, an interval that contains zero.
///
/// All unknowns beyond a bound are held there at once, and all that a step inwards would lower the cost are freed at once;
/// where the number of those at a wrong place does not fall for several exchanges, only the last of them is exchanged until
/// it does (block principal pivoting with Murty's rule, J. Judice and F. Pires 1994). It ends in the only minimum, or
/// rounding errors prevent the end: then the active set method of Lawson and Hanson, with two bounds as by Stark and
/// Parker, takes one decomposition for each unknown.
///
/// Bounds may be infinite. The unknowns are scaled first, so that the diagonal of the Gram matrix is one. Unidentifiable
/// combinations of unknowns are close to zero.
pub(crate) fn bounded(gram: &Arrow, rhs: &Vector, lower: &Vector, upper: &Vector) -> Vector {
    let scale = gram.diagonal().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
    let mut scaled = gram.scaled(&scale);
    let diagonal = scaled.diagonal();
    let target = rhs.component_div(&scale);
    let (low, high) = (lower.component_mul(&scale), upper.component_mul(&scale));
    let is_free: Vec<bool> = lower.iter().zip(upper).map(|(low, high)| low < high).collect();
    for regularization in REGULARIZATIONS {
        scaled.set_diagonal(&diagonal.add_scalar(regularization));
        if ArrowSolver::new(&scaled).solve(&target, &is_free).is_some() {
            break;
        }
    }
    let found = pivoted(&scaled, &target, &low, &high);
    let found = found.unwrap_or_else(|| active_set(&scaled, &target, &low, &high));
    // exactly the bound, not one that was multiplied and divided: what stands there is known to be held
    let unscaled = |i: usize| match found[i] {
        value if value == low[i] => lower[i],
        value if value == high[i] => upper[i],
        value => value / scale[i],
    };
    DVector::from_fn(found.len(), |i, _| unscaled(i))
}

/// The minimum by exchanges of whole sets; `None` where they do not end.
fn pivoted(gram: &Arrow, rhs: &Vector, lower: &Vector, upper: &Vector) -> Option<Vector> {
    let n = rhs.len();
    let mut solver = ArrowSolver::new(gram);
    let mut x: Vector = DVector::zeros(n);
    let mut passive: Vec<bool> = (0..n).map(|i| lower[i] < upper[i]).collect();
    let slack = SLACK * rhs.amax();
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    for _ in 0..PATIENCE + EXCHANGES * n {
        x = passive_solution(&mut solver, gram, rhs, &x, &passive);
        let descent = rhs - gram.times(&x);
        let is_misplaced = |&i: &usize| {
            if passive[i] {
                x[i] < lower[i] || x[i] > upper[i]
            } else {
                inward(descent[i], x[i], lower[i], upper[i]) > slack
            }
        };
        let mut misplaced: Vec<usize> = (0..n).filter(is_misplaced).collect();
        if misplaced.is_empty() {
            return x.iter().all(|value| value.is_finite()).then_some(x);
        }
        if misplaced.len() < fewest {
            (fewest, patience) = (misplaced.len(), PATIENCE);
        } else if patience > 0 {
            patience -= 1;
        } else {
            misplaced.drain(..misplaced.len() - 1);
        }
        for i in misplaced {
            if passive[i] {
                x[i] = x[i].clamp(lower[i], upper[i]);
            }
            passive[i] = !passive[i];
        }
    }
    None
}

/// Half the fall of the cost by a step inwards from a bound.
fn inward(descent: f64, x: f64, lower: f64, upper: f64) -> f64 {
    match (x == lower, x == upper) {
        (true, false) => descent,
        (false, true) => -descent,
        _ => 0.0,
    }
}

fn active_set(gram: &Arrow, rhs: &Vector, lower: &Vector, upper: &Vector) -> Vector {
    let n = rhs.len();
    let mut solver = ArrowSolver::new(gram);
    let mut x = DVector::zeros(n);
    // all unknowns are free at first; those beyond a bound are fixed to it one by one
    let mut passive: Vec<bool> = (0..n).map(|i| lower[i] < upper[i]).collect();
    let slack = SLACK * rhs.amax();
    // each change of the active set lowers the cost; the limit prevents cycling due to rounding
    for _ in 0..3 * n.max(1) {
        while passive.iter().any(|&free| free) {
            let target = passive_solution(&mut solver, gram, rhs, &x, &passive);
            let mut fraction = 1.0;
            let mut blocking = None;
            let is_beyond = |&i: &usize| target[i] < lower[i] || target[i] > upper[i];
            for i in (0..n).filter(|&i| passive[i]).filter(is_beyond) {
                let bound = target[i].clamp(lower[i], upper[i]);
                let step = (bound - x[i]) / (target[i] - x[i]);
                if step < fraction || blocking.is_none() {
                    (fraction, blocking) = (step.min(fraction), Some((i, bound)));
                }
            }
            x += fraction * (&target - &x);
            let Some((i, bound)) = blocking else { break };
            x[i] = bound;
            passive[i] = false;
        }
        let descent = rhs - gram.times(&x);
        let inward = |i: usize| inward(descent[i], x[i], lower[i], upper[i]);
        let entering = (0..n).filter(|&i| !passive[i] && inward(i) > slack);
        match entering.max_by(|&i, &j| inward(i).total_cmp(&inward(j))) {
            Some(i) => passive[i] = true,
            None => break,
        }
    }
    x
}

/// The minimum over the passive (free) unknowns, with the others fixed at `x`.
fn passive_solution(
    solver: &mut ArrowSolver,
    gram: &Arrow,
    rhs: &Vector,
    x: &Vector,
    passive: &[bool],
) -> Vector {
    let held = DVector::from_fn(x.len(), |i, _| if passive[i] { 0.0 } else { x[i] });
    match solver.solve(&(rhs - gram.times(&held)), passive) {
        Some(found) => held + found,
        None => x.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_taken_where_rounding_spoils_the_matrix() {
        // two of the columns are the same, and the sum of squares is off by rounding
        let a = Matrix::from_fn(40, 4, |i, j| ((i * (j % 3 + 2)) as f64 * 0.61).sin());
        let b = DVector::from_fn(40, |i, _| (i as f64 * 0.37).cos());
        let (mut gram, rhs) = (a.tr_mul(&a), a.tr_mul(&b));
        gram[(0, 0)] *= 1.0 - 3e-14;
        let free = DVector::from_element(4, f64::INFINITY);
        let x = bounded(&Arrow::from(gram.clone()), &rhs, &-&free, &free);
        assert!((&gram * &x - &rhs).amax() < 1e-6 * rhs.amax(), "{x}");
    }

    #[test]
    fn bounds_hold_and_the_conditions_of_optimality_too() {
        let a = Matrix::from_fn(30, 5, |i, j| ((i * (j + 2)) as f64 * 0.61).sin() + 0.3);
        let b = DVector::from_fn(30, |i, _| (i as f64 * 0.37).cos() - 0.4);
        let (dense, rhs) = (a.tr_mul(&a), a.tr_mul(&b));
        let gram = Arrow::from(dense.clone());
        let lower = DVector::from_vec(vec![0.0, 0.0, f64::NEG_INFINITY, 0.0, -0.1]);
        let free = DVector::from_element(5, f64::INFINITY);
        let loose = bounded(&gram, &rhs, &lower, &free);
        let mut upper = free;
        let largest = loose.imax();
        upper[largest] = 0.5 * loose[largest];
        let x = bounded(&gram, &rhs, &lower, &upper);
        let gradient = &dense * &x - &rhs;
        for i in 0..5 {
            assert!(x[i] >= lower[i] && x[i] <= upper[i]);
            if x[i] == lower[i] {
                assert!(gradient[i] > -1e-9);
            } else if x[i] == upper[i] {
                assert!(gradient[i] < 1e-9);
            } else {
                assert!(gradient[i].abs() < 1e-8);
            }
        }
        assert!((0..5).any(|i| x[i] == lower[i]), "the example must exercise a lower bound");
        let one_by_one = active_set(&gram, &rhs, &lower, &upper);
        assert!((pivoted(&gram, &rhs, &lower, &upper).unwrap() - one_by_one).amax() < 1e-10);
        assert_eq!(x[largest], upper[largest], "and an upper one");
    }

    #[test]
    fn an_unknown_at_its_bound_is_there_exactly() {
        // uncoupled unknowns of unequal scales, each of which would go beyond its bound
        let n = 200;
        let size = |i: usize| 1.0 + 0.7 * i as f64;
        let mut gram = Arrow::zeros(n, vec![]);
        let diagonal = Matrix::from_fn(n, n, |i, j| if i == j { size(i) } else { 0.0 });
        gram.add_part(&diagonal, &(0..n).collect::<Vec<_>>());
        let lower = DVector::from_fn(n, |i, _| -0.1 / (3.0 + i as f64));
        let rhs = DVector::from_fn(n, |i, _| -size(i));
        let found = bounded(&gram, &rhs, &lower, &DVector::from_element(n, f64::INFINITY));
        assert_eq!(found, lower);
    }

    #[test]
    fn many_bounds_of_many_groups_end_in_the_same_minimum() {
        let groups: Vec<Vec<usize>> = (0..30).map(|e| (4 + 6 * e..10 + 6 * e).collect()).collect();
        let unknowns = 4 + 6 * groups.len();
        let mut gram = Arrow::zeros(unknowns, groups.clone());
        let mut rhs = DVector::zeros(unknowns);
        for (number, group) in groups.iter().enumerate() {
            let places: Vec<usize> = (0..4).chain(group.iter().copied()).collect();
            let a = Matrix::from_fn(14, 10, |i, j| {
                ((i * (j + 2) + 7 * number) as f64 * 0.37).sin() + 0.4
            });
            let b = DVector::from_fn(14, |i, _| ((i * 3 + number) as f64 * 0.83).cos());
            gram.add_part(&a.tr_mul(&a), &places);
            let own = a.tr_mul(&b);
            places.iter().zip(own.iter()).for_each(|(&i, value)| rhs[i] += value);
        }
        let bound = DVector::from_element(unknowns, 0.05);
        let found = pivoted(&gram, &rhs, &-&bound, &bound).unwrap();
        let held = found.iter().filter(|x| x.abs() == 0.05).count();
        assert!(held > unknowns / 4 && held < unknowns, "{held}");
        let expected = active_set(&gram, &rhs, &-&bound, &bound);
        assert!((found - expected).amax() < 1e-7);
    }
}
