//! Sums of products of a window of samples, and the regression that they give.
//!
//! Let r be the residual, `phi_1 .. phi_n` what it would contain per unit of each possible change, and
//! `r(k) = sum_i d_i phi_i(k) + m(k) + w(k)` with white noise w of standard deviation s and an error m that is known to be
//! possible. The sums `sum_k phi_i phi_j`, `sum_k phi_i r` and `sum_k r^2` of a window are all that least squares needs.
//! The sweep operator (J. H. Goodnight, *A tutorial on the SWEEP operator*, The American Statistician 33, 1979) takes one
//! regressor after the other into the regression, in place, and out again.
//!
//! Errors of which samples are known, such as those that uncertain parameters cause, are draws `e_1 .. e_D` whose squares add
//! up to the variance. The sums `sum_k phi_i e_j` tell what each of them does to an estimate.

use crate::operators::{Sample, Storage};

/// A pivot below this part of its regressor's own sum is rounding: what the others leave of it is nothing.
const DEPENDENT: f64 = 1e-6;

/// Sums over a window of samples.
///
/// `S` holds for each i the products of `phi_i` with `phi_i .. phi_n, e_1 .. e_D, r`, row by row, and at last that of r with
/// itself: [`Moments::length`] numbers, an array on firmware.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments<S: Storage> {
    products: S,
    /// Number of samples.
    pub samples: S::Item,
    /// `sum_k m(k)^2`, the square sum of an error that may have any shape.
    pub known: S::Item,
    /// `sum_k sum_j e_j(k)^2`.
    pub drawn: S::Item,
}

impl<S: Storage> Moments<S> {
    /// Empty sums, in the storage of `products`.
    pub fn like(products: &S) -> Self {
        let zero = S::Item::ZERO;
        Self { products: products.filled(zero), samples: zero, known: zero, drawn: zero }
    }

    /// The number of products of n regressors and D draws: `n (n + 1) / 2 + n (D + 1) + 1`.
    pub const fn length(regressors: usize, draws: usize) -> usize {
        regressors * (regressors + 1) / 2 + regressors * (draws + 1) + 1
    }

    /// Counts one sample: what each change would add to the residual, the draws of the error, the residual, and `m(k)^2`.
    #[inline]
    pub fn add(
        &mut self,
        regressors: &[S::Item],
        draws: &[S::Item],
        residual: S::Item,
        known: S::Item,
    ) {
        let values = self.products.values_mut();
        let mut place = 0;
        for (i, &left) in regressors.iter().enumerate() {
            for &right in &regressors[i..] {
                values[place] = values[place] + left * right;
                place += 1;
            }
            for &right in draws {
                values[place] = values[place] + left * right;
                place += 1;
            }
            values[place] = values[place] + left * residual;
            place += 1;
        }
        values[place] = values[place] + residual * residual;
        self.samples = self.samples + S::Item::ONE;
        self.known = self.known + known;
        draws.iter().for_each(|&draw| self.drawn = self.drawn + draw * draw);
    }

    /// The sums of two windows together.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mut both = self.clone();
        let pairs = both.products.values_mut().iter_mut().zip(other.products.values());
        pairs.for_each(|(sum, &value)| *sum = *sum + value);
        both.samples = both.samples + other.samples;
        both.known = both.known + other.known;
        both.drawn = both.drawn + other.drawn;
        both
    }

    /// The sums of what is left of this window without a part of it.
    #[must_use]
    pub fn without(&self, part: &Self) -> Self {
        let mut rest = self.clone();
        let pairs = rest.products.values_mut().iter_mut().zip(part.products.values());
        pairs.for_each(|(sum, &value)| *sum = *sum - value);
        rest.samples = rest.samples - part.samples;
        rest.known = rest.known - part.known;
        rest.drawn = rest.drawn - part.drawn;
        rest
    }

    /// The sums for regressors that are zero in this window, except those that `is_there` names; `count` is their number.
    #[must_use]
    pub fn with_only(&self, count: usize, is_there: impl Fn(usize) -> bool) -> Self {
        let mut sums = self.clone();
        let columns = self.columns(count);
        let mut place = 0;
        for i in 0..count {
            for j in i..columns {
                if [i, j].into_iter().any(|i| i < count && !is_there(i)) {
                    sums.products.values_mut()[place] = S::Item::ZERO;
                }
                place += 1;
            }
        }
        sums
    }

    /// The regression of the residual on no regressor yet; `count` is the number n of regressors.
    pub fn regression(&self, count: usize) -> Regression<S> {
        let columns = self.columns(count);
        Regression { swept: self.products.clone(), own: self.products.clone(), count, columns }
    }

    /// The number of regressors, draws and the residual together.
    fn columns(&self, count: usize) -> usize {
        let rows = self.products.values().len() - 1;
        (rows + count * count.saturating_sub(1) / 2).checked_div(count).unwrap_or(1)
    }
}

/// A regression of the residual on some of the regressors.
#[derive(Clone, Debug)]
pub struct Regression<S: Storage> {
    swept: S,
    own: S,
    count: usize,
    columns: usize,
}

impl<S: Storage> Regression<S> {
    fn place(&self, i: usize, j: usize) -> usize {
        let (low, high) = if i < j { (i, j) } else { (j, i) };
        if low >= self.count {
            return self.swept.values().len() - 1;
        }
        low * (2 * self.columns - low - 1) / 2 + high
    }

    /// The column of the residual.
    fn residual(&self) -> usize {
        self.columns - 1
    }

    fn at(&self, i: usize, j: usize) -> S::Item {
        self.swept.values()[self.place(i, j)]
    }

    /// Takes a regressor into the regression; false, without any change, if it depends on those that are in, or
    /// is zero.
    pub fn enter(&mut self, regressor: usize) -> bool {
        let own = self.own.values()[self.place(regressor, regressor)];
        let pivot = self.at(regressor, regressor);
        if pivot.into() <= DEPENDENT * own.into() || pivot <= S::Item::ZERO {
            return false;
        }
        self.sweep(regressor, pivot, S::Item::ONE);
        true
    }

    /// Takes a regressor that is in the regression out again.
    pub fn leave(&mut self, regressor: usize) {
        self.sweep(regressor, self.at(regressor, regressor), -S::Item::ONE);
    }

    /// Replaces the pivot d by `-1 / d`, its row by `sign row / d`, and the rest by the Schur complement; `sign` is 1 to
    /// enter, and -1 to leave.
    fn sweep(&mut self, k: usize, pivot: S::Item, sign: S::Item) {
        let residual = self.residual();
        let rows = (0..self.count).flat_map(|i| (i..self.columns).map(move |j| (i, j)));
        for (i, j) in rows.chain([(residual, residual)]).filter(|&(i, j)| i != k && j != k) {
            let place = self.place(i, j);
            let less = self.at(i, k) * self.at(k, j) / pivot;
            let value = self.swept.values()[place] - less;
            self.swept.values_mut()[place] = value;
        }
        for i in (0..self.columns).filter(|&i| i != k) {
            let place = self.place(i, k);
            let value = sign * self.swept.values()[place] / pivot;
            self.swept.values_mut()[place] = value;
        }
        let place = self.place(k, k);
        self.swept.values_mut()[place] = -S::Item::ONE / pivot;
    }

    /// The estimated change of a regressor that is in the regression.
    pub fn change(&self, regressor: usize) -> S::Item {
        self.at(regressor, self.residual())
    }

    /// The sum of squares that the regression leaves.
    pub fn left(&self) -> S::Item {
        self.at(self.residual(), self.residual()).at_least(S::Item::ZERO)
    }

    /// The change of one regressor over its standard error for noise of deviation 1, with its sign: of one that is in the
    /// regression, or would enter it; zero if it cannot enter.
    pub fn deviation(&self, regressor: usize, is_in: bool) -> f64 {
        self.divisor(regressor, is_in)
            .map_or(0.0, |divisor| self.change(regressor).into() / divisor)
    }

    /// The variance of this deviation by the draws of the error.
    pub fn drawn(&self, regressor: usize, is_in: bool) -> f64 {
        let Some(divisor) = self.divisor(regressor, is_in) else { return 0.0 };
        let of = |draw: usize| {
            let deviation = self.at(regressor, draw).into() / divisor;
            deviation * deviation
        };
        (self.count..self.residual()).map(of).sum()
    }

    /// What a product of the regressor, with the residual or a draw, is divided by for a deviation.
    fn divisor(&self, regressor: usize, is_in: bool) -> Option<f64> {
        let information = self.at(regressor, regressor);
        if is_in {
            return Some(square_root((-information).into()));
        }
        let own = self.own.values()[self.place(regressor, regressor)];
        let can_enter = information > S::Item::ZERO && information.into() > DEPENDENT * own.into();
        can_enter.then(|| square_root(information.into()))
    }
}

/// The square root by Newton's method: `core` has none without std.
pub(super) fn square_root(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 0.0;
    }
    // half the exponent is right within a factor of two
    let mut root = f64::from_bits((value.to_bits() >> 1) + (0x1ff8_u64 << 48));
    for _ in 0..5 {
        root = 0.5 * (root + value / root);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums() -> Moments<[f64; 10]> {
        let mut sums = Moments::like(&[0.0; 10]);
        for k in 0..200 {
            let t = f64::from(k);
            let phi = [1.0, (0.3 * t).sin(), (0.3 * t).sin() + 0.1 * (0.9 * t).cos()];
            sums.add(&phi, &[], 0.5 * phi[0] - 2.0 * phi[2], 0.01);
        }
        sums
    }

    #[test]
    fn the_regression_finds_what_is_there() {
        let sums = sums();
        let mut regression = sums.regression(3);
        for i in [1, 2, 0] {
            assert!(regression.enter(i));
        }
        for (i, expected) in [0.5, 0.0, -2.0].into_iter().enumerate() {
            assert!((regression.change(i) - expected).abs() < 1e-9, "{i}");
        }
        assert!(regression.left() < 1e-9);
        assert!((sums.known - 2.0).abs() < 1e-12);
    }

    #[test]
    fn leaving_undoes_entering() {
        let mut regression = sums().regression(3);
        regression.enter(0);
        let before = regression.swept;
        regression.enter(2);
        regression.leave(2);
        for (a, b) in regression.swept.iter().zip(&before) {
            assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()), "{a} {b}");
        }
    }

    #[test]
    fn a_dependent_regressor_does_not_enter() {
        let mut sums = Moments::like(&[0.0; 6]);
        (0..50).for_each(|k| sums.add(&[1.0, 3.0], &[], f64::from(k), 0.0));
        let mut regression = sums.regression(2);
        assert!(regression.enter(0) && !regression.enter(1));
        assert_eq!(regression.deviation(1, false), 0.0);
    }

    #[test]
    fn a_draw_does_what_a_residual_of_its_shape_would_do() {
        let mut sums = Moments::like(&[0.0; Moments::<[f64; 1]>::length(2, 1)]);
        for k in 0..300 {
            let t = f64::from(k);
            let phi = [1.0, (0.3 * t).sin()];
            let error = 0.3 + 0.2 * (0.29 * t).sin();
            sums.add(&phi, &[error], error, 0.0);
        }
        let mut regression = sums.regression(2);
        let agree = |regression: &Regression<_>, i, is_in| {
            let (own, drawn) = (regression.deviation(i, is_in), regression.drawn(i, is_in));
            assert!((own * own / drawn - 1.0).abs() < 1e-9, "{i}: {own} {drawn}");
        };
        agree(&regression, 0, false);
        regression.enter(0);
        agree(&regression, 0, true);
        agree(&regression, 1, false);
        let only = sums.with_only(2, |i| i == 1).regression(2);
        assert_eq!(
            [only.drawn(0, false), only.drawn(1, false)],
            [0.0, sums.regression(2).drawn(1, false)]
        );
    }

    #[test]
    fn windows_add_up() {
        let sums = sums();
        let both = sums.with(&sums);
        assert_eq!(both.samples, 400.0);
        let (mut one, mut two) = (sums.regression(3), both.regression(3));
        one.enter(1);
        two.enter(1);
        assert!((one.change(1) - two.change(1)).abs() < 1e-12);
        let ratio = two.deviation(1, true) / one.deviation(1, true);
        assert!((ratio - 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn square_roots_are_those_of_the_library() {
        for value in [1e-300, 2e-9, 0.3, 1.0, 2.0, 1e7, 3e250] {
            assert!((square_root(value) / value.sqrt() - 1.0).abs() < 1e-14, "{value}");
        }
        assert_eq!([square_root(0.0), square_root(-1.0), square_root(f64::NAN)], [0.0; 3]);
    }
}
