//! Every tolerance and every choice of the fits, with its meaning and the reason for its value.
//!
//! "By hand" means that nobody derived the value; `gpi reproduce` and docs/scoreboard.md show what all values
//! together achieve.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

/// How a point is prepared and fitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FitSettings {
    /// Which samples are scored, and which initial states are fitted.
    pub preparation: PreparationSettings,
    /// Plays on a dense grid.
    pub dense: DenseSettings,
    /// A smooth density of plays.
    pub smooth: SmoothSettings,
    /// The joint fit.
    pub joint: JointSettings,
    /// What is removed from a fitted model.
    pub simplification: SimplificationSettings,
    /// The fit of the initial state alone.
    pub initial_state: InitialStateSettings,
    /// When parts of a few experiments give the curvature of all; a fit uses the defaults.
    pub representatives: RepresentativeSettings,
    /// How long the memory of a stage's dynamics may be; a search uses the defaults.
    pub memory: MemorySettings,
    pub line_modes: LineModeSettings,
    /// The stretches of a long record on which structures are compared.
    pub excerpt: ExcerptSettings,
}

impl FitSettings {
    /// Those for fits to a whole record that is long.
    pub(crate) fn of_long_record(mut self) -> Self {
        let ExcerptSettings { steps, gain, .. } = self.excerpt;
        (self.joint.most_steps, self.joint.fewest_steps) =
            (steps, steps.min(self.joint.fewest_steps));
        (self.joint.least_gain, self.joint.largest_gain) =
            (gain, gain.max(self.joint.largest_gain));
        self
    }

    /// Refuses settings that mean nothing.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.preparation.validate()?;
        self.dense.validate()?;
        self.smooth.validate()?;
        self.joint.validate()?;
        let JointSettings { fewest_steps, most_steps, .. } = self.joint;
        if fewest_steps > most_steps {
            let requirement = format!("at most `most_steps`, {most_steps}");
            return Err(Error::parameter("fewest_steps", fewest_steps, requirement));
        }
        self.simplification.validate()?;
        self.initial_state.validate()?;
        self.representatives.validate()?;
        self.memory.validate()?;
        self.line_modes.validate()?;
        self.excerpt.validate()
    }
}

settings! {
    /// Which samples are scored, and which initial states are fitted.
    struct PreparationSettings {
        /// Part of an experiment that may be left out of the score while the plays lose their unknown initial
        /// state. Where they need longer, their initial state is fitted. By hand.
        forgetting: f64 = 0.1, PART;
        /// Part of the range of the plays' input that the rest of the experiment must reach for that. Plays that only the samples
        /// before have moved are wider than this part of half the range: 1 % is no more than a step of the densest grid of plays.
        reach: f64 = 0.99, PART;
        /// An experiment starts at rest if its first samples, so many, are zero. By hand.
        quiet: usize = 10, FROM_ONE;
        /// Part of the largest input below which an input is zero: far below any resolution, above rounding.
        zero: f64 = 1e-9, PART;
    }

    /// Plays on a dense grid, see [`dense`](super::dense).
    struct DenseSettings {
        /// Half-widths, zero included. By hand: the joint fit moves the plays from there.
        half_widths: usize = 60, FROM_ONE;
        /// Initial places of the plays between z - r (-1) and z + r (1): both ends and the middle, between which
        /// mixtures lie.
        starts: [f64; 3] = [-1.0, 0.0, 1.0], -1.0..=1.0;
        /// Steps, and the part of the cost below which a step is the last. By hand: the joint fit follows.
        steps: usize = 8, FROM_ONE;
        gain: f64 = 1e-4, PART;
    }

    /// A smooth density of plays, see [`smooth`](super::smooth).
    struct SmoothSettings {
        /// Half-widths, zero included. By hand: enough for a smooth density, few enough for a fit.
        half_widths: usize = 40, 4.0..=1e3;
        /// Deadzones: as many as the richest structure that is compared has.
        thresholds: usize = 10, 0.0..=1e3;
        /// The slopes of the deadzones that are expected at first. By hand: the data change it.
        slopes: f64 = 0.3, POSITIVE;
        /// Steps of the fit between two changes of the prior, the part of the cost below which a step is the last, and changes at most. By hand.
        steps: usize = 6, FROM_ONE;
        gain: f64 = 1e-4, PART;
        rounds: usize = 5, FROM_ONE;
        /// Changes of the prior on each quadratic model of the cost. By hand: each takes little time.
        iterations: usize = 10, FROM_ONE;
        /// Logarithm of the change of a factor below which it is the last. By hand.
        change: f64 = 0.2, POSITIVE;
        /// The least number of combinations that the data determine.
        least: f64 = 0.1, POSITIVE;
        /// Root mean square second difference of the weights over their mean, and of the slopes, that is expected at least, which bounds
        /// the factors. By hand: no record shows less.
        finest: f64 = 1e-3, POSITIVE;
    }

    /// The joint fit.
    struct JointSettings {
        /// Steps after which a candidate is compared with the best one so far. By hand: the cost falls most in them.
        first_steps: usize = 15, FROM_ONE;
        /// Steps, accepted or not: between these numbers, and so many that `products` are not exceeded.
        fewest_steps: usize = 40, FROM_ONE;
        most_steps: usize = 300, FROM_ONE;
        /// Multiplications of all Gram matrices of a fit: about a minute of one core.
        products: f64 = 4e11, POSITIVE;
        /// Steps of a quick fit, whose model is refined again when more is known. By hand.
        quick_steps: usize = 40, FROM_ONE;
        /// Part of the cost below which a step of a quick fit is the last, where each step takes long. By hand.
        quick_gain: f64 = 1e-3, PART;
        /// Multiplications of a quick fit beyond which plays of weight zero are not tried elsewhere. By
        /// hand.
        quick_products: f64 = 1e10, POSITIVE;
        /// A step that lowers the cost by less than this part of one value's share is the last: a superfluous
        /// parameter gains one share on average, so finer steps would fit noise.
        gain: f64 = 0.1, PART;
        /// Limits of that as a part of the cost: rounding, and what a record of few samples still needs. By hand.
        least_gain: f64 = 1e-9, PART;
        largest_gain: f64 = 1e-4, PART;
        /// Isolated outliers from which on Huber's loss is used: one or two do not bias a fit. By hand.
        outliers: usize = 3, FROM_ONE;
        /// Passes of Huber's loss, each with the scale of the previous residual. By hand.
        passes: usize = 3, FROM_ONE;
        /// Robust standard deviations at which Huber's loss becomes linear: 95 % of the efficiency of least squares
        /// on Gaussian noise (Huber, Robust Statistics, 1981).
        turn: f64 = 1.345, POSITIVE;
        /// Part of the cost that a play must take which was placed again, to be worth another round. By hand.
        worth: f64 = 1e-3, PART;
        /// Times that such plays are placed again. By hand: a model of the wrong form goes on to gain a little each time.
        revivals: usize = 8, 0.0..=1e3;
    }

    /// What is removed from a fitted model.
    struct SimplificationSettings {
        /// Steps of the fit that follows a removal: it starts at a minimum, or close to one. By hand.
        steps: usize = 20, FROM_ONE;
        /// Times that unidentifiable deadzones are removed. By hand.
        passes: usize = 5, FROM_ONE;
        /// Squares, in units of the residual's variance, that may be lost by a pass: what five superfluous
        /// parameters gain on average. By hand.
        loss: f64 = 5.0, POSITIVE;
        /// Part by which rounding may raise the cost of a bridged envelope. By hand.
        rounding: f64 = 1e-6, PART;
    }

    /// The fit of the initial state alone.
    struct InitialStateSettings {
        /// Steps of each fit: by hand.
        steps: usize = 60, FROM_ONE;
        /// Initial places of the plays between z - r (-1) and z + r (1), one fit from each: the cost has a minimum
        /// wherever another set of plays turns at the first peaks. By hand.
        places: [f64; 3] = [0.0, -0.5, 0.5], -1.0..=1.0;
    }

    /// The fit of a hysteresis to an intermediate signal.
    struct HysteresisSettings {
        /// Steps, and the part of the cost below which a step is the last. By hand.
        steps: usize = 60, FROM_ONE;
        gain: f64 = 1e-4, PART;
    }

    /// When parts of a few experiments give the curvature of all.
    struct RepresentativeSettings {
        /// Multiplications of one Gram matrix that take long. By hand.
        long: f64 = 1e10, POSITIVE;
        /// Values for each unknown that determine the curvature well enough for a step. By hand.
        enough: f64 = 25.0, FROM_ONE;
        /// Experiments at least: one each of small, middle and large amplitude.
        fewest: f64 = 3.0, FROM_ONE;
        /// Part of the record from which on the choice saves too little time. By hand.
        most: f64 = 0.5, PART;
        /// Part to which the slowest pole must have decayed before the scored part: one percent.
        decayed: f64 = 0.01, f64::MIN_POSITIVE..=1.0;
    }

    /// The stretches of a long record on which structures are compared.
    struct ExcerptSettings {
        /// Scored samples from which on a record is long, and those of its stretches together. By hand: all parameters of
        /// a stage are determined by far fewer, and comparing on so many takes seconds.
        long: usize = 200_000, FROM_ONE;
        samples: usize = 40_000, FROM_ONE;
        /// Samples of a stretch at least: its unknown initial state is few unknowns beside them. By hand.
        shortest: usize = 4000, FROM_ONE;
        /// Swings that a stretch has, so that the plays lose their unknown initial state in a twentieth of it, and those
        /// without which it shows no loops. By hand.
        swings: f64 = 20.0, POSITIVE;
        fewest_swings: f64 = 4.0, 0.0..=1e6;
        /// Steps of a fit to the whole record at most, and the part of the cost below which a step is the last: further ones
        /// gain what only so many samples can show, and nobody can use. By hand.
        steps: usize = 25, FROM_ONE;
        gain: f64 = 1e-4, PART;
    }

    /// How long the memory of a stage's dynamics may be.
    struct MemorySettings {
        /// Part of the longest experiment: a slower pole follows a disturbance. By hand.
        part: f64 = 0.05, PART;
        /// Part of the longest experiment for a real pole of a plant that is slow itself: the record does not show a slower one to
        /// settle. By hand.
        of_slow_plant: f64 = 0.5, PART;
        /// Part of the movement, and of the DC gain, that is there at once, at least, where a slow lag is creep: the gains of creep
        /// add up to about one at most, so that half of both is there at once. By hand, with a margin.
        at_once: f64 = 0.25, PART;
        /// Samples of the longest experiment that tell a slow plant from the misfit of its hysteresis: 40 for each of the about 50
        /// parameters of the richest structure. By hand.
        enough: usize = 2000, FROM_ONE;
    }

    /// Which modes of G are examined for following a line, and the lines that are tried.
    struct LineModeSettings {
        /// Time constant of a mode over the length of the longest experiment, at least: a mode that decays faster follows no
        /// line that the input does not contain. By hand.
        part: f64 = 0.005, PART;
        /// Angles of lines on each side of the pole's, in half-widths `-ln|p|` of its resonance.
        reach: f64 = 2.0, POSITIVE;
        /// The same in bins of the spectrum of the longest experiment, at least.
        bins: f64 = 2.0, POSITIVE;
        /// Distance of the angles in such bins: half of it away from a line, a sine explains 96 % of it.
        step: f64 = 0.25, POSITIVE;
        /// Halvings of that distance, for an angle that a sine over the whole record needs.
        halvings: usize = 10, FROM_ONE;
    }

    /// The part of a residual that is not white noise.
    struct MisfitSettings {
        /// Lags over which the autocovariance is averaged: a misfit is smooth over some samples, and many lags see a small
        /// one that is slow. By hand.
        lags: [usize; 3] = [1, 3, 10], FROM_ONE;
        /// Standard errors of white noise that a mean must exceed: noise alone does so once in forty times.
        standard_errors: f64 = 2.0, 0.0..=100.0;
        /// Length in seconds, and number of samples at least, of the pieces of which the largest misfit is known: those of
        /// the blocks of a monitor.
        seconds: f64 = 1.0, POSITIVE;
        samples: usize = 100, FROM_ONE;
    }
}

/// Part of the outputs' squares that rounding leaves: the square of some thousand times the machine's epsilon.
pub(crate) const ROUNDING: f64 = 1e-25;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_settings_are_valid() {
        FitSettings::default().validate().unwrap();
        HysteresisSettings::default().validate().unwrap();
        MisfitSettings::default().validate().unwrap();
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |change: fn(&mut FitSettings)| {
            let mut settings = FitSettings::default();
            change(&mut settings);
            settings.validate().unwrap_err().to_string()
        };
        assert!(refused(|s| s.preparation.forgetting = 2.0).contains("forgetting"));
        assert!(refused(|s| s.joint.turn = f64::NAN).contains("turn"));
        assert!(refused(|s| s.joint.fewest_steps = 301).contains("most_steps"));
        assert!(refused(|s| s.simplification.loss = 0.0).contains("loss"));
        assert!(refused(|s| s.initial_state.places[1] = -1.5).contains("places"));
    }
}
