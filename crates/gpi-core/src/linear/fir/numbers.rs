//! Sequences of numbers in twice the working precision, high and low parts apart, so that vectors of them are added at
//! once.

use super::double_double::{DoubleDouble, Number};
use pulp::{Scalar, Simd};
use std::ops::Range;

/// A sequence of numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    pub high: Vec<f64>,
    pub low: Vec<f64>,
}

/// Consecutive numbers of a sequence.
pub(super) struct Part<'a> {
    high: &'a [f64],
    low: &'a [f64],
}

/// Consecutive numbers of a sequence, to be changed.
pub(super) struct PartMut<'a> {
    high: &'a mut [f64],
    low: &'a mut [f64],
}

impl<'a> Extend<&'a Number> for Numbers {
    fn extend<I: IntoIterator<Item = &'a Number>>(&mut self, numbers: I) {
        for number in numbers {
            self.high.push(number.high);
            self.low.push(number.low);
        }
    }
}

impl Numbers {
    pub(super) fn zeros(count: usize) -> Self {
        Self { high: vec![0.0; count], low: vec![0.0; count] }
    }

    pub(super) fn get(&self, place: usize) -> Number {
        Number { high: self.high[place], low: self.low[place] }
    }

    pub(super) fn set(&mut self, place: usize, number: Number) {
        (self.high[place], self.low[place]) = (number.high, number.low);
    }

    pub(super) fn swap(&mut self, one: usize, other: usize) {
        self.high.swap(one, other);
        self.low.swap(one, other);
    }

    pub(super) fn part(&self, at: Range<usize>) -> Part<'_> {
        Part { high: &self.high[at.clone()], low: &self.low[at] }
    }

    pub(super) fn part_mut(&mut self, at: Range<usize>) -> PartMut<'_> {
        PartMut { high: &mut self.high[at.clone()], low: &mut self.low[at] }
    }

    /// A part to be changed, and one that comes before it.
    pub(super) fn split(
        &mut self,
        before: Range<usize>,
        at: Range<usize>,
    ) -> (Part<'_>, PartMut<'_>) {
        let (first_high, high) = self.high.split_at_mut(at.start);
        let (first_low, low) = self.low.split_at_mut(at.start);
        let count = at.len();
        let first = Part { high: &first_high[before.clone()], low: &first_low[before] };
        (first, PartMut { high: &mut high[..count], low: &mut low[..count] })
    }
}

impl PartMut<'_> {
    /// Adds the numbers of another part of the same length.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, other: Part) {
        self.increase(simd, other, Itself);
    }

    /// Subtracts `factor` times the numbers of another part of the same length.
    #[inline(always)]
    pub(super) fn subtract<S: Simd>(&mut self, simd: S, factor: Number, other: Part) {
        self.increase(simd, other, Multiple(-factor));
    }

    /// Adds `factor` times each of `values`, exactly before each sum is rounded.
    #[inline(always)]
    pub(super) fn add_products<S: Simd>(&mut self, simd: S, factor: f64, values: &[f64]) {
        self.increase(simd, Part { high: values, low: values }, MultipleOfHigh(factor));
    }

    #[inline(always)]
    fn increase<S: Simd, A: Addend>(&mut self, simd: S, other: Part, addend: A) {
        let (high, high_rest) = S::as_simd_f64s(other.high);
        let (low, low_rest) = S::as_simd_f64s(other.low);
        let (own_high, own_high_rest) = S::as_mut_simd_f64s(self.high);
        let (own_low, own_low_rest) = S::as_mut_simd_f64s(self.low);
        let vectors = own_high.iter_mut().zip(own_low).zip(high.iter().zip(low));
        for ((own_high, own_low), (&high, &low)) in vectors {
            let own = DoubleDouble { high: *own_high, low: *own_low };
            let own = own.plus(simd, addend.of(simd, DoubleDouble { high, low }));
            (*own_high, *own_low) = (own.high, own.low);
        }
        let rest = own_high_rest.iter_mut().zip(own_low_rest).zip(high_rest.iter().zip(low_rest));
        for ((own_high, own_low), (&high, &low)) in rest {
            let own = Number { high: *own_high, low: *own_low };
            let own = own.plus(Scalar, addend.of(Scalar, Number { high, low }));
            (*own_high, *own_low) = (own.high, own.low);
        }
    }
}

/// What is added to a number for another one.
trait Addend: Copy {
    fn of<S: Simd>(self, simd: S, other: DoubleDouble<S>) -> DoubleDouble<S>;
}

/// The other number.
#[derive(Clone, Copy)]
struct Itself;

impl Addend for Itself {
    #[inline(always)]
    fn of<S: Simd>(self, _: S, other: DoubleDouble<S>) -> DoubleDouble<S> {
        other
    }
}

/// A multiple of the other number.
#[derive(Clone, Copy)]
struct Multiple(Number);

impl Addend for Multiple {
    #[inline(always)]
    fn of<S: Simd>(self, simd: S, other: DoubleDouble<S>) -> DoubleDouble<S> {
        let Number { high, low } = self.0;
        DoubleDouble { high: simd.splat_f64s(high), low: simd.splat_f64s(low) }.times(simd, other)
    }
}

/// A multiple of the other number's high part, exactly.
#[derive(Clone, Copy)]
struct MultipleOfHigh(f64);

impl Addend for MultipleOfHigh {
    #[inline(always)]
    fn of<S: Simd>(self, simd: S, other: DoubleDouble<S>) -> DoubleDouble<S> {
        DoubleDouble::product(simd, simd.splat_f64s(self.0), other.high)
    }
}
