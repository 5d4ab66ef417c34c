//! Symmetric matrices of the shape of an arrow, and bounded least squares with them.
//!
//! The unknowns of a fit fall into those that all experiments share and, for each experiment, those that move its own
//! output only. With s shared and `q_e` own unknowns the normal matrix is
//!
//! ```text
//!     [ H    C_1'  C_2'  .. ]      H    (s, s)       shared with shared
//! A = [ C_1  D_1   0     .. ]      C_e  (q_e, s)     own with shared
//!     [ C_2  0     D_2   .. ]      D_e  (q_e, q_e)   own with own
//! ```
//!
//! and `A x = b` is solved by eliminating the own unknowns, with `D_e = L_e L_e'`:
//!
//! ```text
//! (H - sum_e W_e' W_e) x_s = b_s - sum_e W_e' r_e      W_e = L_e^-1 C_e,  r_e = L_e^-1 b_e
//! x_e = L_e^-T (r_e - W_e x_s)
//! ```
//!
//! This takes `sum_e q_e (q_e + s)^2 + s^3` multiplications and `sum_e q_e (q_e + s) + s^2` numbers: both grow with the
//! number of experiments, where a dense matrix takes its third power and its square. Source: A. Björck, Numerical
//! Methods for Least Squares Problems, 1996, section 6.3 (block angular problems).

use super::decompose::Cholesky;
use crate::Matrix;
use nalgebra::DVector;

type Vector = DVector<f64>;

/// With more unknowns than this, faer's blocked Cholesky decomposition is faster, at the cost of megabytes of workspace.
const LARGE: usize = 300;

/// A symmetric matrix (unknowns, unknowns) that is zero between unknowns of different groups.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Arrow {
    /// The unknowns of no group, ascending.
    shared: Vec<usize>,
    /// (shared, shared).
    head: Matrix,
    groups: Vec<Group>,
    /// Of each unknown: its group, if it has one, and its place there or among the shared ones.
    places: Vec<(Option<usize>, usize)>,
}

/// Unknowns that meet the shared ones and each other alone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Group {
    pub unknowns: Vec<usize>,
    /// (unknowns, unknowns).
    pub own: Matrix,
    /// (unknowns, shared).
    pub coupling: Matrix,
}

impl From<Matrix> for Arrow {
    /// A dense matrix: all unknowns are shared.
    fn from(head: Matrix) -> Self {
        let all = 0..head.nrows();
        let places = all.clone().map(|i| (None, i)).collect();
        Self { shared: all.collect(), head, groups: Vec::new(), places }
    }
}

impl Arrow {
    /// Zero, of so many unknowns, of which each group's meet the shared ones and each other alone.
    pub(crate) fn zeros(unknowns: usize, groups: Vec<Vec<usize>>) -> Self {
        let mut places = vec![(None, 0); unknowns];
        for (number, group) in groups.iter().enumerate() {
            group.iter().enumerate().for_each(|(at, &i)| places[i] = (Some(number), at));
        }
        let shared: Vec<usize> = (0..unknowns).filter(|&i| places[i].0.is_none()).collect();
        shared.iter().enumerate().for_each(|(at, &i)| places[i].1 = at);
        let count = shared.len();
        let group = |unknowns: Vec<usize>| Group {
            own: Matrix::zeros(unknowns.len(), unknowns.len()),
            coupling: Matrix::zeros(unknowns.len(), count),
            unknowns,
        };
        let groups = groups.into_iter().map(group).collect();
        Self { shared, head: Matrix::zeros(count, count), groups, places }
    }

    /// Number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// The unknowns of no group, ascending, and their matrix.
    pub(crate) fn shared(&self) -> (&[usize], &Matrix) {
        (&self.shared, &self.head)
    }

    /// The groups in their order.
    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The same of some unknowns only, which keep their order.
    pub(crate) fn restricted(&self, kept: &[usize]) -> Self {
        let mut is_kept = vec![false; self.len()];
        let mut place = vec![0; self.len()];
        for (at, &i) in kept.iter().enumerate() {
            (is_kept[i], place[i]) = (true, at);
        }
        let of = |unknowns: &[usize]| -> Vec<usize> {
            (0..unknowns.len()).filter(|&at| is_kept[unknowns[at]]).collect()
        };
        let now = |unknowns: &[usize], kept: &[usize]| -> Vec<usize> {
            kept.iter().map(|&at| place[unknowns[at]]).collect()
        };
        let shared = of(&self.shared);
        let own: Vec<Vec<usize>> = self.groups.iter().map(|group| of(&group.unknowns)).collect();
        let names = self.groups.iter().zip(&own).map(|(group, own)| now(&group.unknowns, own));
        let mut restricted = Self::zeros(kept.len(), names.collect());
        restricted.head = select(&self.head, &shared, &shared);
        for ((target, group), own) in restricted.groups.iter_mut().zip(&self.groups).zip(&own) {
            target.own = select(&group.own, own, own);
            target.coupling = select(&group.coupling, own, &shared);
        }
        restricted
    }

    /// Every element, (unknowns, unknowns).
    pub(crate) fn to_dense(&self) -> Matrix {
        let all: Vec<usize> = (0..self.len()).collect();
        self.select(&all)
    }

    /// The elements of some unknowns, in their order.
    pub(crate) fn select(&self, unknowns: &[usize]) -> Matrix {
        Matrix::from_fn(unknowns.len(), unknowns.len(), |i, j| self.get(unknowns[i], unknowns[j]))
    }

    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        match (self.places[i], self.places[j]) {
            ((None, i), (None, j)) => self.head[(i, j)],
            ((Some(group), i), (None, j)) | ((None, j), (Some(group), i)) => {
                self.groups[group].coupling[(i, j)]
            }
            ((Some(one), i), (Some(other), j)) if one == other => self.groups[one].own[(i, j)],
            _ => 0.0,
        }
    }

    /// The elements on the diagonal.
    pub(crate) fn diagonal(&self) -> Vector {
        DVector::from_fn(self.len(), |i, _| self.get(i, i))
    }

    /// Replaces the elements on the diagonal.
    pub(crate) fn set_diagonal(&mut self, values: &Vector) {
        for (&(group, i), &value) in self.places.iter().zip(values.iter()) {
            let block = group.map_or(&mut self.head, |group| &mut self.groups[group].own);
            block[(i, i)] = value;
        }
    }

    /// Adds a matrix of some unknowns, of which those with a group have the same one.
    pub(crate) fn add_part(&mut self, part: &Matrix, unknowns: &[usize]) {
        for (j, &column) in unknowns.iter().enumerate() {
            for (i, &row) in unknowns.iter().enumerate() {
                match (self.places[row], self.places[column]) {
                    ((None, row), (None, column)) => self.head[(row, column)] += part[(i, j)],
                    ((Some(group), row), (None, column)) => {
                        self.groups[group].coupling[(row, column)] += part[(i, j)];
                    }
                    ((Some(group), row), (Some(_), column)) => {
                        self.groups[group].own[(row, column)] += part[(i, j)];
                    }
                    // the other half of the coupling
                    ((None, _), (Some(_), _)) => {}
                }
            }
        }
    }

    /// Adds row q to row p and column q to column p, of two shared unknowns or two of one group: `T' A T` of the
    /// unit matrix T with a one at (q, p).
    pub(crate) fn join(&mut self, p: usize, q: usize) {
        let ((group, p), (other, q)) = (self.places[p], self.places[q]);
        debug_assert_eq!(group, other);
        let block = group.map_or(&mut self.head, |group| &mut self.groups[group].own);
        for i in 0..block.ncols() {
            block[(p, i)] += block[(q, i)];
        }
        for i in 0..block.nrows() {
            block[(i, p)] += block[(i, q)];
        }
        let add_columns = |coupling: &mut Matrix| {
            for i in 0..coupling.nrows() {
                coupling[(i, p)] += coupling[(i, q)];
            }
        };
        let Some(group) = group else {
            return self.groups.iter_mut().for_each(|group| add_columns(&mut group.coupling));
        };
        let coupling = &mut self.groups[group].coupling;
        for i in 0..coupling.ncols() {
            coupling[(p, i)] += coupling[(q, i)];
        }
    }

    /// Element (i, j) over `scale[i] scale[j]`.
    pub(crate) fn scaled(&self, scale: &Vector) -> Self {
        let mut scaled = self.clone();
        let of = |unknowns: &[usize]| scale.select_rows(unknowns);
        let shared = of(&self.shared);
        divide(&mut scaled.head, &shared, &shared);
        for group in &mut scaled.groups {
            let own = of(&group.unknowns);
            divide(&mut group.own, &own, &own);
            divide(&mut group.coupling, &own, &shared);
        }
        scaled
    }

    /// The product with a vector.
    pub(crate) fn times(&self, x: &Vector) -> Vector {
        let shared = x.select_rows(&self.shared);
        let mut of_shared = &self.head * &shared;
        let mut product = DVector::zeros(x.len());
        for Group { unknowns, own, coupling } in &self.groups {
            let x = x.select_rows(unknowns);
            of_shared.gemv_tr(1.0, coupling, &x, 1.0);
            scatter(&(own * &x + coupling * &shared), unknowns, &mut product);
        }
        scatter(&of_shared, &self.shared, &mut product);
        product
    }
}

/// Solves `A x = b` again and again over other sets of free unknowns: a group whose free unknowns have not changed since the
/// last solution is not eliminated again.
pub(crate) struct ArrowSolver<'a> {
    arrow: &'a Arrow,
    eliminated: Vec<Option<Eliminated>>,
    /// `H - sum_e W_e' W_e` of the eliminated groups, (shared, shared); none where a group was eliminated anew.
    reduced: Option<Matrix>,
}

/// A group whose free unknowns are eliminated.
struct Eliminated {
    /// The places of the free unknowns in their group.
    free: Vec<usize>,
    /// L, (free, free).
    factor: Matrix,
    /// W, (free, shared), and `W' W`, (shared, shared).
    coupling: Matrix,
    product: Matrix,
}

impl<'a> ArrowSolver<'a> {
    pub(crate) fn new(arrow: &'a Arrow) -> Self {
        let eliminated = arrow.groups.iter().map(|_| None).collect();
        Self { arrow, eliminated, reduced: None }
    }

    /// The solution of `A x = b` over some unknowns, with all others at zero; `None` where the matrix of these
    /// unknowns is not positive definite.
    pub(crate) fn solve(&mut self, b: &Vector, is_free: &[bool]) -> Option<Vector> {
        let Arrow { shared, head, groups, .. } = self.arrow;
        let free = |unknowns: &[usize]| -> Vec<usize> {
            (0..unknowns.len()).filter(|&at| is_free[unknowns[at]]).collect()
        };
        for (group, kept) in groups.iter().zip(&mut self.eliminated) {
            let free = free(&group.unknowns);
            if kept.as_ref().is_none_or(|kept| kept.free != free) {
                // also where this elimination fails: those before it have changed
                self.reduced = None;
                *kept = Some(group.eliminate(free)?);
            }
        }
        let eliminated = self.eliminated.iter().flatten();
        // from H each time, so that rounding errors do not add up
        let reduce = || eliminated.fold(head.clone(), |rest, own| rest - &own.product);
        let reduced = self.reduced.get_or_insert_with(reduce);
        let known = || groups.iter().zip(self.eliminated.iter().flatten());
        let mut rest = DVector::from_fn(shared.len(), |i, _| b[shared[i]]);
        let mut right = Vec::with_capacity(groups.len());
        for (group, Eliminated { free, factor, coupling, .. }) in known() {
            let mut own = DVector::from_fn(free.len(), |i, _| b[group.unknowns[free[i]]]);
            factor.solve_lower_triangular_mut(&mut own).then_some(())?;
            rest.gemv_tr(-1.0, coupling, &own, 1.0);
            right.push(own);
        }
        let at = free(shared);
        let reduced = select(reduced, &at, &at);
        let target = rest.select_rows(&at);
        let solution = if reduced.nrows() > LARGE {
            let solved = Cholesky::new(&reduced)?.solve(&Matrix::from_columns(&[target]));
            solved.column(0).into_owned()
        } else {
            reduced.cholesky()?.solve(&target)
        };
        let mut of_shared = DVector::zeros(shared.len());
        scatter(&solution, &at, &mut of_shared);
        let mut x = DVector::zeros(b.len());
        scatter(&of_shared, shared, &mut x);
        for ((group, own), mut solved) in known().zip(right) {
            solved.gemv(-1.0, &own.coupling, &of_shared, 1.0);
            own.factor.tr_solve_lower_triangular_mut(&mut solved).then_some(())?;
            own.free
                .iter()
                .zip(solved.iter())
                .for_each(|(&at, value)| x[group.unknowns[at]] = *value);
        }
        Some(x)
    }
}

impl Group {
    /// The elimination of some of the unknowns; `None` where their matrix is not positive definite.
    fn eliminate(&self, free: Vec<usize>) -> Option<Eliminated> {
        let factor = select(&self.own, &free, &free).cholesky()?.unpack();
        let mut coupling = self.coupling.select_rows(&free);
        factor.solve_lower_triangular_mut(&mut coupling).then_some(())?;
        let product = coupling.transpose() * &coupling;
        Some(Eliminated { free, factor, coupling, product })
    }
}

/// Divides element (i, j) by `rows[i] columns[j]`. The product is taken first, so that a symmetric matrix stays symmetric.
fn divide(matrix: &mut Matrix, rows: &Vector, columns: &Vector) {
    for (mut column, by) in matrix.column_iter_mut().zip(columns.iter()) {
        column.iter_mut().zip(rows.iter()).for_each(|(value, row)| *value /= row * by);
    }
}

fn scatter(values: &Vector, places: &[usize], target: &mut Vector) {
    places.iter().zip(values.iter()).for_each(|(&place, value)| target[place] = *value);
}

fn select(matrix: &Matrix, rows: &[usize], columns: &[usize]) -> Matrix {
    Matrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seven unknowns: 1, 4 and 6 are shared, 0 and 5 are of one group, 2 and 3 of another.
    fn arrow() -> Arrow {
        let mut arrow = Arrow::zeros(7, vec![vec![0, 5], vec![2, 3]]);
        for (number, unknowns) in [[0, 1, 4, 5, 6], [1, 2, 3, 4, 6]].iter().enumerate() {
            let rows = Matrix::from_fn(9, 5, |i, j| {
                ((i * (j + 2) + 3 * number) as f64 * 0.61).sin() + 0.3
            });
            arrow.add_part(&rows.tr_mul(&rows), unknowns);
        }
        arrow
    }

    #[test]
    fn a_failed_elimination_leaves_nothing_behind() {
        let mut arrow = arrow();
        // unknown 3 depends on nothing: its group cannot be eliminated while it is free
        arrow.groups[1].own.fill_row(1, 0.0);
        arrow.groups[1].own.fill_column(1, 0.0);
        let b = DVector::from_fn(7, |i, _| (i as f64 + 0.5).sin());
        let free = |held: &[usize]| (0..7).map(|i| !held.contains(&i)).collect::<Vec<_>>();
        let mut solver = ArrowSolver::new(&arrow);
        assert!(solver.solve(&b, &free(&[3])).is_some());
        // the first group changes before the second one fails
        assert!(solver.solve(&b, &free(&[0])).is_none());
        let again = solver.solve(&b, &free(&[0, 3])).unwrap();
        assert_eq!(again, ArrowSolver::new(&arrow).solve(&b, &free(&[0, 3])).unwrap());
    }

    #[test]
    fn products_scales_and_solutions_are_those_of_the_dense_matrix() {
        let arrow = arrow();
        let dense = arrow.to_dense();
        assert_eq!(dense, dense.transpose());
        assert_eq!((dense[(0, 2)], dense[(5, 3)]), (0.0, 0.0));
        let x = DVector::from_fn(7, |i, _| (i as f64 + 1.0).cos());
        assert!((arrow.times(&x) - &dense * &x).amax() < 1e-13);
        let scale = DVector::from_fn(7, |i, _| 1.0 + i as f64);
        let expected = Matrix::from_fn(7, 7, |i, j| dense[(i, j)] / (scale[i] * scale[j]));
        assert!((arrow.scaled(&scale).to_dense() - expected).amax() < 1e-12);
        let mut solver = ArrowSolver::new(&arrow);
        let all = solver.solve(&x, &[true; 7]).unwrap();
        assert!((&dense * all - &x).amax() < 1e-10);
        let is_free = [true, true, false, true, false, true, true];
        let some = solver.solve(&x, &is_free).unwrap();
        let left = &dense * &some - &x;
        for i in 0..7 {
            assert!(if is_free[i] { left[i].abs() < 1e-10 } else { some[i] == 0.0 }, "{i}");
        }
    }

    #[test]
    fn a_restriction_leaves_unknowns_out() {
        let (arrow, kept) = (arrow(), [0, 2, 3, 4, 6]);
        let restricted = arrow.restricted(&kept);
        assert_eq!(restricted.to_dense(), arrow.select(&kept));
        assert_eq!(restricted.shared().0, [3, 4]);
        assert_eq!(restricted.groups()[1].unknowns, [1, 2]);
    }

    #[test]
    fn a_diagonal_is_read_and_replaced() {
        let mut arrow = arrow();
        let raised = arrow.diagonal() * 2.0;
        let mut expected = arrow.to_dense();
        expected.set_diagonal(&raised);
        arrow.set_diagonal(&raised);
        assert_eq!(arrow.to_dense(), expected);
    }

    #[test]
    fn what_is_not_positive_definite_has_no_solution() {
        let ones = DVector::from_element(7, 1.0);
        let zero = Arrow::zeros(7, vec![vec![0, 5]]);
        assert_eq!(ArrowSolver::new(&zero).solve(&ones, &[true; 7]), None);
    }
}
