//! How small the error was with effects that were refused for what they follow.
//!
//! Some effects are refused although they explain a part of the residual: a slow function of time that follows the input or a signal
//! that jumps, or an effect with values that no machine has. That part then has a cause which the catalogue does not contain. Another
//! effect that explains less of it is therefore not named either ([`super::examination`], [`super::noise`]).

use super::refusal::Refusal;
use crate::effects::Entry;

/// The smallest held-out rms errors with refused effects, by the reason; infinite without one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surpassing {
    /// With a slow function of time that follows the input's motion, or a signal that jumps.
    pub follows: f64,
    /// With one that does not predict gaps between its knots.
    pub misses_gaps: f64,
    /// With an effect that the input drives and that no machine can have.
    pub impossible: f64,
}

impl Surpassing {
    /// Takes note of a refused effect with its held-out rms error.
    pub(super) fn note(&mut self, entry: &Entry, why: Refusal, rms: f64) {
        let least = match why {
            Refusal::FollowsInput | Refusal::Jumps => &mut self.follows,
            Refusal::Gaps => &mut self.misses_gaps,
            Refusal::Impossible if entry.driven => &mut self.impossible,
            _ => return,
        };
        *least = least.min(rms);
    }
}

impl Default for Surpassing {
    fn default() -> Self {
        Self { follows: f64::INFINITY, misses_gaps: f64::INFINITY, impossible: f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::CATALOGUE;

    #[test]
    fn the_smallest_error_counts_for_its_own_reason() {
        let of = |name: &str| CATALOGUE.iter().find(|entry| entry.name == name).unwrap();
        let (drift, creep) = (of("drift"), of("creep"));
        let mut known = Surpassing::default();
        known.note(drift, Refusal::Jumps, 0.4);
        known.note(drift, Refusal::FollowsInput, 0.5);
        known.note(drift, Refusal::Gaps, 0.7);
        known.note(drift, Refusal::TooLarge, 0.1);
        assert_eq!((known.follows, known.misses_gaps), (0.4, 0.7));
        // what the input does not drive says nothing about it
        known.note(drift, Refusal::Impossible, 0.2);
        assert!(known.impossible.is_infinite());
        known.note(creep, Refusal::Impossible, 0.3);
        assert_eq!(known.impossible, 0.3);
    }
}
