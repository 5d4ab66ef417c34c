//! The inverse of a bank of plays is a bank of plays.

use crate::operators::storage::sort_by_key;
use crate::operators::{OperatorError, PlayBank, PlayBankState, Sample, Storage};

impl<S: Storage> PlayBank<S> {
    /// The inverse bank P^-1, its plays in ascending order of half-widths.
    ///
    /// For half-widths in ascending order with `r_0 = 0`, and with the slopes `P_i = p_0 + .. + p_i`, the inverse has the
    /// half-widths `r'_i = sum_{j <= i} p_j (r_i - r_j)` and the weights `p'_0 = 1 / P_0`,
    /// `p'_i = 1 / P_i - 1 / P_{i-1}` (K. Kuhnen, *Modeling, identification and compensation of complex hysteretic
    /// nonlinearities*, European Journal of Control 9, 2003). Of plays with equal half-widths, the last one gets the
    /// weight of all and the others get zero.
    ///
    /// ```
    /// use gpi_core::operators::{Operator, PlayBank};
    /// let bank = PlayBank::new([0.0, 0.5, 1.5], [1.0, 2.0, -0.5])?;
    /// let inverse = bank.inverse()?;
    /// let wanted = [1.0, 7.0, -2.0, 3.0, 2.5];
    /// let mut signal = wanted;
    /// inverse.in_place(&mut inverse.rest(), &mut signal);
    /// bank.in_place(&mut bank.rest(), &mut signal);
    /// assert!(signal.iter().zip(wanted).all(|(v, w)| (v - w as f64).abs() < 1e-14));
    /// # Ok::<(), gpi_core::operators::OperatorError>(())
    /// ```
    ///
    /// # Errors
    /// A slope P_i is not positive; P_0 is zero if no play has the half-width zero.
    pub fn inverse(&self) -> Result<Self, OperatorError> {
        let not_rising = |index, slope: S::Item| {
            let slope = slope.into();
            Err(OperatorError::NotRising { parameter: "weights", index, slope })
        };
        let zero = S::Item::ZERO;
        let (mut r, mut p) = (self.half_widths.clone(), self.weights.clone());
        sort_by_key(&mut r, [&mut p]);
        let (mut half_widths, mut weights) = (r.clone(), p.clone());
        let widths = r.values().iter().zip(r.values().iter().skip(1)).map(Some).chain([None]);
        let columns =
            widths.zip(p.values()).zip(half_widths.values_mut()).zip(weights.values_mut());
        let (mut slope, mut before, mut width, mut size) = (zero, zero, zero, zero);
        for (index, (((neighbours, &own), half_width), weight)) in columns.enumerate() {
            if index == 0 && r.values().first() != Some(&zero) {
                return not_rising(index, zero);
            }
            (*half_width, *weight) = (width, zero);
            slope = slope + own;
            size = size + own.at_least(-own);
            if neighbours.is_some_and(|(r, next)| r == next) {
                continue;
            }
            if slope <= S::Item::EPSILON * size {
                return not_rising(index, slope);
            }
            let one = S::Item::ONE;
            *weight = if before > zero { (before - slope) / (slope * before) } else { one / slope };
            before = slope;
            if let Some((&r, &next)) = neighbours {
                width = width + slope * (next - r);
            }
        }
        if before == zero {
            return not_rising(0, zero);
        }
        Self::new(half_widths, weights)
    }

    /// The state of [`PlayBank::inverse`] that corresponds to a state of this bank:
    /// `F'_i = P_i F_i + sum_{j > i} p_j F_j`.
    ///
    /// # Errors
    /// The outputs of two plays differ by more than their half-widths do; no input leads to such a state.
    pub fn inverse_state(
        &self,
        state: &PlayBankState<S>,
    ) -> Result<PlayBankState<S>, OperatorError> {
        let (mut r, mut p) = (self.half_widths.clone(), self.weights.clone());
        let mut places = state.plays.clone();
        sort_by_key(&mut r, [&mut p, &mut places]);
        let plays = r.values().iter().zip(places.values());
        for (index, ((r, place), (wider, next))) in plays.clone().zip(plays.skip(1)).enumerate() {
            let distance = (*next - *place).at_least(*place - *next);
            let most = *wider - *r;
            let size = next.at_least(-*next) + place.at_least(-*place) + *wider;
            let rounding = (S::Item::ONE + S::Item::ONE) * S::Item::EPSILON * size;
            if distance > most + rounding {
                let (distance, most) = (distance.into(), most.into());
                return Err(OperatorError::OutOfPlace { index: index + 1, distance, most });
            }
        }
        let mut moved = places.clone();
        let mut slope = S::Item::ZERO;
        for ((own, place), p) in moved.values_mut().iter_mut().zip(places.values()).zip(p.values())
        {
            slope = slope + *p;
            *own = slope * *place;
        }
        let mut wider = S::Item::ZERO;
        let rows = moved.values_mut().iter_mut().zip(places.values()).zip(p.values());
        for ((own, place), p) in rows.rev() {
            *own = *own + wider;
            wider = wider + *p * *place;
        }
        Ok(PlayBankState { plays: moved })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::Operator;

    #[test]
    fn without_a_positive_slope_there_is_none() {
        let refused =
            |r: Vec<f64>, p: Vec<f64>| PlayBank::new(r, p).unwrap().inverse().unwrap_err();
        let not_rising =
            |index, slope| OperatorError::NotRising { parameter: "weights", index, slope };
        assert_eq!(refused(vec![], vec![]), not_rising(0, 0.0));
        assert_eq!(refused(vec![0.1, 0.5], vec![1.0, 1.0]), not_rising(0, 0.0));
        assert_eq!(refused(vec![0.0, 0.5], vec![1.0, -1.0]), not_rising(1, 0.0));
        assert_eq!(refused(vec![0.0, 0.0, 0.5], vec![2.0, -1.0, -1.5]), not_rising(2, -0.5));
    }

    #[test]
    fn in_any_order_and_with_equal_half_widths() {
        let bank =
            PlayBank::new(vec![0.7, 0.0, 0.2, 0.7, 0.0], vec![1.0, 0.25, 0.5, -0.5, 0.75]).unwrap();
        let inverse = bank.inverse().unwrap();
        let again = inverse.inverse().unwrap();
        let wanted: Vec<f64> = (0..400).map(|k| 3.0 * (0.3 * f64::from(k)).sin()).collect();
        let mut signal = wanted.clone();
        inverse.in_place(&mut inverse.rest(), &mut signal);
        let drive = signal.clone();
        bank.in_place(&mut bank.rest(), &mut signal);
        assert!(signal.iter().zip(&wanted).all(|(v, w)| (v - w).abs() < 1e-14));
        let mut twice = drive;
        again.in_place(&mut again.rest(), &mut twice);
        assert!(twice.iter().zip(&wanted).all(|(v, w)| (v - w).abs() < 1e-14));
    }

    #[test]
    fn it_goes_on_from_where_the_plays_stand() {
        let bank = PlayBank::new([0.5, 0.0, 1.0], [1.0, 2.0, 0.5]).unwrap();
        let mut state = bank.rest();
        for z in [3.0, -2.0, 1.1] {
            bank.step(&mut state, z);
        }
        let inverse = bank.inverse().unwrap();
        let mut own = bank.inverse_state(&state).unwrap();
        for wanted in [0.3_f64, 4.0, -7.0] {
            let z = inverse.step(&mut own, wanted);
            assert!((bank.step(&mut state, z) - wanted).abs() < 1e-14);
        }
        let torn = bank.state_from([5.0, 0.0, 0.0]).unwrap();
        let expected = OperatorError::OutOfPlace { index: 1, distance: 5.0, most: 0.5 };
        assert_eq!(bank.inverse_state(&torn).unwrap_err(), expected);
    }
}
