//! The eigensystem realization algorithm (ERA): from Markov parameters to a state space.

use super::StateSpace;
use super::decompose::{Svd, eigen, leading_svd, svd};
use crate::{Error, Matrix};
use num_complex::Complex64;

/// Largest dimension of a Hankel matrix whose size is not given: larger ones are less accurate for noisy taps.
const LARGEST: usize = 300;

/// From this dimension on, and for at most [`FEW`] singular values, computing the leading ones only is faster.
const LARGE: usize = 100;
const FEW: usize = 12;

/// Singular values below this fraction of the largest are rounding errors.
const ROUNDING: f64 = 1e-14;

/// Singular values below this fraction of the largest are not searched for a gap: the part of the response that they
/// describe is below 1 %.
const SIGNIFICANT: f64 = 0.01;

/// A ratio of consecutive singular values that marks the order: those of noise decay slowly, without such a gap.
const GAP: f64 = 20.0;

/// Without a gap, the order is the smallest for which the rest holds at most this fraction of the sum of squares: 1 % in
/// amplitude.
const REST: f64 = 1e-4;

/// Poles are kept inside the unit circle by this margin: a transient of 10^10 samples outlasts any record by far, so that a pole that
/// integrates keeps its place when a system is realized again.
const MARGIN: f64 = 1e-10;

/// Options of [`realize`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EraOptions {
    /// Number of states; chosen from the singular values if `None`.
    pub order: Option<usize>,
    /// Number of block rows and of block columns of the Hankel matrix; `(taps - 1) / 2 - 1` if `None`, but at most 300
    /// rows or columns, because larger matrices are less accurate for noisy taps.
    pub blocks: Option<usize>,
}

/// A realization, with the singular values that its order was chosen from.
#[derive(Clone, Debug, PartialEq)]
pub struct Era {
    /// The realized model, which is balanced: both Gramians of the finite Hankel matrix are diag(s).
    pub system: StateSpace,
    /// Singular values of the block Hankel matrix, descending: all of them, or as many as the order if this was given and
    /// the matrix is large.
    pub singular_values: Vec<f64>,
    /// Number of unstable poles that were reflected into the unit circle. They result from noise in the taps, because a
    /// true unstable mode would make the taps grow.
    pub reflected: usize,
}

/// Realizes Markov parameters H_0, H_1, .., each (outputs, inputs), as a stable state space.
///
/// With the singular value decomposition `U S V^T` of the block Hankel matrix `[H_{i+j+1}]` and the shifted matrix
/// `[H_{i+j+2}]`: `A = S^-1/2 U^T [H_{i+j+2}] V S^-1/2`, `B = S^1/2 V^T E_1`, `C = E_1^T U S^1/2`, `D = H_0` (Ho and
/// Kalman 1966; Juang 1994, chapter 5), (T1) in the documentation's theory.
///
/// If the order is not given, it is the place where the singular values fall by a factor of 20. If there is no such place,
/// it is the smallest order for which the rest holds at most 1e-4 of the sum of squares.
///
/// ```
/// use gpi_core::linear::{EraOptions, TransferFunction, realize};
/// let truth = TransferFunction::new(&[1.0, 0.3], &[1.0, -1.2, 0.6])?.to_state_space()?;
/// let era = realize(&truth.markov(41), &EraOptions::default())?;
/// assert_eq!(era.system.order(), 2);
/// assert!((era.system.dc_gain()?[0] - truth.dc_gain()?[0]).abs() < 1e-9);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// There are too few taps for the order or the blocks, the taps differ in size or are not finite, or the realization
/// cannot be made stable.
pub fn realize(markov: &[Matrix], options: &EraOptions) -> Result<Era, Error> {
    let hankel = Hankel::of_order(markov, options.blocks, options.order)?;
    hankel.realize(options.order.unwrap_or_else(|| hankel.suggested_order()))
}

/// A decomposed block Hankel matrix, from which models of any order are realized.
pub(crate) struct Hankel {
    decomposition: Svd,
    shifted: Matrix,
    direct: Matrix,
}

impl Hankel {
    /// The full decomposition, for any order.
    pub(crate) fn new(markov: &[Matrix], blocks: Option<usize>) -> Result<Self, Error> {
        Self::of_order(markov, blocks, None)
    }

    fn of_order(
        markov: &[Matrix],
        blocks: Option<usize>,
        order: Option<usize>,
    ) -> Result<Self, Error> {
        let taps = markov.len();
        Error::require_samples(taps, 3, "Markov parameters for a Hankel matrix")?;
        let (outputs, inputs) = markov[0].shape();
        let requirement = "outputs x inputs of a tap; at least one of each is needed";
        let size = format!("{outputs} x {inputs}");
        Error::require(outputs > 0 && inputs > 0, "markov", size, requirement)?;
        let longest = (LARGEST / outputs.max(inputs)).max(1);
        let blocks = blocks.unwrap_or(((taps - 1) / 2).saturating_sub(1).clamp(1, longest));
        let most = (taps - 1) / 2;
        let requirement = format!("{taps} taps allow between 1 and {most} Hankel blocks");
        Error::require((1..=most).contains(&blocks), "blocks", blocks, requirement)?;
        for tap in markov {
            Error::require_equal("outputs", ("H_0", outputs), ("another tap", tap.nrows()))?;
            Error::require_equal("inputs", ("H_0", inputs), ("another tap", tap.ncols()))?;
            Error::require_finite("markov", tap)?;
        }
        // each block column of the Hankel matrix is a part of the stacked taps
        let mut stacked = Matrix::zeros(taps * outputs, inputs);
        for (lag, tap) in markov.iter().enumerate() {
            stacked.rows_mut(lag * outputs, outputs).copy_from(tap);
        }
        let hankel = |shift: usize| {
            let mut matrix = Matrix::zeros(blocks * outputs, blocks * inputs);
            for block in 0..blocks {
                let part = stacked.rows((shift + block) * outputs, blocks * outputs);
                matrix.columns_mut(block * inputs, inputs).copy_from(&part);
            }
            matrix
        };
        let first = hankel(1);
        let is_large = blocks * outputs.min(inputs) >= LARGE;
        let few = order.filter(|&order| is_large && (1..=FEW).contains(&order));
        let leading = few.and_then(|order| leading_svd(&first, order));
        let decomposition = leading.map_or_else(|| svd(&first), Ok)?;
        Ok(Self { decomposition, shifted: hankel(2), direct: markov[0].clone() })
    }

    /// Numerical rank: the number of singular values above rounding errors.
    pub(crate) fn rank(&self) -> usize {
        self.significant(ROUNDING)
    }

    /// The number of singular values above a fraction of the largest.
    pub(crate) fn significant(&self, fraction: f64) -> usize {
        let s = &self.decomposition.s;
        s.iter().take_while(|&&value| value > fraction * s[0] && value > 0.0).count()
    }

    /// The order that the singular values suggest, see [`realize`].
    pub(crate) fn suggested_order(&self) -> usize {
        choose_order(&self.decomposition.s[..self.rank()])
    }

    /// The balanced realization of an order, with unstable poles reflected.
    pub(crate) fn realize(&self, order: usize) -> Result<Era, Error> {
        let rank = self.rank();
        let requirement =
            format!("the Hankel matrix has rank {rank}; use at most that many states");
        Error::require(order <= rank, "order", order, requirement)?;
        let Svd { u, s, v } = &self.decomposition;
        let (outputs, inputs) = self.direct.shape();
        let root = |state: usize| s[state].sqrt();
        let left = Matrix::from_fn(u.nrows(), order, |i, j| u[(i, j)] / root(j));
        let right = Matrix::from_fn(v.nrows(), order, |i, j| v[(i, j)] / root(j));
        let (a, reflected) = stabilize(left.transpose() * &self.shifted * &right)?;
        let b = Matrix::from_fn(order, inputs, |i, j| v[(j, i)] * root(i));
        let c = Matrix::from_fn(outputs, order, |i, j| u[(i, j)] * root(j));
        let system = StateSpace::new(a, b, c, self.direct.clone())?;
        Ok(Era { system, singular_values: s.clone(), reflected })
    }
}

/// The order that positive singular values, descending, suggest.
fn choose_order(s: &[f64]) -> usize {
    let significant = s.iter().take_while(|&&value| value >= SIGNIFICANT * s[0]).count();
    let gap = (1..=significant).find(|&n| n == s.len() || s[n - 1] >= GAP * s[n]);
    if let Some(order) = gap {
        return order;
    }
    let total: f64 = s.iter().map(|value| value * value).sum();
    let mut rest = total;
    let cut = s.iter().position(|value| {
        rest -= value * value;
        rest <= REST * total
    });
    cut.map_or(s.len(), |index| index + 1)
}

/// Reflects unstable eigenvalues of `a` at the unit circle: z becomes 1 / conj(z). Returns their number too.
fn stabilize(a: Matrix) -> Result<(Matrix, usize), Error> {
    if a.is_empty() {
        return Ok((a, 0));
    }
    let (values, vectors) = eigen(&a)?;
    let limit = 1.0 - MARGIN;
    let reflected = values.iter().filter(|pole| pole.norm() > limit).count();
    if reflected == 0 {
        return Ok((a, 0));
    }
    let stable = values.map(|pole| {
        let modulus = pole.norm();
        if modulus > limit { pole / modulus * (1.0 / modulus).min(limit) } else { pole }
    });
    let scaled = &vectors * nalgebra::DMatrix::<Complex64>::from_diagonal(&stable);
    let modulus = values.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let remedy = "its poles are defective and cannot be reflected; use another order";
    let inverse = vectors.try_inverse().ok_or(Error::Unstable { modulus, remedy })?;
    let mended = (scaled * inverse).map(|value| value.re);
    let radius = super::decompose::eigenvalues(&mended)?;
    if radius.iter().all(|pole| pole.norm() < 1.0) {
        Ok((mended, reflected))
    } else {
        Err(Error::Unstable { modulus, remedy })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;

    #[test]
    fn two_inputs_and_outputs_are_recovered() {
        let a = Matrix::from_row_slice(3, 3, &[0.6, 0.3, 0.0, -0.3, 0.6, 0.1, 0.0, 0.2, -0.4]);
        let b = Matrix::from_row_slice(3, 2, &[1.0, 0.0, 0.5, -1.0, 0.0, 2.0]);
        let c = Matrix::from_row_slice(2, 3, &[1.0, 0.0, 1.0, 0.0, 1.0, -1.0]);
        let d = Matrix::from_row_slice(2, 2, &[0.1, 0.0, 0.0, -0.2]);
        let truth = StateSpace::new(a, b, c, d).unwrap();
        let era = realize(&truth.markov(41), &EraOptions::default()).unwrap();
        assert_eq!(era.system.order(), 3);
        for (found, expected) in era.system.markov(30).iter().zip(truth.markov(30)) {
            assert!((found - expected).amax() < 1e-10);
        }
        assert_eq!(era.singular_values.len(), 2 * 19);
    }

    #[test]
    fn unstable_poles_are_reflected_and_counted() {
        let growing =
            TransferFunction::new(&[1.0], &[1.0, -1.1]).unwrap().to_state_space().unwrap();
        let era = realize(&growing.markov(21), &EraOptions::default()).unwrap();
        assert_eq!((era.system.order(), era.reflected), (1, 1));
        assert!((era.system.spectral_radius().unwrap() - 1.0 / 1.1).abs() < 1e-9);
    }

    #[test]
    fn an_order_above_the_rank_is_refused() {
        let lag = TransferFunction::new(&[1.0], &[1.0, -0.5]).unwrap().to_state_space().unwrap();
        let options = EraOptions { order: Some(4), blocks: None };
        assert!(matches!(
            realize(&lag.markov(21), &options),
            Err(Error::Parameter { name: "order", .. })
        ));
        assert!(realize(&lag.markov(2), &EraOptions::default()).is_err());
    }
}
