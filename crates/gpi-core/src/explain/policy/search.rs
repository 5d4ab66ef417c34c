//! Settings of the model that the search begins with, and of its candidates.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

settings! {
    /// Blocks of time that no fit of the search sees.
    struct HoldoutPolicy {
        /// Blocks of an experiment: enough of them for a standard error of their differences, few enough that
        /// a block is longer than the noise's autocorrelation.
        blocks: usize = 10, FROM_ONE;
        /// Part of each stretch of time that is held out: a fifth, as in five-fold cross-validation.
        fraction: f64 = 0.2, PART;
        /// Part of each experiment, at its start, that is not held out: the fit finds the initial state there.
        lead: f64 = 0.1, PART;
        /// Where a block may lie in its stretch, in the order of preference. The middle comes first, so that
        /// slow effects are seen on both sides; the others avoid extremes of the input. By hand.
        places: [f64; 5] = [0.5, 0.2, 0.8, 0.35, 0.65], PART;
    }

    /// Plays and deadzones: what the declared model itself can explain is no effect.
    struct GridPolicy {
        /// Half-widths of a first model, and the same where the initial state is unknown and plays have to find
        /// it. By hand: rich enough for a first model, cheap enough for a search that refines the grid later.
        half_widths: usize = 16, FROM_ONE;
        half_widths_in_motion: usize = 24, FROM_ONE;
        /// Part of the squares of plays that stops leave at least for a search beside plays, if that beside stops leaves structure. By
        /// hand, between a stage with a drift that resembles stops and a friction damper.
        of_plays: f64 = 0.25, PART;
        /// Thresholds of a first model. By hand.
        thresholds: usize = 7, FROM_ONE;
        /// Times that plays and deadzones are added before effects are tried. By hand.
        rounds: usize = 6, FROM_ONE;
        /// A round that lowers the squares by less than this part is the last: another one would gain less.
        small: f64 = 0.02, PART;
        /// Squares over those of the noise up to which plays are not chosen anew on a dense grid, and an expansion in many terms is not
        /// named, which may follow what the plays leave: 5 % of the error. By hand.
        at_noise: f64 = 1.1, FROM_ONE;
        /// Plays and deadzones that are added at once, before they are refined together. By hand.
        at_once: usize = 8, FROM_ONE;
        /// A play that would take a smaller part of the squares is not added: the search asks for 20 times as much
        /// before it names an effect.
        least: f64 = 1e-3, PART;
        /// Weight of a play whose column is measured by a difference: small, so that the output changes linearly,
        /// and far above rounding.
        probe: f64 = 1e-4, POSITIVE;
        /// Places of plays and deadzones that are tried: more than the record can tell apart, by hand.
        tried_plays: usize = 40, FROM_ONE;
        tried_deadzones: usize = 32, FROM_ONE;
        /// Tried half-widths grow with this power of their number: dense where they are small, since small loops
        /// turn more often. By hand.
        density: f64 = 1.5, FROM_ONE;
        /// A threshold nearer to zero, in steps between thresholds, is the identity's. By hand.
        near_zero: f64 = 0.1, PART;
        /// Steps of a fit with the grids held, before they move: new weights settle first, because a fit in which
        /// everything moves stops early at the kinks where plays begin to turn.
        held_steps: usize = 6, FROM_ONE;
        /// Steps with moving grids; a third of them after unused plays were dropped. By hand.
        moving_steps: usize = 12, FROM_ONE;
        /// Part of the squares below which a step of these fits is the last: a fortieth of what an effect must take.
        gain: f64 = 1e-3, PART;
    }

    /// In how many steps loops are computed between samples.
    struct StepsPolicy {
        /// Twice as many steps are taken where they lower the squares by this part, 1 % of the error: twice as many leave a quarter
        /// of what the steps contribute to it. By hand.
        least: f64 = 0.02, PART;
        /// Most steps: a mode at a third of the sampling rate takes an eighth of a radian in one. By hand.
        most: usize = 16, FROM_ONE;
        /// Steps of a model from which poles with a negative real part are taken: their error is a sixty-fourth of that of one step.
        instead_of_poles: usize = 8, FROM_ONE;
    }

    /// Which effects are fitted at all.
    struct RankingPolicy {
        /// Effects of a round that are fitted: the score test's best four. The score test ranks the right effect
        /// first on 42 of 44 simulated records.
        fitted: usize = 4, FROM_ONE;
        /// An effect whose worth is a smaller part of the best one's is not fitted. By hand.
        far_behind: f64 = 0.2, PART;
        /// Where an effect promises this part of the squares, it is fitted before the grids are refined: the grids
        /// would bend to what it explains. By hand.
        strong: f64 = 0.6, PART;
        /// Where no effect promises this part of [`JudgementPolicy::least`], none is fitted: the score test promises
        /// too little, but hardly by more than that. By hand.
        hopeless: f64 = 0.5, PART;
        /// Candidates of an effect, beside its best one, that its fit begins at where the model stays far above the noise, and
        /// the part of the best one's gain that each promises. By hand: another exponent or time constant is often in reach of the
        /// minimum where the most promising one is not.
        others: usize = 2, 0.0..=1e3;
        other: f64 = 0.5, PART;
        /// Where fits take long: the part of the best gain so far that the score test must promise. By hand.
        near: f64 = 0.5, PART;
        /// A slow function of time explains this part of what it does with a quarter of its knots. By hand.
        slow: f64 = 0.75, PART;
        /// Times as many knots as that.
        coarser: usize = 4, FROM_ONE;
    }

    /// How far fits go.
    struct FitPolicy {
        /// Steps of a trial. A trial is only compared with other trials; what is found is refined at the end.
        steps: usize = 12, FROM_ONE;
        /// Steps of a trial that begins far from the present model. They are those of one fit, because a fit that is continued begins with
        /// the first damping again. By hand.
        far_steps: usize = 60, FROM_ONE;
        /// Part of the squares below which a step of a trial is the last. By hand, far below any threshold.
        gain: f64 = 1e-5, PART;
        /// Times that a trial goes on which is still making progress, and what that means: its last steps, so many,
        /// lowered the squares by this part. By hand.
        more: usize = 3, 0.0..=1e3;
        last_steps: usize = 4, FROM_ONE;
        progress: f64 = 0.1, PART;
        /// Growth of the squares beyond which the score test's start is not used: its linear prediction fails there.
        beyond: f64 = 10.0, FROM_ONE;
        /// The same for loops with plays, where a start that is worse than none leads to another minimum.
        beyond_with_memory: f64 = 1.0, FROM_ONE;
        /// Steps of the last refinement with everything free, and with the grids held: everything free stops at the
        /// kinks of plays, and creep's gain had not settled with fewer.
        last_free_steps: usize = 15, FROM_ONE;
        last_held_steps: usize = 30, FROM_ONE;
        /// The last refinement ends at this factor times the usual gain, which is a tenth of what a superfluous
        /// parameter gains on average: finer steps would fit noise.
        coarser: f64 = 10.0, FROM_ONE;
    }

    /// Fits that begin at limits of states, see [`limits`](super::super::limits).
    struct LimitPolicy {
        /// Fits with a limit of one state that are continued with what the poles hold that they have moved to: several begin near the
        /// best one. By hand.
        retied: usize = 3, FROM_ONE;
        /// Such continuations at most, and the part of the squares below which one is the last. By hand.
        ties: usize = 8, FROM_ONE;
        worth: f64 = 1e-3, PART;
    }

    /// What the balance of forces must show, see [`force_balance`](super::super::force_balance).
    struct BalancePolicy {
        /// The first poles of the filter, over the rms change of the output from sample to sample relative to its standard
        /// deviation: faster than the motion, so that all of it takes part. By hand.
        faster: f64 = 3.0, POSITIVE;
        /// Iterations of the filter. By hand.
        iterations: usize = 5, FROM_ONE;
        /// Slowest pole of the filter in radians over the length of the record: four periods. What is slower cannot be told from
        /// the start.
        slowest: f64 = 25.0, POSITIVE;
        /// The same of the mechanics that a fit begins at: one that integrates has a pole at zero, which the fit finds from there.
        least_pole: f64 = 0.1, POSITIVE;
        /// The part of the squares that forces must explain. By hand: a fit that begins at a force which is not there costs time, but no
        /// name.
        least: f64 = 0.15, PART;
        /// The squares of a fit that began at a force, over those of the model, from which on the force is not asked for again beside other
        /// effects: most effects lower the squares of both by the same amount, so that the fit stays behind. By hand: twice the rms error.
        out_of_reach: f64 = 4.0, FROM_ONE;
    }

    /// The last fit of a stage that integrates forces, see [`stretches`](super::super::stretches).
    struct StretchPolicy {
        /// Lengths of the stretches of one fit after the other, in time constants m/c of the speed. By hand: after five, 1 % of a wrong
        /// initial speed is left, and in a short stretch a simulation follows the measured motion from the beginning.
        time_constants: [f64; 2] = [5.0, 10.0], POSITIVE;
        /// Stretches of the longest experiment, at most and at least. By hand: each has an initial state of its own, and with fewer than
        /// three a simulation adds up errors as over the whole record.
        most: usize = 20, FROM_ONE;
        least: usize = 3, FROM_ONE;
        /// Steps of each fit. By hand: a force that stops a mass has kinks, at which steps are short.
        steps: usize = 200, FROM_ONE;
        /// Steps of fits of initial states alone. By hand: the output is nearly linear in them.
        settling_steps: usize = 12, FROM_ONE;
    }

    /// When a mass is said to slide, see [`sliding_mass`](super::super::sliding_mass).
    struct SlidingPolicy {
        /// The rms change of the output over the samples that tell motion from rest, over its standard deviation, and the part of that
        /// change from which on a sample moves. By hand: noise of 1 % of the standard deviation is far below both.
        changed: f64 = 0.05, PART;
        moving: f64 = 0.2, PART;
        /// An experiment is so many times as long as these samples at least. By hand.
        many_times: usize = 20, FROM_ONE;
        /// Part of the squares of the balance of forces of the moving samples that dry friction explains where there is an end stop, and
        /// where there is none. By hand: without a stop, another hysteresis that depends on the direction may explain more than half, but
        /// hardly all.
        explained: f64 = 0.5, PART;
        alone: f64 = 0.95, PART;
        /// Friction holds an output that is pushed with less than so many times its force. By hand: friction at rest is often larger
        /// than in motion.
        pushed: f64 = 1.5, FROM_ONE;
        /// Samples at a stop, at least, and the part of the samples that are held against more than friction. By hand.
        samples: usize = 10, FROM_ONE;
        one_place: f64 = 0.8, PART;
        /// What is at one place, as a part of the range of the output, and the number of samples beyond it over those at the stop: a stop
        /// may give way a little. By hand.
        near: f64 = 0.05, PART;
        beyond: f64 = 0.1, PART;
        /// Parts of the speed that a stop takes away where fits begin: none, and much of it. By hand: a fit from one start may end in a minimum far above the other.
        lost: [f64; 2] = [0.0, 0.5], PART;
        /// Part of the squares that the model with all of this may leave of the model without it: half of its rms error. By hand: the
        /// balance of forces has shown the friction already.
        left: f64 = 0.25, PART;
    }
}
