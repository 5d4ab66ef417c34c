//! Every choice of the rivals, with its reason.

use crate::Error;
use crate::settings::{FROM_ONE, PART, settings};

settings! {
    /// How the rivals are fitted.
    struct RivalPolicy {
        /// Samples that enter the sums: far more than the coefficients need, few enough that all rivals take a small part
        /// of the time of `explain`.
        most_samples: usize = 30_000, FROM_ONE;
        /// Parts of the training data, each predicted from all others.
        folds: usize = 10, FROM_ONE;
        /// Blocks of time that are dealt to the folds in turn: several a fold, so that each has a part of every excitation.
        blocks: usize = 50, FROM_ONE;
        /// Ridges, as parts of the variance of each regressor. The smallest is far below what data determine, the
        /// largest shrinks a well-determined coefficient by a tenth.
        ridges: [f64; 5] = [1e-10, 1e-6, 1e-4, 1e-2, 1e-1], PART;
        /// Highest degree of the polynomial: more wave between the data.
        degree: usize = 5, FROM_ONE;
        /// Plays of each input, with half-widths that are uniform over half the span.
        plays: usize = 20, FROM_ONE;
        /// Delays that are tried before the neighbours of the best, and the part of the shortest experiment that one may take.
        delays: [usize; 12] = [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64], 0.0..=1e6;
        delayed: f64 = 0.1, PART;
        /// Lengths of the FIR model, and its most coefficients, inputs together, whose sums are quick.
        lengths: [usize; 7] = [2, 5, 12, 24, 48, 96, 192], FROM_ONE;
        most_lags: usize = 256, FROM_ONE;
        /// Samples for each coefficient: with fewer a model is left out.
        for_each: usize = 4, FROM_ONE;
        /// Orders of ARX: past outputs, and past inputs besides the present one.
        past_outputs: [usize; 6] = [1, 2, 3, 4, 6, 8], FROM_ONE;
        past_inputs: [usize; 5] = [0, 1, 2, 4, 8], 0.0..=1e3;
        /// Part of the squares that a higher order must take: less is of no use.
        higher_order: f64 = 0.01, PART;
    }
}
