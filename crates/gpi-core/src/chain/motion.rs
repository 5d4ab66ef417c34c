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
        ([a1, a2], [x1, x2]) => {
            let before = *x1;
            *x1 = driven[0];
            add(simd, x1, 1.0, x2);
            add(simd, x1, -a1, &before);
            *x2 = driven[1];
            add(simd, x2, -a2, &before);
        }
        (a, x) => {
            let before = x[0];
            x[0] = driven[0];
            add(simd, &mut x[0], -a[0], &before);
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
