//! Settings of the decisions on effects.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

settings! {
    /// Which trial is accepted, see [`judgement`](super::super::judgement).
    struct JudgementPolicy {
        /// An effect that takes a smaller part of the squares is of no practical use: 2 % of the squares are 1 % of
        /// the rms error. By hand.
        least: f64 = 0.02, PART;
        /// Candidates that a round compares, all effects together: the largest of so many gains on noise must be exceeded.
        looks: f64 = 150.0, FROM_ONE;
        /// Gains beyond this factor times the threshold for white noise need no test against the residual's
        /// autocorrelation, which would raise the threshold by less. It saves the covariance of long records. By hand.
        certain: f64 = 50.0, FROM_ONE;
        /// Squares over those of the noise up to which a model is near the noise: 1.5 times its rms. By hand.
        near_noise: f64 = 2.25, FROM_ONE;
        /// Squares that an effect must take near the noise, over those that it leaves above the noise. What is left may be
        /// another effect, or a bad fit that resembles this one a little: the first of three equal effects takes half of
        /// what it leaves.
        beyond_rest: f64 = 0.5, POSITIVE;
        /// Part of the squares that an effect must take far from the noise, where a bad fit resembles many effects a
        /// little, and part of the held-out squares, which varies more from block to block. By hand.
        substantial: f64 = 0.3, PART;
        substantial_held_out: f64 = 0.2, PART;
        /// Part by which the held-out squares must fall at least: less is of no use, however sure. By hand.
        confirmed: f64 = 5e-3, PART;
        /// What is really there is seen in the held-out data too: the part of the squares that it takes there over the part
        /// that it takes of the training data, which varies with the blocks. By hand.
        seen: f64 = 0.2, PART;
        /// Or the part of the squares of what it changes in the held-out data by which their squares fall: 1 if it is right,
        /// 0.6 to 1.1 of right effects near the noise, below 0.5 of wrong ones. By hand.
        predicted: f64 = 0.7, PART;
        /// Standard errors of the mean difference between blocks: one-sided, 5 % for a normal number.
        standard_errors: f64 = 1.7, 0.0..=100.0;
        /// Part of the deviance of another function of time that one which is added to the output must reach to be preferred,
        /// because it assumes less. By hand.
        tied: f64 = 0.99, PART;
        /// Or the better blocks gain so many times what the worse ones lose: an effect may show in few blocks only.
        one_sided: f64 = 10.0, FROM_ONE;
        /// Part of the squares that comes back when nothing drives the lags of a driven effect; else they only decay.
        /// By hand.
        driven: f64 = 0.5, PART;
    }

    /// Whether the accepted trial has earned its name, see [`examination`](super::super::examination).
    struct ExaminationPolicy {
        /// Probability with which noise alone may pass for an effect's own part: very small, because the statistic rests on a
        /// linear model and on the autocorrelation of a residual that may be no noise. On records of known truth false
        /// effects of two parameters reached 56, true ones began at 560; this probability stands at 92.
        chance: f64 = 1e-20, PART;
        /// The residual's autocorrelation below this is negligible; lags are counted up to a part of the record.
        negligible: f64 = 0.05, PART;
        parts: usize = 4, FROM_ONE;
        /// Part of the movement that lags slower than the knots of a function of time carry, at most: what creep does. By hand.
        carried_by_lags: f64 = 0.25, PART;
        /// A function of time of fewer knots is a trend, whose gaps would be a large part of the record.
        fewest_knots: usize = 4, FROM_ONE;
        /// Length of a gap in spacings of the knots. Gaps of 3 spacings reject a true drift.
        gap: f64 = 1.5, POSITIVE;
        /// Part of each knot's own power that holds it where it is: where the output hardly shows a knot, nothing outside of a gap
        /// determines it. By hand.
        held: f64 = 0.01, PART;
        /// Part of the samples beside a gap that must take part in the fit, over a third of its length on both sides.
        whole: f64 = 0.8, PART;
        /// Rms error inside the gaps over that of the fit. On records of known truth, true functions of time have 1.00 to 1.12,
        /// most false ones 1.5 to 33.
        bridged: f64 = 1.25, FROM_ONE;
        /// Part of a drift's squares above white noise that levels between jumps may leave for it not to be named. By hand: levels that
        /// follow true jumps leave hardly any, and the curve of a random walk leaves about as many as levels do.
        jumping: f64 = 0.5, PART;
        /// Probability with which a function of time that does not depend on the input is said to follow its motion, for all tests
        /// together. By hand: such an error should be much rarer than a true drift.
        followed: f64 = 1e-4, PART;
        /// Size beyond which an effect is large. On records of known truth false ones have 0.14 to 1.0. True ones that
        /// are large bring the held-out error within a factor of the noise.
        large: f64 = 0.1, PART;
        near: f64 = 2.0, FROM_ONE;
        /// Times that the input must exceed a limit of its speed where the model is far from the noise. By hand: as
        /// many as an experiment has held-out blocks, because with fewer some blocks cannot test the limit.
        exceedances: usize = 10, FROM_ONE;
        /// Part of the squares of the best model without it that a hysteretic force in the mechanics may leave, where the model is far
        /// from the noise. On records of known truth false ones left 0.10 to 0.6, true forces of one element at most 0.042; sums
        /// of elements left up to 0.4 and are then not named.
        left: f64 = 0.05, PART;
        /// The same of a gap that a force passes, and of creep; of the held-out squares, each of these effects leaves no more than this
        /// part. By hand: most of the squares are their own. A bank of stops with positive weights cannot follow a gap.
        left_at_most: f64 = 0.5, PART;
        /// The same of a slow function of time: it must be three times what is left, because it can follow any slow error. By hand.
        left_by_slow: f64 = 0.1, PART;
        /// Part of the excess over a limit that a limit may leave in steady state. By hand: water rises above a rim, too, but most of it
        /// runs off. What leaves more is a kink of a restoring force.
        excess: f64 = 1.0 / 3.0, PART;
        /// Stiffness of a hysteretic spring over the linear one, at most. By hand: structures that yield keep 2 to 20 % of their
        /// stiffness. Beside no spring at all, the same force is friction.
        hysteretic: f64 = 1e3, POSITIVE;
        /// Part by which the squares must fall for the model without a refused effect to be taken instead of the present one:
        /// that of a finer grid that goes on.
        better: f64 = 0.02, PART;
        /// Factor on the rms error of what is held out up to which a measured column is preferred to a function of time.
        measured_instead: f64 = 1.05, FROM_ONE;
    }

    /// When an earlier decision is changed.
    struct RevisionPolicy {
        /// Rounds of the search, which end one that does not end by itself. By hand.
        rounds: usize = 12, FROM_ONE;
        /// Part by which the squares must fall when an effect moves to the other side of the output stage. By hand.
        other_side: f64 = 0.01, PART;
        /// Factor by which the held-out squares may grow without a superfluous effect. The few held-out blocks
        /// vary; the training data decide. By hand.
        superfluous: f64 = 1.5, FROM_ONE;
        /// Part by which all squares may grow without a section of G that stands beside a mode with a loop, without a hysteresis before
        /// such a loop, or where forces enter with the input: 2.5 % of the error. Far from the noise, what explains so little may
        /// stand for anything, and it takes a share of the force. By hand.
        negligible: f64 = 0.05, PART;
        /// Factor by which the held-out squares may grow when a driven effect replaces a slow function of time. By hand.
        driven_instead: f64 = 1.05, FROM_ONE;
        /// Fits that are compared after an exchange take so many times the steps of a trial: they start farther from
        /// their minimum. By hand.
        longer: usize = 2, FROM_ONE;
        /// Factor by which the squares may grow when an effect replaces slow poles of G. By hand.
        instead_of_lags: f64 = 1.05, FROM_ONE;
    }
}
