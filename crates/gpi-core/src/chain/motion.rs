//! The linear dynamics in motion: G with its loops, and the sections in parallel with G.
//!
//! ```text
//! y = C x + D v,      x+ = A x + B v + E w      (loops with one step a sample, else see `between`)
//! ```
//!
//! A is block diagonal, one block a section in observer form: `x1+ = -a1 x1 + x2 + d1`, `x2+ = -a2 x1 + d2` for what
//! drives it, d. Values, tangents and adjoints of a section's step stand here side by side:
//!
//! ```text
//! A = [ -a1  1 ]   x+    = A x + d             A' = [ -a1  -a2 ]   xbar = A' xbar+
//!     [ -a2  0 ]   dx+   = A dx + dd                [  1    0  ]   dbar = xbar+
//! ```
//!
//! A section of order one is `A = [-a1]`. C is (outputs, N), D (outputs, inputs), B (N, inputs), E (N, loops) with rows
//! of zeros for sections in parallel with G. A step costs about `N (outputs + inputs + 2 loops + 1)` multiplications.
//!
//! The steady state at a constant v is `x = (I - A)^-1 B v` (`Section::standing`, which says what takes its place where G integrates). It is exact for the linear part; a
//! loop that feeds back at rest is not part of it, so that the state settles from there in the decay time of the closed
//! loop.

use super::between::Between;
use super::lanes::{Lanes, add};
use super::loops::Loops;
use super::point::Point;
use crate::Matrix;
use crate::linear::{Section, advance};
use pulp::Simd;

/// The linear dynamics of a point.
pub(crate) struct Motion<'a> {
    sections: Vec<Section>,
    /// Columns of B by inputs, of C by states, rows of D by outputs, one after the other.
    b: Vec<Vec<f64>>,
    c: Vec<f64>,
    d: Vec<f64>,
    /// The states of G, which come first.
    own: usize,
    pub loops: Loops<'a>,
    /// Of all sections, one after the other.
    pub state: Vec<f64>,
    /// y, before the output stage.
    pub displacement: Vec<f64>,
    /// The part of y that sections in parallel with G have.
    beside: Vec<f64>,
    /// What drives each state.
    drive: Vec<f64>,
}

impl<'a> Motion<'a> {
    /// At rest at zero.
    pub(crate) fn new(point: &'a Point) -> Self {
        let sections = point.sections();
        let (outputs, inputs) = point.dynamics.d.shape();
        let b = columns(&sections, inputs);
        Self {
            loops: Loops::new(
                point.loops().collect(),
                Between::of_sections(&point.dynamics, point.loops(), point.intersample),
            ),
            b,
            c: sections.iter().flat_map(|section| section.c.as_slice()).copied().collect(),
            d: point.dynamics.d.transpose().as_slice().to_vec(),
            own: point.dynamics.order(),
            state: vec![0.0; point.order()],
            displacement: vec![0.0; outputs],
            beside: vec![0.0; outputs],
            drive: vec![0.0; point.order()],
            sections,
        }
    }

    /// Puts the state where a constant v leads to, `x = (I - A)^-1 B v`; nothing goes around the loops.
    pub(crate) fn stand(&mut self, v: &[f64]) {
        let v = nalgebra::DVector::from_column_slice(v);
        let steady = self.sections.iter().map(|section| section.standing(&section.b) * &v);
        self.state = steady.flat_map(|states| states.data.as_vec().clone()).collect();
    }

    /// The displacement (outputs, samples) of all samples of v (inputs, samples) where nothing goes around loops: each section
    /// on its own. `jump` is added to the state at a sample.
    pub(crate) fn respond(&mut self, v: &Matrix, jump: Option<(usize, &[f64])>) -> Matrix {
        let outputs = self.displacement.len();
        let mut displacement = Matrix::from_row_slice(outputs, v.nrows(), &self.d) * v;
        let mut first = 0;
        let parts = jump.map_or(0, |(at, _)| at.min(v.ncols()));
        for section in &self.sections {
            let own = first..first + section.order();
            let c = &self.c[own.start * outputs..own.end * outputs];
            let b = section.b.transpose();
            let state = &mut self.state[own.clone()];
            let (before, after) = v.as_slice().split_at(parts * v.nrows());
            let rows = displacement.as_mut_slice().split_at_mut(parts * outputs);
            pass(&section.a, (b.as_slice(), c), state, before, rows.0);
            if let Some((_, jump)) = jump {
                state.iter_mut().zip(&jump[own.clone()]).for_each(|(x, own)| *x += own);
            }
            pass(&section.a, (b.as_slice(), c), state, after, rows.1);
            first = own.end;
        }
        displacement
    }

    /// The displacement at this sample's v.
    pub(crate) fn observe(&mut self, v: &[f64]) {
        for (y, d) in self.displacement.iter_mut().zip(self.d.chunks_exact(v.len())) {
            *y = d.iter().zip(v).map(|(d, v)| d * v).sum();
        }
        for (x, c) in self.state.iter().zip(self.c.chunks_exact(self.displacement.len())) {
            self.displacement.iter_mut().zip(c).for_each(|(y, c)| *y += c * x);
        }
    }

    /// Takes the state and the loops to the next sample, from v at this one and there.
    pub(crate) fn advance(&mut self, v: &[f64], next: &[f64]) {
        self.beside.fill(0.0);
        let c = self.c.chunks_exact(self.beside.len()).skip(self.own);
        for (x, c) in self.state[self.own..].iter().zip(c) {
            self.beside.iter_mut().zip(c).for_each(|(y, c)| *y += c * x);
        }
        self.loops.run(&self.state[..self.own], v, next, &self.beside);
        self.drive.fill(0.0);
        for (b, v) in self.b.iter().zip(v) {
            self.drive.iter_mut().zip(b).for_each(|(sum, b)| *sum += b * v);
        }
        self.loops.drive(&mut self.drive[..self.own]);
        let mut first = 0;
        for section in &self.sections {
            let own = first..first + section.order();
            let drive = &self.drive[own.clone()];
            advance(&section.a, &mut self.state[own.clone()], |j| drive[j]);
            first = own.end;
        }
    }
}

/// Takes a section through samples of v, each (inputs), and adds to those of y, each (outputs), what it does; `b` and `c` have the inputs and
/// the outputs of each state.
fn pass(a: &[f64], (b, c): (&[f64], &[f64]), state: &mut [f64], v: &[f64], y: &mut [f64]) {
    match (a, state) {
        ([a1, a2], [x1, x2]) => [*x1, *x2] = pass_states([*a1, *a2], (b, c), [*x1, *x2], v, y),
        (a, state) => [state[0]] = pass_states([a[0]], (b, c), [state[0]], v, y),
    }
}

/// The same for a number of states that is known, so that they stay in registers; returns the last ones.
fn pass_states<const N: usize>(
    a: [f64; N],
    (b, c): (&[f64], &[f64]),
    mut state: [f64; N],
    v: &[f64],
    y: &mut [f64],
) -> [f64; N] {
    let (inputs, outputs) = (b.len() / N, c.len() / N);
    for (v, y) in v.chunks_exact(inputs).zip(y.chunks_exact_mut(outputs)) {
        for (x, c) in state.iter().zip(c.chunks_exact(outputs)) {
            y.iter_mut().zip(c).for_each(|(y, c)| *y += c * x);
        }
        let drive = |j: usize| -> f64 {
            b[j * inputs..(j + 1) * inputs].iter().zip(v).map(|(b, v)| b * v).sum()
        };
        advance(&a, &mut state, drive);
    }
    state
}

/// Columns of B by inputs, over the states of all sections.
pub(super) fn columns(sections: &[Section], inputs: usize) -> Vec<Vec<f64>> {
    let column = |input: usize| {
        let own = sections.iter().map(|section| section.b.column(input).into_owned());
        own.flat_map(|column| column.data.as_vec().clone()).collect()
    };
    (0..inputs).map(column).collect()
}

/// Rows of C by outputs, over the states of all sections.
pub(super) fn rows(sections: &[Section], outputs: usize) -> Vec<Vec<f64>> {
    let row = |output: usize| {
        let own = sections.iter().map(|section| section.c.row(output).transpose());
        own.flat_map(|row| row.data.as_vec().clone()).collect()
    };
    (0..outputs).map(row).collect()
}

/// The tangent of a section's step, with the changes of what drives it.
#[inline(always)]
pub(super) fn advance_tangent<S: Simd>(simd: S, a: &[f64], x: &mut [Lanes], driven: &[Lanes]) {
    match (a, x) {
        // in variables, because what is stored and loaded again waits for the memory
        ([a1, a2], [x1, x2]) => {
            let (before, [mut first, mut second]) = (*x1, [driven[0], driven[1]]);
            add(simd, &mut first, 1.0, x2);
            add(simd, &mut first, -a1, &before);
            add(simd, &mut second, -a2, &before);
            (*x1, *x2) = (first, second);
        }
        (a, x) => {
            let (before, mut next) = (x[0], driven[0]);
            add(simd, &mut next, -a[0], &before);
            x[0] = next;
        }
    }
}

/// The adjoint of a section's step: from the cost's sensitivity to the next state to that to this one.
pub(super) fn advance_adjoint(a: &[f64], x: &mut [f64]) {
    match (a, x) {
        ([a1, a2], [x1, x2]) => (*x1, *x2) = (-a1 * *x1 - a2 * *x2, *x1),
        (a, x) => x[0] *= -a[0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{model, record, run};
    use crate::fit::preparation::Prepared;

    #[test]
    fn sections_on_their_own_respond_as_all_at_once() {
        let model = model().with_effects(Vec::new()).unwrap();
        let record = record(&model, vec![run(1.5, 0.0, 130, vec![])]);
        let channels = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let point = Prepared::new(&record, channels).unwrap().point_of(&model).unwrap();
        let v = record.experiments()[0].input.transpose();
        let jump: Vec<f64> = (0..point.order()).map(|state| 0.3 - 0.2 * state as f64).collect();
        let at = |k: usize| v.column(k.min(v.ncols() - 1)).as_slice().to_vec();
        let (mut one, mut other) = (Motion::new(&point), Motion::new(&point));
        one.stand(&at(0));
        other.stand(&at(0));
        let found = one.respond(&v, Some((130, &jump[..])));
        for k in 0..v.ncols() {
            if k == 130 {
                other.state.iter_mut().zip(&jump).for_each(|(x, own)| *x += own);
            }
            other.observe(&at(k));
            let expected = &other.displacement;
            let pairs = found.column(k).into_iter().zip(expected);
            pairs.for_each(|(found, expected)| assert!((found - expected).abs() < 1e-13, "{k}"));
            other.advance(&at(k), &at(k + 1));
        }
    }
}
