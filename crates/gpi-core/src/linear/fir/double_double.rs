//! Arithmetic in twice the working precision (double-double): a number is the unevaluated sum of two `f64`.
//!
//! A sum of products then keeps the digits of the data even under cancellation, so a Gram matrix in this precision
//! determines as much of a regressor as its orthogonal decomposition does (Dekker 1971; Ogita, Rump and Oishi 2005).

use pulp::{Scalar, Simd};

/// `high + low` in each lane of a vector; |low| is at most half a unit in the last place of high.
#[derive(Clone, Copy, Debug)]
pub(super) struct DoubleDouble<S: Simd> {
    pub high: S::f64s,
    pub low: S::f64s,
}

/// A single number.
pub(super) type Number = DoubleDouble<Scalar>;

/// `a + b` and its rounding error.
#[inline(always)]
fn two_sum<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> (S::f64s, S::f64s) {
    let sum = simd.add_f64s(a, b);
    let part = simd.sub_f64s(sum, a);
    let left = simd.sub_f64s(a, simd.sub_f64s(sum, part));
    (sum, simd.add_f64s(left, simd.sub_f64s(b, part)))
}

/// `a b` and its rounding error.
#[inline(always)]
fn two_product<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> (S::f64s, S::f64s) {
    let product = simd.mul_f64s(a, b);
    (product, simd.mul_add_f64s(a, b, simd.neg_f64s(product)))
}

impl<S: Simd> DoubleDouble<S> {
    /// Normalizes: moves the large part of `low` to `high`.
    #[inline(always)]
    fn settled(self, simd: S) -> Self {
        let high = simd.add_f64s(self.high, self.low);
        let low = simd.sub_f64s(self.low, simd.sub_f64s(high, self.high));
        Self { high, low }
    }

    /// `a b`, exactly.
    #[inline(always)]
    pub(super) fn product(simd: S, a: S::f64s, b: S::f64s) -> Self {
        let (high, low) = two_product(simd, a, b);
        Self { high, low }
    }

    #[inline(always)]
    pub(super) fn plus(self, simd: S, other: Self) -> Self {
        let (high, rest) = two_sum(simd, self.high, other.high);
        let low = simd.add_f64s(rest, simd.add_f64s(self.low, other.low));
        Self { high, low }.settled(simd)
    }

    #[inline(always)]
    pub(super) fn times(self, simd: S, other: Self) -> Self {
        let (high, rest) = two_product(simd, self.high, other.high);
        let low = simd.mul_add_f64s(self.low, other.high, rest);
        let low = simd.mul_add_f64s(self.high, other.low, low);
        Self { high, low }.settled(simd)
    }
}

impl Number {
    pub(super) const ZERO: Self = Self { high: 0.0, low: 0.0 };

    pub(super) fn value(self) -> f64 {
        self.high + self.low
    }

    pub(super) fn sqrt(self) -> Self {
        let root = Self::from(self.high.sqrt());
        let rest = self + -(root * root);
        root + Self::from(rest.high / (2.0 * root.high))
    }
}

impl From<f64> for Number {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl std::ops::Add for Number {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.plus(Scalar, other)
    }
}

impl std::ops::AddAssign for Number {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl std::ops::Neg for Number {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl std::ops::Mul for Number {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.times(Scalar, other)
    }
}

impl std::ops::Div for Number {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = Self::from(self.high / other.high);
        let rest = self + -(quotient * other);
        quotient + Self::from(rest.high / other.high)
    }
}

/// Number of samples that is a multiple of the vector width of every processor.
pub(super) const WIDTH: usize = 8;

/// Lags that are summed at once: independent sums hide the latency of the additions.
const AT_ONCE: usize = 4;

/// Adds `sum_k target[k] source[lags - 1 + k - lag]` to the sum of each lag.
///
/// The length of `target` is a multiple of [`WIDTH`]; `source` has `lags - 1` elements more.
pub(super) fn lagged_products(target: &[f64], source: &[f64], sums: &mut [Number]) {
    struct Products<'a>(&'a [f64], &'a [f64], &'a mut [Number]);
    impl pulp::WithSimd for Products<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let Self(target, source, sums) = self;
            let largest = largest(simd, target) * largest(simd, source);
            if largest == 0.0 {
                return;
            }
            let mut end = source.len();
            for sums in sums.chunks_mut(AT_ONCE) {
                let source = &source[..end];
                end -= sums.len().min(end);
                match sums {
                    [a, b, c, d] => group(simd, target, source, largest, [a, b, c, d]),
                    [a, b, c] => group(simd, target, source, largest, [a, b, c]),
                    [a, b] => group(simd, target, source, largest, [a, b]),
                    [a] => group(simd, target, source, largest, [a]),
                    _ => {}
                }
            }
        }
    }
    debug_assert_eq!(target.len() % WIDTH, 0);
    debug_assert_eq!(source.len(), target.len() + sums.len() - 1);
    pulp::Arch::new().dispatch(Products(target, source, sums));
}

/// The largest absolute value.
#[inline(always)]
fn largest<S: Simd>(simd: S, values: &[f64]) -> f64 {
    let (vectors, rest) = S::as_simd_f64s(values);
    let mut sides = [simd.splat_f64s(0.0); 4];
    for vectors in vectors.chunks(sides.len()) {
        for (side, &vector) in sides.iter_mut().zip(vectors) {
            *side = simd.max_f64s(*side, simd.abs_f64s(vector));
        }
    }
    let most = sides.map(|side| simd.reduce_max_f64s(side));
    most.into_iter().chain(rest.iter().map(|value| value.abs())).fold(0.0, f64::max)
}

/// The sums of a few consecutive lags; the smallest lag ends where `source` ends.
///
/// Each sum starts at a number so large that every product is rounded to the same grid. The increments of the sum are
/// then exact, and so are the rounding errors of the products (Zielke and Drygalla 2003; Rump, Ogita and Oishi 2008).
#[inline(always)]
fn group<S: Simd, const LAGS: usize>(
    simd: S,
    target: &[f64],
    source: &[f64],
    largest: f64,
    sums: [&mut Number; LAGS],
) {
    let least = source.len() - target.len();
    let target = S::as_simd_f64s(target).0;
    let sources: [&[S::f64s]; LAGS] =
        std::array::from_fn(|i| &S::as_simd_f64s(&source[least - i..]).0[..target.len()]);
    let begin = 1.5 * (2.0 * largest * target.len() as f64).log2().ceil().exp2();
    let mut parts =
        [DoubleDouble::<S> { high: simd.splat_f64s(begin), low: simd.splat_f64s(0.0) }; LAGS];
    for k in 0..target.len() {
        for i in 0..LAGS {
            let sum = simd.mul_add_f64s(target[k], sources[i][k], parts[i].high);
            let negative = simd.sub_f64s(parts[i].high, sum);
            let rest = simd.mul_add_f64s(target[k], sources[i][k], negative);
            parts[i].high = sum;
            parts[i].low = simd.add_f64s(parts[i].low, rest);
        }
    }
    // a copy: an array that is read in a loop of its own would be stored to memory for every sample
    let ends: [DoubleDouble<S>; LAGS] = std::array::from_fn(|i| parts[i]);
    for (sum, part) in sums.into_iter().zip(&ends) {
        let (mut high, mut low) = ([begin; WIDTH], [0.0; WIDTH]);
        S::as_mut_simd_f64s(&mut high).0[0] = part.high;
        S::as_mut_simd_f64s(&mut low).0[0] = part.low;
        for (high, low) in high.into_iter().zip(low) {
            *sum += Number { high: high - begin, low };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cancels_is_not_lost() {
        let target = [1e16, 1.0, -1e16, 1.0, 0.0, 0.0, 0.0, 0.0];
        let mut source = vec![0.0; 5];
        source.extend([1.0; WIDTH]);
        let mut sums = [Number::ZERO; 6];
        lagged_products(&target, &source, &mut sums);
        assert_eq!(sums.map(Number::value), [2.0, 2.0 - 1e16, 1.0 - 1e16, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn arithmetic_has_twice_the_digits() {
        let third = Number::from(1.0) / Number::from(3.0);
        let one = third + third + third;
        assert!((one + Number::from(-1.0)).value().abs() < 1e-31);
        let root = Number::from(2.0).sqrt();
        assert!((root * root + Number::from(-2.0)).value().abs() < 1e-31);
        assert_eq!(
            Number::product(Scalar, 1.0 + 2f64.powi(-52), 1.0 + 2f64.powi(-52)).low,
            2f64.powi(-104)
        );
    }
}
