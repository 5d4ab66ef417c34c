//! Every tolerance and every choice of the search, with its meaning and the reason for its value.
//!
//! "By hand" means that nobody derived the value: it was chosen on simulated stages, and docs/scoreboard.md
//! shows what all values together achieve. "Squares" are weighted sums of squared residuals.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

/// How [`explain`](super::explain) searches.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SearchPolicy {
    /// What is held out.
    pub holdout: HoldoutPolicy,
    /// Plays and deadzones of the declared model.
    pub grid: GridPolicy,
    /// Which effects are fitted.
    pub ranking: RankingPolicy,
    /// How long they are fitted.
    pub fits: FitPolicy,
    /// In how many steps loops are computed between samples.
    pub steps: StepsPolicy,
    /// Which forces inside the mechanics are fitted too.
    pub balance: BalancePolicy,
    /// Fits that begin at limits of states.
    pub limits: LimitPolicy,
    /// Which of them are accepted.
    pub judgement: JudgementPolicy,
    /// Whether the accepted trial has earned its name.
    pub examination: ExaminationPolicy,
    /// When an earlier decision is changed.
    pub revision: RevisionPolicy,
    /// When the noise itself is called an effect.
    pub noise: NoisePolicy,
    /// When a resonance is said to have moved.
    pub resonance: ResonancePolicy,
    /// When the declared structure is said to be wrong.
    pub outside: OutsidePolicy,
    /// What experiment is proposed.
    pub proposal: ProposalPolicy,
}

impl SearchPolicy {
    /// Refuses settings that mean nothing.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.holdout.validate()?;
        self.grid.validate()?;
        self.ranking.validate()?;
        self.fits.validate()?;
        self.steps.validate()?;
        self.balance.validate()?;
        self.limits.validate()?;
        self.judgement.validate()?;
        self.examination.validate()?;
        self.revision.validate()?;
        self.noise.validate()?;
        self.resonance.validate()?;
        self.outside.validate()?;
        self.proposal.validate()
    }
}

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
        /// Thresholds of a first model. By hand.
        thresholds: usize = 7, FROM_ONE;
        /// Times that plays and deadzones are added before effects are tried. By hand.
        rounds: usize = 6, FROM_ONE;
        /// A round that lowers the squares by less than this part is the last: another one would gain less.
        small: f64 = 0.02, PART;
        /// Squares over those of the noise up to which plays are not chosen anew on a dense grid: 5 % of the error. By hand.
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

    /// Fits that begin at limits of states, see [`limits`](super::limits).
    struct LimitPolicy {
        /// Fits with a limit of one state that are continued with what the poles hold that they have moved to: several begin near the
        /// best one. By hand.
        retied: usize = 3, FROM_ONE;
        /// Such continuations at most, and the part of the squares below which one is the last. By hand.
        ties: usize = 8, FROM_ONE;
        worth: f64 = 1e-3, PART;
    }

    /// What the balance of forces must show, see [`force_balance`](super::force_balance).
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

    /// Which trial is accepted, see [`judgement`](super::judgement).
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

    /// Whether the accepted trial has earned its name, see [`examination`](super::examination).
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

    /// When the noise itself is called an effect.
    struct NoisePolicy {
        /// Times that the search goes on with what the past of autocorrelated noise does not predict. What the model lacks is part
        /// of the noise's model at first, and less of it the second time. By hand.
        rounds: usize = 2, 0.0..=10.0;
        /// Part of a whitened residual's variance that the input may predict for the search to go on in this way. By hand: more is
        /// the error of a model beside a little noise.
        predictable: f64 = 0.1, PART;
        /// Part by which the rms residual may grow there, and by which it must fall for the search to go on from there. By hand: it grew by less than 1 % on a stage with 1/f noise and a drifting
        /// gain, and by 12 % where a smooth error of the model passed for noise.
        grown: f64 = 0.05, PART;
        /// Fewer wrong samples may be noise, or come from the way in which a record was cut. By hand.
        fewest: usize = 3, FROM_ONE;
        /// Part of them that may follow a jump of the input: where most do, the model errs at jumps. By hand.
        after_jumps: f64 = 0.5, PART;
        /// Samples that follow a jump, and the part of the input's changes that are no jumps. By hand.
        shortly: usize = 8, FROM_ONE;
        no_jumps: f64 = 0.99, PART;
        /// A residual so many times larger than the noise at rest comes from the stage. The factor is well above one
        /// because slow noise shows only in part while the input rests. By hand.
        louder: f64 = 2.5, FROM_ONE;
        /// Where the input never rests: a residual of this part of the output's span is no sensor's noise. By hand.
        loud: f64 = 0.02, PART;
        /// Innovations of coloured noise over the noise floor, which sees its fast part. On records of known truth
        /// coloured noise has about 1, relays and friction more than 4.
        innovation: f64 = 2.0, FROM_ONE;
        /// Part by which a prediction from the residual's past must lower its standard deviation, and by which an impossible effect
        /// of the input must not. By hand.
        predicted: f64 = 0.1, PART;
        /// Fourth moment over the square of the second. Stationary Gaussian noise has 3 whatever its
        /// autocorrelation, and what comes in bursts while the stage moves has more. By hand.
        kurtosis: f64 = 3.8, FROM_ONE;
    }

    /// When a resonance is said to have moved.
    struct ResonancePolicy {
        /// Largest over smallest output amplitude (rms): experiments nearer to each other tell nothing. By hand.
        apart: f64 = 1.25, FROM_ONE;
        /// Standard deviations by which the frequencies must differ: beyond doubt, since the sentence rules a cause out.
        sure: f64 = 5.0, 0.0..=100.0;
        /// Steps of the fit to each experiment, and the part of the squares below which a step is the last. By hand.
        steps: usize = 8, FROM_ONE;
        gain: f64 = 1e-4, PART;
    }

    /// When the declared structure is said to be wrong, see [`outside`](super::outside).
    struct OutsidePolicy {
        /// Root mean square residual over the noise floor below which no reason is asked for. By hand.
        near_noise: f64 = 1.5, FROM_ONE;
        /// Squares without the integrals of the input over those with them. By hand, between the stages of
        /// `python/tests/plants/textbook` that integrate and the tanks there.
        integrated: f64 = 2.0, FROM_ONE;
        /// The largest part of the output's squares that the regression with the integrals may leave. By hand, between the same
        /// stages: a slow plant that begins in motion has a large ratio, but it is not described well.
        remainder: f64 = 0.05, PART;
        /// Past values and plays of the input that stand beside the integrals, and the ridge of the regression: enough to
        /// describe an ordinary stage roughly. By hand.
        lags: [usize; 12] = [0, 1, 2, 3, 5, 8, 12, 20, 32, 50, 80, 128], 0.0..=1e6;
        plays: usize = 10, FROM_ONE;
        ridge: f64 = 1e-8, PART;
        /// Leaking integrals that are tried instead, and the longest of their time constants over the length of the longest
        /// experiment; each next one is half as long. By hand: what is forgotten within a twentieth of the record is no integral.
        leaks: usize = 8, 1.0..=30.0;
        forgotten: f64 = 0.05, PART;
        /// Part of the rms error that a rival must take: less is of no use. By hand.
        useful: f64 = 0.05, PART;
        /// Standard errors of the mean logarithm of the blocks' ratios. With ten blocks and four rivals, 3 % of equal
        /// rivals win by chance.
        standard_errors: f64 = 3.0, 0.0..=100.0;
        /// Blocks of held-out time at least, for a standard error of their differences.
        parts: usize = 10, FROM_ONE;
        /// Part of the samples that stand at a limit. By hand: on records of known truth a clipping sensor has 1.5 %.
        clipped: f64 = 0.005, PART;
        /// Part of the samples between the ends of the range that may repeat the one before them where a few samples are
        /// to show a limit. By hand: noise in double precision never repeats, and quantized signals do at every turning point.
        repeated: f64 = 0.001, PART;
        /// Samples of a run at a limit, the part of the input's span that it moves meanwhile, and how many times more
        /// samples stand there than at the next value. By hand.
        run: usize = 3, FROM_ONE;
        moved: f64 = 0.01, PART;
        crowded: f64 = 5.0, FROM_ONE;
        /// Past inputs and past outputs that predict the next input. The inputs' past is long, so that modes that ring
        /// know nothing older.
        past_inputs: usize = 160, FROM_ONE;
        past_outputs: usize = 10, FROM_ONE;
        /// Part of the squares that past outputs must take, and its standard errors. On records of known truth a stage
        /// under feedback has 0.47 and 21, and fifty others at most 0.06 or at most 5.
        predicted: f64 = 0.1, PART;
        sure: f64 = 5.0, 0.0..=100.0;
        /// Mean square of what the input's past leaves of its step, in half spans: less is rounding of a smooth input.
        least_news: f64 = 1e-10, PART;
        /// Bins of a loop's mean curve: each has many samples, and the ends are steep enough.
        bins: usize = 20, FROM_ONE;
        /// Parts of the curve's variance that is even and of the output's that it follows, and the mean opening of either
        /// lobe over the output's standard deviation. By hand.
        even: f64 = 0.8, PART;
        followed: f64 = 0.5, PART;
        crossed: f64 = 0.02, PART;
    }

    /// What experiment is proposed.
    struct ProposalPolicy {
        /// Seconds of it, long enough for creep, and the most samples, few enough to be handled. By hand.
        seconds: f64 = 600.0, POSITIVE;
        samples: f64 = 1e6, FROM_ONE;
        /// Periods of a triangle in that time. By hand.
        periods: f64 = 20.0, POSITIVE;
    }
}

/// Numerical limits of the score test, which no result should depend on.
pub(super) mod score {
    /// Eigenvalues of the model's scaled Gram matrix below this part of the largest are rounding.
    pub(in crate::explain) const RANK: f64 = 1e-11;
    /// Eigenvalues of a candidate's scaled Gram matrix below this are not solved for: the projection has cost digits.
    pub(in crate::explain) const OWN_RANK: f64 = 1e-9;
    /// A column of which the projection leaves a smaller part is in the span of the model's sensitivities.
    pub(in crate::explain) const LEFT: f64 = 1e-7;
    /// Numbers that the columns held at once may take: 200 MB. Each time, the derivatives of the model are streamed once more.
    pub(in crate::explain) const AT_ONCE: usize = 25_000_000;
    /// Probes beyond which all derivatives together take less time than single simulations. By hand.
    pub(in crate::explain) const MANY: usize = 50;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn todays_settings_are_valid() {
        SearchPolicy::default().validate().unwrap();
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |change: fn(&mut SearchPolicy)| {
            let mut policy = SearchPolicy::default();
            change(&mut policy);
            policy.validate().unwrap_err().to_string()
        };
        assert!(refused(|p| p.judgement.least = -0.1).contains("least"));
        assert!(refused(|p| p.judgement.near_noise = 0.5).contains("near_noise"));
        assert!(refused(|p| p.judgement.looks = f64::NAN).contains("NaN"));
        assert!(refused(|p| p.holdout.fraction = 1.5).contains("between 0 and 1"));
        assert!(refused(|p| p.holdout.places[2] = 2.0).contains("places"));
        assert!(refused(|p| p.holdout.blocks = 0).contains("blocks"));
        assert!(refused(|p| p.grid.probe = 0.0).contains("probe"));
        assert!(refused(|p| p.ranking.fitted = 0).contains("fitted"));
        assert!(refused(|p| p.fits.steps = 0).contains("steps"));
        assert!(refused(|p| p.revision.superfluous = 0.9).contains("superfluous"));
        assert!(refused(|p| p.noise.loud = f64::INFINITY).contains("loud"));
        assert!(refused(|p| p.resonance.sure = -1.0).contains("sure"));
        assert!(refused(|p| p.outside.integrated = 0.5).contains("integrated"));
    }
}
