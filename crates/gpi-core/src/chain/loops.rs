//! Loops around the linear dynamics: values, tangents and adjoints of their laws.
//!
//! ```text
//! z = S x + T v  (or an output),      w = law(z),      x+ = A x + B v + E w      (one step a sample)
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
//!           where m_i != 0:  zbar += Fbar_i,  rbar_i -= m_i Fbar_i,  Fbar_i = 0
//! ```
//!
//! where `Fbar_i` arrives from the sample behind and goes on to the one before. A stop whose play slides at every
//! sample thus passes nothing of z: `dw = g_i m_i dr_i`, the saturated stop. The derivative by a weight is the stop
//! `z - F_i` itself, and is injected at w (see `injections`).
//!
//! The forces of Bouc and Wen and of Dahl remember the force and the last two z, and depend on the path of z alone; their steps and the
//! derivatives of them, which are the marks, are in [`super::bouc_wen`] and [`super::dahl`]. The mark of an excess is 1 while z exceeds its
//! limit, and 0 elsewhere: `dw = m (dz - d limit)`. The speed `|z - z_1|` has the sign of
//! `z - z_1` as its mark, and damping its derivatives by that change and by its scale. What depends on the speed counts the change in a
//! sample: that of a step times the number of steps. No loop is algebraic: w of one step changes z from the next step on ([`super::between`]).

use super::between::{Between, Row};
use super::bouc_wen::{Shape, Step};
use super::dahl::friction;
use super::lanes::{Lanes, NONE, add};
use crate::effects::{ClosedLoops, Effect, InnerLoop, Law, Sees};
use crate::linear::dot;
use crate::operators::play;
use pulp::Simd;

/// All loops that effects close around G, in the order of the chain.
pub(crate) fn loops_of(effects: &[Effect]) -> impl Iterator<Item = &InnerLoop> {
    let closed = effects.iter().filter_map(|effect| effect.place().closed_loops());
    closed.flat_map(ClosedLoops::loops)
}

/// Loops in motion.
pub(crate) struct Loops<'a> {
    loops: Vec<&'a InnerLoop>,
    between: Between,
    /// What each law remembers.
    pub places: Vec<Vec<f64>>,
    /// The signals of each step of a sample, loops one after the other.
    pub signals: Vec<LoopSignals>,
    w: Vec<f64>,
    /// Steps in a sample.
    pace: f64,
}

/// The signals of one loop in one step: w, its marks, and what the weights of its stops multiply.
pub(crate) struct LoopSignals {
    pub w: f64,
    pub marks: Vec<f64>,
    pub stops: Vec<f64>,
}

impl<'a> Loops<'a> {
    /// Loops in which nothing moves.
    pub(crate) fn new(loops: Vec<&'a InnerLoop>, between: Between) -> Self {
        let rest = |number: usize| {
            let law = &loops[number % loops.len()].law;
            LoopSignals { w: 0.0, marks: vec![0.0; law.marks()], stops: vec![0.0; law.weights()] }
        };
        Self {
            signals: (0..between.seen.len()).map(rest).collect(),
            places: loops.iter().map(|inner| vec![0.0; inner.law.memories()]).collect(),
            w: vec![0.0; between.seen.len()],
            pace: (between.seen.len() / loops.len().max(1)) as f64,
            loops,
            between,
        }
    }

    /// All steps from a sample to the next, from the state of G behind its dead time, v at both samples, and the displacement of what is
    /// in parallel with G.
    pub(crate) fn run(&mut self, state: &[f64], v: &[f64], next: &[f64], beside: &[f64]) {
        let Self { loops, between, places, signals, w, pace } = self;
        for (number, (row, own)) in between.seen.iter().zip(signals).enumerate() {
            let inner = number % loops.len();
            let Row { states, inputs, next: ahead, earlier } = row;
            let mut z = dot(states, state) + dot(inputs, v) + dot(ahead, next);
            z += dot(earlier, &w[..earlier.len()]);
            if let Sees::Output(output) = loops[inner].sees {
                z += beside[output];
            }
            own.w = loops[inner].law.step(&mut places[inner], z, *pace, &mut own.marks);
            w[number] = own.w;
            for (stop, place) in own.stops.iter_mut().zip(&places[inner]) {
                *stop = z - place;
            }
        }
    }

    /// What all laws remember.
    pub(crate) fn places(&mut self) -> impl Iterator<Item = &mut f64> {
        self.places.iter_mut().flatten()
    }

    /// Adds E w to what drives the states of G behind its dead time.
    pub(crate) fn drive(&self, driven: &mut [f64]) {
        for (drives, w) in self.between.drives.iter().zip(&self.w) {
            driven.iter_mut().zip(drives).for_each(|(sum, drive)| *sum += drive * w);
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

    /// w at z, so many steps a sample.
    pub(crate) fn step(&self, places: &mut [f64], z: f64, pace: f64, marks: &mut [f64]) -> f64 {
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
                let change = pace * (z - std::mem::replace(&mut places[0], z));
                marks[0] = if change < 0.0 { -pace } else { pace };
                change.abs()
            }
            Self::Damping { scale } => {
                let change = pace * (z - std::mem::replace(&mut places[0], z)) / scale;
                let part = change.tanh();
                let slope = 1.0 - part * part;
                marks.copy_from_slice(&[pace * slope, part - change * slope]);
                scale * part
            }
            &Self::Excess { limit, is_lower } => {
                let beyond = z - limit;
                let exceeds = if is_lower { beyond < 0.0 } else { beyond > 0.0 };
                marks[0] = f64::from(u8::from(exceeds));
                if exceeds { beyond } else { 0.0 }
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
            Self::Damping { .. } => {
                add(simd, &mut w, marks[0], &z);
                add(simd, &mut w, -marks[0], &places[0]);
                add(simd, &mut w, marks[1], &shape[0]);
                places[0] = z;
            }
            Self::Excess { .. } => {
                add(simd, &mut w, marks[0], &z);
                add(simd, &mut w, -marks[0], &shape[0]);
            }
        }
        w
    }

    /// The cost's sensitivity to z from that to w: the transpose of [`Law::tangent`]. `places` are the sensitivities
    /// to what is remembered, and those to the shape are added.
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
            Self::Excess { .. } => {
                z += marks[0] * w;
                shape[0] -= marks[0] * w;
            }
            Self::Stops { weights, .. } => {
                let stops = weights.iter().zip(shape).zip(marks).zip(places);
                for (((weight, half_width), &mark), place) in stops {
                    z += weight * w;
                    *place -= weight * w;
                    if mark != 0.0 {
                        z += *place;
                        *half_width -= mark * *place;
                        *place = 0.0;
                    }
                }
            }
            Self::Speed => {
                z += places[0] + marks[0] * w;
                places[0] = -marks[0] * w;
            }
            Self::Damping { .. } => {
                z += places[0] + marks[0] * w;
                places[0] = -marks[0] * w;
                shape[0] += marks[1] * w;
            }
            Self::BoucWen { .. } | Self::Dahl { .. } => {
                let [of_w, of_f] = self.slopes(marks);
                let f = places[0];
                let of_f = if of_f.is_empty() { of_w } else { of_f };
                let of = |place: usize| of_w[place] * w + of_f[place] * f;
                z += places[1] + of(1);
                shape.iter_mut().enumerate().for_each(|(place, own)| *own += of(4 + place));
                let older = [of(2) + places[2], of(3)];
                places.copy_from_slice(&[of(0), older[0], older[1]]);
            }
        }
        z
    }
}
