//! The output stage of one output, sample by sample: values, tangents and adjoints.
//!
//! The effects act one after the other, `y_0 = y` and `y_i(k) = H_i(y_i-1(k), state)`. Along the motion each is either
//! a factor, [`Slope::Times`] (curves: dH/dy; a backlash whose gap is closed: 1), or holds its output, [`Slope::Held`]
//! (a backlash within its gap). For one effect with input x and output y,
//!
//! ```text
//! tangent   Times(f):  dy(k) = f dx(k)                 Held:  dy(k) = dy(k-1)
//! adjoint   g = ybar(k) + (what Held passed back from k + 1)
//!           Times(f):  xbar = f g, nothing to k - 1    Held:  xbar = 0, g to k - 1
//! ```
//!
//! dy before the first sample is zero: the place of a backlash at rest is taken as independent of the unknowns. That is
//! exact where the first displacement lies within the gap around zero, and elsewhere an error until the gap first
//! closes.

use super::lanes::Lanes;
use super::point::Point;
use crate::effects::{Moment, OutputStage, Slope};

/// The effects of the output stage on one output, with what they remember.
pub(crate) struct Sensing<'a> {
    blocks: Vec<(&'a dyn OutputStage, Vec<f64>)>,
}

impl<'a> Sensing<'a> {
    /// The displacement was constant at `first`.
    pub(crate) fn new(point: &'a Point, output: usize, first: f64) -> Self {
        let own = point.output_stages().filter(|effect| effect.output() == output);
        let mut value = first;
        let blocks = own.map(|effect| {
            let moment = point.stages().moment(0, &[]);
            let state = effect.rest(value);
            value = effect.sense(&mut state.clone(), value, moment).0;
            (effect, state)
        });
        Self { blocks: blocks.collect() }
    }

    /// Takes one sample through; appends how changes pass each effect.
    pub(crate) fn step(&mut self, output: f64, moment: Moment, slopes: &mut Vec<Slope>) -> f64 {
        self.blocks.iter_mut().fold(output, |value, (effect, state)| {
            let (sensed, slope) = effect.sense(state, value, moment);
            slopes.push(slope);
            sensed
        })
    }
}

impl Slope {
    /// The tangent of a sample: changes of the displacement become those of the reading; `held` are the changes that the
    /// reading had.
    #[inline(always)]
    pub(super) fn tangent(&self, change: &mut Lanes, held: &mut Lanes) {
        match self {
            Self::Times(factor) => change.iter_mut().for_each(|value| *value *= factor),
            Self::Held => *change = *held,
        }
        *held = *change;
    }

    /// The adjoint of a sample: the cost's sensitivity to the reading becomes that to the displacement, and to the
    /// reading before.
    pub(super) fn adjoint(&self, change: &mut f64, held: &mut f64) {
        let all = *change + *held;
        (*change, *held) = match self {
            Self::Times(factor) => (factor * all, 0.0),
            Self::Held => (0.0, all),
        };
    }
}
