//! How unknowns change what loops see and drive.
//!
//! The coefficients of [`Between`] depend on the sections of G, its D, and what each loop sees and drives, by logarithms and
//! exponentials of A. Their derivatives are central differences. Each is a factor of a recorded signal: of the states, of v,
//! or of an earlier w ([`super::injections`]).

use super::between::{Between, Row};
use super::group::Group;
use super::loops::loops_of;
use super::point::Point;
use crate::effects::{InnerLoop, Place};
use crate::linear::Sections;

/// Step of the differences, relative to a value or 1. By hand: its square, by which curvature counts, is 1e-10, and rounding
/// over the step is 1e-11.
const STEP: f64 = 1e-5;

/// Loops around G, to be changed.
pub(super) struct AroundLoops<'a> {
    point: &'a Point,
    loops: Vec<InnerLoop>,
}

impl<'a> AroundLoops<'a> {
    pub(super) fn new(point: &'a Point) -> Self {
        Self { loops: point.loops().cloned().collect(), point }
    }

    /// The derivatives by the unknowns of a group, in order; empty ones where an unknown changes nothing.
    pub(super) fn by(&self, group: Group) -> Vec<Between> {
        match group {
            _ if self.loops.is_empty() => Vec::new(),
            Group::Effect { place } => self.of_loops(place),
            _ => self.of_dynamics(group),
        }
    }

    /// By the values of a group of the dynamics. D follows where the DC gain is held.
    fn of_dynamics(&self, group: Group) -> Vec<Between> {
        let values = values_of(&mut self.point.dynamics.clone(), group).to_vec();
        let by = |(unknown, value): (usize, &f64)| {
            difference(*value, |step| {
                let mut dynamics = self.point.dynamics.clone();
                values_of(&mut dynamics, group)[unknown] += step;
                dynamics.hold_gain();
                Between::of_sections(&dynamics, &self.loops, self.point.intersample)
            })
        };
        values.iter().enumerate().map(by).collect()
    }

    /// By the values of the loops of an effect. Those of a law change nothing here.
    fn of_loops(&self, place: usize) -> Vec<Between> {
        let effects = &self.point.effects;
        let Place::Loops(closed) = effects[place].place() else { return Vec::new() };
        let first = loops_of(&effects[..place]).count();
        let mut found = Vec::new();
        for (number, inner) in (first..).zip(closed.loops()) {
            let values: Vec<f64> =
                inner.clone().linear_values_mut().into_iter().map(|own| *own).collect();
            for (unknown, value) in values.into_iter().enumerate() {
                found.push(difference(value, |step| {
                    let mut loops = self.loops.clone();
                    *loops[number].linear_values_mut()[unknown] += step;
                    Between::of_sections(&self.point.dynamics, &loops, self.point.intersample)
                }));
            }
            found.extend((0..inner.law.values()).map(|_| Between::default()));
        }
        found
    }
}

/// The values of a group of the dynamics.
fn values_of(dynamics: &mut Sections, group: Group) -> &mut [f64] {
    match group {
        Group::Denominator { section } => &mut dynamics.sections[section].a,
        Group::Numerator { section } => dynamics.sections[section].b.as_mut_slice(),
        Group::Observer { section } => dynamics.sections[section].c.as_mut_slice(),
        Group::Feedthrough { input, output } => {
            let place = output + input * dynamics.d.nrows();
            &mut dynamics.d.as_mut_slice()[place..=place]
        }
        _ => &mut [],
    }
}

/// The central difference at a value.
fn difference(value: f64, mut moved: impl FnMut(f64) -> Between) -> Between {
    let step = STEP * value.abs().max(1.0);
    let (there, back) = (moved(step), moved(-step));
    there.combined(&back, |there, back| (there - back) / (2.0 * step))
}

impl Between {
    /// A function of every coefficient and that of another one.
    fn combined(&self, other: &Self, function: impl Fn(f64, f64) -> f64) -> Self {
        let of = |one: &[f64], other: &[f64]| -> Vec<f64> {
            one.iter().zip(other).map(|(one, other)| function(*one, *other)).collect()
        };
        let rows = self.seen.iter().zip(&other.seen).map(|(one, other)| Row {
            states: of(&one.states, &other.states),
            inputs: of(&one.inputs, &other.inputs),
            next: of(&one.next, &other.next),
            earlier: of(&one.earlier, &other.earlier),
        });
        let drives = self.drives.iter().zip(&other.drives).map(|(one, other)| of(one, other));
        Self { seen: rows.collect(), drives: drives.collect() }
    }
}
