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
//! The forces of Bouc and Wen and of Dahl remember the force and the last two z, and depend on the path of z alone; their steps and the
//! derivatives of them, which are the marks, are in [`super::bouc_wen`] and [`super::dahl`]. The speed `|z - z_1|` has the sign of
//! `z - z_1` as its mark. w(k) drives the states for sample k + 1 only, so that no
//! loop is algebraic and all loops of a sample are evaluated independently of each other.

use super::bouc_wen::{Shape, Step};
use super::dahl::friction;
use super::lanes::{Lanes, NONE, add};
use crate::effects::{InnerLoop, Law, Sees};
use crate::linear::dot;
use crate::operators::play;
use pulp::Simd;

/// Loops in motion.
pub(crate) struct Loops<'a> {
    pub loops: Vec<&'a InnerLoop>,
    /// The column of E of each.
    drives: Vec<Vec<f64>>,
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
    /// Loops in which nothing moves, around a G of these columns of B behind its dead time.
    pub(crate) fn new(loops: impl Iterator<Item = &'a InnerLoop>, b: &[Vec<f64>]) -> Self {
        let loops: Vec<&InnerLoop> = loops.collect();
        let rest = |inner: &&InnerLoop| LoopSignals {
            z: 0.0,
            w: 0.0,
            marks: vec![0.0; inner.law.marks()],
            places: vec![0.0; inner.law.memories()],
        };
        let drives = loops.iter().map(|inner| inner.drives.column(b)).collect();
        Self { signals: loops.iter().map(rest).collect(), drives, loops }
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
        for (drives, own) in self.drives.iter().zip(&self.signals) {
            let first = driven.len() - drives.len();
            let driven = driven[first..].iter_mut().zip(drives);
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
    /// What it remembers where z has always been the same, and no force has built up.
    pub(crate) fn at_rest(&self, z: f64) -> Vec<f64> {
        let mut places = vec![z; self.memories()];
        if let Self::BoucWen { .. } | Self::Dahl { .. } = self {
            places[0] = 0.0;
        }
        places
    }

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
            &Self::Dahl { distance, averaged } => {
                let [f, w] = friction(places[0], [z, places[1], places[2]], distance, averaged);
                places.copy_from_slice(&[f.value, z, places[1]]);
                let (of_w, of_f) = marks.split_at_mut(w.slopes.len());
                of_w.copy_from_slice(&w.slopes);
                of_f.copy_from_slice(&f.slopes);
                w.value
            }
            Self::Speed => {
                let change = z - std::mem::replace(&mut places[0], z);
                marks[0] = if change < 0.0 { -1.0 } else { 1.0 };
                change.abs()
            }
        }
    }

    /// The marks of a force that follows the path of z: derivatives of w and, where this is another number, of the force f that is
    /// remembered, by f and z before, z, and the shape.
    fn slopes<'a>(&self, marks: &'a [f64]) -> [&'a [f64]; 2] {
        let (of_w, of_f) = marks.split_at(4 + self.shapes());
        [of_w, of_f]
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
            Self::BoucWen { .. } | Self::Dahl { .. } => {
                let changes = [places[0], z, places[1], places[2]];
                let of = |marks: &[f64]| {
                    let mut sum = NONE;
                    for (mark, change) in marks.iter().zip(changes.iter().chain(shape)) {
                        add(simd, &mut sum, *mark, change);
                    }
                    sum
                };
                let [of_w, of_f] = self.slopes(marks);
                w = of(of_w);
                let f = if of_f.is_empty() { w } else { of(of_f) };
                places.copy_from_slice(&[f, z, places[1]]);
            }
            Self::Speed => {
                add(simd, &mut w, marks[0], &z);
                add(simd, &mut w, -marks[0], &places[0]);
                places[0] = z;
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
            Self::Speed => {
                z += places[0] + marks[0] * w;
                places[0] = -marks[0] * w;
            }
            Self::BoucWen { .. } | Self::Dahl { .. } => {
                let [of_w, of_f] = self.slopes(marks);
                let f = places[0];
                let of_f = if of_f.is_empty() { of_w } else { of_f };
                let of = |place: usize| of_w[place] * w + of_f[place] * f;
                z += places[1] + of(1);
                shape.iter_mut().enumerate().for_each(|(place, own)| *own = of(4 + place));
                let older = [of(2) + places[2], of(3)];
                places.copy_from_slice(&[of(0), older[0], older[1]]);
            }
        }
        z
    }
}
