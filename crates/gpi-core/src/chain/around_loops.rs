//! How unknowns change what loops see and drive.
//!
//! The coefficients of [`Between`] depend on the sections of G, its D, and what each loop sees and drives, by logarithms and
//! exponentials of A. Their derivatives are central differences, which are exact to about nine digits. Each is a factor of a recorded signal: of the
//! states, of v, or of an earlier w ([`super::injections`]).

use super::between::{Between, Row};
use super::point::Point;
use super::table::Group;
use crate::Intersample;
use crate::effects::{InnerLoop, Place};
use crate::linear::Sections;

/// Step of the differences, relative to a value or 1. By hand: rounding and curvature are both about 1e-10 of a coefficient.
const STEP: f64 = 1e-5;

/// Loops around G, to be changed.
pub(super) struct AroundLoops<'a> {
    point: &'a Point,
    loops: Vec<InnerLoop>,
    intersample: Intersample,
}

impl<'a> AroundLoops<'a> {
    pub(super) fn new(point: &'a Point) -> Self {
        Self { loops: point.loops().cloned().collect(), intersample: point.intersample, point }
    }

    /// The derivatives by the first unknowns of a group, in order; those that follow change none.
    pub(super) fn by(&self, group: Group) -> Vec<Between> {
        if self.loops.is_empty() {
            return Vec::new();
        }
        let of_dynamics = |value: fn(&mut Sections, Group) -> &mut [f64]| {
            let mut dynamics = self.point.dynamics.clone();
            let count = value(&mut dynamics, group).len();
            let moved = |unknown: usize, step: f64| {
                let mut dynamics = self.point.dynamics.clone();
                value(&mut dynamics, group)[unknown] += step;
                dynamics.hold_gain();
                Between::of_sections(&dynamics, &self.loops, self.intersample)
            };
            let values = value(&mut dynamics, group).to_vec();
            (0..count)
                .map(|unknown| difference(values[unknown], |step| moved(unknown, step)))
                .collect()
        };
        match group {
            Group::Denominator { .. }
            | Group::Numerator { .. }
            | Group::Observer { .. }
            | Group::Feedthrough { .. } => of_dynamics(values_of),
            Group::Effect { place } => self.of_loops(place),
            _ => Vec::new(),
        }
    }

    /// By what the loops of an effect see and drive; zero for the values of a law.
    fn of_loops(&self, place: usize) -> Vec<Between> {
        let effects = &self.point.effects;
        let Place::Loops(closed) = effects[place].place() else { return Vec::new() };
        let before = effects[..place].iter().filter_map(|effect| effect.place().closed_loops());
        let first: usize = before.map(|other| other.loops().len()).sum();
        let mut found = Vec::new();
        for (number, inner) in (first..).zip(closed.loops()) {
            let mut values = inner.clone();
            let linear = values.linear_values_mut().into_iter().map(|own| *own);
            for (unknown, value) in linear.collect::<Vec<f64>>().into_iter().enumerate() {
                found.push(difference(value, |step| {
                    let mut loops = self.loops.clone();
                    *loops[number].linear_values_mut()[unknown] += step;
                    Between::of_sections(&self.point.dynamics, &loops, self.intersample)
                }));
            }
            let nothing = || {
                let none =
                    Between::of_sections(&self.point.dynamics, &self.loops, self.intersample);
                none.combined(&none, |_, _| 0.0)
            };
            found.extend((0..inner.law.values()).map(|_| nothing()));
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
