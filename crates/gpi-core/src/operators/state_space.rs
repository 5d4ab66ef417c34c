//! Linear dynamics whose dimensions are known at compile time.

use super::error::require_finite;
use super::{OperatorError, Sample};

/// `x(k+1) = A x(k) + B v(k)`, `y(k) = C x(k) + D v(k)`, with N states, M inputs and P outputs.
///
/// Intended for firmware. On a host, the dimensions of `linear::StateSpace` are known at run time.
///
/// ```
/// use gpi_core::operators::StateSpaceStep;
/// let lag = StateSpaceStep::new([[0.5]], [[0.5]], [[1.0]], [[0.0]])?;
/// let mut state = [0.0];
/// assert_eq!([1.0, 1.0, 1.0].map(|v| lag.step(&mut state, &[v])[0]), [0.0, 0.5, 0.75]);
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpaceStep<T, const N: usize, const M: usize, const P: usize> {
    a: [[T; N]; N],
    b: [[T; M]; N],
    c: [[T; N]; P],
    d: [[T; M]; P],
}

impl<T: Sample, const N: usize, const M: usize, const P: usize> StateSpaceStep<T, N, M, P> {
    /// A model from its matrices, each an array of rows: A (N x N), B (N x M), C (P x N), D (P x M).
    ///
    /// # Errors
    /// An element is not finite.
    pub fn new(
        a: [[T; N]; N],
        b: [[T; M]; N],
        c: [[T; N]; P],
        d: [[T; M]; P],
    ) -> Result<Self, OperatorError> {
        require_finite("a", a.as_flattened())?;
        require_finite("b", b.as_flattened())?;
        require_finite("c", c.as_flattened())?;
        require_finite("d", d.as_flattened())?;
        Ok(Self { a, b, c, d })
    }

    /// y(k) for v(k); `state` changes from x(k) to x(k+1).
    #[inline]
    pub fn step(&self, state: &mut [T; N], v: &[T; M]) -> [T; P] {
        let rows = |x: &[[T; N]], u: &[[T; M]], into: &mut [T]| {
            for ((x, u), value) in x.iter().zip(u).zip(into) {
                *value = product(x, state) + product(u, v);
            }
        };
        let (mut y, mut next) = ([T::ZERO; P], [T::ZERO; N]);
        rows(&self.c, &self.d, &mut y);
        rows(&self.a, &self.b, &mut next);
        *state = next;
        y
    }
}

/// The dot product.
#[inline]
fn product<T: Sample, const K: usize>(left: &[T; K], right: &[T; K]) -> T {
    let mut sum = T::ZERO;
    for (left, right) in left.iter().zip(right) {
        sum = sum + *left * *right;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_states_two_inputs_one_output() {
        let a = [[0.5, 1.0], [-0.25, 0.5]];
        let system =
            StateSpaceStep::new(a, [[1.0, 0.0], [0.0, 2.0]], [[1.0, -1.0]], [[0.0, 0.5]]).unwrap();
        let mut state = [0.0, 0.0];
        assert_eq!(system.step(&mut state, &[1.0, 2.0]), [1.0]);
        assert_eq!(state, [1.0, 4.0]);
        assert_eq!(system.step(&mut state, &[0.0, 0.0]), [-3.0]);
        assert_eq!(state, [4.5, 1.75]);
    }

    #[cfg(feature = "identify")]
    #[test]
    fn as_the_one_of_the_host() {
        use crate::Matrix;
        use crate::linear::StateSpace;
        let (a, b) = ([[0.9_f64, 0.3], [-0.3, 0.8]], [[1.0], [0.2]]);
        let (c, d) = ([[0.5, -0.7]], [[0.1]]);
        let matrix =
            |values: &[f64], rows| Matrix::from_row_slice(rows, values.len() / rows, values);
        let host = StateSpace::new(
            matrix(a.as_flattened(), 2),
            matrix(b.as_flattened(), 2),
            matrix(c.as_flattened(), 1),
            matrix(d.as_flattened(), 1),
        )
        .unwrap();
        let input: Vec<f64> = (0..200).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let expected = host.simulate(&Matrix::from_column_slice(200, 1, &input)).unwrap();
        let (system, mut state) = (StateSpaceStep::new(a, b, c, d).unwrap(), [0.0, 0.0]);
        for (v, expected) in input.iter().zip(&expected) {
            assert!((system.step(&mut state, &[*v])[0] - expected).abs() < 1e-13);
        }
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        let refused = StateSpaceStep::new([[0.5]], [[f32::NAN]], [[1.0]], [[0.0]]).unwrap_err();
        assert_eq!(refused, OperatorError::NotFinite { parameter: "b", index: 0 });
    }
}
