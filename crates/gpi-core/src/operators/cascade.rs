//! The generalized Prandtl-Ishlinskii operator: deadzones followed by plays.

use super::{Deadzones, DeadzonesState, IN_CACHE, Operator, PlayBank, PlayBankState, Storage};

/// The generalized Prandtl-Ishlinskii operator `v = P[D[u]]`, equation (1) of the paper.
///
/// `E` stores the parameters of the envelope D, `S` those of the bank of plays P.
///
/// ```
/// use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
/// let envelope = Deadzones::new([0.0, 1.0], [1.0, -0.5], Reading::OneSided)?;
/// let gpi = Gpi::new(envelope, PlayBank::new([0.0, 0.5], [1.0, 2.0])?);
/// let mut state = gpi.rest();
/// assert_eq!(gpi.step(&mut state, 3.0), 2.0 + 2.0 * 1.5);
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "identify",
    serde(bound(
        deserialize = "E: Storage + serde::Deserialize<'de>, S: serde::Deserialize<'de>"
    ))
)]
pub struct Gpi<E, S> {
    envelope: Deadzones<E>,
    plays: PlayBank<S>,
}

/// The state of a [`Gpi`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "identify", derive(serde::Serialize, serde::Deserialize))]
pub struct GpiState<T, S> {
    /// State of the envelope.
    pub envelope: DeadzonesState<T>,
    /// State of the plays.
    pub plays: PlayBankState<S>,
}

impl<E, S> Gpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    /// The cascade of an envelope and a bank of plays.
    pub fn new(envelope: Deadzones<E>, plays: PlayBank<S>) -> Self {
        Self { envelope, plays }
    }

    /// The envelope D.
    pub fn envelope(&self) -> &Deadzones<E> {
        &self.envelope
    }

    /// The bank of plays P.
    pub fn plays(&self) -> &PlayBank<S> {
        &self.plays
    }
}

impl<E, S> Operator for Gpi<E, S>
where
    E: Storage,
    S: Storage<Item = E::Item>,
{
    type Sample = E::Item;
    type State = GpiState<E::Item, S>;

    fn rest(&self) -> Self::State {
        GpiState { envelope: self.envelope.rest(), plays: self.plays.rest() }
    }

    #[inline]
    fn step(&self, state: &mut Self::State, input: E::Item) -> E::Item {
        let z = self.envelope.step(&mut state.envelope, input);
        self.plays.step(&mut state.plays, z)
    }

    fn in_place(&self, state: &mut Self::State, signal: &mut [E::Item]) {
        for signal in signal.chunks_mut(IN_CACHE) {
            self.envelope.in_place(&mut state.envelope, signal);
            self.plays.in_place(&mut state.plays, signal);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Reading;
    use super::*;

    #[test]
    fn cascade_is_deadzones_then_plays() {
        let envelope =
            Deadzones::new([-1.0, 0.0, 1.0], [0.5, 1.0, -0.4], Reading::Directional).unwrap();
        let plays = PlayBank::new([0.0, 0.3], [1.0, 0.7]).unwrap();
        let gpi = Gpi::new(envelope.clone(), plays.clone());
        let input: Vec<f64> = (0..200).map(|k| 3.0 * (0.37 * f64::from(k)).sin()).collect();
        let mut by_parts = input.clone();
        envelope.in_place(&mut envelope.rest(), &mut by_parts);
        plays.in_place(&mut plays.rest(), &mut by_parts);
        let mut whole = vec![0.0; input.len()];
        gpi.block(&mut gpi.rest(), &input, &mut whole);
        assert_eq!(whole, by_parts);
    }
}
