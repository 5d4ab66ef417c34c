//! The settings of the solver.

/// How [`levenberg_marquardt`](super::levenberg_marquardt) proceeds. Validated when a minimisation begins.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SolverSettings {
    /// The largest number of steps, accepted or not.
    pub steps: usize,
    /// A step that is predicted and found to lower the cost by less than this fraction is the last.
    pub gain: f64,
    /// Fraction of `gain` below which a predicted step is not tried: the cost of an evaluation is not worth it, and
    /// it is far enough below `gain` that a wrong prediction does no harm.
    pub negligible: f64,
    /// Damping of the first step. The residuals are nearly linear in most unknowns of a model that starts close to the
    /// data, so a small value saves steps.
    pub damping: f64,
    /// The same where the curvature is approximate: an estimate from a part of the residuals promises too much in
    /// directions that this part hardly determines.
    pub approximate_damping: f64,
    /// Damping to start from when a step failed although the damping had become smaller.
    pub least_raised_damping: f64,
    /// Smallest damping: the rounding of the Gram matrix.
    pub least_damping: f64,
    /// Damping beyond which a step cannot lower the cost: steps are then shorter than a thousandth of a
    /// Gauss-Newton step.
    pub largest_damping: f64,
    /// The largest reduction of the damping by one step, as in H. B. Nielsen's rule but for 1/10 instead of 1/3: fits
    /// that go well reach Gauss-Newton steps sooner.
    pub least_reduction: f64,
    /// How many times more steps an approximate curvature may take: most of these steps keep it, and cost a
    /// fraction of the others.
    pub approximate_steps: usize,
    /// Steps after which an approximate curvature is computed anew; 12 was as good as 6 and better than 30 on the
    /// public steering mirror record (`gpi reproduce fsm`).
    pub oldest: usize,
    /// Growth of the damping after which a curvature of an earlier point is given up.
    pub patience: f64,
    /// The part of the expected curvature that a secant update must show, Powell's 0.2.
    pub least_curvature: f64,
    /// The cost that must be reached, zero where any is of use. A minimisation that would not reach it ends.
    pub goal: f64,
    /// Steps from whose gain it is foreseen whether the goal is reached.
    pub outlook: usize,
    /// How many times faster the logarithm of the cost may fall from then on: a fit that has found its way gains more in a step.
    pub faster: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            steps: 100,
            gain: 1e-6,
            negligible: 1e-3,
            damping: 1e-4,
            approximate_damping: 1e-2,
            least_raised_damping: 1e-9,
            least_damping: 1e-15,
            largest_damping: 1e6,
            least_reduction: 0.1,
            approximate_steps: 3,
            oldest: 12,
            patience: 8.0,
            least_curvature: 0.2,
            goal: 0.0,
            outlook: 4,
            faster: 2.0,
        }
    }
}

impl SolverSettings {
    /// Whether a goal is out of reach of the steps that are left. Over the last m steps the cost fell from `c` to `d`; in s steps it falls
    /// to `d (d / c)^(f s / m)` at most, if its logarithm falls no more than f times faster.
    pub(crate) fn is_out_of_reach(&self, history: &[f64], left: usize) -> bool {
        let before = history.len().checked_sub(self.outlook + 1).map(|first| history[first]);
        let (Some(before), Some(&now)) = (before, history.last()) else { return false };
        let factor = (now / before).powf(self.faster * left as f64 / self.outlook as f64);
        self.goal > 0.0 && now * factor > self.goal
    }

    /// The first setting that makes no sense: its name and what it must be.
    pub(crate) fn flaw(&self) -> Option<(&'static str, &'static str)> {
        let is_fraction = |value: f64| (0.0..1.0).contains(&value);
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        let checks = [
            ("gain", "at least 0 and below 1", is_fraction(self.gain)),
            ("negligible", "at least 0 and below 1", is_fraction(self.negligible)),
            ("damping", "positive", is_positive(self.damping)),
            ("approximate_damping", "positive", is_positive(self.approximate_damping)),
            ("least_raised_damping", "positive", is_positive(self.least_raised_damping)),
            ("least_damping", "positive", is_positive(self.least_damping)),
            ("largest_damping", "above `damping`", self.largest_damping > self.damping),
            ("least_reduction", "at least 0 and below 1", is_fraction(self.least_reduction)),
            ("approximate_steps", "at least 1", self.approximate_steps >= 1),
            ("patience", "at least 1", self.patience >= 1.0),
            ("least_curvature", "at least 0 and below 1", is_fraction(self.least_curvature)),
            ("goal", "at least 0", self.goal >= 0.0),
            ("outlook", "at least 1", self.outlook >= 1),
            ("faster", "at least 1", self.faster >= 1.0),
        ];
        checks.into_iter().find(|(.., holds)| !holds).map(|(name, what, _)| (name, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_without_sense_are_named() {
        assert_eq!(SolverSettings::default().flaw(), None);
        let name = |settings: SolverSettings| settings.flaw().map(|(name, _)| name);
        let usual = SolverSettings::default;
        assert_eq!(name(SolverSettings { gain: -1.0, ..usual() }), Some("gain"));
        assert_eq!(name(SolverSettings { damping: f64::NAN, ..usual() }), Some("damping"));
        assert_eq!(
            name(SolverSettings { largest_damping: 1e-5, ..usual() }),
            Some("largest_damping")
        );
        assert_eq!(name(SolverSettings { patience: 0.5, ..usual() }), Some("patience"));
    }

    #[test]
    fn a_goal_is_out_of_reach_where_the_last_steps_foresee_it() {
        let settings =
            SolverSettings { goal: 1.0, outlook: 2, faster: 2.0, ..SolverSettings::default() };
        // halved in two steps: to 100 / 16 in eight more, to less than 1 in twenty
        let history = [1000.0, 200.0, 150.0, 100.0];
        assert!(settings.is_out_of_reach(&history, 6));
        assert!(!settings.is_out_of_reach(&history, 20));
        // too few steps foresee nothing, and no goal is always reached
        assert!(!settings.is_out_of_reach(&history[2..], 0));
        let any = SolverSettings { goal: 0.0, ..settings };
        assert!(!any.is_out_of_reach(&history, 0));
    }
}
