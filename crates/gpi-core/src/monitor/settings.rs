//! How a machine is monitored.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

settings! {
    /// How a machine is monitored. Numbers without another reason were chosen by hand.
    struct MonitorSettings {
        /// Length of a block in seconds. A change is noticed after two blocks at the earliest.
        seconds: f64 = 1.0, POSITIVE;
        /// Samples of a block at least, so that its sums are close to normal.
        samples: usize = 100, FROM_ONE;
        /// The smallest part by which the noise must have changed: its size in the training record is itself uncertain.
        least_noise: f64 = 0.1, PART;
        /// The part of the noise that an error of the model may have in a state of the machine although the training record does
        /// not show it: a term that the choice of the structure left out. Chosen on the machines of
        /// `tools/monitor_figures.py --seed 500`.
        hidden: f64 = 0.4, PART;
        /// The smallest root mean square of a new line as a part of the noise, because the training record may contain weaker
        /// lines that are not in the model; and the part of the model's own motion at a frequency that counts as the motion's.
        least_line: f64 = 0.3, PART;
        /// Blocks of a frame whose spectrum is taken.
        frame: usize = 4, FROM_ONE;
        /// Ratio of the misfit on data that the fit has not seen to that on the training data, as for the expected error of a
        /// compensation.
        unseen: f64 = 2.0, FROM_ONE;
        /// Models drawn from the covariance of the parameters.
        draws: usize = 8, FROM_ONE;
        /// The part by which a parameter is moved for the derivative of the output.
        step: f64 = 1e-3, PART;
        /// The part to which a transient of the dynamics has decayed when the first sample counts, and the blocks that
        /// this may take at most.
        decayed: f64 = 1e-4, PART;
        waiting: usize = 20, FROM_ONE;
        /// The part of the noise below which a difference between starts is forgotten, and the derivative of the output by a
        /// relative change is nothing.
        forgotten: f64 = 1e-3, PART;
        /// Blocks that are kept one by one; more are kept in pairs, then in fours, and so on.
        history: usize = 32_768, 16.0..=1e9;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert!(MonitorSettings::default().validate().is_ok());
    }
}
