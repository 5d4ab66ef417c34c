//! What an explanation comes to, and what to measure next.

use super::residual::{ResidualTest, STRUCTURE};
use super::trial::Rejected;
use crate::Record;
use crate::spectrum::is_one_sine;

/// How far what was measured is explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// What is left shows no structure: it is the noise.
    Explained,
    /// Effects were found, and structure is left.
    PartlyExplained,
    /// Structure is left, and no effect of the catalogue explains any of it.
    Unattributed,
}

impl Verdict {
    /// The word for it: `explained`, `partly-explained` or `unattributed`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unattributed => "unattributed",
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

/// Whether tests show more than the noise of a model with these effects: a dependence on input or time,
/// or memory.
///
/// Memory alone is noise with a colour once `coloured-noise` is among the effects, and isolated wrong
/// samples are no structure.
///
/// ```
/// use gpi_core::explain::{ResidualTest, structured};
/// let name = "whiteness";
/// let test = ResidualTest {
///     name, output: 0, statistic: 90.0, threshold: 50.0, p_value: 1e-8, points_to: "memory",
/// };
/// assert!(structured(&[], &[test.clone()]));
/// assert!(!structured(&["coloured-noise"], &[test]));
/// ```
pub fn structured(effects: &[&str], tests: &[ResidualTest]) -> bool {
    let coloured = effects.contains(&"coloured-noise");
    let shows = |test: &ResidualTest| {
        STRUCTURE.contains(&test.name) || (test.name == "whiteness" && !coloured)
    };
    tests.iter().any(|test| !test.passed() && shows(test))
}

pub(crate) fn verdict(effects: &[&str], tests: &[ResidualTest]) -> Verdict {
    match (structured(effects, tests), effects.is_empty()) {
        (false, _) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
        (true, true) => Verdict::Unattributed,
    }
}

/// The effects whose pictures are alike, and what tells them apart.
const APART: [(&[&str], &str); 3] = [
    (
        &["creep", "drift", "gain-drift"],
        "hold the input still for several minutes after a large step, then again without the step: creep \
         follows the step, drift does not, and a drifting gain shows only away from zero",
    ),
    (
        &["output-nonlinearity", "hysteresis-shape", "backlash", "stiffness"],
        "drive slow triangles of several sizes around several levels: a sensor's curve depends on the \
         level alone, a loop's shape on its past, and stiffness needs speed",
    ),
    (
        &["rate-dependence", "amplifier-slew", "linear-dynamics", "delay"],
        "drive the same triangle at several speeds: a slew limit starts at one speed, loops that open \
         with speed do so at all of them",
    ),
];

pub(crate) fn next_experiment(
    rejected: &[Rejected],
    effects: &[&str],
    tests: &[ResidualTest],
    verdict: Verdict,
    record: &Record,
) -> Option<NextExperiment> {
    let (low, high) = crate::identify::point::range(record, 0);
    let rate = record.rate();
    let duration = 600.0_f64.min(1e6 / rate);
    let triangle = format!(
        "gpi excite triangle --rate {rate} --duration {duration} --frequency {} --range {low} {high} \
         -o next.csv",
        // a number that can be typed
        (20e4 / duration).round() / 1e4
    );
    let confounded = rejected.iter().find(|one| !one.confounded_with.is_empty());
    if let Some(one) = confounded {
        let names = |name: &&str| *name == one.effect || one.confounded_with.contains(name);
        let group = APART.iter().find(|(group, _)| group.iter().filter(|n| names(n)).count() > 1);
        let with = one.confounded_with.join(", ");
        let how = group.map_or("repeat the experiment with another input", |(_, how)| *how);
        let why = format!("{} and {with} explain the same here; {how}", one.effect);
        return Some(NextExperiment { why, command: triangle });
    }
    if verdict == Verdict::Explained {
        return None;
    }
    if is_one_sine(record) {
        let why = "one cycle that repeats cannot tell a sensor's curve, a loop's shape, stiffness or a mode \
                   from the declared model; drive triangles of several sizes";
        return Some(NextExperiment { why: why.to_owned(), command: triangle });
    }
    let worst = tests
        .iter()
        .filter(|test| !test.passed() && STRUCTURE.contains(&test.name))
        .max_by(|a, b| (a.statistic / a.threshold).total_cmp(&(b.statistic / b.threshold)))?;
    let found = if effects.is_empty() { "nothing" } else { "not everything" };
    let why = format!(
        "{found} in the catalogue explains the residual, which fails the test `{}` ({}); a record that \
         moves one thing at a time tells more",
        worst.name, worst.points_to
    );
    Some(NextExperiment { why, command: triangle })
}
