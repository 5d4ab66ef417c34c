//! The balance of forces of a mass with a spring and a damper: what a force inside the mechanics explains, without a simulation.
//!
//! A mass on a spring and a damper that forces w_i of its displacement y act on obeys
//!
//! ```text
//! m y'' + c y' + k y + sum_i f_i w_i + o = u
//! ```
//!
//! which is linear in m, c, k, the f_i and o. Both sides pass the filter `1 / (s^2 + a_1 s + a_0)`, so that y is not
//! differentiated, and its poles become those of the balance in a few iterations (the iteration of Sanathanan and Koerner, and of Steiglitz
//! and McBride): the error of the balance is then that of the output. u is held between samples, and all other signals are linear. Each run of scored
//! samples begins with a free response of the filter, off which everything is projected.
//!
//! What a force explains is the part of the squares of the balance without it, `1 - S / S_0`. A simulation is not needed for it,
//! which matters where the output integrates the forces: there a small force is soon a large displacement.
//!
//! Source: H. Garnier and L. Wang (editors), *Identification of continuous-time models from sampled data*, Springer, 2008.

use super::policy::BalancePolicy;
use crate::effects::{InnerLoop, Law, Sees};
use crate::linear::{Section, Sections, TransferFunction, zero_order_hold};
use crate::{Error, Experiment, Matrix, Record};
use nalgebra::{DVector, Matrix2, Vector2};
use num_complex::Complex64;

/// Mass, damping and stiffness in units of the input, with time in samples, and the forces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Balance {
    /// k, c, m.
    pub mechanics: [f64; 3],
    /// f_i.
    pub forces: Vec<f64>,
    /// The part of the squares of the balance without forces that they explain.
    pub explained: f64,
    /// a_1 and a_0 of the filter.
    filter: [f64; 2],
    /// k, c, m, o without forces, and with them.
    solutions: [DVector<f64>; 2],
}

/// The balance with forces; `None` where it has no solution, or the loops do not see the displacement.
pub(super) fn balance(
    record: &Record,
    delay: usize,
    loops: &[InnerLoop],
    policy: &BalancePolicy,
) -> Option<Balance> {
    if loops.iter().any(|inner| inner.sees != Sees::Output(0)) {
        return None;
    }
    let laws: Vec<&Law> = loops.iter().map(|inner| &inner.law).collect();
    let runs = runs(record, delay, &laws);
    let samples: usize = runs.iter().map(Matrix::nrows).sum();
    let [slowest, least] =
        [policy.slowest, policy.least_pole].map(|own| own / samples.max(1) as f64);
    // as fast as the output changes
    let pace = policy.faster * speed(&runs);
    let mut filter = [2.0 * pace, pace * pace];
    let mut found = None;
    for _ in 0..policy.iterations {
        let gram = runs.iter().map(|run| gram(run, filter)).reduce(|sum, next| sum + next)?;
        let with = solve(&gram, gram.ncols() - 1)?;
        let without = solve(&gram, UNFORCED)?;
        let [k, c, m] = [0, 1, 2].map(|i| with.unknowns[i]);
        let next = stable([c / m, k / m], slowest)?;
        let own = stable([c / m, k / m], least)?;
        let forces = with.unknowns.as_slice()[UNFORCED..].to_vec();
        let mechanics = [own[1] * m, own[0] * m, m];
        let explained = 1.0 - with.squares / without.squares;
        let solutions = [without.unknowns, with.unknowns];
        found = Some(Balance { mechanics, forces, explained, filter, solutions });
        filter = next;
    }
    found.filter(|own| own.explained.is_finite() && own.mechanics.iter().all(|own| own.is_finite()))
}

/// The squares of the balance in each run of scored samples of a record, without forces and with them.
pub(super) fn squares(
    balance: &Balance,
    record: &Record,
    delay: usize,
    loops: &[InnerLoop],
) -> [Vec<f64>; 2] {
    let laws: Vec<&Law> = loops.iter().map(|inner| &inner.law).collect();
    let runs = runs(record, delay, &laws);
    let grams: Vec<Matrix> = runs.iter().map(|run| gram(run, balance.filter)).collect();
    balance.solutions.clone().map(|unknowns| {
        let error = |gram: &Matrix| {
            // of u less what the unknowns make of the other columns
            let mut factors = DVector::zeros(gram.ncols());
            factors.rows_mut(0, unknowns.len()).copy_from(&unknowns);
            factors[gram.ncols() - 1] = -1.0;
            factors.dot(&(gram * &factors)).max(0.0)
        };
        grams.iter().map(error).collect()
    })
}

impl Balance {
    /// o, in units of the input.
    pub(super) fn offset(&self) -> f64 {
        self.solutions[1][UNFORCED - 1]
    }

    /// The time constant m/c of the speed, in samples.
    pub(super) fn time_constant(&self) -> f64 {
        let [_, damping, mass] = self.mechanics;
        mass / damping
    }

    /// The linear mechanics behind an input of so much gain that is held between samples; `growth` as in [`Section::growth`].
    pub(super) fn dynamics(&self, gain: f64, delay: usize, growth: f64) -> Result<Sections, Error> {
        let [k, c, m] = self.mechanics;
        let continuous = TransferFunction::new(&[1.0 / (m * gain)], &[1.0, c / m, k / m])?;
        let system = zero_order_hold(&continuous.to_state_space()?, 1.0)?;
        let sections = Sections::from_state_space(&system, delay)?.sections;
        // apart, a pole at 1 can be held there
        let apart = |section: Section| {
            let poles = section.poles();
            if poles.iter().any(|pole| pole.im != 0.0) {
                return vec![section];
            }
            poles.iter().filter_map(|own| section.with_poles(|pole| pole == own)).collect()
        };
        let sections = sections.into_iter().flat_map(apart);
        let sections = sections.map(|section| Section { growth, ..section }).collect();
        Ok(Sections { delay, sections, d: Matrix::zeros(1, 1), held: vec![None] })
    }
}

/// Columns of a run: y, u, and w of each law.
const OUTPUT: usize = 0;
const INPUT: usize = 1;
/// Unknowns without forces: k, c, m, o.
const UNFORCED: usize = 4;

/// The signals of each run of scored samples, (samples, 2 + laws).
fn runs(record: &Record, delay: usize, laws: &[&Law]) -> Vec<Matrix> {
    let of = |experiment: &Experiment| -> Vec<Matrix> {
        let signals = |run: std::ops::Range<usize>| {
            let (first, rows) = (run.start, run.len());
            let mut signals = Matrix::zeros(rows, 2 + laws.len());
            let y = experiment.output.column(0);
            signals.column_mut(OUTPUT).copy_from(&y.rows(first, rows));
            for k in 0..rows {
                signals[(k, INPUT)] = experiment.input[((first + k).saturating_sub(delay), 0)];
            }
            for (number, law) in laws.iter().enumerate() {
                let (mut places, mut marks) = (law.at_rest(y[first]), vec![0.0; law.marks()]);
                for k in 0..rows {
                    signals[(k, 2 + number)] = law.step(&mut places, y[first + k], 1.0, &mut marks);
                }
            }
            signals
        };
        experiment.scored_runs().filter(|run| run.len() > 2 * UNFORCED).map(signals).collect()
    };
    record.experiments().iter().flat_map(of).collect()
}

/// The root mean square change of y from sample to sample over its standard deviation.
fn speed(runs: &[Matrix]) -> f64 {
    let (mut changes, mut squares) = (0.0, 0.0);
    for run in runs {
        let y = run.column(OUTPUT);
        let mean = y.mean();
        squares += y.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
        changes += y.iter().zip(y.iter().skip(1)).map(|(a, b)| (b - a).powi(2)).sum::<f64>();
    }
    (changes / squares.max(f64::MIN_POSITIVE)).sqrt()
}

/// A second-order filter `1 / (s^2 + a_1 s + a_0)`: the states are its output and the derivative of it. Where its input is linear between
/// samples, `x+ = A x + B_0 u(k) + B_1 u(k + 1)`; where it is held, `x+ = A x + (B_0 + B_1) u(k)`.
struct Filter {
    a: Matrix2<f64>,
    b: [Vector2<f64>; 2],
}

impl Filter {
    fn new([a1, a0]: [f64; 2]) -> Self {
        let generator = Matrix::from_row_slice(
            4,
            4,
            &[0.0, 1.0, 0.0, 0.0, -a0, -a1, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        );
        let exponential = generator.exp();
        let column = |j: usize| Vector2::new(exponential[(0, j)], exponential[(1, j)]);
        let a = Matrix2::from_columns(&[column(0), column(1)]);
        Self { a, b: [column(2) - column(3), column(3)] }
    }

    /// Its states at each sample from rest.
    fn states(&self, signal: impl Iterator<Item = f64>) -> Vec<Vector2<f64>> {
        let (mut state, mut before) = (Vector2::zeros(), None);
        let mut next = |now: f64| {
            if let Some(before) = before.replace(now) {
                state = self.a * state + self.b[0] * before + self.b[1] * now;
            }
            state
        };
        signal.map(&mut next).collect()
    }

    /// The same where the signal is held.
    fn states_held(&self, signal: impl Iterator<Item = f64>) -> Vec<Vector2<f64>> {
        let mut state = Vector2::zeros();
        let next = |now: f64| {
            let then = self.a * state + (self.b[0] + self.b[1]) * now;
            std::mem::replace(&mut state, then)
        };
        signal.map(next).collect()
    }

    /// Its free responses from either state, (samples, 2).
    fn free(&self, rows: usize) -> Matrix {
        let mut free = Matrix::zeros(rows, 2);
        let mut states = Matrix2::identity();
        for k in 0..rows {
            free.row_mut(k).copy_from(&states.row(0));
            states = self.a * states;
        }
        free
    }
}

/// Products of all filtered columns of a run: y, y', y'', 1, the forces and, last, u.
fn gram(run: &Matrix, poles: [f64; 2]) -> Matrix {
    let filter = Filter::new(poles);
    let [a1, a0] = poles;
    let (rows, forces) = (run.nrows(), run.ncols() - 2);
    let columns = UNFORCED + forces + 1;
    let mut filtered = Matrix::zeros(rows, columns);
    let y = filter.states(run.column(OUTPUT).iter().copied());
    for (k, state) in y.iter().enumerate() {
        let second = run[(k, OUTPUT)] - a1 * state[1] - a0 * state[0];
        filtered.fixed_view_mut::<1, 3>(k, 0).copy_from_slice(&[state[0], state[1], second]);
    }
    let mut pass = |place: usize, signal: &mut dyn Iterator<Item = f64>| {
        let states = filter.states(signal);
        states.iter().enumerate().for_each(|(k, state)| filtered[(k, place)] = state[0]);
    };
    pass(UNFORCED - 1, &mut (0..rows).map(|_| 1.0));
    for force in 0..forces {
        pass(UNFORCED + force, &mut run.column(2 + force).iter().copied());
    }
    let u = filter.states_held(run.column(INPUT).iter().copied());
    u.iter().enumerate().for_each(|(k, state)| filtered[(k, columns - 1)] = state[0]);
    let free = filter.free(rows).qr().q();
    let rest = &filtered - &free * (free.transpose() * &filtered);
    rest.transpose() * &rest
}

struct Solution {
    unknowns: DVector<f64>,
    squares: f64,
}

/// The least squares solution in the first unknowns.
fn solve(gram: &Matrix, count: usize) -> Option<Solution> {
    /// Far above rounding, and far below what data determine.
    const RIDGE: f64 = 1e-13;
    let last = gram.ncols() - 1;
    let scale = DVector::from_fn(count, |i, _| gram[(i, i)].max(f64::MIN_POSITIVE).sqrt());
    let own = Matrix::from_fn(count, count, |i, j| {
        gram[(i, j)] / (scale[i] * scale[j]) + if i == j { RIDGE } else { 0.0 }
    });
    let rhs = DVector::from_fn(count, |i, _| gram[(i, last)] / scale[i]);
    let scaled = own.cholesky()?.solve(&rhs);
    let squares = (gram[(last, last)] - scaled.dot(&rhs)).max(f64::MIN_POSITIVE);
    Some(Solution { unknowns: scaled.component_div(&scale), squares })
}

/// A denominator `s^2 + a_1 s + a_0` with its poles in the left half plane, and none slower than a limit.
fn stable([a1, a0]: [f64; 2], slowest: f64) -> Option<[f64; 2]> {
    let root = Complex64::new(0.25 * a1 * a1 - a0, 0.0).sqrt();
    let left = |pole: Complex64| {
        let stable = Complex64::new(-pole.re.abs(), pole.im);
        if stable.norm() < slowest { Complex64::new(-slowest, 0.0) } else { stable }
    };
    let [p, q] = [-0.5 * a1 + root, -0.5 * a1 - root].map(left);
    let found = [-(p + q).re, (p * q).re];
    found.iter().all(|own| own.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    const SAMPLES: usize = 6000;

    /// The break-away distance.
    const DISTANCE: f64 = 0.05;

    /// A mass with Dahl's friction by `m y'' + c y' + k y + F f = u`, in small steps, with noise of this span.
    fn stage([m, c, k]: [f64; 3], friction: f64, noise: f64) -> Record {
        const STEPS: usize = 20;
        let h = 1.0 / STEPS as f64;
        let (mut y, mut speed, mut rubbing, mut state) = (0.2, 0.0, 0.0, 1_u32);
        let (mut input, mut output) = (Vec::new(), Vec::new());
        for sample in 0..SAMPLES {
            let t = sample as f64;
            let u = (0.013 * t).sin() + 0.7 * (0.031 * t + 1.0).cos() + 0.4 * (0.0071 * t).sin();
            input.push(u);
            // an even distribution of noise
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            output.push(y + noise * (f64::from(state) / f64::from(u32::MAX) - 0.5));
            for _ in 0..STEPS {
                speed += h * (u - k * y - c * speed - friction * rubbing) / m;
                y += h * speed;
                rubbing += h * (speed - speed.abs() * rubbing) / DISTANCE;
            }
        }
        let column = |values| Matrix::from_vec(SAMPLES, 1, values);
        let run = Experiment::new(column(input), column(output));
        let run = Experiment { held_out: vec![2000..2300, 4000..4200], ..run };
        let channel = |name| vec![Channel::new(name, "")];
        Record::new(vec![run], 100.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    fn rubbing(distance: f64) -> Vec<InnerLoop> {
        let drives = crate::effects::Drives::Input { input: 0, force: 0.0, states: 2 };
        vec![InnerLoop {
            sees: Sees::Output(0),
            law: Law::Dahl { distance, averaged: true },
            drives,
        }]
    }

    fn of(record: &Record, loops: &[InnerLoop]) -> Balance {
        balance(record, 0, loops, &BalancePolicy::default()).unwrap()
    }

    #[test]
    fn mass_damping_stiffness_and_friction_are_found_with_and_without_a_spring() {
        for (stiffness, wanted) in [(0.5, 0.5), (0.0, 0.0)] {
            let found = of(&stage([400.0, 12.0, stiffness], 0.25, 0.0), &rubbing(DISTANCE));
            let [k, c, m] = found.mechanics;
            assert!(found.explained > 0.98, "{found:?}");
            assert!((m / 400.0 - 1.0).abs() < 0.05 && (c / 12.0 - 1.0).abs() < 0.05, "{found:?}");
            assert!(
                (k - wanted).abs() < 0.02 && (found.forces[0] - 0.25).abs() < 0.02,
                "{found:?}"
            );
        }
    }

    #[test]
    fn friction_explains_nothing_of_a_linear_stage() {
        let found = of(&stage([400.0, 12.0, 0.5], 0.0, 0.02), &rubbing(DISTANCE));
        assert!(found.explained < 0.05, "{found:?}");
    }

    #[test]
    fn the_balance_holds_where_it_was_not_solved() {
        let record = stage([400.0, 12.0, 0.0], 0.25, 0.0);
        let (loops, test) = (rubbing(DISTANCE), record.held_out_part().unwrap());
        let [without, with] = squares(&of(&record, &loops), &test, 0, &loops);
        assert_eq!((without.len(), with.len()), (2, 2));
        assert!(with.iter().zip(&without).all(|(with, without)| *with < 0.3 * without));
    }

    #[test]
    fn poles_stay_in_the_left_half_plane_and_fast_enough() {
        assert_eq!(stable([0.3, 0.02], 0.01), Some([0.3, 0.02]));
        let [a1, a0] = stable([0.1, -0.02], 0.01).unwrap();
        assert!((a1 - 0.3).abs() < 1e-12 && (a0 - 0.02).abs() < 1e-12);
        let [a1, a0] = stable([0.2, 0.0], 0.05).unwrap();
        assert!((a1 - 0.25).abs() < 1e-12 && (a0 - 0.01).abs() < 1e-12);
        assert_eq!(stable([f64::NAN, 1.0], 0.1), None);
    }

    #[test]
    fn loops_that_see_something_else_have_no_balance() {
        let mut loops = rubbing(DISTANCE);
        loops[0].sees = Sees::Mixture { states: vec![1.0, 0.0], inputs: vec![0.0] };
        let record = stage([400.0, 12.0, 0.5], 0.25, 0.0);
        assert_eq!(balance(&record, 0, &loops, &BalancePolicy::default()), None);
    }
}
