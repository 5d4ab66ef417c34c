//! The Gram matrix of a regressor in twice the working precision, and its pivoted Cholesky decomposition.
//!
//! For a regressor A (rows, unknowns) and targets y (rows, targets), the decomposition `P^T A^T A P = r^T r` has the same
//! r as `A P = Q r`, and `z = Q^T y` follows from `A^T y`. The condition number of `A^T A` is the square of A's, so it
//! needs twice the digits.

use super::double_double::Number;
use super::numbers::{Numbers, PartMut};
use super::triangular_factor::TriangularFactor;
use crate::Matrix;
use pulp::Simd;

/// Columns that are decomposed at once: they fit into the second-level cache.
const PANEL: usize = 32;

/// A column counts as a combination of earlier ones if no more than this fraction of its sum of squares is left: 1e-14
/// of its length, about the rounding error of an orthogonal decomposition in working precision.
const DEPENDENT: f64 = 1e-28;

/// The lower part of `[A y]^T A`, for a regressor A and targets y, and the sum of squares of each target.
#[derive(Clone, Debug)]
pub(super) struct Gram {
    unknowns: usize,
    rows: usize,
    /// By columns, (unknowns + targets, unknowns); elements above the diagonal are not used.
    numbers: Numbers,
    /// The part of each diagonal element that was removed with the means.
    means: Vec<f64>,
    pub squares: Vec<Number>,
}

impl Gram {
    pub(super) fn zeros(unknowns: usize, targets: usize) -> Self {
        let rows = unknowns + targets;
        Self {
            unknowns,
            rows,
            numbers: Numbers::zeros(rows * unknowns),
            means: vec![0.0; unknowns],
            squares: vec![Number::ZERO; targets],
        }
    }

    pub(super) fn add_at(&mut self, row: usize, column: usize, number: Number) {
        let sum = self.get(row, column) + number;
        self.numbers.set(column * self.rows + row, sum);
    }

    fn get(&self, row: usize, column: usize) -> Number {
        self.numbers.get(column * self.rows + row)
    }

    /// So many elements of a column from a row on.
    pub(super) fn part_mut(&mut self, column: usize, row: usize, count: usize) -> PartMut<'_> {
        let start = column * self.rows + row;
        self.numbers.part_mut(start..start + count)
    }

    pub(super) fn add(&mut self, other: &Self) {
        for column in 0..self.unknowns {
            for row in column..self.rows {
                self.add_at(row, column, other.get(row, column));
            }
        }
        for (mean, other) in self.means.iter_mut().zip(&other.means) {
            *mean += other;
        }
        for (square, other) in self.squares.iter_mut().zip(&other.squares) {
            *square += *other;
        }
    }

    /// Removes the means of columns; `sums` over `count` rows are those of the regressor, then those of the targets.
    pub(super) fn take_means(&mut self, sums: &[Number], count: usize) {
        struct Subtract<'a>(&'a mut Gram, &'a Numbers, Number);
        impl pulp::WithSimd for Subtract<'_> {
            type Output = ();
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) {
                let Self(gram, sums, count) = self;
                let rows = gram.rows;
                for column in 0..gram.unknowns {
                    let mean = sums.get(column) / count;
                    gram.means[column] += (sums.get(column) * mean).value();
                    let mut own = gram.part_mut(column, column, rows - column);
                    own.subtract(simd, mean, sums.part(column..rows));
                }
            }
        }
        let count = Number::from(count as f64);
        let mut all = Numbers::default();
        all.extend(sums);
        pulp::Arch::new().dispatch(Subtract(self, &all, count));
        for (square, sum) in self.squares.iter_mut().zip(&sums[self.unknowns..]) {
            *square += -(*sum * *sum / count);
        }
    }

    /// `A^T A` and `A^T y`, (unknowns, unknowns) and (unknowns, targets), in working precision.
    pub(super) fn rounded(&self) -> (Matrix, Matrix) {
        let (n, targets) = (self.unknowns, self.squares.len());
        let gram = Matrix::from_fn(n, n, |i, j| self.get(i.max(j), i.min(j)).value());
        (gram, Matrix::from_fn(n, targets, |i, target| self.get(n + target, i).value()))
    }

    /// The Cholesky decomposition. The next pivot is the column of which the earlier ones explain the smallest fraction.
    ///
    /// It ends where the mean and the earlier columns explain all other columns up to [`DEPENDENT`].
    pub(super) fn factor(mut self) -> TriangularFactor {
        struct Decompose<'a>(&'a mut Gram, &'a mut [usize]);
        impl pulp::WithSimd for Decompose<'_> {
            type Output = usize;
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> usize {
                decompose(simd, self.0, self.1)
            }
        }
        let (n, targets) = (self.unknowns, self.squares.len());
        let mut order: Vec<usize> = (0..n).collect();
        let rank = pulp::Arch::new().dispatch(Decompose(&mut self, &mut order));
        let part = |row: usize, column: usize| {
            if column < rank { self.get(row, column) } else { Number::ZERO }
        };
        let r = Matrix::from_fn(n, n, |i, j| if i <= j { part(j, i).value() } else { 0.0 });
        let z = Matrix::from_fn(n, targets, |i, target| part(n + target, i).value());
        let rest = (0..targets).map(|target| {
            let parts = (0..n).map(|i| part(n + target, i));
            parts.fold(self.squares[target], |rest, part| rest + -(part * part)).value().max(0.0)
        });
        TriangularFactor { rest: rest.collect(), r, z, order }
    }

    fn swap_elements(&mut self, one: (usize, usize), other: (usize, usize)) {
        let (one, other) = (one.1 * self.rows + one.0, other.1 * self.rows + other.0);
        self.numbers.swap(one, other);
    }

    /// Exchanges two unknowns, `one <= other`.
    fn exchange(&mut self, one: usize, other: usize) {
        if one == other {
            return;
        }
        (0..one).for_each(|column| self.swap_elements((one, column), (other, column)));
        (one + 1..other).for_each(|i| self.swap_elements((i, one), (other, i)));
        self.swap_elements((one, one), (other, other));
        (other + 1..self.rows).for_each(|row| self.swap_elements((row, one), (row, other)));
    }
}

/// Decomposes in place, panel by panel; returns the number of independent columns. `order` holds the unknown of each
/// column.
#[inline(always)]
fn decompose<S: Simd>(simd: S, gram: &mut Gram, order: &mut [usize]) -> usize {
    let (n, rows) = (gram.unknowns, gram.rows);
    let mut left: Vec<Number> = (0..n).map(|column| gram.get(column, column)).collect();
    let mut whole: Vec<f64> =
        left.iter().zip(&gram.means).map(|(s, mean)| s.value() + mean).collect();
    for start in (0..n).step_by(PANEL) {
        let end = n.min(start + PANEL);
        for column in start..end {
            let share =
                |i: &usize| if whole[*i] > 0.0 { left[*i].value() / whole[*i] } else { 0.0 };
            let next = (column..n).max_by(|i, j| share(i).total_cmp(&share(j)));
            let Some(next) = next.filter(|next| share(next) > DEPENDENT) else { return column };
            gram.exchange(column, next);
            order.swap(column, next);
            left.swap(column, next);
            whole.swap(column, next);
            for earlier in start..column {
                subtract(simd, gram, column, earlier);
            }
            let root = gram.get(column, column).sqrt();
            for row in column..rows {
                let part = gram.get(row, column) / root;
                gram.numbers.set(column * rows + row, part);
                if row < n {
                    left[row] += -(part * part);
                }
            }
        }
        for column in end..n {
            for earlier in start..end {
                subtract(simd, gram, column, earlier);
            }
        }
    }
    n
}

/// Subtracts from a column the part that an earlier one explains.
#[inline(always)]
fn subtract<S: Simd>(simd: S, gram: &mut Gram, column: usize, earlier: usize) {
    let rows = gram.rows;
    let factor = gram.get(column, earlier);
    let part = |of: usize| of * rows + column..(of + 1) * rows;
    let (earlier, mut own) = gram.numbers.split(part(earlier), part(column));
    own.subtract(simd, factor, earlier);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::decompose::svd;
    use pulp::Scalar;

    fn factor(regressor: &Matrix, target: &Matrix) -> TriangularFactor {
        let n = regressor.ncols();
        let mut gram = Gram::zeros(n, 1);
        for (row, y) in regressor.row_iter().zip(target.iter()) {
            for j in 0..n {
                (j..n).for_each(|i| gram.add_at(i, j, Number::product(Scalar, row[i], row[j])));
                gram.add_at(n, j, Number::product(Scalar, *y, row[j]));
            }
            gram.squares[0] += Number::product(Scalar, *y, *y);
        }
        gram.factor()
    }

    #[test]
    fn minimum_norm_on_a_deficient_regressor() {
        let found = factor(&Matrix::from_element(3, 2, 1.0), &Matrix::from_element(3, 1, 4.0));
        let solution = found.solve(1e-6, 0.0).unwrap();
        assert_eq!(solution.rank, 1);
        assert!((solution.x[0] - 2.0).abs() < 1e-14 && (solution.x[1] - 2.0).abs() < 1e-14);
        assert!(solution.residual_squares[0] < 1e-28);
    }

    /// More columns than a panel holds, of a condition whose square working precision does not hold.
    #[test]
    fn it_solves_as_an_orthogonal_decomposition_does() {
        let n = 45;
        let a = Matrix::from_fn(120, n, |i, j| {
            ((i * (j + 3)) as f64 * 0.37).sin() + 1e6 * (i as f64 * 0.1).cos() / (1.0 + j as f64)
        });
        let y = Matrix::from_fn(120, 1, |i, _| (i as f64).sqrt());
        let solution = factor(&a, &y).solve(1e-13, 0.0).unwrap();
        assert_eq!(solution.rank, n);
        let whole = svd(&a).unwrap();
        assert!(whole.s[0] / whole.s[n - 1] > 1e8);
        for (found, expected) in solution.singular_values.iter().zip(&whole.s) {
            assert!((found - expected).abs() < 1e-13 * whole.s[0]);
        }
        let qr = a.clone().qr();
        let x = qr.r().solve_upper_triangular(&qr.q().tr_mul(&y)).unwrap();
        assert!((&a * (&solution.x - x)).norm() < 1e-8 * y.norm());
        let residual = (&y - &a * &solution.x).norm_squared();
        assert!((solution.residual_squares[0] / residual - 1.0).abs() < 1e-8);
    }

    /// Narrow-band input: each column is nearly made up by the others, and in all they have few directions.
    #[test]
    fn few_directions_among_many_columns() {
        let n = 200;
        let tone =
            |k: f64| (0..12).map(|m| (0.02 * f64::from(m) * k + f64::from(m)).cos()).sum::<f64>();
        let a = Matrix::from_fn(600, n, |i, j| tone(i as f64 - j as f64));
        let y = Matrix::from_fn(600, 1, |i, _| 3.0 * a[(i, 4)] - a[(i, 150)]);
        let solution = factor(&a, &y).solve(1e-13, 0.0).unwrap();
        let whole = svd(&a).unwrap();
        for (found, expected) in solution.singular_values.iter().zip(&whole.s) {
            assert!((found - expected).abs() < 1e-13 * whole.s[0], "{found} {expected}");
        }
        assert!(solution.rank <= 30, "{}", solution.rank);
        assert!((&a * &solution.x - &y).norm() < 1e-10 * y.norm());
    }

    #[test]
    fn what_other_columns_make_up_has_no_part_of_its_own() {
        let a = Matrix::from_fn(20, 3, |i, j| match j {
            0 => (i as f64 * 0.3).sin(),
            1 => (i as f64 * 0.3).sin() * 0.1,
            _ => (i as f64 * 0.7).cos(),
        });
        let found = factor(&a, &Matrix::from_fn(20, 1, |i, _| 2.0 * a[(i, 2)]));
        assert_eq!(found.r.row(2).amax(), 0.0);
        let solution = found.solve(1e-13, 0.0).unwrap();
        assert_eq!(solution.rank, 2);
        assert!((solution.x[2] - 2.0).abs() < 1e-13);
    }
}
