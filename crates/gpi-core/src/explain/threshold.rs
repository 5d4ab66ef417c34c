//! What the deviance of a trial must exceed, condition 2 of [`super::judgement`].

use super::policy::JudgementPolicy;

/// What a trial's deviance must exceed, before the residual's autocorrelation is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Significance {
    /// N, the number of training values.
    pub values: f64,
    /// q, the number of parameters that were added.
    pub added: usize,
    /// Whether derivatives of the whole record would take long, and parts of it stand for the rest.
    pub is_long: bool,
    /// Whether the model has this driven effect already.
    pub is_more: bool,
}

impl Significance {
    fn white(&self, policy: &JudgementPolicy) -> f64 {
        self.added.max(1) as f64 * self.values.ln() + 2.0 * policy.looks.ln()
    }

    /// More of what a long record shows already need not be much: its held-out blocks are many samples.
    fn is_certain_to_be_real(&self) -> bool {
        self.is_long && self.is_more
    }

    /// The threshold for white noise.
    pub(super) fn threshold(&self, policy: &JudgementPolicy) -> f64 {
        let white = self.white(policy);
        if self.is_certain_to_be_real() { white } else { white.max(policy.least * self.values) }
    }

    /// Whether the residual's autocorrelation could change the answer.
    pub(super) fn depends_on_autocorrelation(
        &self,
        deviance: f64,
        policy: &JudgementPolicy,
    ) -> bool {
        let is_beyond = self.is_long && deviance > policy.certain * self.white(policy);
        deviance > self.threshold(policy) && !self.is_certain_to_be_real() && !is_beyond
    }

    /// The threshold for noise whose autocorrelation raises the covariance by a factor.
    pub(super) fn threshold_of_autocorrelated(&self, factor: f64, policy: &JudgementPolicy) -> f64 {
        self.threshold(policy).max(factor * self.white(policy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_counts_parameters_looks_and_autocorrelation() {
        let policy = JudgementPolicy::default();
        let of = |values, is_long, is_more| Significance { values, added: 2, is_long, is_more };
        let white = |values: f64| 2.0 * values.ln() + 2.0 * 150_f64.ln();
        assert!((of(500.0, false, false).threshold(&policy) - white(500.0)).abs() < 1e-12);
        // of many values a part of the squares is asked for
        let usual = of(1e5, false, false);
        assert!((usual.threshold(&policy) - 2000.0).abs() < 1e-9);
        assert!(usual.depends_on_autocorrelation(2001.0, &policy));
        assert!(!usual.depends_on_autocorrelation(1999.0, &policy));
        let raised = usual.threshold_of_autocorrelated(200.0, &policy);
        assert!((raised - 200.0 * white(1e5)).abs() < 1e-9);
        assert_eq!(usual.threshold_of_autocorrelated(1.0, &policy), usual.threshold(&policy));
        // more of what a long record shows need not be much, and no autocorrelation explains very much
        let more = of(1e5, true, true);
        assert!((more.threshold(&policy) - white(1e5)).abs() < 1e-12);
        assert!(!more.depends_on_autocorrelation(1e9, &policy));
        assert!(!of(1e5, true, false).depends_on_autocorrelation(1e9, &policy));
        assert!(usual.depends_on_autocorrelation(1e9, &policy));
    }
}
