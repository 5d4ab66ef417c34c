//! The inverse of an envelope is an envelope.

use crate::operators::{Deadzones, Operator, OperatorError, Reading, Sample, Storage};

/// The inverse of an envelope, and the interval in which it is one.
pub(super) struct Inverted<S: Storage> {
    pub envelope: Deadzones<S>,
    /// The limits of the forward envelope's input, lower first.
    pub drive: [S::Item; 2],
    /// The forward envelope's outputs at these limits.
    pub reach: [S::Item; 2],
}

impl<S: Storage> Deadzones<S> {
    /// The inverse of one-sided deadzones on the interval around zero, within `limits`, in which they increase.
    ///
    /// It is the curve through the origin with the slopes `1 / S_j` beyond `D(eta_j)`, where S_j is the slope of D beyond
    /// eta_j.
    pub(super) fn inverse(&self, limits: [S::Item; 2]) -> Result<Inverted<S>, OperatorError> {
        if self.reading() == Reading::Directional {
            return Err(OperatorError::Directional);
        }
        let zero = S::Item::ZERO;
        let (mut at_zero, mut size, mut last) = (zero, zero, 0);
        let zones = || self.thresholds().iter().copied().zip(self.weights().iter().copied());
        for (index, (eta, g)) in zones().enumerate() {
            size = size + g.at_least(-g);
            if eta == zero {
                (at_zero, last) = (at_zero + g, index);
            }
        }
        let least = S::Item::EPSILON * size;
        if at_zero <= least {
            let (parameter, slope) = ("envelope.weights", at_zero.into());
            return Err(OperatorError::NotRising { parameter, index: last, slope });
        }
        let (mut thresholds, mut weights) = (self.thresholds.clone(), self.weights.clone());
        let mut drive = limits;
        let columns = thresholds.values_mut().iter_mut().zip(weights.values_mut());
        for (index, ((place, weight), (eta, _))) in columns.zip(zones()).enumerate() {
            *weight = zero;
            if eta == zero {
                *weight = if index == last { S::Item::ONE / at_zero } else { zero };
                continue;
            }
            *place = self.at(eta);
            // of equal thresholds, the last one gets the weight of all
            let is_upper = eta > zero;
            let before = |other: S::Item| {
                if is_upper { zero < other && other < eta } else { eta < other && other < zero }
            };
            let (mut slope, mut own, mut is_last) = (at_zero, zero, true);
            for (other, (threshold, g)) in zones().enumerate() {
                if before(threshold) {
                    slope = slope + g;
                } else if threshold == eta {
                    own = own + g;
                    is_last = is_last && other <= index;
                }
            }
            let beyond = slope + own;
            if !(slope > least && beyond > least) {
                // the inverse ends where the envelope stops increasing
                if is_upper {
                    drive[1] = drive[1].at_most(eta);
                } else {
                    drive[0] = drive[0].at_least(eta);
                }
            } else if is_last {
                *weight = -own / (beyond * slope);
            }
        }
        // thresholds beyond the limits have no effect
        let columns = weights.values_mut().iter_mut().zip(self.thresholds());
        for (weight, &eta) in columns {
            if eta > drive[1] || eta < drive[0] {
                *weight = zero;
            }
        }
        if drive[0].partial_cmp(&drive[1]) != Some(core::cmp::Ordering::Less) {
            let [lower, upper] = limits.map(Into::into);
            return Err(OperatorError::Limits { lower, upper });
        }
        let reach = [self.at(drive[0]), self.at(drive[1])];
        let envelope = Self::new(thresholds, weights, Reading::OneSided)?;
        Ok(Inverted { envelope, drive, reach })
    }

    /// The output for one input; infinite for an infinite input.
    fn at(&self, input: S::Item) -> S::Item {
        if input.finite() { self.step(&mut self.rest(), input) } else { input }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inverted(eta: &[f64], g: &[f64], limits: [f64; 2]) -> Inverted<Vec<f64>> {
        let envelope = Deadzones::new(eta.to_vec(), g.to_vec(), Reading::OneSided).unwrap();
        envelope.inverse(limits).unwrap()
    }

    const NONE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    #[test]
    fn slopes_are_turned_around() {
        let found = inverted(&[2.0, 0.0, -1.0, 2.0, 0.0], &[0.25, 1.0, 3.0, 0.25, 1.0], NONE);
        assert_eq!((found.drive, found.reach), (NONE, NONE));
        let mut z = [-7.0, -2.0, -1.0, 3.0, 4.0, 6.5];
        found.envelope.in_place(&mut found.envelope.rest(), &mut z);
        for (u, expected) in z.iter().zip([-2.0_f64, -1.0, -0.5, 1.5, 2.0, 3.0]) {
            assert!((u - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn it_ends_where_the_envelope_ceases_to_rise() {
        let found = inverted(&[0.0, 3.0, 2.0, -4.0], &[1.0, 5.0, -1.0, -1.5], NONE);
        assert_eq!((found.drive, found.reach), ([-4.0, 2.0], [-4.0, 2.0]));
        let found = inverted(&[0.0, 2.0], &[1.0, -1.0], [-1.0, 1.5]);
        assert_eq!((found.drive, found.reach), ([-1.0, 1.5], [-1.0, 1.5]));
    }

    #[test]
    fn what_has_none_is_refused() {
        let refused = |eta: &[f64], g: &[f64], reading| {
            Deadzones::new(eta.to_vec(), g.to_vec(), reading).unwrap().inverse(NONE).err().unwrap()
        };
        assert_eq!(refused(&[0.0], &[1.0], Reading::Directional), OperatorError::Directional);
        let expected =
            OperatorError::NotRising { parameter: "envelope.weights", index: 1, slope: -1.0 };
        assert_eq!(refused(&[1.0, 0.0], &[3.0, -1.0], Reading::OneSided), expected);
        let empty = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided).unwrap();
        let expected = OperatorError::Limits { lower: 2.0, upper: 1.0 };
        assert_eq!(empty.inverse([2.0, 1.0]).err().unwrap(), expected);
    }
}
