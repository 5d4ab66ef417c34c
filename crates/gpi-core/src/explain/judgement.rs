//! Which trial is accepted by itself, and why another one is not: functions of numbers alone.
//!
//! A trial is the whole model with one more effect, fitted jointly. With J the weighted sum of squared residuals
//! over the N training values, its *deviance* `N ln(J_before / J_after)` is twice the rise of the log-likelihood of
//! white Gaussian noise. Where the effect is absent, q superfluous parameters raise it by about q. The trial is
//! accepted if all of the following holds.
//!
//! 1. *Driven*: what the input is said to drive does not stand there as a decay from the initial state.
//! 2. *Significant*: the deviance exceeds the threshold `max(q ln N + 2 ln L, p N)` (T8 in the documentation's
//!    theory). `q ln N` is the price of q parameters in the BIC; `2 ln L` raises it for the best of L candidates
//!    (Bonferroni's correction, since a chi-square tail falls as `exp(-x / 2)`); `p N` asks for a part p of the squares.
//!    Autocorrelated residuals are worth fewer samples than they have: with a factor kappa, by which the covariance
//!    of the parameters exceeds that for white noise, the first two terms count kappa times.
//! 3. *Confirmed*: the squares of the held-out blocks fall, see [`is_confirmed`] and [`is_foreseen`], and by nearly as large a part as those of
//!    the training data, or by most of the squares of what the effect changes there, see [`is_seen`]. A model with fewer unknowns than the present one adds nothing that chance could use: of it, the fall of
//!    the sum is enough, if it is substantial.
//! 4. *Substantial*: far from the noise a bad fit resembles many effects a little, so a large part of the training
//!    and of the held-out squares must go. Near the noise, a considerable part of those above the noise is enough, of the training data and
//!    what is held out together. This is not asked of an effect whose signature no bad fit
//!    has, or of more of a driven effect that the model has already.

use super::policy::JudgementPolicy;
use super::refusal::Refusal;

/// What is known of a trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence<'a> {
    /// Twice the rise of the log-likelihood that is the effect's own.
    pub deviance: f64,
    /// What it must exceed.
    pub threshold: f64,
    /// Training squares without and with the effect.
    pub squares: [f64; 2],
    /// The squares that noise alone would leave.
    pub noise: f64,
    /// The same of the held-out blocks.
    pub held_out_noise: f64,
    /// Squares of each held-out block without and with the effect.
    pub held_out: [&'a [f64]; 2],
    /// M, the number of their values.
    pub held_out_values: f64,
    /// Squares of what it changes of the held-out output, where that was computed.
    pub change: Option<f64>,
    /// Whether the input makes it explain what it does, where it is an effect that the input drives.
    pub is_driven: bool,
    /// Whether the model with it has fewer unknowns than the present one.
    pub is_simpler: bool,
    /// Whether no bad fit has its signature.
    pub is_unique: bool,
    /// Whether the model has this driven effect already.
    pub is_more: bool,
    /// Whether its parameters are such as a machine can have.
    pub is_plausible: bool,
    /// Whether another measured column explains it.
    pub is_measured: bool,
    /// Whether it is a slow function of time.
    pub is_slow: bool,
    /// Whether it is added to the output, and does nothing else.
    pub is_added: bool,
    /// Whether it is an expansion in many terms, without a law of its own.
    pub is_expansion: bool,
    /// Whether the balance of forces is what speaks for it.
    pub is_balanced: bool,
    /// Whether the output integrates the input, and the error of a simulation is all that speaks for it.
    pub is_integrated: bool,
    /// Why its examination ended without a name, if so.
    pub doubt: Option<Refusal>,
}

/// Whether a trial is accepted by itself.
pub(super) fn judge(trial: &Evidence, policy: &JudgementPolicy) -> Result<(), Refusal> {
    if let Some(doubt) = trial.doubt {
        Err(doubt)
    } else if !trial.is_driven {
        Err(Refusal::Undriven)
    } else if trial.deviance <= trial.threshold {
        Err(Refusal::Insignificant)
    } else if !(is_confirmed(trial.held_out, policy)
        || is_better_and_simpler(trial, policy)
        || is_foreseen(trial, policy))
        || !is_seen(trial, policy)
    {
        Err(Refusal::Unconfirmed)
    } else if !is_weighty(trial, policy) {
        Err(Refusal::Insubstantial)
    } else {
        Ok(())
    }
}

/// Whether the held-out squares fall by nearly as large a part as the training squares, or as they must where the held-out
/// blocks show less of the effect.
///
/// With e the held-out residual of the model with the effect, d what the effect changes of the output, and e + d the
/// residual without it, an effect that is right leaves e without correlation to d, and the squares fall by
///
/// ```text
/// |e + d|^2 - |e|^2 = |d|^2 + 2 e'd,      close to |d|^2,
/// ```
///
/// however little of it the blocks show. What only fits the training data changes the blocks at random: d has no correlation to
/// the residual e + d, and the squares grow by `|d|^2`.
fn is_seen(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    let part = |[before, after]: [f64; 2]| 1.0 - after / before.max(f64::MIN_POSITIVE);
    let held_out = trial.held_out.map(|blocks| blocks.iter().sum());
    part(held_out) >= policy.seen * part(trial.squares) || falls_as_predicted(trial, policy)
}

/// Whether the held-out squares fall by most of the squares of what the effect changes there.
fn falls_as_predicted(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    let [before, after] = trial.held_out.map(|blocks| blocks.iter().sum::<f64>());
    trial.change.is_some_and(|change| before - after >= policy.predicted * change)
}

/// Whether an effect brings the model near the noise, and the held-out squares T of M values fall as predicted and by more than
/// chance: `M ln(T_before / T_after) > 2 ln L` for L looks. Near the noise, nothing but noise is left that could look like the effect,
/// and blocks differ because they show different parts of it.
fn is_foreseen(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    let [before, after] = trial.held_out.map(|blocks| blocks.iter().sum::<f64>());
    let deviance = trial.held_out_values * (before / after.max(f64::MIN_POSITIVE)).ln();
    trial.squares[1] < policy.near_noise * trial.noise
        && falls_as_predicted(trial, policy)
        && deviance > 2.0 * policy.looks.ln()
}

/// Whether the model of a trial has fewer unknowns, and substantially smaller squares of both kinds.
fn is_better_and_simpler(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    trial.is_simpler && is_substantial(trial, policy)
}

/// Whether a large part of the training squares and of the held-out squares is gone.
fn is_substantial(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    let takes = |part: f64, [before, after]: [f64; 2]| after < (1.0 - part) * before;
    takes(policy.substantial, trial.squares)
        && takes(policy.substantial_held_out, trial.held_out.map(|blocks| blocks.iter().sum()))
}

/// Whether a trial is substantial, or need not be. Where the output integrates the input, small errors of v add up to a residual
/// that follows the output, the input or time, so that only what is added to the output may take a small part of it.
fn is_weighty(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    let adds_up = trial.is_integrated && !trial.is_added;
    let is_near_noise = !adds_up
        && trial.squares[1] < policy.near_noise * trial.noise
        && takes_much_of_the_rest(trial, policy);
    is_substantial(trial, policy) || is_near_noise || trial.is_unique || trial.is_more
}

/// Whether a trial takes a considerable part of the squares above the noise, of the training data and what is held out together: either
/// may show little of the effect.
fn takes_much_of_the_rest(trial: &Evidence, policy: &JudgementPolicy) -> bool {
    let held_out = trial.held_out.map(|blocks| blocks.iter().sum::<f64>());
    let [before, after] = [0, 1].map(|place| trial.squares[place] + held_out[place]);
    before - after > policy.beyond_rest * (after - trial.noise - trial.held_out_noise)
}

/// Whether the held-out squares, block by block without and with an effect, have fallen significantly.
///
/// The sum must fall. Beyond that, either the mean difference of the blocks exceeds its standard error by a factor,
/// or the blocks that become better gain far more than the others lose: an effect may show in few blocks only, and
/// makes their differences vary. With `d_b = before_b - after_b` for n blocks, both of
///
/// ```text
/// sum d_b > confirmed sum before_b,
/// mean d > z sqrt(var d / n)   or   sum of d_b > 0 exceeds a factor times -(sum of d_b < 0)
/// ```
///
/// must hold, where var d divides by n - 1. It is the paired t-test of two models on the same blocks.
pub(super) fn is_confirmed([before, after]: [&[f64]; 2], policy: &JudgementPolicy) -> bool {
    let differences: Vec<f64> = before.iter().zip(after).map(|(a, b)| a - b).collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let total: f64 = before.iter().sum();
    let gained: f64 = differences.iter().filter(|d| **d > 0.0).sum();
    let lost: f64 = -differences.iter().filter(|d| **d < 0.0).sum::<f64>();
    let one_sided = gained > policy.one_sided * lost;
    let is_sure = one_sided || mean > policy.standard_errors * (variance / n).sqrt();
    mean * n > policy.confirmed * total && is_sure
}

/// Whether an earlier effect is superfluous: the deviance lost without it is below the newest effect's threshold, and
/// the held-out squares (with it, without it) do not grow beyond a factor.
pub(super) fn is_superfluous(
    lost: f64,
    threshold: f64,
    held_out: [&[f64]; 2],
    factor: f64,
) -> bool {
    let [with, without] = held_out.map(|blocks| blocks.iter().sum::<f64>());
    lost < threshold && without < factor * with
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::explain) const BEFORE: [f64; 4] = [10.0, 11.0, 9.0, 10.0];
    const AFTER: [f64; 4] = [5.0, 5.5, 4.5, 5.0];

    /// A trial that meets every condition, far from the noise.
    pub(in crate::explain) fn sound() -> Evidence<'static> {
        Evidence {
            deviance: 500.0,
            threshold: 40.0,
            squares: [100.0, 60.0],
            noise: 1.0,
            held_out_noise: 1.0,
            held_out: [&BEFORE, &AFTER],
            held_out_values: 400.0,
            change: None,
            is_driven: true,
            is_simpler: false,
            is_unique: false,
            is_more: false,
            is_plausible: true,
            is_measured: false,
            is_slow: false,
            is_added: false,
            is_expansion: false,
            is_balanced: false,
            is_integrated: false,
            doubt: None,
        }
    }

    fn judged(change: impl FnOnce(&mut Evidence<'static>)) -> Result<(), Refusal> {
        let mut trial = sound();
        change(&mut trial);
        judge(&trial, &JudgementPolicy::default())
    }

    #[test]
    fn each_condition_refuses_with_its_reason() {
        assert_eq!(judged(|_| ()), Ok(()));
        assert_eq!(judged(|trial| trial.is_driven = false), Err(Refusal::Undriven));
        assert_eq!(judged(|trial| trial.deviance = 40.0), Err(Refusal::Insignificant));
        let unconfirmed = judged(|trial| trial.held_out = [&BEFORE, &BEFORE]);
        assert_eq!(unconfirmed, Err(Refusal::Unconfirmed));
        // a small part near the noise, which the errors of a plant that integrates may take
        let small = |is_integrated, is_added| {
            judged(|trial| {
                trial.squares = [1.3, 1.02];
                (trial.is_integrated, trial.is_added) = (is_integrated, is_added);
            })
        };
        assert_eq!(small(false, false), Ok(()));
        assert_eq!(small(true, false), Err(Refusal::Insubstantial));
        assert_eq!(small(true, true), Ok(()));
        // unsure by block, which fewer unknowns make up for
        let unsure = |is_simpler, after: &'static [f64]| {
            judged(|trial| {
                (trial.held_out, trial.is_simpler) = ([&BEFORE, after], is_simpler);
            })
        };
        const UNEVEN: [f64; 4] = [1.0, 14.0, 4.0, 8.0];
        assert_eq!(unsure(false, &UNEVEN), Err(Refusal::Unconfirmed));
        assert_eq!(unsure(true, &UNEVEN), Ok(()));
        assert_eq!(unsure(true, &[1.0, 17.0, 9.0, 8.0]), Err(Refusal::Unconfirmed));
        // unsure by block, and as predicted near the noise
        let foreseen = |left, change| {
            judged(|trial| {
                trial.held_out = [&BEFORE, &UNEVEN];
                trial.change = change;
                trial.squares[1] = left;
            })
        };
        assert_eq!(foreseen(2.0, Some(14.0)), Ok(()));
        assert_eq!(foreseen(2.0, Some(20.0)), Err(Refusal::Unconfirmed));
        assert_eq!(foreseen(2.0, None), Err(Refusal::Unconfirmed));
        assert_eq!(foreseen(60.0, Some(14.0)), Err(Refusal::Unconfirmed));
        // a part of 0.02 in the blocks, of 0.4 in the training data: the blocks may show little of it
        let little_shown = |change| {
            judged(|trial| {
                trial.held_out = [&BEFORE, &[9.8, 10.78, 8.82, 9.8]];
                trial.change = change;
                trial.is_unique = true;
            })
        };
        assert_eq!(little_shown(None), Err(Refusal::Unconfirmed));
        assert_eq!(little_shown(Some(0.9)), Ok(()));
        assert_eq!(little_shown(Some(1.2)), Err(Refusal::Unconfirmed));
        assert_eq!(judged(|trial| trial.squares[1] = 71.0), Err(Refusal::Insubstantial));
        let little = judged(|trial| trial.held_out = [&BEFORE, &[8.1, 9.0, 7.3, 8.1]]);
        assert_eq!(little, Err(Refusal::Insubstantial));
    }

    #[test]
    fn a_small_part_is_enough_near_the_noise_and_for_what_is_known_or_unique() {
        let small = |change: fn(&mut Evidence)| {
            judged(|trial| {
                trial.squares[1] = 90.0;
                trial.held_out = [&BEFORE, &[8.0, 8.8, 7.2, 8.0]];
                change(trial);
            })
        };
        assert_eq!(small(|_| ()), Err(Refusal::Insubstantial));
        // it takes 10 of the training data and 8 of what is held out, and leaves 35 or 37 of both above the noise
        let left = |noise, held_out| {
            judged(|trial| {
                trial.squares = [100.0, 90.0];
                trial.held_out = [&BEFORE, &[8.0, 8.8, 7.2, 8.0]];
                (trial.noise, trial.held_out_noise) = (noise, held_out);
            })
        };
        assert_eq!(left(86.0, 1.0), Ok(()));
        assert_eq!(left(84.0, 1.0), Err(Refusal::Insubstantial));
        assert_eq!(left(56.0, 31.0), Ok(()));
        assert_eq!(left(56.0, 29.0), Err(Refusal::Insubstantial));
        let near = |noise| judged(|trial| (trial.squares, trial.noise) = ([300.0, 226.0], noise));
        assert_eq!(near(101.0), Ok(()));
        assert_eq!(near(100.0), Err(Refusal::Insubstantial), "more than 1.5 times its rms");
        assert_eq!(small(|trial| trial.is_unique = true), Ok(()));
        assert_eq!(small(|trial| trial.is_more = true), Ok(()));
    }

    #[test]
    fn blocks_confirm_by_their_mean_or_by_being_one_sided() {
        let policy = JudgementPolicy::default();
        let confirmed = |after: [f64; 4]| is_confirmed([&[10.0; 4], &after], &policy);
        assert!(confirmed([9.0, 9.1, 8.9, 9.0]));
        // all in one block, hardly worse in the others
        assert!(confirmed([4.0, 10.1, 10.1, 10.1]));
        assert!(!confirmed([4.0, 11.0, 11.0, 11.0]));
        // sure, and of no use
        assert!(!confirmed([9.96; 4]));
        assert!(!confirmed([10.5; 4]));
        assert!(!is_confirmed([&[], &[]], &policy));
    }

    #[test]
    fn an_effect_is_superfluous_where_nothing_is_lost_without_it() {
        let superfluous = |lost, without| is_superfluous(lost, 40.0, [&[1.0, 1.0], without], 1.5);
        assert!(superfluous(30.0, &[1.4, 1.4]));
        assert!(!superfluous(40.0, &[1.0, 1.0]));
        assert!(!superfluous(30.0, &[1.6, 1.6]));
    }
}
