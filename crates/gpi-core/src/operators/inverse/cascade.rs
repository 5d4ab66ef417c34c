//! The inverse of the cascade: plays, then deadzones.

use super::curve::Curve;
use super::envelope::Inverted;
use crate::operators::{
    Deadzones, Gpi, GpiState, IN_CACHE, Operator, OperatorError, PlayBank, PlayBankState, Sample,
    Storage, play,
};

/// `u = D^-1[P^-1[v]]`: the drive that makes a [`Gpi`] give v, exactly.
///
/// P^-1 are plays ([`PlayBank::inverse`]), D^-1 deadzones, so that a step costs what the forward one does. What the
/// drive's limits do not reach is clamped: the drive stops at its limit, the plays go on from there as they do
/// forwards, and [`InverseState::out_of_reach`] counts the sample.
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
    /// The envelope, for one sample.
    curve: Curve<E>,
    drive: [E::Item; 2],
    reach: [E::Item; 2],
    /// Between these every v is within reach, wherever the plays stand.
    safe: [E::Item; 2],
}

/// What an [`InverseGpi`] remembers.
#[derive(Clone, Debug, PartialEq)]
pub struct InverseState<S> {
    /// State of its plays.
    pub plays: PlayBankState<S>,
    /// Samples at which the drive stopped at its limit, as many as fit into the counter.
    pub out_of_reach: u32,
}

impl<E, S> Gpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    /// The inverse, as far around zero as the envelope rises.
    ///
    /// # Errors
    /// A slope of the plays, or of the envelope at zero, that is not positive; directional deadzones.
    pub fn inverse(&self) -> Result<InverseGpi<E, S>, OperatorError> {
        let infinity = E::Item::INFINITY;
        self.inverse_within(-infinity, infinity)
    }

    /// The inverse whose drive stays between two limits, in the unit of u.
    ///
    /// # Errors
    /// As [`Gpi::inverse`], or limits between which the envelope does not rise.
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

    /// The state of [`Gpi::inverse`] that belongs to a state of the cascade.
    ///
    /// # Errors
    /// Plays further apart than their half-widths allow, which no input brings about.
    pub fn inverse_state(
        &self,
        state: &GpiState<E::Item, S>,
    ) -> Result<InverseState<S>, OperatorError> {
        Ok(InverseState { plays: self.plays().inverse_state(&state.plays)?, out_of_reach: 0 })
    }
}

/// The v for which z stays within reach wherever plays stand that an input has brought there: z is at most
/// `v P' + sum_j (r'_j - r'_{j-1}) |p'_j + p'_{j+1} + ..|`, P' the sum of all weights.
fn safe<S: Storage>(plays: &PlayBank<S>, reach: [S::Item; 2]) -> [S::Item; 2] {
    let zero = S::Item::ZERO;
    let (mut slack, mut tail) = (zero, zero);
    let (r, p) = (plays.half_widths(), plays.weights());
    for (pair, weight) in r.windows(2).zip(p.iter().skip(1)).rev() {
        let &[narrower, wider] = pair else { continue };
        tail = tail + *weight;
        slack = slack + (wider - narrower) * tail.at_least(-tail);
    }
    let all = p.first().map_or(zero, |first| *first + tail);
    [(reach[0] + slack) / all, (reach[1] - slack) / all]
}

impl<E, S> InverseGpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    /// P^-1, from v to z.
    pub fn plays(&self) -> &PlayBank<S> {
        &self.plays
    }

    /// D^-1, from z to u.
    pub fn envelope(&self) -> &Deadzones<E> {
        &self.envelope
    }

    /// D^-1 as a curve, of which a sample needs one piece.
    pub fn curve(&self) -> &Curve<E> {
        &self.curve
    }

    /// The lowest and the highest drive u.
    pub fn drive(&self) -> [E::Item; 2] {
        self.drive
    }

    /// The lowest and the highest z, the envelope's outputs at these drives.
    pub fn reach(&self) -> [E::Item; 2] {
        self.reach
    }

    /// The lowest and the highest v that are within reach wherever the plays stand.
    pub fn safe(&self) -> [E::Item; 2] {
        self.safe
    }

    /// The drive for z.
    #[inline]
    fn drive_for(&self, z: E::Item) -> E::Item {
        self.curve.at(z).at_most(self.drive[1]).at_least(self.drive[0])
    }

    /// The drive u for v, and the v that it reaches.
    #[inline]
    pub fn step_reached(&self, state: &mut InverseState<S>, v: E::Item) -> (E::Item, E::Item) {
        if v < self.safe[0] || v > self.safe[1] {
            self.step_to_limit(state, v)
        } else {
            (self.drive_for(self.plays.step(&mut state.plays, v)), v)
        }
    }

    /// The step where v may be out of reach.
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
    /// The output for an input, while the plays stay where they stand.
    fn output_for(&self, state: &PlayBankState<S>, input: S::Item) -> S::Item {
        let plays = self.half_widths.values().iter().zip(self.weights.values());
        let outputs =
            plays.zip(state.plays.values()).map(|((r, p), place)| *p * play(*r, input, *place));
        outputs.fold(S::Item::ZERO, |sum, output| sum + output)
    }

    /// The input for which plays from narrow to wide, with slopes that are positive, give an output.
    fn input_for(&self, state: &PlayBankState<S>, output: S::Item) -> S::Item {
        let plays = || {
            let own = self.half_widths.values().iter().zip(self.weights.values());
            own.zip(state.plays.values()).map(|((r, p), place)| (*r, *p, *place))
        };
        let zero = S::Item::ZERO;
        let (mut input, mut reached, mut slope) = (zero, zero, zero);
        for (index, (_, p, place)) in plays().enumerate() {
            input = if index == 0 { place } else { input };
            reached = reached + p * place;
        }
        let rises = output > reached;
        for (r, p, place) in plays() {
            // from here on the next wider play moves along
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

    /// The state that belongs to the cascade at rest.
    fn rest(&self) -> InverseState<S> {
        InverseState { plays: self.plays.rest(), out_of_reach: 0 }
    }

    /// The drive u for v.
    #[inline]
    fn step(&self, state: &mut InverseState<S>, v: E::Item) -> E::Item {
        self.step_reached(state, v).0
    }

    fn block(&self, state: &mut Self::State, input: &[E::Item], output: &mut [E::Item]) -> usize {
        for (output, input) in output.chunks_mut(IN_CACHE).zip(input.chunks(IN_CACHE)) {
            let samples = input.len().min(output.len());
            output[..samples].copy_from_slice(&input[..samples]);
            self.in_place(state, &mut output[..samples]);
        }
        input.len().min(output.len())
    }

    /// As fast as the forward operators where v is within reach.
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

    fn wanted() -> Vec<f64> {
        (0..5000)
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
        assert!(missed > 1000 && missed <= beyond);
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
