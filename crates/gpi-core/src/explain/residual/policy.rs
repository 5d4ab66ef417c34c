//! Every tolerance of the residual tests, with its meaning and the reason for its value ("by hand" as in the search's
//! policy).

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

settings! {
    /// How a residual is tested.
    struct ResidualPolicy {
        /// Probability that any test of a record fails where there is nothing: one record in a hundred.
        significance: f64 = 0.01, PART;
        /// Residuals below this part of the simulation's largest value are rounding.
        rounding: f64 = 1e-13, PART;
        /// Blocks of time over which products are summed: few enough that one is longer than the noise's
        /// autocorrelation, enough of them for a standard error.
        blocks: usize = 40, FROM_ONE;
        /// A dependence of fewer standard errors is not looked into, however few tests there are. By hand.
        standard_errors: f64 = 4.0, 0.0..=100.0;
        /// Lags of the autocorrelation that the test of whiteness sums. By hand, a usual number.
        lags: usize = 25, FROM_ONE;
        /// Part of the variance in correlations that is of no practical size, however significant. By hand.
        small: f64 = 0.01, PART;
        /// Neighbours in the spectrum that a line is compared with: the background is smooth over so many. By hand.
        around: usize = 64, 4.0..=1e6;
        /// The slowest places of the spectrum have no line: the taper smears the mean into them.
        slowest: usize = 4, FROM_ONE;
        /// The background of a line lies so far from it, between both numbers of places: a line is a few places wide;
        /// a resonance is wider, and belongs to the noise's spectrum. By hand.
        line_near: usize = 4, FROM_ONE;
        line_far: usize = 12, FROM_ONE;
        /// A peak this many times above the higher one of the medians on both sides is a line. By hand.
        stands_out: f64 = 12.0, FROM_ONE;
        /// Seconds over which the local amplitude of a signal is taken. By hand: several periods of a resonance.
        amplitude_seconds: f64 = 0.05, POSITIVE;
        /// Speeds beyond this many times their rms count as this: single jumps would outweigh all else. By hand.
        fastest: f64 = 5.0, POSITIVE;
        /// Steps of the past, in samples, that the residual must not follow: a geometric series.
        past: [usize; 10] = [0, 1, 2, 4, 8, 16, 32, 64, 128, 256], 0.0..=1e6;
        /// Steps whose slopes are compared between amplitudes. By hand: the length of most resonances.
        compared: [usize; 7] = [0, 1, 2, 4, 8, 16, 32], 0.0..=1e6;
        /// Steps that are alike at all amplitudes: a residual of any linear dynamics that is not too long. By hand.
        alike: [usize; 26] = [
            0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 20, 24, 28, 32, 40, 48, 64, 96, 128,
        ], 0.0..=1e6;
        /// Samples of a block of that comparison, and its fewest and most blocks: more than elsewhere, since large
        /// amplitudes fill only few of them. By hand.
        block: usize = 40, FROM_ONE;
        fewest_blocks: usize = 40, FROM_ONE;
        most_blocks: usize = 100, FROM_ONE;
        /// Part of each diagonal element that is added before its equations are solved: far below any dependence that
        /// matters, far above rounding.
        ridge: f64 = 1e-10, PART;
        /// Part of a whitened residual's variance that the input may predict. On simulated records coloured noise has at
        /// most 0.0013, relays, friction and Bouc-Wen hysteresis 0.011 to 0.5.
        predicted: f64 = 0.005, PART;
        /// Folds of that cross-validation, and the blocks of time that are dealt to them: enough that each fold has some of
        /// every excitation, few enough that a block is longer than what the features remember. By hand.
        predicted_folds: usize = 10, 2.0..=1e3;
        predicted_blocks: usize = 100, 2.0..=1e4;
        /// Part of each diagonal element of its equations that is added: features of one signal are nearly dependent.
        predicted_ridge: f64 = 1e-4, PART;
        /// Lags in samples of the signals' levels, and half-widths of the plays, 1 being half of a signal's range. By hand.
        predicted_lags: [usize; 8] = [0, 1, 2, 4, 8, 16, 32, 64], 0.0..=1e6;
        predicted_plays: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.4, 0.7], PART;
        /// Wrong samples that are allowed: too few to look for a cause. By hand.
        wrong_samples: f64 = 2.0, 0.0..=1e6;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused_by_name() {
        let usual = ResidualPolicy::default();
        usual.validate().unwrap();
        let refused = |policy: ResidualPolicy| policy.validate().unwrap_err().to_string();
        assert!(
            refused(ResidualPolicy { significance: -0.1, ..usual.clone() })
                .contains("significance")
        );
        assert!(refused(ResidualPolicy { blocks: 0, ..usual.clone() }).contains("blocks"));
        assert!(refused(ResidualPolicy { small: f64::NAN, ..usual }).contains("small"));
    }
}
