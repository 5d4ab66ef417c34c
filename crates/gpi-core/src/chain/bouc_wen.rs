//! One step of Bouc and Wen's hysteretic force along the path of z, with its derivatives.
//!
//! The force w follows z by
//!
//! ```text
//! dw = dz - (beta |dz| w + gamma dz |w|) |w|^(n-1)
//! ```
//!
//! which depends on the path of z and not on its speed. Over a change `dz = s l` in one direction, with the sign s and the
//! length l, the size g = |w| of the force obeys
//!
//! ```text
//! dg/dl = -1 - k g^n,   k = beta - gamma      unloading, w and s of opposite signs
//! dg/dl =  1 - k g^n,   k = beta + gamma      loading, w and s of the same sign
//! ```
//!
//! Unloading ends at zero after the length `l_0 = integral of 1 / (1 + k x^n) over x from 0 to g`, by Gauss's quadrature; the
//! rest of the change is loading. Each part is integrated by the classical method of Runge and Kutta, with as many steps as
//! make `n k g^(n-1) l` small, the shortest near zero. A long loading would take many steps, because the force approaches its limit
//! `G = k^(-1/n)`. There, the part e that is missing decays at a rate that hardly changes, and is integrated instead:
//!
//! ```text
//! e = 1 - g / G,      d ln(e) / d(l / G) = -(1 - (1 - e)^n) / e,      between -1 at e = 1 and -n at e = 0
//! ```
//!
//! All numbers carry their derivatives ([`Jet`]), which are therefore those of the numerical solution.
//!
//! A z that turns back between two samples goes by way of its [turning point](turning_point).
//!
//! Source: Y.-K. Wen, *Method for random vibration of hysteretic systems*, J. Eng. Mech. Div. ASCE 102, 1976.

use super::jet::Jet;
use super::turning_point::turning_point;

/// A number with its derivatives by the force at the sample before, z, z one and two samples before, beta, gamma and n.
type Number = Jet<7>;

/// Largest `n k g^(n-1) l` of one step of Runge and Kutta: its error is of the order of the fifth power.
const STIFF: f64 = 0.05;
/// `n k g^(n-1) l` of a loading beyond which the missing part is integrated instead.
const LONG: f64 = 1.0;
/// Most steps of one part of a change.
const STEPS: f64 = 100.0;
/// Fewest steps: g^n bends near zero.
const FEWEST: f64 = 3.0;
/// Steps of the missing part: longest n l / G, longest part of g / G, and the shortest l / G at g = 0. By hand: the error of a change
/// stays below 1e-6, see the test `a_change_solves_the_equation`.
const LONGEST: f64 = 0.2;
const GROWTH: f64 = 0.3;
const FIRST: f64 = 0.001;
/// Most steps of the missing part. A usual law needs about 100; values that are no law would need any number of steps.
const MOST: usize = 200;
/// A missing part whose rate of decay is taken as constant, and one whose rate is that of the series to the second power.
const NEGLIGIBLE: f64 = 1e-7;
const SMALL: f64 = 1e-4;
/// Nodes `x^2` and weights `2 x w` of Gauss's quadrature of `2 x f(x^2)` from 0 to 1, where f bends like a power at zero.
const NODES: [(f64, f64); 8] = [
    (0.000_394_223_874_247, 0.002_009_899_851_318),
    (0.010_336_130_351_846, 0.022_608_759_545_903),
    (0.056_279_873_509_952, 0.074_421_818_131_456),
    (0.166_694_745_769_052, 0.148_077_506_617_691),
    (0.350_129_388_264_702, 0.214_606_276_760_671),
    (0.581_812_283_426_281, 0.239_284_827_746_431),
    (0.807_002_607_765_473, 0.199_772_274_907_471),
    (0.960_684_080_371_783, 0.099_218_636_439_059),
];

/// beta, gamma and the exponent n.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub beta: f64,
    pub gamma: f64,
    pub exponent: f64,
}

/// The force at a sample, and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub force: f64,
    /// By the force at the sample before, z, z one and two samples before, beta, gamma and the exponent.
    pub slopes: [f64; 7],
}

impl Step {
    /// From the force at the sample before, for the last three samples of z, the newest first.
    pub(super) fn new(force: f64, z: [f64; 3], shape: Shape) -> Self {
        let [now, before, _] = [0, 1, 2].map(|i| Number::variable(z[i], 1 + i));
        let law = Law {
            beta: Number::variable(shape.beta, 4),
            gamma: Number::variable(shape.gamma, 5),
            exponent: Number::variable(shape.exponent, 6),
        };
        let mut w = Number::variable(force, 0);
        let mut from = before;
        if let Some(turn) = turning_point(z) {
            w = law.changed(w, turn.z - from);
            from = turn.z;
        }
        w = law.changed(w, now - from);
        Self { force: w.value, slopes: w.slopes }
    }
}

struct Law {
    beta: Number,
    gamma: Number,
    exponent: Number,
}

impl Law {
    /// The force behind a change of z in one direction.
    fn changed(&self, force: Number, dz: Number) -> Number {
        let sign = if dz.value < 0.0 { -1.0 } else { 1.0 };
        let (along, mut length) = (force * sign, dz * sign);
        let loading = self.beta + self.gamma;
        let mut size = along;
        if along.value < 0.0 {
            let unloading = self.beta - self.gamma;
            let to_zero = self.to_zero(-along, unloading);
            match to_zero.filter(|to_zero| to_zero.value < length.value) {
                None => return self.integrated(-along, length, unloading, -1.0) * -sign,
                Some(to_zero) => {
                    length = length - to_zero;
                    size = Number::constant(0.0);
                }
            }
        }
        self.integrated(size, length, loading, 1.0) * sign
    }

    /// The length after which a force of this size is zero; `None` where it never is.
    fn to_zero(&self, size: Number, k: Number) -> Option<Number> {
        let one = Number::constant(1.0);
        let slope = |x: Number| one + k * x.power(self.exponent);
        (slope(size).value > 0.0).then(|| {
            let node = |&(node, weight): &(f64, f64)| slope(size * node).recip() * weight;
            size * NODES.iter().map(node).fold(Number::constant(0.0), |sum, own| sum + own)
        })
    }

    /// `dg/dl = direction - k g^n` over a length.
    fn integrated(&self, size: Number, length: Number, k: Number, direction: f64) -> Number {
        let n = self.exponent.value;
        let most = size.value.max(size.value + direction * length.value);
        let stiff = n * k.value.abs() * most.max(0.0).powf(n - 1.0) * length.value;
        if stiff > LONG && direction > 0.0 && k.value > 0.0 {
            return self.approached(size, length, k);
        }
        let steps = (stiff / STIFF).min(STEPS - 1.0).floor() + FEWEST;
        // shortest near zero, where g^n bends
        let part = |step: f64| if direction > 0.0 { step } else { steps - 1.0 - step };
        let slope = |g: Number| {
            // rounding at zero
            let g = if g.value < 0.0 { Number::constant(0.0) } else { g };
            Number::constant(direction) - k * g.power(self.exponent)
        };
        let mut g = size;
        for step in 0..steps as usize {
            let h = length * ((2.0 * part(step as f64) + 1.0) / (steps * steps));
            let first = slope(g);
            let second = slope(g + h * first * 0.5);
            let third = slope(g + h * second * 0.5);
            let last = slope(g + h * third);
            g = g + h * (first + (second + third) * 2.0 + last) * (1.0 / 6.0);
        }
        g
    }

    /// The same of a long loading, which approaches a limit: the missing part is integrated.
    fn approached(&self, size: Number, length: Number, k: Number) -> Number {
        let (one, n) = (Number::constant(1.0), self.exponent);
        let limit = k.power(-n.recip());
        let scale = limit.recip();
        let rate = |missing: Number| {
            if missing.value.abs() < SMALL {
                let second = n * (n - one) * 0.5;
                let third = second * (n - one * 2.0) * (1.0 / 3.0);
                return n - second * missing + third * missing * missing;
            }
            (one - (one - missing).power(n)) * missing.recip()
        };
        let (mut missing, mut left) = (one - size * scale, length * scale);
        let mut steps = 0;
        while left.value > 0.0 {
            steps += 1;
            let reached = (1.0 - missing.value).max(0.0);
            let longest = (GROWTH * reached + FIRST).min(LONGEST / n.value.max(1.0));
            let is_missed = missing.value.abs() >= NEGLIGIBLE;
            let is_last = !is_missed || steps == MOST || longest >= left.value;
            let step = if is_last { left } else { Number::constant(longest) };
            let first = rate(missing);
            let mut decay = first;
            if is_missed {
                let after = |part: f64, rate: Number| missing * (-(step * rate * part)).exp();
                let second = rate(after(0.5, first));
                let third = rate(after(0.5, second));
                let last = rate(after(1.0, third));
                decay = (first + (second + third) * 2.0 + last) * (1.0 / 6.0);
            }
            missing = missing * (-(step * decay)).exp();
            left = left - step;
        }
        limit * (one - missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn changed(force: f64, dz: f64, shape: Shape) -> f64 {
        let [beta, gamma, exponent] =
            [shape.beta, shape.gamma, shape.exponent].map(Number::constant);
        let law = Law { beta, gamma, exponent };
        law.changed(Number::constant(force), Number::constant(dz)).value
    }

    /// The equation by many short steps of the midpoint rule.
    fn integrated(mut force: f64, dz: f64, shape: Shape) -> f64 {
        const STEPS: usize = 20_000;
        let Shape { beta, gamma, exponent } = shape;
        let step = dz / STEPS as f64;
        let change = |w: f64| {
            step - (beta * step.abs() * w + gamma * step * w.abs()) * w.abs().powf(exponent - 1.0)
        };
        for _ in 0..STEPS {
            force += change(force + 0.5 * change(force));
        }
        force
    }

    #[test]
    fn a_change_solves_the_equation() {
        // softening, stiffening, and Dahl's friction; loading, unloading, and unloading past zero
        for (beta, gamma) in [(0.8, -1.1), (0.8, 0.5), (2.0, 0.0), (0.0, 0.0), (0.5, -0.5)] {
            for exponent in [1.0, 1.4, 2.0] {
                for (force, dz) in [(0.3, 0.4), (0.5, -0.2), (0.2, -0.7), (-0.4, 0.9), (0.0, -0.3)]
                {
                    let shape = Shape { beta, gamma, exponent };
                    let error = changed(force, dz, shape) - integrated(force, dz, shape);
                    assert!(error.abs() < 1e-6, "{shape:?} {force} {dz}: {error}");
                }
            }
        }
    }

    #[test]
    fn friction_saturates() {
        // Dahl: the force ends at 1 / beta
        let shape = Shape { beta: 4.0, gamma: 0.0, exponent: 1.0 };
        assert!((changed(0.0, 12.0, shape) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn values_that_are_no_law_take_a_limited_time() {
        for (beta, exponent) in [(1e6, 400.0), (1e300, 1e300), (1e-300, 1e12), (2.0, f64::NAN)] {
            let shape = Shape { beta, gamma: 0.0, exponent };
            for (force, dz) in [(1e9, 1e12), (0.0, 1e300), (-1e300, 1e200), (f64::NAN, 1.0)] {
                // whatever it is
                let _ = changed(force, dz, shape);
            }
        }
    }

    #[test]
    fn a_motion_that_turns_goes_by_way_of_the_turning_point() {
        // the parabola 4 - (t + 1/2)^2 at t = 0, -1, -2
        let shape = Shape { beta: 0.8, gamma: 0.3, exponent: 1.3 };
        let there = changed(0.1, 0.25, shape);
        let found = Step::new(0.1, [3.75, 3.75, 1.75], shape).force;
        assert_eq!(found, changed(there, -0.25, shape));
    }

    proptest! {
        #[test]
        fn slopes_are_derivatives(
            force in -1.0..1.0_f64,
            now in -1.0..1.0_f64,
            before in -1.0..1.0_f64,
            older in -1.0..1.0_f64,
            beta in 0.0..2.0_f64,
            part_of_beta in -1.0..1.5_f64,
            exponent in 1.1..2.5_f64,
        ) {
            const STEP: f64 = 1e-6;
            let gamma = part_of_beta * beta;
            let at = |moved: [f64; 7]| {
                let [f, z0, z1, z2, b, g, n] = moved;
                let z = [now + z0, before + z1, older + z2];
                let shape = Shape { beta: beta + b, gamma: gamma + g, exponent: exponent + n };
                Step::new(force + f, z, shape)
            };
            // no derivative where loading turns into unloading
            let turn = turning_point::<7>([now, before, older]).map_or(now, |turn| turn.z.value);
            prop_assume!(force.abs() > 1e-3 && (now - before).abs() > 1e-4);
            prop_assume!((turn - before).abs() > 1e-4);
            prop_assume!(turn == now || (now - turn).abs() > 1e-4);
            for (place, slope) in at([0.0; 7]).slopes.into_iter().enumerate() {
                let mut moved = [0.0; 7];
                moved[place] = STEP;
                let there = at(moved);
                let back = at(moved.map(|value| -value));
                let difference = (there.force - back.force) / (2.0 * STEP);
                // the force passes zero at the end of a part, or the number of steps changes
                let bends = there.slopes.iter().zip(&back.slopes).any(|(a, b)| (a - b).abs() > 1e-4);
                prop_assert!(bends || (slope - difference).abs() < 1e-3, "{place}: {slope} {difference}");
            }
        }

        #[test]
        fn two_changes_are_one(
            force in -1.0..1.0_f64,
            dz in -1.0..1.0_f64,
            part in 0.0..1.0_f64,
            beta in 0.0..2.0_f64,
            part_of_beta in -1.0..1.5_f64,
            exponent in 1.0..2.5_f64,
        ) {
            // a force that stiffens on loading may become infinite
            let shape = Shape { beta, gamma: part_of_beta * beta, exponent };
            let half = changed(force, part * dz, shape);
            let found = changed(half, (1.0 - part) * dz, shape);
            prop_assert!((found - changed(force, dz, shape)).abs() < 1e-5);
        }
    }
}
