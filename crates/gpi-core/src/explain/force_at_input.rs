//! Forces inside the mechanics that enter where the input does.
//!
//! A loop drives the states of G by a column E of its own, as many numbers as G has states. Where w is a force on the mass that the
//! input moves, one number is enough: `E = -f b` with the column b by which the input enters ([`Drives::Input`]). Numbers that
//! the data hardly determine move the force in steady state, which is printed in physical terms. A model in which all forces enter
//! with the input is therefore taken where it explains nearly as much: with J the training squares and T the held-out ones,
//!
//! ```text
//! J_input <= (1 + p) J,      T_input <= (1 + p) T,
//! ```
//!
//! for the part p below which parts of the model are negligible ([`super::policy`]). Near the noise, the training squares may grow
//! by `N ln(J_input / J) <= q ln N` only for the q numbers that it saves. It begins at the same force in steady state,
//! and with either hold of v between samples where loops take several steps.

use super::state::SearchState;
use crate::Error;
use crate::chain::point::Point;
use crate::effects::{Drives, InnerLoop};
use crate::progress::Progress;
use crate::{Hold, Intersample};

/// Lets all forces inside the mechanics enter where the input does, if that explains nearly as much.
pub(super) fn enter_with_input(state: &mut SearchState, progress: Progress) -> Result<(), Error> {
    let Some(point) = with_input(&state.point) else { return Ok(()) };
    let present = point.intersample;
    let holds = if present.is_plain() { vec![present.hold] } else { vec![Hold::First, Hold::Zero] };
    let is_far = state.cost > state.setup.policy.judgement.near_noise * state.noise_squares()?;
    let (values, unknowns) = (state.prepared.values(), |point| state.setup.unknowns(point) as f64);
    let saved = unknowns(&state.point) - unknowns(&point);
    let most =
        if is_far { f64::INFINITY } else { (saved * values.ln() / values).exp() * state.cost };
    let mut best: Option<(Point, f64)> = None;
    for hold in holds {
        let mut point = point.clone();
        point.intersample = Intersample { hold, ..present };
        let fitted = state.fit(point, &state.setup.options, "rearrangement", progress)?;
        let least = best.as_ref().map_or(most, |&(_, cost)| cost);
        if fitted.linearization.cost <= least && state.explains_nearly_as_much(&fitted)? {
            best = Some((fitted.point, fitted.linearization.cost));
        }
    }
    if let Some(best) = best {
        (state.point, state.cost) = best;
    }
    Ok(())
}

/// The point in which every loop drives what its input drives, with the same force in steady state; `None` where all do, where there is
/// no such force, where a state has a limit, or where there are several inputs or outputs.
fn with_input(point: &Point) -> Option<Point> {
    let is_single = point.channels.len() == 1 && point.dynamics.outputs() == 1;
    let is_own = |inner: &InnerLoop| matches!(inner.drives, Drives::States(_));
    // what exceeds a limit is taken from a state, and is no force
    let has_limits = point.loops().any(|inner| inner.law.limits());
    if !is_single || has_limits || !point.loops().any(is_own) {
        return None;
    }
    let states = point.dynamics.order();
    let over_stiffness = |inner: &InnerLoop| Some(point.steady_force(inner)?.over_stiffness);
    let force = |inner: &InnerLoop| {
        let drives = Drives::Input { input: 0, force: 1.0, states };
        Some(over_stiffness(inner)? / over_stiffness(&InnerLoop { drives, ..inner.clone() })?)
    };
    let forces: Vec<f64> = point.loops().map(force).collect::<Option<_>>()?;
    if !forces.iter().all(|force| force.is_finite()) {
        return None;
    }
    let mut moved = point.clone();
    for (inner, force) in moved.loops_mut().zip(forces) {
        inner.drives = Drives::Input { input: 0, force, states };
    }
    Some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Intersample;
    use crate::chain::plain::plain;
    use crate::effects::{Law, Sees, Stiffness};

    /// A resonance behind a dead time, with a cubic force and a damping.
    fn point(intersample: Intersample) -> Point {
        let around = |law, drives: [f64; 2]| InnerLoop {
            sees: Sees::Output(0),
            law,
            drives: Drives::States(drives.to_vec()),
        };
        let cubic = Law::Power { exponent: 3, scale: 0.5 };
        let loops =
            vec![around(cubic, [-0.04, -0.03]), around(Law::Damping { scale: 0.1 }, [0.01, 0.03])];
        let mut point = plain(&[0.3, 0.1], &[1.0, -1.6, 0.8], vec![Stiffness { loops }.into()]);
        point.dynamics.delay = 2;
        point.intersample = intersample;
        point
    }

    #[test]
    fn the_force_in_steady_state_is_kept() {
        let fine = Intersample { substeps: 4, hold: Hold::First };
        for intersample in [Intersample::default(), fine] {
            let point = point(intersample);
            let moved = with_input(&point).unwrap();
            assert!(with_input(&moved).is_none());
            for (before, after) in point.loops().zip(moved.loops()) {
                let of = |point: &Point, inner| point.steady_force(inner).unwrap().over_stiffness;
                let [before, after] = [of(&point, before), of(&moved, after)];
                assert!((before - after).abs() < 1e-12 * before.abs(), "{before} {after}");
            }
        }
    }
}
