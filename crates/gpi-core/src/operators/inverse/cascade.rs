//! The inverse of the cascade: plays followed by deadzones.

use super::curve::Curve;
use super::envelope::Inverted;
use crate::operators::{
    Deadzones, Gpi, GpiState, IN_CACHE, Operator, OperatorError, PlayBank, PlayBankState, Sample,
    Storage, play,
};

/// The exact inverse of a [`Gpi`], `u = D^-1[P^-1[v]]`: the drive u for which the cascade's output is v.
///
/// P^-1 is a bank of plays ([`PlayBank::inverse`]) and D^-1 a sum of deadzones, so a step costs as much as a forward
/// step. If v would need a drive beyond its limits, the drive stays at the limit, the state of the plays follows the v
/// that this drive reaches, and [`InverseState::out_of_reach`] counts the sample.
///
/// ```
/// use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
/// let envelope = Deadzones::new([0.0, 1.0], [1.0, -0.5], Reading::OneSided)?;
/// let gpi = Gpi::new(envelope, PlayBank::new([0.0, 0.5], [1.0, 2.0])?);
/// let inverse = gpi.inverse()?;
/// let (mut backward, mut forward) = (inverse.rest(), gpi.rest());
/// for wanted in [0.5_f64, 3.0, 2.0, -1.0] {
///     let u = inverse.step(&mut backward, wanted);
///     assert!((gpi.step(&mut forward, u) - wanted).abs() < 1e-15);
/// }
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct InverseGpi<E: Storage, S> {
    plays: PlayBank<S>,
    envelope: Deadzones<E>,
    /// The envelope D^-1 as a curve, which a single sample evaluates faster.
    curve: Curve<E>,
    drive: [E::Item; 2],
    reach: [E::Item; 2],
    /// The interval of v that is within reach for every state of the plays.
    safe: [E::Item; 2],
}

/// The state of an [`InverseGpi`].
#[derive(Clone, Debug, PartialEq)]
pub struct InverseState<S> {
    /// State of the plays P^-1.
    pub plays: PlayBankState<S>,
    /// Number of samples at which the drive was clamped to a limit; the counter saturates.
    pub out_of_reach: u32,
}

impl<E, S> Gpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    /// The inverse on the interval around zero in which the envelope increases.
    ///
    /// # Errors
    /// A slope of the plays, or of the envelope at zero, is not positive; the deadzone convention is directional.
    pub fn inverse(&self) -> Result<InverseGpi<E, S>, OperatorError> {
        let infinity = E::Item::INFINITY;
        self.inverse_within(-infinity, infinity)
    }

    /// The inverse with a drive between two limits, in the unit of u.
    ///
    /// # Errors
    /// As [`Gpi::inverse`], or the envelope does not increase between the limits.
    pub fn inverse_within(
        &self,
        lower: E::Item,
        upper: E::Item,
    ) -> Result<InverseGpi<E, S>, OperatorError> {
        let plays = self.plays().inverse()?;
        let Inverted { envelope, drive, reach } = self.envelope().inverse([lower, upper])?;
        let safe = safe(&plays, reach);
        let curve = Curve::new(&envelope);
        Ok(InverseGpi { plays, envelope, curve, drive, reach, safe })
    }

    /// The state of [`Gpi::inverse`] that corresponds to a state of the cascade.
    ///
    /// # Errors
    /// The outputs of two plays differ by more than their half-widths do; no input leads to such a state.
    pub fn inverse_state(
        &self,
        state: &GpiState<E::Item, S>,
    ) -> Result<InverseState<S>, OperatorError> {
        Ok(InverseState { plays: self.plays().inverse_state(&state.plays)?, out_of_reach: 0 })
    }
}

/// The interval of v for which z is within reach for every state that an input leads to.
///
/// z is at most `v P' + sum_j (r'_j - r'_{j-1}) |p'_j + p'_{j+1} + ..|`, where P' is the sum of all weights p'_j.
fn safe<S: Storage>(plays: &PlayBank<S>, reach: [S::Item; 2]) -> [S::Item; 2] {
    let (slack, all) = slack(plays);
    [(reach[0] + slack) / all, (reach[1] - slack) / all]
}

/// The largest difference between z and `v P'`, and P'.
pub(super) fn slack<S: Storage>(plays: &PlayBank<S>) -> (S::Item, S::Item) {
    let zero = S::Item::ZERO;
    let (mut slack, mut tail) = (zero, zero);
    let (r, p) = (plays.half_widths(), plays.weights());
    for (pair, weight) in r.windows(2).zip(p.iter().skip(1)).rev() {
        let &[narrower, wider] = pair else { continue };
        tail = tail + *weight;
        slack = slack + (wider - narrower) * tail.at_least(-tail);
    }
    let all = p.first().map_or(zero, |first| *first + tail);
    (slack, all)
}

impl<E, S> InverseGpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    /// The bank of plays P^-1, from v to z.
    pub fn plays(&self) -> &PlayBank<S> {
        &self.plays
    }

    /// The envelope D^-1, from z to u.
    pub fn envelope(&self) -> &Deadzones<E> {
        &self.envelope
    }

    /// D^-1 as a piecewise linear curve.
    pub fn curve(&self) -> &Curve<E> {
        &self.curve
    }

    /// The limits of the drive u, lower first.
    pub fn drive(&self) -> [E::Item; 2] {
        self.drive
    }

    /// The limits of z, lower first: the forward envelope's outputs at the limits of the drive.
    pub fn reach(&self) -> [E::Item; 2] {
        self.reach
    }

    /// The limits of v that is within reach for every state of the plays, lower first.
    pub fn safe(&self) -> [E::Item; 2] {
        self.safe
    }

    /// The drive for z.
    #[inline]
    fn drive_for(&self, z: E::Item) -> E::Item {
        self.curve.at(z).at_most(self.drive[1]).at_least(self.drive[0])
    }

    /// The drive u for v, and the v that this drive reaches.
    #[inline]
    pub fn step_reached(&self, state: &mut InverseState<S>, v: E::Item) -> (E::Item, E::Item) {
        if v < self.safe[0] || v > self.safe[1] {
            self.step_to_limit(state, v)
        } else {
            (self.drive_for(self.plays.step(&mut state.plays, v)), v)
        }
    }

    /// [`InverseGpi::step_reached`] for a v that may be out of reach.
    #[cold]
    fn step_to_limit(&self, state: &mut InverseState<S>, v: E::Item) -> (E::Item, E::Item) {
        let z = self.plays.output_for(&state.plays, v);
        let within = z.at_most(self.reach[1]).at_least(self.reach[0]);
        let mut nearest = v;
        if within != z {
            nearest = self.plays.input_for(&state.plays, within);
            state.out_of_reach = state.out_of_reach.saturating_add(1);
        }
        self.plays.step(&mut state.plays, nearest);
        (self.drive_for(within), nearest)
    }
}

impl<S: Storage> PlayBank<S> {
    /// The half-width, the weight and the output of each play.
    fn terms(&self, state: &PlayBankState<S>) -> impl Iterator<Item = [S::Item; 3]> {
        let own = self.half_widths.values().iter().zip(self.weights.values());
        own.zip(state.plays.values()).map(|((r, p), place)| [*r, *p, *place])
    }

    /// The output for an input, without an update of the state.
    fn output_for(&self, state: &PlayBankState<S>, input: S::Item) -> S::Item {
        let terms = self.terms(state);
        terms.fold(S::Item::ZERO, |sum, [r, p, place]| sum + p * play(r, input, place))
    }

    /// The input for an output; needs plays in ascending order of half-widths and positive slopes.
    fn input_for(&self, state: &PlayBankState<S>, output: S::Item) -> S::Item {
        let zero = S::Item::ZERO;
        let (mut slope, mut input) = (zero, state.plays.values().first().copied().unwrap_or(zero));
        let mut reached = self.terms(state).fold(zero, |sum, [_, p, place]| sum + p * place);
        let rises = output > reached;
        for [r, p, place] in self.terms(state) {
            // beyond this input the next wider play changes too
            let turn = if rises { place + r } else { place - r };
            let there = reached + slope * (turn - input);
            if (rises && there > output) || (!rises && there < output) {
                break;
            }
            (input, reached, slope) = (turn, there, slope + p);
        }
        if slope > zero { input + (output - reached) / slope } else { input }
    }
}

impl<E, S> Operator for InverseGpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    type Sample = E::Item;
    type State = InverseState<S>;

    /// The state that corresponds to the initial state of the cascade.
    fn rest(&self) -> InverseState<S> {
        InverseState { plays: self.plays.rest(), out_of_reach: 0 }
    }

    /// The drive u for v.
    #[inline]
    fn step(&self, state: &mut InverseState<S>, v: E::Item) -> E::Item {
        self.step_reached(state, v).0
    }

    /// As fast as the forward operators if v is within reach.
    fn in_place(&self, state: &mut InverseState<S>, signal: &mut [E::Item]) {
        for block in signal.chunks_mut(IN_CACHE) {
            let is_beyond = |v: &E::Item| *v < self.safe[0] || *v > self.safe[1];
            if block.iter().any(is_beyond) {
                block.iter_mut().for_each(|v| *v = self.step(state, *v));
                continue;
            }
            self.plays.in_place(&mut state.plays, block);
            self.envelope.in_place(&mut self.envelope.rest(), block);
            for u in block {
                *u = u.at_most(self.drive[1]).at_least(self.drive[0]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::Reading;

    fn example() -> Gpi<[f64; 3], [f64; 3]> {
        let envelope =
            Deadzones::new([0.0, 1.0, -2.0], [1.0, 0.5, -0.4], Reading::OneSided).unwrap();
        Gpi::new(envelope, PlayBank::new([0.0, 0.3, 0.8], [1.0, 0.5, 0.7]).unwrap())
    }

    /// Miri takes milliseconds for each sample: it runs the first period.
    const SAMPLES: u32 = if cfg!(miri) { 130 } else { 5000 };

    fn wanted() -> Vec<f64> {
        (0..SAMPLES)
            .map(|k| 4.0 * (0.05 * f64::from(k)).sin() * (0.003 * f64::from(k)).cos())
            .collect()
    }

    #[test]
    fn beyond_the_limits_the_drive_waits_there() {
        let gpi = example();
        let inverse = gpi.inverse_within(-1.0, 1.5).unwrap();
        let (mut backward, mut forward) = (inverse.rest(), gpi.rest());
        let (mut beyond, mut missed) = (0_u32, 0_u32);
        for v in wanted() {
            let u = inverse.step(&mut backward, v);
            let reached = gpi.step(&mut forward, u);
            assert!((-1.0..=1.5).contains(&u));
            if (reached - v).abs() > 1e-12 {
                missed += 1;
                assert!(u == -1.0 && reached > v || u == 1.5 && reached < v);
            }
            beyond += u32::from(u == -1.0 || u == 1.5);
        }
        assert!(missed > SAMPLES / 5 && missed <= beyond);
        assert_eq!(backward.out_of_reach, missed);
    }

    #[test]
    fn a_block_is_its_samples_within_reach_or_not() {
        for limits in [(f64::NEG_INFINITY, f64::INFINITY), (-1.0, 1.5), (-30.0, 30.0)] {
            let inverse = example().inverse_within(limits.0, limits.1).unwrap();
            let (mut one, mut all) = (inverse.rest(), inverse.rest());
            let mut signal = wanted();
            inverse.in_place(&mut all, &mut signal);
            for (v, u) in wanted().iter().zip(&signal) {
                assert!((inverse.step(&mut one, *v) - u).abs() < 1e-13);
            }
            assert_eq!(one.out_of_reach, all.out_of_reach);
        }
    }
}
