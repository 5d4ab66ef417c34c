//! One section of the linear dynamics: one or two states.

use super::decompose::solve;
use crate::Matrix;
use num_complex::Complex64;

type ComplexMatrix = nalgebra::DMatrix<Complex64>;

/// One or two states in observer form:
/// `x1+ = -a1 x1 + x2 + b1 v`, `x2+ = -a2 x1 + b2 v`, seen by the reference output as x1.
///
/// Two real poles and a conjugate pair are the same two numbers a1, a2, so that a fit can pass from
/// one to the other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Section {
    /// The denominator `z^order + a1 z^(order-1) + ..`.
    pub a: Vec<f64>,
    /// (order, inputs).
    pub b: Matrix,
    /// (outputs, order); the reference output's row is 1, 0.
    pub c: Matrix,
    /// The output that fixes the states' scale.
    pub reference: usize,
    /// Initial states are counted from those that an input leads to which has grown as z^k with this z: 1, the steady state, or more
    /// where the section integrates.
    pub growth: f64,
}

/// Moves the state of a section in observer form on by one sample, with what drives each of its states.
#[inline]
pub(crate) fn advance(a: &[f64], state: &mut [f64], driven: impl Fn(usize) -> f64) {
    match (a, state) {
        ([a1, a2], [x1, x2]) => {
            (*x1, *x2) = (*x2 - a1 * *x1 + driven(0), driven(1) - a2 * *x1);
        }
        (a, state) => state[0] = driven(0) - a[0] * state[0],
    }
}

/// Distance from the unit circle inside which poles are kept: nearer ones have a memory of more than 10^10 samples. The output of a
/// plant that integrates may be 10^4 times its noise over 10^5 samples, and a pole that forgets a part of it would be seen.
const MARGIN: f64 = 1e-10;

/// The largest modulus of a pole.
pub(crate) const LARGEST_POLE: f64 = 1.0 - MARGIN;

/// Whether all poles of a denominator lie inside a circle slightly smaller than the unit circle.
fn is_stable(a: &[f64]) -> bool {
    match a {
        // with the poles p and q: (1 - p) (1 - q) and the sum of both factors, and the same at -1
        [a1, a2] => {
            let keeps_off = |a1: f64| 1.0 + a1 + a2 > MARGIN * (2.0 + a1);
            *a2 < 1.0 - MARGIN && keeps_off(*a1) && keeps_off(-a1)
        }
        a => a[0].abs() <= LARGEST_POLE,
    }
}

/// Adds a change to a denominator, or as much of it as keeps the poles inside the unit circle.
pub(crate) fn move_poles(a: &mut [f64], change: &[f64]) {
    /// Smallest part of the change that is tried; below, the denominator stays as it is.
    const LEAST: f64 = 1e-6;
    let before = a.to_vec();
    let mut fraction = 1.0;
    while fraction >= LEAST {
        let values = a.iter_mut().zip(&before).zip(change);
        values.for_each(|((a, before), change)| *a = before + fraction * change);
        if is_stable(a) {
            return;
        }
        fraction *= 0.5;
    }
    a.copy_from_slice(&before);
}

impl Section {
    /// A section from one input to the first output, with denominator `1, a1, ..` and numerator `b1, ..`.
    pub(crate) fn from_one_input(
        (a, b): (Vec<f64>, Vec<f64>),
        input: usize,
        (outputs, inputs): (usize, usize),
    ) -> Self {
        let mut c = Matrix::zeros(outputs, a.len());
        c[(0, 0)] = 1.0;
        let mut driven = Matrix::zeros(a.len(), inputs);
        driven.column_mut(input).copy_from_slice(&b);
        Self { a, b: driven, c, reference: 0, growth: 1.0 }
    }

    pub(crate) fn order(&self) -> usize {
        self.a.len()
    }

    /// A, (order, order).
    pub(crate) fn matrix(&self) -> Matrix {
        match self.a[..] {
            [a1, a2] => Matrix::from_row_slice(2, 2, &[-a1, 1.0, -a2, 0.0]),
            _ => Matrix::from_element(1, 1, -self.a[0]),
        }
    }

    /// The state that a constant drive of each unknown (order, n) leads to: `(I - A)^-1 drive`.
    pub(crate) fn steady(&self, drive: &Matrix) -> Matrix {
        self.growing(drive, 1.0)
    }

    /// The state from which initial states are counted, `(z I - A)^-1 drive` at [`Section::growth`].
    pub(crate) fn standing(&self, drive: &Matrix) -> Matrix {
        self.growing(drive, self.growth)
    }

    fn growing(&self, drive: &Matrix, z: f64) -> Matrix {
        let mut states = drive.clone();
        match self.a[..] {
            [a1, a2] => {
                for mut column in states.column_iter_mut() {
                    let x1 = (z * column[0] + column[1]) / (z * z + a1 * z + a2);
                    (column[0], column[1]) = (x1, (column[1] - a2 * x1) / z);
                }
            }
            _ => states /= z + self.a[0],
        }
        states
    }

    /// The terms of the partial fractions that belong to the poles that are wanted: none, one of two real poles, or all.
    pub(crate) fn with_poles(&self, is_wanted: impl Fn(&Complex64) -> bool) -> Option<Self> {
        let poles = self.poles();
        let wanted: Vec<&Complex64> = poles.iter().filter(|pole| is_wanted(pole)).collect();
        match wanted[..] {
            [] => None,
            [pole] if poles.len() == 2 => Some(self.part(pole.re)),
            _ => Some(self.clone()),
        }
    }

    /// The term of the partial fractions that belongs to one of two real poles p, of which q is the other:
    /// `((p b1 + b2) / (p - q)) / (z - p)` at the reference output, seen by the others as `c (1, -q)'`.
    fn part(&self, p: f64) -> Self {
        let q = -self.a[0] - p;
        let b = (self.b.row(0) * p + self.b.row(1)) / (p - q);
        let c = self.c.column(0) - self.c.column(1) * q;
        let (b, c) = (
            Matrix::from_row_slice(1, b.len(), b.as_slice()),
            Matrix::from_column_slice(c.len(), 1, c.as_slice()),
        );
        Self { a: vec![-p], b, c, ..*self }
    }

    pub(crate) fn is_stable(&self) -> bool {
        is_stable(&self.a)
    }

    pub(crate) fn poles(&self) -> Vec<Complex64> {
        match self.a[..] {
            [a1, a2] => {
                let root = Complex64::new(0.25 * a1 * a1 - a2, 0.0).sqrt();
                vec![-0.5 * a1 + root, -0.5 * a1 - root]
            }
            _ => vec![Complex64::new(-self.a[0], 0.0)],
        }
    }

    /// The section with poles `poles` and residues `seen` (outputs, poles) times `driven` (poles,
    /// inputs); the first `references` outputs may fix the states' scale.
    pub(super) fn from_poles(
        poles: &[Complex64],
        seen: &ComplexMatrix,
        driven: &ComplexMatrix,
        references: usize,
    ) -> Self {
        let (outputs, order) = seen.shape();
        let size = |output: usize| seen.row(output).iter().map(|c| c.norm()).product::<f64>();
        let reference = (0..references).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0);
        let real = |matrix: ComplexMatrix| matrix.map(|value| value.re);
        if let [pole] = *poles {
            let scale = seen[(reference, 0)];
            let c = real(seen.map(|value| value / scale));
            return Self { a: vec![-pole.re], b: real(driven * scale), c, reference, growth: 1.0 };
        }
        let (first, second) = (poles[0], poles[1]);
        let a = vec![-(first + second).re, (first * second).re];
        let row = seen.row(reference);
        let to_observer = ComplexMatrix::from_row_slice(
            2,
            2,
            &[row[0], row[1], -row[0] * second, -row[1] * first],
        );
        let b = real(&to_observer * driven);
        let mut c = Matrix::zeros(outputs, order);
        if outputs > 1
            && let Some(c_transposed) = solve(to_observer.transpose(), &seen.transpose())
        {
            c = real(c_transposed.transpose());
        }
        c.set_row(reference, &nalgebra::RowDVector::from_vec(vec![1.0, 0.0]));
        Self { a, b, c, reference, growth: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_real_poles_are_the_sum_of_their_parts() {
        let (p, q) = (0.9, -0.4);
        let whole = Section {
            a: vec![-(p + q), p * q],
            b: Matrix::from_row_slice(2, 1, &[0.3, -0.2]),
            c: Matrix::from_row_slice(2, 2, &[1.0, 0.0, 0.7, 0.5]),
            reference: 0,
            growth: 1.0,
        };
        let parts = [whole.part(p), whole.part(q)];
        let impulse = |section: &Section| {
            let mut state = section.b.column(0).into_owned();
            let output = |_| {
                let y = &section.c * &state;
                state = section.matrix() * &state;
                y
            };
            (0..8).map(output).collect::<Vec<_>>()
        };
        for ((y, one), two) in
            impulse(&whole).iter().zip(impulse(&parts[0])).zip(impulse(&parts[1]))
        {
            assert!((y - (one + two)).amax() < 1e-14, "{y}");
        }
    }
}
