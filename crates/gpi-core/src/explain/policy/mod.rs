//! Every tolerance and every choice of the search, with its meaning and the reason for its value.
//!
//! "By hand" means that nobody derived the value: it was chosen on simulated stages, and docs/scoreboard.md
//! shows what all values together achieve. "Squares" are weighted sums of squared residuals.

mod answer;
mod decisions;
mod search;

pub(crate) use answer::{NoisePolicy, OutsidePolicy, ProposalPolicy, ResonancePolicy};
pub(crate) use decisions::{ExaminationPolicy, JudgementPolicy, RevisionPolicy};
pub(crate) use search::{
    BalancePolicy, FitPolicy, GridPolicy, HoldoutPolicy, LimitPolicy, RankingPolicy, SlidingPolicy,
    StepsPolicy, StretchPolicy,
};

use crate::Error;

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
    /// The last fit of a stage that integrates forces.
    pub stretches: StretchPolicy,
    /// Fits that begin at limits of states.
    pub limits: LimitPolicy,
    /// Masses that slide with dry friction.
    pub sliding: SlidingPolicy,
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
        self.stretches.validate()?;
        self.limits.validate()?;
        self.sliding.validate()?;
        self.judgement.validate()?;
        self.examination.validate()?;
        self.revision.validate()?;
        self.noise.validate()?;
        self.resonance.validate()?;
        self.outside.validate()?;
        self.proposal.validate()
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
