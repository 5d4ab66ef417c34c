//! The linear dynamics G: sections in parallel with them, and loops around them.

use crate::effects::block::Block;
use crate::effects::inner_loop::InnerLoop;
use crate::effects::loop_values;
use crate::effects::quantity::{Quantity, Units};
use crate::effects::steady_force::SteadyForce;

/// The coefficients `a1, ..` and `b1, ..` of `(b1 q^-1 + ..) / (1 + a1 q^-1 + ..)`.
pub type Coefficients = (Vec<f64>, Vec<f64>);

/// Linear sections from v to the displacement, in parallel with G. The model has one output.
pub trait ParallelSections: Block {
    /// The input channel whose v drives the sections.
    fn input(&self) -> usize;

    /// The dead time in samples after which v reaches the sections.
    fn dead_time(&self) -> usize;

    /// The sections at a sampling rate in Hz. The values of the block follow from them.
    fn sections(&self, rate: f64) -> Vec<Coefficients>;

    /// Takes the dead time of G in samples, which the sections share.
    fn set_dead_time(&mut self, samples: usize);

    /// Takes estimated sections: as many as it has, or any number of first-order sections where it consists of such sections.
    fn set_sections(&mut self, sections: &[Coefficients], rate: f64);

    /// Smallest and largest a1 of the first-order sections.
    fn section_bounds(&self, _rate: f64) -> (f64, f64) {
        (f64::NEG_INFINITY, f64::INFINITY)
    }
}

/// Loops that are closed around G. Their values are those of the block, in the order of the loops.
pub trait ClosedLoops: Block {
    /// The loops.
    fn loops(&self) -> &[InnerLoop];

    /// The same, to be changed.
    fn loops_mut(&mut self) -> &mut Vec<InnerLoop>;

    /// What the loops do in steady state, as an engineer reads it, where the force of a loop is known.
    fn in_steady_state(
        &self,
        units: Units,
        forces: &dyn Fn(&InnerLoop) -> Option<SteadyForce>,
    ) -> Vec<Quantity> {
        loop_values::in_steady_state(self.loops(), units, forces)
    }
}
