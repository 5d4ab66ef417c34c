//! The output stage of one output.

use crate::chain::point::Point;
use crate::effects::{Moment, OutputStage, Slope};

/// The effects of the output stage on one output, with what they remember.
pub(crate) struct Sensing<'a> {
    blocks: Vec<(&'a dyn OutputStage, Vec<f64>)>,
}

impl<'a> Sensing<'a> {
    /// The output stood at `first`.
    pub(crate) fn new(point: &'a Point, output: usize, first: f64) -> Self {
        let own = point.output_stages().filter(|effect| effect.output() == output);
        let mut value = first;
        let blocks = own.map(|effect| {
            let moment = point.moment(0, &[]);
            let state = effect.rest(value);
            value = effect.sense(&mut state.clone(), value, moment).0;
            (effect, state)
        });
        Self { blocks: blocks.collect() }
    }

    /// Takes one sample through; leaves how changes pass each effect.
    pub(crate) fn step(&mut self, output: f64, moment: Moment, slopes: &mut Vec<Slope>) -> f64 {
        self.blocks.iter_mut().fold(output, |value, (effect, state)| {
            let (sensed, slope) = effect.sense(state, value, moment);
            slopes.push(slope);
            sensed
        })
    }
}
