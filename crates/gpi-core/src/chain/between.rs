//! Loops around G between two samples: what they see, and what they drive; (T13) of docs/theory.md.
//!
//! From sample k to the next, the loops are computed in M > 1 steps ([`Intersample`]), m = 0 .. M - 1, each from its
//! middle `s = (m + 1/2)/M`. With `N = ln A` and the hold of v between samples,
//!
//! ```text
//! x(s) = e^(sN) (x + d v) + s phi_1(sN) g v + s^2 phi_2(sN) g (v+ - v),     phi_1(N) = (e^N - 1)/N,  phi_2(N) = (phi_1(N) - 1)/N
//! z_m  = c x(s) + t v(s) + sum over earlier steps j < m of c S^(m-j-1/2) E_s w_j,          S = A^(1/M)
//! w_m  = law(z_m),      x+ = A x + B v + sum_m S^(M-1-m) E_s w_m,      E_s = (sum_(j<M) S^j)^-1 E
//! ```
//!
//! c and t are a loop's rows of S and T, or the rows of C and D of the output that it sees. g and d follow from B, so
//! that G has the same samples whatever happens between them:
//!
//! | hold | g | d | v(s) | what is left of t |
//! |---|---|---|---|---|
//! | zero | `phi_1(N)^-1 B` | 0 | v | t |
//! | first | `phi_1(N)^-2 B` | `phi_2(N) g` | `v + s (v+ - v)` | `t - c d` |
//!
//! For a first-order hold, x is the state of the continuous system less `d v`: what a change of v within the last sample
//! has moved, which D contains. E is what a w that stays constant for a sample drives; a force that enters where an input
//! does drives `E = -force phi_1(N) g`, which is what a constant input drives.
//!
//! What w of a step moves until its middle is left out: a force moves a mass by a part of the square of the step, so that
//! the error of M steps is that of the midpoint rule, proportional to 1/M^2.
//!
//! With one step a sample, loops see the sample itself, `z = c x + t v`, and `x+ = A x + B v + E w`, with E = -force B for
//! a force that enters where an input does: half a sample late, but v at the next sample is not needed.
//!
//! Sections in parallel with G are slow: between samples they stand still.

use crate::effects::{InnerLoop, Sees};
use crate::linear::{Sections, StateSpace, logarithm};
use crate::{Hold, Intersample, Matrix};

/// What one loop sees in one step: factors of the states of G at the sample, of v there and at the next sample, and of
/// all w before.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub states: Vec<f64>,
    pub inputs: Vec<f64>,
    pub next: Vec<f64>,
    pub earlier: Vec<f64>,
}

/// All loops in all steps, those of the first step first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Between {
    pub seen: Vec<Row>,
    /// What w adds to the states of G at the next sample.
    pub drives: Vec<Vec<f64>>,
}

impl Between {
    /// Loops around the sections of G. Where A has no logarithm, nothing is a number.
    pub(crate) fn of_sections<'a>(
        dynamics: &Sections,
        loops: impl IntoIterator<Item = &'a InnerLoop>,
        intersample: Intersample,
    ) -> Self {
        let loops: Vec<&InnerLoop> = loops.into_iter().collect();
        if loops.is_empty() {
            return Self::default();
        }
        let found = Self::around(dynamics, &loops, intersample);
        found.unwrap_or_else(|| Self::nowhere(dynamics, loops.len(), intersample))
    }

    /// Loops around the sections of G; `None` where A has no logarithm.
    pub(crate) fn around(
        dynamics: &Sections,
        loops: &[&InnerLoop],
        intersample: Intersample,
    ) -> Option<Self> {
        let behind = Sections { delay: 0, ..dynamics.clone() };
        let system = behind.to_state_space().ok()?;
        Self::new(&system, loops, intersample)
    }

    /// Loops around a G without its dead time; `None` where A has no logarithm.
    pub(crate) fn new(
        system: &StateSpace,
        loops: &[&InnerLoop],
        intersample: Intersample,
    ) -> Option<Self> {
        if intersample.is_plain() {
            return Some(Self::at_samples(system, loops));
        }
        let steps = intersample.substeps;
        let motion = Motion::new(system, intersample.hold)?;
        let part = |steps: usize| (&motion.logarithm / steps as f64).exp();
        let (step, half) = (part(steps), part(2 * steps));
        let identity = Matrix::identity(system.order(), system.order());
        let powers: Vec<Matrix> =
            std::iter::successors(Some(identity), |power| Some(&step * power))
                .take(steps)
                .collect();
        let e = driven(loops, &columns(&motion.held));
        let of_a_step = powers.iter().sum::<Matrix>().lu().solve(&e)?;
        let responses: Vec<Matrix> = powers.iter().map(|power| power * &of_a_step).collect();
        let (c, t) = seen(system, loops);
        let mut between = Self::default();
        for m in 0..steps {
            let moment = motion.at((m as f64 + 0.5) / steps as f64, &c, &t);
            // what the loops see of the steps before, half a step after each
            let earlier: Vec<Matrix> = (0..m).map(|j| &c * &half * &responses[m - j - 1]).collect();
            for number in 0..loops.len() {
                let row =
                    |matrix: &Matrix| -> Vec<f64> { matrix.row(number).iter().copied().collect() };
                between.seen.push(Row {
                    states: row(&moment.states),
                    inputs: row(&moment.inputs),
                    next: row(&moment.next),
                    earlier: earlier.iter().flat_map(row).collect(),
                });
                let drive = responses[steps - 1 - m].column(number);
                between.drives.push(drive.iter().copied().collect());
            }
        }
        Some(between)
    }

    /// Loops that take one step a sample.
    fn at_samples(system: &StateSpace, loops: &[&InnerLoop]) -> Self {
        let (c, t) = seen(system, loops);
        let row = |number: usize| Row {
            states: c.row(number).iter().copied().collect(),
            inputs: t.row(number).iter().copied().collect(),
            next: vec![0.0; system.inputs()],
            earlier: Vec::new(),
        };
        Self {
            seen: (0..loops.len()).map(row).collect(),
            drives: columns(&driven(loops, &columns(system.b()))),
        }
    }

    /// The same form, and nothing is a number.
    fn nowhere(dynamics: &Sections, loops: usize, intersample: Intersample) -> Self {
        let nothing = |count: usize| vec![f64::NAN; count];
        let (order, inputs) = (dynamics.order(), dynamics.inputs());
        let all = 0..loops * intersample.substeps;
        let seen = all.clone().map(|number| Row {
            states: nothing(order),
            inputs: nothing(inputs),
            next: nothing(inputs),
            earlier: nothing(number / loops * loops),
        });
        Self { seen: seen.collect(), drives: all.map(|_| nothing(order)).collect() }
    }
}

/// What a constant input of one drives in a sample, by inputs; `None` where A has no logarithm.
pub(crate) fn held_inputs(system: &StateSpace, intersample: Intersample) -> Option<Vec<Vec<f64>>> {
    if intersample.is_plain() {
        return Some(columns(system.b()));
    }
    Some(columns(&Motion::new(system, intersample.hold)?.held))
}

/// The columns of E, from what a constant input drives in a sample.
fn driven(loops: &[&InnerLoop], held: &[Vec<f64>]) -> Matrix {
    let mut e = Matrix::zeros(held.first().map_or(0, Vec::len), loops.len());
    for (mut column, inner) in e.column_iter_mut().zip(loops) {
        last(column.as_mut_slice(), &inner.drives.column(held));
    }
    e
}

/// Values for the last states; those before have none.
fn last(all: &mut [f64], values: &[f64]) {
    let first = all.len() - values.len();
    all[first..].copy_from_slice(values);
}

fn columns(matrix: &Matrix) -> Vec<Vec<f64>> {
    matrix.column_iter().map(|column| column.iter().copied().collect()).collect()
}

/// What the loops see at one step of the states, of v and of the next v, a row each.
struct Moment {
    states: Matrix,
    inputs: Matrix,
    next: Matrix,
}

/// The rows c (loops, order) and t (loops, inputs) of all loops.
fn seen(system: &StateSpace, loops: &[&InnerLoop]) -> (Matrix, Matrix) {
    let mut c = Matrix::zeros(loops.len(), system.order());
    let mut t = Matrix::zeros(loops.len(), system.inputs());
    for (number, inner) in loops.iter().enumerate() {
        match &inner.sees {
            Sees::Output(output) => {
                c.set_row(number, &system.c().row(*output));
                t.set_row(number, &system.d().row(*output));
            }
            Sees::Mixture { states, inputs } => {
                let mut row = vec![0.0; system.order()];
                last(&mut row, states);
                c.row_mut(number).copy_from_slice(&row);
                t.row_mut(number).copy_from_slice(inputs);
            }
        }
    }
    (c, t)
}

/// The continuous system that has the samples of G.
struct Motion {
    /// N.
    logarithm: Matrix,
    hold: Hold,
    g: Matrix,
    d: Matrix,
    /// What a constant input drives in a sample.
    held: Matrix,
}

impl Motion {
    fn new(system: &StateSpace, hold: Hold) -> Option<Self> {
        let logarithm = logarithm(system.a())?;
        let [_, whole, ramp] = integrals(&logarithm, 1.0);
        let inverse = whole.lu();
        let once = inverse.solve(system.b())?;
        Some(match hold {
            Hold::Zero => {
                let d = 0.0 * &once;
                Self { logarithm, hold, g: once, d, held: system.b().clone() }
            }
            Hold::First => {
                let g = inverse.solve(&once)?;
                Self { logarithm, hold, d: ramp * &g, g, held: once }
            }
        })
    }

    /// Where it leads to within a sample.
    fn at(&self, s: f64, c: &Matrix, t: &Matrix) -> Moment {
        let through = t - c * &self.d;
        let [free, constant, ramp] = integrals(&self.logarithm, s);
        let (ramp, s) =
            if self.hold == Hold::First { (c * ramp * &self.g, s) } else { (0.0 * t, 0.0) };
        Moment {
            states: c * &free,
            inputs: c * (free * &self.d + constant * &self.g) - &ramp + (1.0 - s) * &through,
            next: ramp + s * &through,
        }
    }
}

/// `e^(sN)`, `s phi_1(sN)` and `s^2 phi_2(sN)`: the response to a state, to a constant and to a ramp of slope one, as the first row of
/// one exponential (C. Van Loan, *Computing integrals involving the matrix exponential*, IEEE Trans. Automatic Control 23, 1978).
fn integrals(logarithm: &Matrix, s: f64) -> [Matrix; 3] {
    let order = logarithm.nrows();
    let mut all = Matrix::zeros(3 * order, 3 * order);
    all.view_mut((0, 0), (order, order)).copy_from(logarithm);
    all.view_mut((0, order), (order, order)).fill_with_identity();
    all.view_mut((order, 2 * order), (order, order)).fill_with_identity();
    let all = (s * all).exp();
    [0, 1, 2].map(|place| all.view((0, place * order), (order, order)).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::circulate::tests::{Plant, simulated};

    /// A mode of one radian a second, sampled every h seconds.
    fn plant(h: f64, hold: Hold) -> Plant {
        let f = Matrix::from_row_slice(2, 2, &[0.0, 1.0, -1.0, -0.4]);
        let [a, constant, ramp] = integrals(&f, h);
        let g = Matrix::from_column_slice(2, 1, &[0.0, 1.0]);
        let c = Matrix::from_row_slice(1, 2, &[1.0, 0.0]);
        // the state behind a ramp, less the part of the newest v
        let late = if hold == Hold::First { ramp * &g / h } else { Matrix::zeros(2, 1) };
        let b = &constant * &g + (&a - Matrix::identity(2, 2)) * &late;
        let force = &constant * &g;
        let d = &c * late;
        Plant { linear: StateSpace::new(a, b, c, d).unwrap(), force, speed: 0.05 / h }
    }

    fn difference(hold: Hold, steps: usize) -> f64 {
        const H: f64 = 0.7;
        let coarse: Vec<f64> = (0..80)
            .map(f64::from)
            .map(|k| 0.6 * (0.5 * k).sin() + 0.5 * (0.23 * k).cos())
            .collect();
        let fine = (0..160).map(|k| {
            let (before, after) = (coarse[k / 2], coarse[(k / 2 + 1).min(79)]);
            if hold == Hold::First && k % 2 == 1 { 0.5 * (before + after) } else { before }
        });
        let fine: Vec<f64> = fine.collect();
        let slow = simulated(&plant(H, hold), &coarse, Intersample { substeps: 2 * steps, hold });
        let fast = simulated(&plant(0.5 * H, hold), &fine, Intersample { substeps: steps, hold });
        let pairs = slow.iter().zip(fast.iter().step_by(2));
        pairs.map(|(slow, fast)| (slow - fast).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn steps_are_those_of_a_record_that_is_sampled_twice_as_fast() {
        for hold in [Hold::Zero, Hold::First] {
            for steps in [2, 3] {
                let found = difference(hold, steps);
                assert!(found < 1e-10, "{hold:?}, {steps}: {found}");
            }
        }
    }
}
