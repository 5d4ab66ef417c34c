//! Number types, and the arrays that hold parameters and states.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// A real number type that the operators run on: `f32` or `f64`.
pub trait Sample:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Into<f64>
    + Neg<Output = Self>
    + core::fmt::Debug
{
    /// The additive identity.
    const ZERO: Self;
    /// The multiplicative identity.
    const ONE: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// The difference between 1 and the next larger number.
    const EPSILON: Self;
    /// Whether the value is neither NaN nor infinite.
    fn finite(self) -> bool;
    /// The smaller of two values; `self` if either is NaN.
    #[inline]
    fn at_most(self, limit: Self) -> Self {
        if limit < self { limit } else { self }
    }
    /// The larger of two values; `self` if either is NaN.
    #[inline]
    fn at_least(self, limit: Self) -> Self {
        if limit > self { limit } else { self }
    }
    /// The values if the type is `f64`: selects the block kernels of the host.
    fn doubles(_: &[Self]) -> Option<&[f64]> {
        None
    }
    /// The mutable values if the type is `f64`.
    fn doubles_mut(_: &mut [Self]) -> Option<&mut [f64]> {
        None
    }
}

macro_rules! impl_sample {
    ($number:ty, $($doubles:item)*) => {
        impl Sample for $number {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const INFINITY: Self = <$number>::INFINITY;
            const EPSILON: Self = <$number>::EPSILON;
            fn finite(self) -> bool {
                self.is_finite()
            }
            $($doubles)*
        }
    };
}

impl_sample!(f32,);
impl_sample! {
    f64,
    fn doubles(values: &[Self]) -> Option<&[f64]> {
        Some(values)
    }
    fn doubles_mut(values: &mut [Self]) -> Option<&mut [f64]> {
        Some(values)
    }
}

/// Number of independent partial sums: one sum alone would wait for the latency of each addition.
const SIDE_BY_SIDE: usize = 4;

/// The sum of `term(i)` over `0..count`.
#[inline(always)]
pub(super) fn sum<T: Sample>(count: usize, mut term: impl FnMut(usize) -> T) -> T {
    let mut sums = [T::ZERO; SIDE_BY_SIDE];
    let whole = count - count % SIDE_BY_SIDE;
    let mut first = 0;
    while first < whole {
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum = *sum + term(first + i);
        }
        first += SIDE_BY_SIDE;
    }
    for i in whole..count {
        sums[0] = sums[0] + term(i);
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// An array of samples: `[T; N]` on firmware (no heap), `Vec<T>` on a host.
pub trait Storage:
    Clone + AsRef<[<Self as Storage>::Item]> + AsMut<[<Self as Storage>::Item]>
{
    /// The number type.
    type Item: Sample;
    /// The values.
    #[inline]
    fn values(&self) -> &[Self::Item] {
        self.as_ref()
    }
    /// The values, mutable.
    #[inline]
    fn values_mut(&mut self) -> &mut [Self::Item] {
        self.as_mut()
    }
    /// An array of the same length in which every element is `value`.
    fn filled(&self, value: Self::Item) -> Self;
}

/// Sorts `keys` in ascending order, and the arrays of `others` along with it (insertion sort, which is stable and needs
/// no heap).
pub(super) fn sort_by_key<S: Storage, const K: usize>(keys: &mut S, mut others: [&mut S; K]) {
    let keys = keys.values_mut();
    for next in 1..keys.len() {
        let mut place = next;
        while place > 0 && keys[place - 1] > keys[place] {
            keys.swap(place - 1, place);
            others.iter_mut().for_each(|other| other.values_mut().swap(place - 1, place));
            place -= 1;
        }
    }
}

impl<T: Sample, const N: usize> Storage for [T; N] {
    type Item = T;
    fn filled(&self, value: T) -> Self {
        [value; N]
    }
}

#[cfg(any(feature = "identify", test))]
impl<T: Sample> Storage for Vec<T> {
    type Item = T;
    fn filled(&self, value: T) -> Self {
        vec![value; self.len()]
    }
}
