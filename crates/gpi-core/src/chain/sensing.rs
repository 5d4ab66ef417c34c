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
//! closes. A backlash that begins in motion stands at `x(0) + s b`, so that dy(0) = dx(0) however the gap stands.

use super::lanes::Lanes;
use super::point::Point;
use crate::effects::{Moment, OutputStage, Slope};

/// The effects of the output stage on one output, with what they remember.
pub(crate) struct Sensing<'a> {
    blocks: Vec<(&'a dyn OutputStage, Vec<f64>)>,
    /// Whether the next sample is the first one of an experiment that begins in motion.
    begins: bool,
}

impl<'a> Sensing<'a> {
    /// In an experiment of which the displacement `first` is the first one.
    pub(crate) fn new(point: &'a Point, experiment: usize, output: usize, first: f64) -> Self {
        let side = point.pasts[experiment].side(output);
        let own = point.output_stages().filter(|effect| effect.output() == output);
        let mut value = first;
        let blocks = own.map(|effect| {
            let moment = point.stages().moment(0, &[]);
            let state = effect.rest(value, side);
            value = effect.sense(&mut state.clone(), value, moment).0;
            (effect, state)
        });
        Self { blocks: blocks.collect(), begins: side.is_some() }
    }

    /// Takes one sample through; appends how changes pass each effect.
    pub(crate) fn step(&mut self, output: f64, moment: Moment, slopes: &mut Vec<Slope>) -> f64 {
        let begins = std::mem::take(&mut self.begins);
        self.blocks.iter_mut().fold(output, |value, (effect, state)| {
            let (sensed, slope) = effect.sense(state, value, moment);
            let moves_along = begins && slope == Slope::Held;
            slopes.push(if moves_along { Slope::Times(1.0) } else { slope });
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

#[cfg(test)]
mod tests {
    use crate::chain::group::Group;
    use crate::chain::plain::{FREE, plain};
    use crate::chain::stream::Stream;
    use crate::chain::table::Table;
    use crate::effects::Backlash;
    use crate::{Channel, Experiment, Matrix, Record};
    use nalgebra::DVector;

    #[test]
    fn derivatives_of_a_gap_that_begins_in_motion_are_those_of_differences() {
        let gap = Backlash { output: 0, half_width: 0.3, missing: None };
        let mut point = plain(&[0.0, 0.3], &[1.0, -0.7], vec![gap.into()]);
        point.pasts[0].has_unknown_state = true;
        point.pasts[0].gaps[0] = 0.4;
        let u = Matrix::from_fn(150, 1, |k, _| 1.5 + (0.05 * k as f64).sin());
        let run = Experiment::new(u.clone(), u);
        let channel = |name| vec![Channel::new(name, "")];
        let record = Record::new(vec![run], 1e3, channel("u"), channel("y"), vec![]).unwrap();
        let table = Table::new(&point, FREE);
        let side = table.range(Group::Gaps { experiment: 0 });
        assert_eq!(table.names(&point, &record)[side.clone()], ["start[0].gap[y]"]);
        let experiment = &record.experiments()[0];
        let stream = Stream::new(&point, &table, FREE.derivatives, experiment, 0);
        let mut columns = Matrix::zeros(table.len, 150);
        let mut first = 0;
        let mut take = |rows: crate::chain::stream::Rows| {
            let count = rows.residuals.ncols();
            columns.columns_mut(first, count).copy_from(&rows.regressors[0]);
            first += count;
            Ok(())
        };
        stream.unwrap().run(&mut take).unwrap();
        // the place in the gap matters until the gap first closes
        let held = columns.row(side.start).iter().take_while(|&&change| change > 0.2999).count();
        assert!((5..140).contains(&held) && columns[(side.start, 149)] == 0.0, "{held}");
        let step = 1e-6;
        for unknown in 0..table.len {
            let at = |step: f64| {
                let mut all = DVector::zeros(table.len);
                all[unknown] = step;
                point.moved(&all, &table).residuals(&record).unwrap().remove(0)
            };
            let expected = (at(-step) - at(step)) / (2.0 * step);
            // weights cannot become negative, and a bound weight has a derivative to one side only
            let largest = expected.amax().max(1.0);
            for k in 0..150 {
                let error = columns[(unknown, k)] - expected[k];
                assert!(error.abs() < 1e-4 * largest, "{unknown} {k}: {error} of {largest}");
            }
        }
    }
}
