//! Which of the accepted trials is taken, and why another one is not.
//!
//! Of the accepted trials ([`super::judgement`]) the one with the largest deviance beyond its threshold is taken. Trials whose deviance lies
//! within that threshold of its own explain the same: of these, one with plausible parameters is preferred, more of a driven
//! effect that the model has already to a new name, an effect with a law of its own to an expansion in many terms, which takes the form
//! of many effects, of functions of time one that is added to the output and gains nearly the same, and the others are reported as
//! confounded.

use super::judgement::{Evidence, judge};
use super::policy::JudgementPolicy;
use super::refusal::Refusal;

/// The place of the trial to take, of those that are sorted by their deviance beyond the threshold. Another measured
/// column is taken instead of a slow function of time where its held-out error is no larger than `measured` times.
pub(super) fn choose(
    trials: &[Evidence],
    measured: f64,
    policy: &JudgementPolicy,
) -> Option<usize> {
    let is_accepted = |trial: &Evidence| judge(trial, policy).is_ok();
    let best = trials.iter().position(is_accepted)?;
    let is_as_good = |trial: &Evidence| {
        explains_as_much(trial, &trials[best]) && is_accepted(trial) && trial.is_plausible
    };
    let measured_instead = |trial: &Evidence| {
        let rms = |trial: &Evidence| trial.held_out[1].iter().sum::<f64>().sqrt();
        let is_near = rms(trial) < measured * rms(&trials[best]);
        trials[best].is_slow && trial.is_measured && is_near && is_accepted(trial)
    };
    // of functions of time, one that is added assumes least
    let is_simpler = |trial: &Evidence| {
        let is_tied = trial.deviance > policy.tied * trials[best].deviance;
        trials[best].is_slow && trial.is_slow && trial.is_added && is_tied && is_accepted(trial)
    };
    let instead = trials.iter().position(measured_instead);
    let instead = instead.or_else(|| trials.iter().position(is_simpler));
    // no new name where more of what is there explains the same
    let is_no_new_name = |trial: &Evidence| trial.is_more && is_as_good(trial);
    let instead = instead.or_else(|| trials.iter().position(is_no_new_name));
    let has_law = |trial: &Evidence| !trial.is_expansion && is_as_good(trial);
    let instead = instead.or_else(|| trials.iter().position(has_law));
    Some(instead.or_else(|| trials.iter().position(is_as_good)).unwrap_or(best))
}

/// Why a trial was not taken, with the one that was taken if any.
pub(super) fn refusal(
    trial: &Evidence,
    taken: Option<&Evidence>,
    policy: &JudgementPolicy,
) -> Refusal {
    match taken {
        _ if !trial.is_driven => Refusal::Undriven,
        Some(_) if trial.doubt.is_some() => trial.doubt.unwrap_or(Refusal::Inferior),
        Some(taken) if explains_as_much(trial, taken) => Refusal::Confounded,
        Some(_) => Refusal::Inferior,
        None => judge(trial, policy).err().unwrap_or(Refusal::Inferior),
    }
}

/// Whether the deviance reaches that of another one up to the other's threshold.
fn explains_as_much(trial: &Evidence, other: &Evidence) -> bool {
    trial.deviance > other.deviance - other.threshold
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::judgement::tests::{BEFORE, sound};

    #[test]
    fn of_equals_a_plausible_one_is_taken_and_the_others_are_confounded() {
        let policy = JudgementPolicy::default();
        let best = Evidence { is_plausible: false, ..sound() };
        let equal = Evidence { deviance: 470.0, ..sound() };
        let weaker = Evidence { deviance: 450.0, ..sound() };
        assert_eq!(choose(&[best, equal, weaker], 1.05, &policy), Some(1));
        assert_eq!(choose(&[best, weaker], 1.05, &policy), Some(0));
        let unconfirmed = Evidence { held_out: [&BEFORE, &BEFORE], ..best };
        assert_eq!(choose(&[unconfirmed, weaker], 1.05, &policy), Some(1));
        assert_eq!(choose(&[unconfirmed], 1.05, &policy), None);
        assert_eq!(refusal(&equal, Some(&best), &policy), Refusal::Confounded);
        assert_eq!(refusal(&weaker, Some(&best), &policy), Refusal::Inferior);
        assert_eq!(refusal(&unconfirmed, None, &policy), Refusal::Unconfirmed);
        let drift = Evidence { is_slow: true, ..sound() };
        let measured = Evidence { is_measured: true, ..weaker };
        assert_eq!(choose(&[drift, weaker, measured], 1.05, &policy), Some(2));
        assert_eq!(choose(&[sound(), measured], 1.05, &policy), Some(0));
        let gain_drift = Evidence { is_slow: true, ..sound() };
        let added = Evidence { deviance: 499.0, is_slow: true, is_added: true, ..equal };
        assert_eq!(choose(&[gain_drift, added], 1.05, &policy), Some(1));
        let doubted = Evidence { doubt: Some(Refusal::NotItsOwn), ..sound() };
        assert_eq!(choose(&[doubted, weaker], 1.05, &policy), Some(1));
        assert_eq!(refusal(&doubted, None, &policy), Refusal::NotItsOwn);
        let decay = Evidence { is_driven: false, ..equal };
        assert_eq!(refusal(&decay, Some(&best), &policy), Refusal::Undriven);
        let expansion = Evidence { is_expansion: true, ..sound() };
        assert_eq!(choose(&[expansion, equal], 1.05, &policy), Some(1));
        assert_eq!(choose(&[expansion, weaker], 1.05, &policy), Some(0));
        let more = Evidence { is_more: true, ..equal };
        assert_eq!(choose(&[sound(), equal, more], 1.05, &policy), Some(2));
        assert_eq!(
            choose(&[sound(), Evidence { is_more: true, ..weaker }], 1.05, &policy),
            Some(0)
        );
    }
}
