//! Loops around the linear dynamics: values, tangents and adjoints of their laws.
//!
//! ```text
//! z = S x + T v  (or an output),      w = law(z),      x+ = A x + B v + E w
//! ```
//!
//! A power has the slope `dw/dz = n (z/s)^(n-1)`. A stop `z - F_r(z)` passes a change of z while its play F sticks;
//! while it slides up (down), F is z - r (z + r), so that the stop shows the change of r alone. [`Law::step`] leaves
//! these facts as marks: the slope of a power, or for each stop the direction in which its play slides, 0 where it
//! sticks.
//!
//! For stops with weights g_i and half-widths r_i, the step, its tangent and its adjoint are, with the mark m_i in {-1,
//! 0, 1},
//!
//! ```text
//! value     F_i = max(z - r_i, min(z + r_i, F_i)),                  w = sum_i g_i (z - F_i)
//! tangent   where m_i != 0:  dF_i = dz - m_i dr_i;                  dw = sum_i g_i (dz - dF_i)
//! adjoint   zbar += g_i wbar,  Fbar_i -= g_i wbar;
//!           where m_i != 0:  zbar += Fbar_i,  rbar_i = -m_i Fbar_i,  Fbar_i = 0
//! ```
//!
//! where `Fbar_i` arrives from the sample behind and goes on to the one before. A stop whose play slides at every
//! sample thus passes nothing of z: `dw = g_i m_i dr_i`, the saturated stop. The derivative by a weight is the stop
//! `z - F_i` itself, and is injected at w (see `injections`).
//!
//! Bouc and Wen's force remembers w and the last two z, and depends on the path of z alone; its step and the derivatives of it,
//! which are the marks, are in [`super::bouc_wen`]. w(k) drives the states for sample k + 1 only, so that no
//! loop is algebraic and all loops of a sample are evaluated independently of each other.

use super::bouc_wen::{Shape, Step};
use super::lanes::{Lanes, NONE, add};
use crate::effects::{InnerLoop, Law, Sees};
use crate::linear::dot;
use crate::operators::play;
use pulp::Simd;

/// Loops in motion.
pub(crate) struct Loops<'a> {
    pub loops: Vec<&'a InnerLoop>,
    /// The signals of each.
    pub signals: Vec<LoopSignals>,
}

/// The signals of one loop, its marks, and what its law remembers: the places of its plays, or w and the last two z.
pub(crate) struct LoopSignals {
    pub z: f64,
    pub w: f64,
    pub marks: Vec<f64>,
    pub places: Vec<f64>,
}

impl<'a> Loops<'a> {
    /// Loops in which nothing moves.
    pub(crate) fn new(loops: impl Iterator<Item = &'a InnerLoop>) -> Self {
        let loops: Vec<&InnerLoop> = loops.collect();
        let rest = |inner: &&InnerLoop| LoopSignals {
            z: 0.0,
            w: 0.0,
            marks: vec![0.0; inner.law.marks()],
            places: vec![0.0; inner.law.memories()],
        };
        Self { signals: loops.iter().map(rest).collect(), loops }
    }

    /// z and w of one sample, from the state of G (that of its dead time first), v and the displacements.
    pub(crate) fn observe(&mut self, state: &[f64], v: &[f64], displacement: &[f64]) {
        for (inner, own) in self.loops.iter().zip(&mut self.signals) {
            own.z = inner.sees.signal(state, v, displacement);
            own.w = inner.law.step(&mut own.places, own.z, &mut own.marks);
        }
    }

    /// What all laws remember.
    pub(crate) fn places(&mut self) -> impl Iterator<Item = &mut f64> {
        self.signals.iter_mut().flat_map(|own| &mut own.places)
    }

    /// Adds E w to what drives the states of G.
    pub(crate) fn drive(&self, driven: &mut [f64]) {
        for (inner, own) in self.loops.iter().zip(&self.signals) {
            let first = driven.len() - inner.drives.len();
            let driven = driven[first..].iter_mut().zip(&inner.drives);
            driven.for_each(|(sum, drive)| *sum += drive * own.w);
        }
    }
}

impl Sees {
    /// z at a state of G and its dead time, v and the displacement of all outputs.
    fn signal(&self, state: &[f64], v: &[f64], displacement: &[f64]) -> f64 {
        match self {
            Self::Output(output) => displacement[*output],
            Self::Mixture { states, inputs } => {
                let (late, own) = state.split_at(state.len() - states.len());
                // what comes out of the dead time is what went in first
                let v = if late.is_empty() { v } else { &late[late.len() - inputs.len()..] };
                dot(states, own) + dot(inputs, v)
            }
        }
    }
}

impl Law {
    /// w at z.
    pub(crate) fn step(&self, places: &mut [f64], z: f64, marks: &mut [f64]) -> f64 {
        match self {
            Self::Power { exponent, scale } => {
                let relative = z / scale;
                marks[0] = f64::from(*exponent) * relative.powi(exponent - 1);
                relative.powi(*exponent) * scale
            }
            Self::Stops { half_widths, weights } => {
                let mut w = 0.0;
                let stops = half_widths.iter().zip(weights).zip(places).zip(marks);
                for (((&r, weight), place), mark) in stops {
                    let before = std::mem::replace(place, play(r, z, *place));
                    *mark = if *place == before { 0.0 } else { (*place - before).signum() };
                    w += weight * (z - *place);
                }
                w
            }
            &Self::BoucWen { beta, gamma, exponent } => {
                let shape = Shape { beta, gamma, exponent };
                let step = Step::new(places[0], [z, places[1], places[2]], shape);
                places.copy_from_slice(&[step.force, z, places[1]]);
                marks.copy_from_slice(&step.slopes);
                step.force
            }
        }
    }

    /// Changes of w by changes of z and of the shape; `places` are the changes of what is remembered.
    #[inline(always)]
    pub(super) fn tangent<S: Simd>(
        &self,
        simd: S,
        z: Lanes,
        shape: &[Lanes],
        marks: &[f64],
        places: &mut [Lanes],
    ) -> Lanes {
        let mut w = NONE;
        match self {
            Self::Power { .. } => add(simd, &mut w, marks[0], &z),
            Self::Stops { weights, .. } => {
                let stops = weights.iter().zip(shape).zip(marks).zip(places);
                for (((weight, half_width), &mark), place) in stops {
                    if mark != 0.0 {
                        *place = z;
                        add(simd, place, -mark, half_width);
                    }
                    add(simd, &mut w, *weight, &z);
                    add(simd, &mut w, -weight, place);
                }
            }
            Self::BoucWen { .. } => {
                let [beta, gamma, exponent] = [shape[0], shape[1], shape[2]];
                let changes = [places[0], z, places[1], places[2], beta, gamma, exponent];
                for (mark, change) in marks.iter().zip(&changes) {
                    add(simd, &mut w, *mark, change);
                }
                places.copy_from_slice(&[w, z, places[1]]);
            }
        }
        w
    }

    /// The cost's sensitivity to z from that to w: the transpose of [`Law::tangent`]. `places` are the sensitivities
    /// to what is remembered, and those to the shape are written.
    pub(super) fn adjoint(
        &self,
        w: f64,
        shape: &mut [f64],
        marks: &[f64],
        places: &mut [f64],
    ) -> f64 {
        let mut z = 0.0;
        match self {
            Self::Power { .. } => z += marks[0] * w,
            Self::Stops { weights, .. } => {
                let stops = weights.iter().zip(shape).zip(marks).zip(places);
                for (((weight, half_width), &mark), place) in stops {
                    z += weight * w;
                    *place -= weight * w;
                    if mark != 0.0 {
                        z += *place;
                        *half_width = -mark * *place;
                        *place = 0.0;
                    }
                }
            }
            Self::BoucWen { .. } => {
                let force = places[0] + w;
                z += places[1] + marks[1] * force;
                shape.iter_mut().zip(&marks[4..]).for_each(|(own, mark)| *own = mark * force);
                let older = [marks[2] * force + places[2], marks[3] * force];
                places.copy_from_slice(&[marks[0] * force, older[0], older[1]]);
            }
        }
        z
    }
}
