//! The verdict of an explanation, and what to measure next.

use super::policy::ProposalPolicy;
use super::residual::{ResidualTest, STRUCTURE, WHITENESS};
use super::state::Rejected;
use crate::Record;
use crate::effects::{CATALOGUE, SeparatedBy};
use crate::spectrum::is_one_sine;

/// How far the record is explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The residual shows no structure: it is noise.
    Explained,
    /// Effects were found, and the residual still has structure.
    PartlyExplained,
    /// The residual has structure, and no effect of the catalogue explains any of it.
    Unattributed,
    /// The residual has structure because the declared structure is wrong, whatever effects were found.
    OutsideClass,
}

impl Verdict {
    /// The word for it: `explained`, `partly-explained`, `unattributed` or `outside-class`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unattributed => "unattributed",
            Self::OutsideClass => "outside-class",
        }
    }
}

/// An experiment that would tell more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NextExperiment {
    /// What it would tell apart, or show.
    pub why: String,
    /// A command that makes its input; empty where the input is to stand still.
    pub command: String,
}

/// Whether tests show more than the noise of a model with these effects: a dependence on the input or on time, or
/// autocorrelation.
///
/// Autocorrelation alone is noise once an effect explains it (`coloured-noise`), and isolated wrong samples are no
/// structure.
///
/// ```
/// use gpi_core::explain::{ResidualTest, structured};
/// let name = "whiteness";
/// let test = ResidualTest {
///     name, output: 0, statistic: 90.0, threshold: 50.0, significance: None, points_to: "memory".to_owned(),
/// };
/// assert!(structured(&[], &[test.clone()]));
/// assert!(!structured(&["coloured-noise"], &[test]));
/// ```
pub fn structured(effects: &[&str], tests: &[ResidualTest]) -> bool {
    let is_explained = CATALOGUE
        .iter()
        .any(|entry| entry.explains_autocorrelation && effects.contains(&entry.name));
    let shows = |test: &ResidualTest| {
        STRUCTURE.contains(&test.name) || (test.name == WHITENESS && !is_explained)
    };
    tests.iter().any(|test| !test.passed() && shows(test))
}

/// The verdict on a model: whether its residual is structured, whether the declared structure is wrong, and whether effects
/// were found.
pub(super) fn verdict(is_structured: bool, is_outside: bool, has_effects: bool) -> Verdict {
    match (is_structured, is_outside, has_effects) {
        (false, _, _) => Verdict::Explained,
        (true, true, _) => Verdict::OutsideClass,
        (true, false, true) => Verdict::PartlyExplained,
        (true, false, false) => Verdict::Unattributed,
    }
}

/// The kind of input that separates most effects.
const TRIANGLE: &str = "triangle";

/// What separates effects that look alike, and the kind of input that does.
fn separation(by: SeparatedBy) -> (&'static str, &'static str) {
    match by {
        SeparatedBy::Rests => (
            "keep the input constant for minutes, at zero and after large steps: creep follows each step, drift does \
             not, and a drift of the gain is visible only if the output is not zero",
            "steps",
        ),
        SeparatedBy::Levels => (
            "drive slow triangles of several amplitudes around several levels: a sensor's curve depends only on the \
             level, the shape of a loop depends on the history of the input, and stiffness acts only in fast motion",
            TRIANGLE,
        ),
        SeparatedBy::Speeds => (
            "drive the same triangle at several speeds: a slew limit acts only above a certain speed, and rate \
             dependence widens the loop at every speed",
            TRIANGLE,
        ),
        SeparatedBy::Nothing => ("repeat the experiment with another input", TRIANGLE),
    }
}

/// A number that can be typed: four significant digits, all digits before the point.
pub(super) fn typed(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() {
        return 0.0;
    }
    let digits = (3 - number.abs().log10().floor() as i32).max(0);
    format!("{number:.*}", digits as usize).parse().unwrap_or(number)
}

/// What to measure next: what separates effects that this record cannot tell apart, or what shows more of the structure
/// that is left.
pub(super) fn next_experiment(
    rejected: &[Rejected],
    effects: &[&str],
    tests: &[ResidualTest],
    verdict: Verdict,
    record: &Record,
    policy: &ProposalPolicy,
) -> Option<NextExperiment> {
    let (low, high) = crate::chain::bounds::range(record, 0);
    let rate = record.rate();
    let duration = policy.seconds.min(policy.samples / rate);
    let command = |kind: &str| {
        let frequency = format!(" --frequency {}", typed(policy.periods / duration));
        let frequency = if kind == TRIANGLE { frequency } else { String::new() };
        format!(
            "gpi excite {kind} --rate {} --duration {}{frequency} --range {},{} -o next.csv",
            typed(rate),
            typed(duration),
            typed(low),
            typed(high)
        )
    };
    let confounded = rejected.iter().find(|one| !one.confounded_with.is_empty());
    if let Some(one) = confounded {
        let is_named = |name| name == one.effect || one.confounded_with.contains(&name);
        let alike = |by: &SeparatedBy| {
            let group = CATALOGUE.iter().filter(|entry| entry.separated_by == *by);
            group.filter(|entry| is_named(entry.name)).count() > 1
        };
        let groups = [SeparatedBy::Rests, SeparatedBy::Levels, SeparatedBy::Speeds];
        let by = groups.into_iter().find(alike).unwrap_or(SeparatedBy::Nothing);
        let (how, kind) = separation(by);
        let with = one.confounded_with.join(", ");
        let why = format!("{} and {with} explain this record equally well; {how}", one.effect);
        return Some(NextExperiment { why, command: command(kind) });
    }
    if matches!(verdict, Verdict::Explained | Verdict::OutsideClass) {
        // no record makes a wrong structure right
        return None;
    }
    if is_one_sine(record) {
        let why = "a record of one cycle that repeats cannot distinguish a sensor's curve, the shape of a loop, \
                   stiffness or a mode from the declared model; drive triangles of several amplitudes";
        return Some(NextExperiment { why: why.to_owned(), command: command(TRIANGLE) });
    }
    let worst = tests
        .iter()
        .filter(|test| !test.passed() && STRUCTURE.contains(&test.name))
        .max_by(|a, b| (a.statistic / a.threshold).total_cmp(&(b.statistic / b.threshold)))?;
    let found = if effects.is_empty() {
        "no effect of the catalogue"
    } else {
        "no further effect of the catalogue"
    };
    let why = format!(
        "{found} explains the residual, which fails the test `{}` (possible causes: {}); record experiments in \
         which only one quantity changes at a time",
        worst.name, worst.points_to
    );
    Some(NextExperiment { why, command: command(TRIANGLE) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Experiment, Matrix};

    fn record() -> Record {
        let input =
            Matrix::from_fn(1000, 1, |k, _| (0.1 * k as f64).sin() + (0.037 * k as f64).cos());
        let output = input.clone();
        let covariates = Matrix::zeros(1000, 0);
        let run = Experiment { input, output, covariates, warmup: 0, held_out: vec![] };
        let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
        Record::new(vec![run], 1000.0, u, y, vec![]).unwrap()
    }

    fn confused(effect: &'static str, with: &'static str) -> NextExperiment {
        let rejected = Rejected {
            effect,
            holdout_rms: 1.0,
            why: String::new(),
            confounded_with: vec![with],
            probability: None,
        };
        next_experiment(
            &[rejected],
            &[with],
            &[],
            Verdict::Explained,
            &record(),
            &ProposalPolicy::default(),
        )
        .unwrap()
    }

    #[test]
    fn numbers_of_a_command_have_four_digits() {
        assert_eq!(typed(0.120_399_999_999_999_95).to_string(), "0.1204");
        assert_eq!(typed(-12_345.678).to_string(), "-12346");
        assert_eq!(typed(9.999_96).to_string(), "10");
        assert_eq!((typed(0.0), typed(1e-5), typed(100.0)), (0.0, 1e-5, 100.0));
    }

    #[test]
    fn the_command_makes_the_input_that_is_asked_for() {
        let next = confused("drift", "creep");
        assert!(next.why.contains("keep the input constant"), "{}", next.why);
        assert!(next.command.starts_with("gpi excite steps --rate 1000 --duration 600 --range "));
        let range = next.command.split("--range ").nth(1).unwrap().split(' ').next().unwrap();
        assert!(range.split(',').all(|end| end.trim_start_matches('-').len() <= 6), "{range}");
        let next = confused("backlash", "hysteresis-shape");
        assert!(next.why.contains("triangles"), "{}", next.why);
        assert!(
            next.command.starts_with("gpi excite triangle ")
                && next.command.contains("--frequency")
        );
    }

    #[test]
    fn a_wrong_structure_comes_before_effects_and_after_noise() {
        assert_eq!(verdict(false, true, true), Verdict::Explained);
        assert_eq!(verdict(true, true, true), Verdict::OutsideClass);
        assert_eq!(verdict(true, true, false), Verdict::OutsideClass);
        assert_eq!(verdict(true, false, true), Verdict::PartlyExplained);
        assert_eq!(verdict(true, false, false), Verdict::Unattributed);
    }

    #[test]
    fn nothing_is_asked_for_where_all_is_explained() {
        assert_eq!(
            next_experiment(
                &[],
                &[],
                &[],
                Verdict::Explained,
                &record(),
                &ProposalPolicy::default()
            ),
            None
        );
    }
}
