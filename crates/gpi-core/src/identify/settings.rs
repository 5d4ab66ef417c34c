//! Every tolerance and every choice of the identification, with its meaning and the reason for its value.
//!
//! "By hand" means that nobody derived the value; `gpi reproduce` and docs/scoreboard.md show what all values
//! together achieve.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

/// How a model is identified.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct IdentifySettings {
    /// How many taps, and when the linear part is a gain with a delay.
    pub taps: TapPolicy,
    /// Hysteresis and dynamics in turn.
    pub alternation: AlternationPolicy,
    /// A plant that is slower than the taps.
    pub slow: SlowPolicy,
    /// A gain with a delay.
    pub quasi_static: QuasiStaticPolicy,
    /// Orders of the first estimates of G.
    pub realization: RealizationPolicy,
    /// Which structures are compared.
    pub structure: StructurePolicy,
}

impl IdentifySettings {
    /// Refuses settings that mean nothing.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.taps.validate()?;
        self.alternation.validate()?;
        self.slow.validate()?;
        self.quasi_static.validate()?;
        self.realization.validate()?;
        self.structure.validate()
    }
}

settings! {
    /// How many taps the FIR estimates have, and when the linear part is a gain with a delay.
    struct TapPolicy {
        /// So many taps and fewer tell no more than a gain and a delay.
        gain_and_delay: usize = 4, FROM_ONE;
        /// Samples of the longest experiment for each tap, and each input, at least. By hand.
        samples: usize = 4, FROM_ONE;
        /// Taps of the first estimate. By hand.
        first: usize = 400, FROM_ONE;
        /// Most taps, and most unknowns of all inputs together: by hand.
        most: usize = 1024, FROM_ONE;
        unknowns: usize = 1200, FROM_ONE;
        /// Part to which the slowest pole decays within the taps: one percent.
        decayed: f64 = 0.01, f64::MIN_POSITIVE..=1.0;
        /// One more tap for so many changes nothing: the estimate is only repeated where more are needed. By hand.
        tolerance: usize = 5, FROM_ONE;
    }

    /// Hysteresis and dynamics in turn.
    struct AlternationPolicy {
        /// Plays and deadzones of the first hysteresis, as the richest structure that is compared later.
        half_widths: usize = 24, FROM_ONE;
        thresholds: usize = 10, 0.0..=1e3;
        /// Regularization of the FIR estimates, see [`linear::estimate`](crate::linear::estimate). By hand.
        ridge: f64 = 3e-2, POSITIVE;
        /// Rounds at most. By hand: the joint refinement that follows makes further ones superfluous.
        rounds: usize = 4, FROM_ONE;
        /// Levenberg-Marquardt steps of a round, and the part of the cost below which a step is the last. By hand.
        steps: usize = 7, FROM_ONE;
        gain: f64 = 1e-4, PART;
        /// A round that lowers the rms by less than this part is the last one. By hand.
        small: f64 = 5e-3, PART;
    }

    /// Lags of a plant that is slower than the taps.
    struct SlowPolicy {
        /// The shortest time constant that is tried, in samples: a shorter lag is as good as none in a slow plant. By hand.
        shortest: f64 = 5.0, FROM_ONE;
        /// The longest one, as a part of the longest experiment: the record does not show slower ones to settle. By hand.
        longest: f64 = 0.5, PART;
        /// The ratio of one time constant to the next. By hand: all are refined.
        ratio: f64 = 1.5, 1.01..=10.0;
        /// Stretches of scored samples that take part, the longest ones. By hand: each has an offset and a start of its own in every fit.
        stretches: usize = 16, FROM_ONE;
        /// The time constant of a plant that integrates, over the length of the longest experiment. By hand: a part of 1e-4 of the
        /// movement is forgotten at the end, about as much as noise. The joint fit moves it.
        integrator: f64 = 1e4, FROM_ONE;
    }

    /// A gain with a delay.
    struct QuasiStaticPolicy {
        /// The longest delay that is tried, in samples. By hand.
        longest: usize = 7, FROM_ONE;
        /// The longest delay that may be given, which takes as many states: a longer one is better cut out of the
        /// record.
        longest_given: usize = 500, FROM_ONE;
        /// Steps of each delay's fit, and the part of the cost below which a step is the last. By hand.
        steps: usize = 15, FROM_ONE;
        gain: f64 = 1e-4, PART;
    }

    /// Orders of the first estimates of G.
    struct RealizationPolicy {
        /// All orders up to this one are tried. By hand.
        small: usize = 6, FROM_ONE;
        /// The largest order that the singular values may suggest: with a larger one their flat tail is noise. By hand.
        largest: usize = 60, FROM_ONE;
        /// Part of the small orders' error that a large one may have: many states can follow any misfit a little. By
        /// hand.
        worth: f64 = 0.8, PART;
    }

    /// Which structures are compared.
    struct StructurePolicy {
        /// Plays and deadzones of each rung, from many to few; the last one is the linear model. By hand.
        plays: [usize; 6] = [24, 16, 12, 8, 6, 1], FROM_ONE;
        deadzones: [usize; 6] = [10, 7, 5, 4, 2, 0], 0.0..=1e3;
        /// Half-widths of dead bands about zero, as parts of the input's reach. By hand: the fit moves them.
        dead_bands: [f64; 2] = [0.02, 0.06], PART;
        /// Fits in a row of what begins at a dead band or at the rate of the output, and the part of the squares below which one is the
        /// last. By hand: thresholds of a dead band move far while the slope between them vanishes.
        repeats: usize = 6, FROM_ONE;
        settled: f64 = 0.01, PART;
        /// Structures in a row that gain nothing and end a series: after one of them the next may be better, such as
        /// an even order after an odd one.
        missed: usize = 2, FROM_ONE;
        /// Beyond this order one state more or less changes nothing that the criterion shows. By hand.
        largest_order: usize = 8, FROM_ONE;
        /// The first pole of a lag after a gain with a delay: the middle of the range of lags of a few samples.
        lag: f64 = 0.5, PART;
        /// The slowest pole of such a lag, exp(-1/7): no longer memory than the longest delay. A slower one follows
        /// drift and creep, which so few frequencies do not tell from dynamics, and fails on other records.
        slowest_lag: f64 = 0.867, PART;
        /// Samples by which the lag may shorten the delay. By hand.
        shorter: usize = 2, 0.0..=1e3;
        /// The rms residual over the noise floor from which on plays of a dense grid are tried: below, they have next to
        /// nothing to gain. By hand.
        near_noise: f64 = 1.01, FROM_ONE;
        /// Growth of the cost, beyond what fewer parameters save, with which a candidate is given up after a few steps: its rms is
        /// a fifth larger. By hand.
        hopeless: f64 = 1.44, FROM_ONE;
        /// Samples for each parameter of the best structure below which a series goes on to the simplest structures, and stops are
        /// tried as well as plays. By hand: of a slow residual, few of the samples count.
        crowded: f64 = 40.0, FROM_ONE;
        /// Frequencies at which the response is compared, and the largest over smallest gain of a flat one. By hand.
        frequencies: usize = 32, FROM_ONE;
        flat: f64 = 2.0, FROM_ONE;
        /// The part of the squares of plays that stops with as many parameters may leave at most to be taken instead. By hand: without hysteresis,
        /// both leave the same.
        of_stops: f64 = 0.8, PART;
        /// The part of the squares of stops without deadzones that deadzones may leave at most to be taken too. By hand: deadzones follow
        /// a gap that the force passes only in part, and a field that saturates nearly completely.
        of_deadzones: f64 = 0.5, PART;
        /// Steps of the hysteresis on new grids, and the part of the cost below which a step is the last. By hand:
        /// the joint fit follows.
        steps: usize = 7, FROM_ONE;
        gain: f64 = 1e-3, PART;
    }
}

/// Samples that are added to the normal equations of G at once, which bounds their memory.
pub(super) const BLOCK: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_settings_are_valid() {
        IdentifySettings::default().validate().unwrap();
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |change: fn(&mut IdentifySettings)| {
            let mut settings = IdentifySettings::default();
            change(&mut settings);
            settings.validate().unwrap_err().to_string()
        };
        assert!(refused(|s| s.taps.samples = 0).contains("samples"));
        assert!(refused(|s| s.alternation.ridge = f64::NAN).contains("ridge"));
        assert!(refused(|s| s.quasi_static.gain = 2.0).contains("gain"));
        assert!(refused(|s| s.realization.worth = -0.1).contains("worth"));
        assert!(refused(|s| s.structure.plays[3] = 0).contains("plays"));
    }
}
