//! The principal logarithm of a matrix.
//!
//! Square roots `X <- X^(1/2)` bring the matrix near the identity, where the quadrature of Gauss and Legendre of
//! `log(I + Y) = integral_0^1 Y (I + t Y)^-1 dt` is exact to rounding: `log(A) = 2^s log(A^(1/2^s))`. The roots are found by
//! the iteration of Denman and Beavers. Source: N. J. Higham, *Functions of Matrices*, 2008, chapters 6 and 11.

use crate::Matrix;

/// Nodes and weights of the quadrature on [0, 1], seven nodes: those below the middle, which is a node itself.
const NODES: [(f64, f64); 3] = [
    (0.025_446_043_828_620_736, 0.064_742_483_084_434_85),
    (0.129_234_407_200_302_78, 0.139_852_695_744_638_34),
    (0.297_077_424_311_301_4, 0.190_915_025_252_559_5),
];

/// The weight of the middle node.
const MIDDLE: f64 = 0.208_979_591_836_734_7;

/// `log A`; `None` where A has an eigenvalue that is zero or negative, up to rounding.
pub(crate) fn logarithm(matrix: &Matrix) -> Option<Matrix> {
    /// Distance from the identity at which seven nodes are exact to rounding.
    const NEAR: f64 = 0.25;
    /// Roots that bring any pole of a record near the identity: 2^-40 of its logarithm.
    const ROOTS: usize = 40;
    let identity = Matrix::identity(matrix.nrows(), matrix.nrows());
    let mut root = matrix.clone();
    let mut times = 1.0;
    for _ in 0..ROOTS {
        let distance = &root - &identity;
        if distance.norm() < NEAR {
            let part = |(node, weight): (f64, f64)| {
                let inverse = (&identity + node * &distance).try_inverse()?;
                Some(weight * &distance * inverse)
            };
            let mut sum = part((0.5, MIDDLE))?;
            for (node, weight) in NODES {
                sum += part((node, weight))? + part((1.0 - node, weight))?;
            }
            return Some(times * sum);
        }
        root = square_root(&root)?;
        times *= 2.0;
    }
    None
}

/// The principal square root, by the iteration of Denman and Beavers.
fn square_root(matrix: &Matrix) -> Option<Matrix> {
    /// Quadratic convergence from anywhere but an eigenvalue near the negative axis.
    const STEPS: usize = 60;
    const EXACT: f64 = 1e-14;
    let mut root = matrix.clone();
    let mut inverse = Matrix::identity(matrix.nrows(), matrix.nrows());
    for _ in 0..STEPS {
        let next = 0.5 * (&root + inverse.clone().try_inverse()?);
        inverse = 0.5 * (&inverse + root.try_inverse()?);
        root = next;
        let left = (&root * &root - matrix).norm();
        if left <= EXACT * matrix.norm() {
            return Some(root);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_leads_back() {
        let pair = Matrix::from_row_slice(2, 2, &[1.6, 1.0, -0.98, 0.0]);
        let mut all = Matrix::identity(5, 5);
        all.view_mut((0, 0), (2, 2)).copy_from(&pair);
        // a double pole, and one that has almost decayed after one sample
        all[(2, 3)] = 0.1;
        all[(4, 4)] = 1e-4;
        let back = logarithm(&all).unwrap().exp();
        assert!((back - all).amax() < 1e-12);
        let angle = logarithm(&pair).unwrap().complex_eigenvalues()[0].im.abs();
        assert!((angle - (0.8 / 0.98_f64.sqrt()).acos()).abs() < 1e-12);
    }

    #[test]
    fn negative_and_vanishing_poles_have_none() {
        for pole in [-0.5, 0.0] {
            assert!(logarithm(&Matrix::from_diagonal_element(1, 1, pole)).is_none(), "{pole}");
        }
    }
}
