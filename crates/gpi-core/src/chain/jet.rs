//! Numbers with their derivatives by a few variables (forward mode).

use std::ops::{Add, Mul, Neg, Sub};

/// A number and its derivatives by N variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jet<const N: usize> {
    pub value: f64,
    pub slopes: [f64; N],
}

impl<const N: usize> Jet<N> {
    /// A number that depends on no variable.
    pub(super) fn constant(value: f64) -> Self {
        Self { value, slopes: [0.0; N] }
    }

    /// The variable of a number.
    pub(super) fn variable(value: f64, number: usize) -> Self {
        let mut own = Self::constant(value);
        own.slopes[number] = 1.0;
        own
    }

    /// A function of the value, from its result and its derivative there.
    fn through(self, value: f64, slope: f64) -> Self {
        Self { value, slopes: self.slopes.map(|own| slope * own) }
    }

    pub(super) fn recip(self) -> Self {
        let value = self.value.recip();
        self.through(value, -value * value)
    }

    pub(super) fn exp(self) -> Self {
        let value = self.value.exp();
        self.through(value, value)
    }

    /// `(1 - exp(-x)) / x` for x >= 0, the mean of a decay.
    pub(super) fn mean_of_decay(self) -> Self {
        /// Where the series to the third power is exact to rounding.
        const SMALL: f64 = 1e-4;
        let x = self.value;
        if x < SMALL {
            let value = 1.0 - x * (1.0 / 2.0 - x * (1.0 / 6.0 - x / 24.0));
            return self.through(value, -1.0 / 2.0 + x * (1.0 / 3.0 - x / 8.0));
        }
        let value = -(-x).exp_m1() / x;
        self.through(value, ((-x).exp() - value) / x)
    }

    /// `x^p` for x >= 0 and p >= 1. At x = 0 all derivatives are those from the right; `x^p ln x` is 0 there.
    pub(super) fn power(self, exponent: Self) -> Self {
        let (x, p) = (self.value, exponent.value);
        let below = x.powf(p - 1.0);
        let value = below * x;
        let by_exponent = if x > 0.0 { value * x.ln() } else { 0.0 };
        self.through(value, p * below) + exponent.through(0.0, by_exponent)
    }
}

impl<const N: usize> Add for Jet<N> {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        self.slopes.iter_mut().zip(other.slopes).for_each(|(own, other)| *own += other);
        self
    }
}

impl<const N: usize> Sub for Jet<N> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const N: usize> Neg for Jet<N> {
    type Output = Self;

    fn neg(self) -> Self {
        self.through(-self.value, -1.0)
    }
}

impl<const N: usize> Mul for Jet<N> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let sum = self.through(0.0, other.value) + other.through(0.0, self.value);
        Self { value: self.value * other.value, ..sum }
    }
}

impl<const N: usize> Mul<f64> for Jet<N> {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        self.through(factor * self.value, factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_calculus() {
        let (x, p) = (Jet::<2>::variable(0.7, 0), Jet::variable(1.8, 1));
        let found = x.power(p) * 3.0 - (x * p + Jet::constant(2.0)).recip();
        let power = 0.7_f64.powf(1.8);
        let inverse = (0.7 * 1.8 + 2.0_f64).recip();
        assert!((found.value - (3.0 * power - inverse)).abs() < 1e-15);
        let by_x = 3.0 * 1.8 * 0.7_f64.powf(0.8) + inverse * inverse * 1.8;
        let by_p = 3.0 * power * 0.7_f64.ln() + inverse * inverse * 0.7;
        assert!((found.slopes[0] - by_x).abs() < 1e-14 && (found.slopes[1] - by_p).abs() < 1e-14);
        let found = (x * 2.0).exp();
        assert_eq!((found.value, found.slopes), (1.4_f64.exp(), [2.0 * 1.4_f64.exp(), 0.0]));
        for x in [0.0, 5e-5, 0.3, 40.0] {
            let of = |x: f64| Jet::<1>::variable(x, 0).mean_of_decay();
            let exact = if x > 0.0 { -f64::exp_m1(-x) / x } else { 1.0 };
            assert!((of(x).value - exact).abs() < 1e-14);
            let difference = (of(x + 1e-5).value - of(x).value) / 1e-5;
            assert!((of(x + 5e-6).slopes[0] - difference).abs() < 1e-9, "{x}");
        }
        let zero = Jet::<2>::variable(0.0, 0).power(Jet::variable(1.0, 1));
        assert_eq!(zero, Jet { value: 0.0, slopes: [1.0, 0.0] });
    }
}
