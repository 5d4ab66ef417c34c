//! A compensator that computes the drive for a reference, one sample at a time.

use super::Faults;
use super::cascade::{InverseGpi, InverseState};
use crate::operators::error::require_finite;
use crate::operators::{Lags, LagsState, Operator, OperatorError, Sample, Storage};

/// The drive `u = D^-1[P^-1[v]]`, `v = (r - offset - sum_i c_i l_i) / gain`, for which an actuator with creep follows a
/// reference r that is slow compared with its dynamics.
///
/// The actuator is `y = gain v + sum_i c_i l_i + offset`, where v is the output of a [`crate::operators::Gpi`] and l_i
/// are [`Lags`]. The creep of a sample does not depend on v of the same sample, so it is known before v is computed. If
/// the drive is clamped to a limit, creep follows the v that this drive reaches.
///
/// # Bad samples
/// The drive and the state stay finite for every sequence of references, and the drive stays within its limits.
/// - A reference that is NaN or infinite holds the drive: the state does not change, and [`Faults::not_finite`] is set.
///   [`Compensator::standing_at`] takes such a reference as `offset`, for which v = 0.
/// - v is limited to [`Compensator::range`], and [`Faults::saturated`] is set when it is.
///
/// Hence every lag stays within the range. Let all c_i have the sign of the gain, and let b be the length of the range. A
/// bad sample changes each lag by at most `rate_i b`. After m bad and n good samples, v therefore differs from the v
/// without the bad samples by at most `m b sum_i rate_i |c_i / gain| (1 - min_i rate_i)^n`. (With the weights
/// `c_i / (gain rate_i)`, the matrix that maps the errors of the lags to those of the next sample is symmetric, and no
/// eigenvalue exceeds `1 - min_i rate_i`.) The inverse plays return to the state without the bad samples when v
/// has moved up and down by twice their largest half-width. Until then, the drive is the right one for the actuator,
/// whose plays have followed the drive too.
///
/// `E`, `S` and `L` store the parameters of deadzones, plays and lags: `[T; N]` on firmware.
///
/// ```
/// use gpi_core::operators::{Compensator, Deadzones, Gpi, Lags, Operator, PlayBank, Reading};
/// let envelope = Deadzones::new([0.0, 1.0], [1.0, -0.5], Reading::OneSided)?;
/// let gpi = Gpi::new(envelope, PlayBank::new([0.0, 0.5], [1.0, 2.0])?);
/// let creep = Lags::new([0.01], [0.2])?;
/// let compensator = Compensator::new(gpi.inverse_within(-5.0, 5.0)?, creep.clone(), 2.0, 0.1)?;
/// let mut state = compensator.standing_at(0.1);
/// let (mut plays, mut lags) = (gpi.rest(), creep.rest());
/// for reference in [0.5_f64, 3.0, 2.0, -1.0] {
///     let v = gpi.step(&mut plays, compensator.step(&mut state, reference));
///     assert!((2.0 * v + creep.step(&mut lags, v) + 0.1 - reference).abs() < 1e-14);
/// }
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Compensator<E: Storage, S, L> {
    hysteresis: InverseGpi<E, S>,
    creep: Lags<L>,
    gain: E::Item,
    offset: E::Item,
    range: [E::Item; 2],
}

/// The state of a [`Compensator`].
#[derive(Clone, Debug, PartialEq)]
pub struct CompensatorState<S: Storage, L> {
    /// State of the inverse hysteresis, with the number of samples out of reach.
    pub hysteresis: InverseState<S>,
    /// State of the creep.
    pub creep: LagsState<L>,
    /// The latest drive, in the unit of u.
    pub drive: S::Item,
    /// What was wrong with the references.
    pub faults: Faults,
}

impl<E, S, L> Compensator<E, S, L>
where
    E: Storage,
    S: Storage<Item = E::Item>,
    L: Storage<Item = E::Item>,
{
    /// A compensator from the inverse hysteresis, the creep, the DC gain of the dynamics and the output at v = 0.
    ///
    /// # Errors
    /// The gain is zero or cancelled by creep, or a number is not finite.
    pub fn new(
        hysteresis: InverseGpi<E, S>,
        creep: Lags<L>,
        gain: E::Item,
        offset: E::Item,
    ) -> Result<Self, OperatorError> {
        require_finite("gain", &[gain])?;
        require_finite("offset", &[offset])?;
        let size = |value: E::Item| value.at_least(-value);
        let largest = creep.gains().iter().fold(size(gain), |sum, &c| sum + size(c));
        let range = hysteresis.range(offset / gain);
        let compensator = Self { hysteresis, creep, gain, offset, range };
        let slope = size(gain).at_most(size(compensator.steady_gain()));
        if slope <= E::Item::EPSILON * largest {
            let slope = slope.into();
            return Err(OperatorError::NotRising { parameter: "gain", index: 0, slope });
        }
        require_finite("range", &compensator.range)?;
        Ok(compensator)
    }

    /// The inverse hysteresis, from v to u.
    pub fn hysteresis(&self) -> &InverseGpi<E, S> {
        &self.hysteresis
    }

    /// The creep, from v to y.
    pub fn creep(&self) -> &Lags<L> {
        &self.creep
    }

    /// The DC gain from v to y without creep.
    pub fn gain(&self) -> E::Item {
        self.gain
    }

    /// The output y at v = 0.
    pub fn offset(&self) -> E::Item {
        self.offset
    }

    /// The range in which v is limited, lower end first, see [`Compensator`].
    pub fn range(&self) -> [E::Item; 2] {
        self.range
    }

    /// The nearest v in the range.
    #[inline]
    fn within(&self, v: E::Item, faults: &mut Faults) -> E::Item {
        let nearest = v.at_most(self.range[1]).at_least(self.range[0]);
        faults.saturated |= nearest != v;
        nearest
    }

    /// The steady-state gain from v to y, with creep.
    fn steady_gain(&self) -> E::Item {
        self.creep.gains().iter().fold(self.gain, |sum, &gain| sum + gain)
    }

    /// The steady state after the reference changed from zero to this value, or to `offset` if the value is NaN or infinite.
    pub fn standing_at(&self, reference: E::Item) -> CompensatorState<S, L> {
        let mut faults = Faults { not_finite: !reference.finite(), ..Faults::default() };
        let reference = if faults.not_finite { self.offset } else { reference };
        let v = self.within((reference - self.offset) / self.steady_gain(), &mut faults);
        let mut hysteresis = self.hysteresis.rest();
        let (drive, reached) = self.hysteresis.step_reached(&mut hysteresis, v);
        hysteresis.out_of_reach = 0;
        CompensatorState { hysteresis, creep: self.creep.settled(reached), drive, faults }
    }
}

impl<E, S, L> Operator for Compensator<E, S, L>
where
    E: Storage,
    S: Storage<Item = E::Item>,
    L: Storage<Item = E::Item>,
{
    type Sample = E::Item;
    type State = CompensatorState<S, L>;

    /// The initial state: v = 0.
    fn rest(&self) -> CompensatorState<S, L> {
        self.standing_at(self.offset)
    }

    /// The drive u for one sample of the reference; a sample that is not finite holds the drive.
    #[inline]
    fn step(&self, state: &mut CompensatorState<S, L>, reference: E::Item) -> E::Item {
        if reference.finite() {
            let v = (reference - self.offset - self.creep.output(&state.creep)) / self.gain;
            let v = self.within(v, &mut state.faults);
            let (drive, reached) = self.hysteresis.step_reached(&mut state.hysteresis, v);
            self.creep.advance(&mut state.creep, reached);
            state.drive = drive;
        } else {
            state.faults.not_finite = true;
        }
        state.drive
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::{Deadzones, Gpi, PlayBank, Reading};

    type Cascade = Gpi<[f64; 3], [f64; 3]>;

    fn actuator() -> (Cascade, Lags<[f64; 2]>) {
        let envelope =
            Deadzones::new([-1.0, 0.0, 1.0], [0.5, 1.0, -0.4], Reading::OneSided).unwrap();
        let plays = PlayBank::new([0.0, 0.3, 0.8], [1.0, 0.7, 0.4]).unwrap();
        (Gpi::new(envelope, plays), Lags::new([0.02, 0.001], [0.1, 0.2]).unwrap())
    }

    /// Miri takes milliseconds for each sample: it runs a part of them.
    const STRIDE: usize = if cfg!(miri) { 20 } else { 1 };

    fn references() -> impl Iterator<Item = f64> {
        (0..3000)
            .step_by(STRIDE)
            .map(|k| 1.0 + 4.0 * (0.01 * f64::from(k)).sin() * (0.0007 * f64::from(k)).cos())
    }

    #[test]
    fn creep_and_hysteresis_are_undone_to_rounding() {
        let (gpi, creep) = actuator();
        let compensator =
            Compensator::new(gpi.inverse().unwrap(), creep.clone(), -0.5, 3.0).unwrap();
        let mut state = compensator.standing_at(1.0);
        let mut plays = gpi.rest();
        let mut lags = creep.settled(gpi.step(&mut plays, state.drive));
        for reference in references() {
            let v = gpi.step(&mut plays, compensator.step(&mut state, reference));
            let y = -0.5 * v + creep.step(&mut lags, v) + 3.0;
            assert!((y - reference).abs() < 1e-12, "{y} {reference}");
        }
    }

    #[test]
    fn back_within_reach_it_follows_again() {
        let (gpi, creep) = actuator();
        let inverse = gpi.inverse_within(-1.0, 1.5).unwrap();
        let compensator = Compensator::new(inverse, creep.clone(), 1.0, 0.0).unwrap();
        let (mut state, mut plays, mut lags) = (compensator.rest(), gpi.rest(), creep.rest());
        let mut missed = 0;
        for reference in references() {
            let u = compensator.step(&mut state, reference);
            let v = gpi.step(&mut plays, u);
            let y = v + creep.step(&mut lags, v);
            if (y - reference).abs() > 1e-12 {
                missed += 1;
                assert!(u == -1.0 && y > reference || u == 1.5 && y < reference);
            }
        }
        let stride = STRIDE as u32;
        assert!((500 / stride..2500 / stride).contains(&missed), "{missed}");
        assert_eq!(state.hysteresis.out_of_reach, missed);
    }

    #[test]
    fn what_is_not_finite_holds_the_drive() {
        let (gpi, creep) = actuator();
        let compensator = Compensator::new(gpi.inverse().unwrap(), creep, 1.0, 0.0).unwrap();
        let mut state = compensator.standing_at(0.5);
        let drive = compensator.step(&mut state, 0.7);
        let mut expected = state.clone();
        assert_eq!(state.faults, Faults::default());
        expected.faults.not_finite = true;
        for reference in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(compensator.step(&mut state, reference), drive);
            assert_eq!(state, expected);
            let started = compensator.standing_at(reference);
            assert_eq!(
                (started.drive, started.faults),
                (compensator.rest().drive, expected.faults)
            );
        }
    }

    /// After samples that are out of range the output of the actuator is the reference again at once, since the compensator
    /// knows what the drive did to it.
    #[test]
    fn bad_samples_saturate_and_are_recovered_from() {
        const PERIOD: i32 = if cfg!(miri) { 20 } else { 500 };
        const SAMPLES: i32 = if cfg!(miri) { 30 } else { 4000 };
        let (gpi, creep) = actuator();
        for limits in [[-1.0, 1.5], [f64::NEG_INFINITY, f64::INFINITY], [-1.0, f64::INFINITY]] {
            let inverse = gpi.inverse_within(limits[0], limits[1]).unwrap();
            let compensator = Compensator::new(inverse, creep.clone(), 1.0, 0.2).unwrap();
            let [low, high] = compensator.range();
            assert!(low.is_finite() && high.is_finite() && low < 0.0 && high > 0.0);
            for bad in [f64::NAN, f64::INFINITY, f64::MAX, -f64::MAX, 1e37, -1e10] {
                let mut state = compensator.standing_at(bad);
                assert!(state.drive.is_finite() && state.faults != Faults::default());
                let mut plays = gpi.rest();
                let mut lags = creep.settled(gpi.step(&mut plays, state.drive));
                for k in 0..SAMPLES {
                    let good = 0.2 + 0.5 * (0.01 * f64::from(k)).sin();
                    let reference = if k % PERIOD < 5 { bad } else { good };
                    if k % PERIOD == 5 {
                        assert!(state.faults != Faults::default());
                        state.faults = Faults::default();
                    }
                    let u = compensator.step(&mut state, reference);
                    assert!(u >= limits[0] && u <= limits[1] && u.is_finite());
                    let v = gpi.step(&mut plays, u);
                    let y = v + creep.step(&mut lags, v) + 0.2;
                    assert!(state.creep.lags.iter().all(|lag| (low..=high).contains(lag)));
                    if k % PERIOD >= 5 {
                        assert_eq!(state.faults, Faults::default());
                        let is_at_limit = u == limits[0] || u == limits[1];
                        // the actuator creeps while the drive is held, and the compensator does not know
                        let is_known = bad.is_finite() && !is_at_limit;
                        assert!(!is_known || (y - good).abs() < 1e-13 * (high - low), "{bad} {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn without_a_gain_there_is_none() {
        let (gpi, creep) = actuator();
        let refused = |gain, offset| {
            Compensator::new(gpi.inverse().unwrap(), creep.clone(), gain, offset).unwrap_err()
        };
        let is_none = |error| matches!(error, OperatorError::NotRising { parameter: "gain", .. });
        assert!(is_none(refused(0.0, 0.0)) && is_none(refused(-0.3, 0.0)));
        let expected = OperatorError::NotFinite { parameter: "offset", index: 0 };
        assert_eq!(refused(1.0, f64::NAN), expected);
    }
}
