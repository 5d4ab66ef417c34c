//! The range in which a compensator limits v, and the faults that it reports.

use super::cascade::{InverseGpi, slack};
use crate::operators::{Sample, Storage};

/// The range without limits of the drive is `2^DOUBLINGS` times the largest number of the model, in the unit of v. Such a
/// reference is a fault of its source, since the half-widths and thresholds of a model cover the amplitudes of its record;
/// yet the numbers stay small enough for single precision.
const DOUBLINGS: u32 = 10;

/// What was wrong with the references since the flags were last cleared. To clear them, assign `Faults::default()`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// A reference was NaN or infinite. The drive was held.
    pub not_finite: bool,
    /// A reference needed a v outside the compensator's range. v was set to the nearest end of the range.
    pub saturated: bool,
}

impl<E, S> InverseGpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    /// The range in which v is limited, lower end first; `rest` is the v of another number of the model, its offset.
    ///
    /// Let `[a, b]` be the interval of v outside of which the drive is at a limit for every state of the plays. The range is
    /// `[a - w, b + w]`, extended to zero if it does not contain it, with `w = b - a`. Hence a reference that only exceeds
    /// what the actuator reaches is no fault. At an end without a limit, a or b is zero, and w is `2^10` times the largest of
    /// the half-widths, the thresholds, |rest| and the other end, or `2^10` if all of them are zero.
    pub(super) fn range(&self, rest: E::Item) -> [E::Item; 2] {
        let (zero, one) = (E::Item::ZERO, E::Item::ONE);
        let size = |value: E::Item| value.at_least(-value);
        let (slack, all) = slack(self.plays());
        let [low, high] = self.reach();
        let ends = [(low - slack) / all, (high + slack) / all];
        let [low, high] = ends.map(|end| if end.finite() { end } else { zero });
        let width = if ends.iter().all(|end| end.finite()) {
            high - low
        } else {
            let knots = self.curve().knots().iter().map(|&knot| knot / all);
            let numbers = self.plays().half_widths().iter().copied().chain(knots);
            let largest = numbers.chain([rest, low, high]).map(size).fold(zero, E::Item::at_least);
            let scale = if largest > zero { largest } else { one };
            (0..DOUBLINGS).fold(scale, |scale, _| scale + scale)
        };
        [(low - width).at_most(zero), (high + width).at_least(zero)]
    }
}
