//! One step of Dahl's friction along the path of z, with its derivatives.
//!
//! ```text
//! df = (dz - |dz| f) / d
//! ```
//!
//! Over a change dz of one direction with the sign s, the friction f approaches s: `f = s + (f_1 - s) exp(-|dz| / d)`. A z that turns
//! back between two samples goes by way of its [turning point](turning_point).
//!
//! Where f is smooth, it is the force at the sample. Where d is short, f changes its sign within a sample. What acts on the mechanics until the
//! next sample is then
//!
//! ```text
//! w = m + f - f_1,      m = mean of f over the last sample
//! ```
//!
//! f is what will act in the next sample as far as is known, f_1 was that of the last sample, and m what should have acted there: the sum of
//! all w is exact up to the last sample. Where f jumps, w depends smoothly on the time of the jump, and so does the output. Where f is
//! smooth, w is the rule of Adams and Bashforth of second order, `(3 f - f_1) / 2`. For the mean, z is linear in time on both sides of a
//! turning point:
//!
//! ```text
//! mean over a change = s + (f_1 - s) (1 - exp(-x)) / x,      x = |dz| / d
//! ```
//!
//! Source: P. R. Dahl, *Solid friction damping of mechanical vibrations*, AIAA Journal 14, 1976.

use super::jet::Jet;
use super::turning_point::{TurningPoint, turning_point};

/// A number with its derivatives by f at the sample before, z, z one and two samples before, and d.
pub(super) type Number = Jet<5>;

/// f and w behind f at the sample before, for the last three samples of z, the newest first, the break-away distance and the
/// lead.
pub(super) fn friction(f: f64, z: [f64; 3], distance: f64, averaged: bool) -> [Number; 2] {
    let [now, before, _] = [0, 1, 2].map(|i| Number::variable(z[i], 1 + i));
    let pace = Number::variable(distance, 4).recip();
    let last = Number::variable(f, 0);
    let (f, mean) = match turning_point(z) {
        Some(TurningPoint { z, time }) => {
            let (turned, before) = moved(last, z - before, pace);
            let (f, after) = moved(turned, now - z, pace);
            (f, before + (before - after) * time)
        }
        None => moved(last, now - before, pace),
    };
    [f, if averaged { mean + f - last } else { f }]
}

/// f behind a change of z in one direction, and its mean over it.
fn moved(f: Number, dz: Number, pace: Number) -> (Number, Number) {
    let sign = if dz.value < 0.0 { -1.0 } else { 1.0 };
    let part = dz * sign * pace;
    let approaches = |left: Number| f * left + (Number::constant(1.0) - left) * sign;
    (approaches((-part).exp()), approaches(part.mean_of_decay()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn it_ends_at_one() {
        let values = |f: f64, z: [f64; 3], d: f64| friction(f, z, d, true).map(|own| own.value);
        let [f, w] = values(0.0, [6.0, 0.0, -6.0], 0.5);
        let left = (-12.0_f64).exp();
        assert!((f - (1.0 - left)).abs() < 1e-15);
        assert!((w - (1.0 - (1.0 - left) / 12.0 + f)).abs() < 1e-15);
        // rests where z rests
        assert_eq!(values(0.3, [1.0; 3], 0.5), [0.3, 0.3]);
    }

    #[test]
    fn a_motion_that_turns_goes_by_way_of_the_turning_point() {
        // the parabola 4 - (t + 1/2)^2 at t = 0, -1, -2
        let [f, w] = friction(0.1, [3.75, 3.75, 1.75], 0.5, true);
        let of = |f: f64, dz: f64| {
            let (f, mean) = moved(Number::constant(f), Number::constant(dz), Number::constant(2.0));
            (f.value, mean.value)
        };
        let (up, down) = (of(0.1, 0.25), of(of(0.1, 0.25).0, -0.25));
        assert!((f.value - down.0).abs() < 1e-15);
        assert!((w.value - (0.5 * (up.1 + down.1) + f.value - 0.1)).abs() < 1e-15);
    }

    #[test]
    fn coulombs_friction_is_exact_in_the_mean_and_smooth_in_the_time_of_a_jump() {
        // z turns at a part of the last sample, and f jumps from 1 to -1
        for part in [0.1, 0.4, 0.9] {
            let z = [0.0, 1.0, 2.0].map(|ago: f64| -(part - ago).powi(2));
            let [f, w] = friction(1.0, z, 1e-6, true);
            assert_eq!(f.value, -1.0);
            assert!((w.value - (1.0 - 2.0 * part - 2.0)).abs() < 1e-4, "{part}: {}", w.value);
        }
    }

    proptest! {
        #[test]
        fn two_changes_are_one(w in -1.0..1.0_f64, dz in -1.0..1.0_f64, part in 0.0..1.0_f64) {
            let pace = Number::constant(3.0);
            let by = |w: f64, dz: f64| {
                moved(Number::constant(w), Number::constant(dz), pace).0.value
            };
            prop_assert!((by(by(w, part * dz), (1.0 - part) * dz) - by(w, dz)).abs() < 1e-14);
        }

        #[test]
        fn slopes_are_derivatives(
            w in -1.0..1.0_f64,
            now in -1.0..1.0_f64,
            before in -1.0..1.0_f64,
            older in -1.0..1.0_f64,
            distance in 0.1..2.0_f64,
        ) {
            const STEP: f64 = 1e-6;
            let at = |moved: [f64; 5]| {
                let [f, z0, z1, z2, d] = moved;
                friction(w + f, [now + z0, before + z1, older + z2], distance + d, true)
            };
            // no derivative where the direction changes
            let turn = turning_point::<5>([now, before, older]).map_or(now, |turn| turn.z.value);
            prop_assume!((now - before).abs() > 1e-4 && (turn - before).abs() > 1e-4);
            prop_assume!(turn == now || (now - turn).abs() > 1e-4);
            for (place, output) in [0, 1].into_iter().flat_map(|o| (0..5).map(move |p| (p, o))) {
                let mut moved = [0.0; 5];
                moved[place] = STEP;
                let slope = at([0.0; 5])[output].slopes[place];
                let there = at(moved)[output].value;
                let back = at(moved.map(|own| -own))[output].value;
                let difference = (there - back) / (2.0 * STEP);
                prop_assert!((slope - difference).abs() < 1e-3 * (1.0 + slope.abs()), "{place}: {slope} {difference}");
            }
        }
    }
}
