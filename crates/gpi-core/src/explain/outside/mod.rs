//! Whether the declared structure itself is wrong.
//!
//! Each file asks one question about a record, and answers with a number or with nothing. An answer counts only where the
//! residual of the final model is structured and above the noise: what is explained to the noise needs no other class. Signals
//! are in the units of [`Units`], in which each input spans -1 to 1 and each output has the variance one.

mod butterfly;
mod feedback;
mod integration;
#[cfg(test)]
pub(super) mod plants;
mod saturation;
mod signs;
mod winner;

pub use signs::{Signs, signs};

use super::policy::OutsidePolicy;
use crate::rivals::{Fitted, RivalPolicy, Units};
use crate::{Error, Matrix, Record};

/// What the questions are asked about.
pub(super) struct Situation<'a> {
    /// The training record.
    pub record: &'a Record,
    /// What the final model leaves of it, held-out samples included.
    pub residuals: &'a [Matrix],
    /// Root mean square of that over the noise floor.
    pub over_noise: f64,
    /// Whether the residual shows more than noise.
    pub is_structured: bool,
    /// What is held out, and what the final model leaves there.
    pub test: (&'a Record, &'a [Matrix]),
    /// The simple models.
    pub rivals: &'a [Fitted],
}

/// Why the declared structure is wrong, and what else the reader has to know of the record.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Answer {
    /// Clauses that can be joined; none where the structure may be right.
    pub reasons: Vec<String>,
    /// Sentences.
    pub notes: Vec<String>,
}

/// Whether any output integrates the input.
pub(super) fn integrates(record: &Record, policy: &OutsidePolicy) -> Result<bool, Error> {
    let rivals = RivalPolicy::default();
    let scaled = Units::of(record).scaled(record)?;
    let mut ratios = (0..scaled.outputs().len())
        .filter_map(|output| integration::ratio(&scaled, output, &rivals, policy));
    Ok(ratios.any(|ratio| ratio > policy.integrated))
}

/// Whether any output stands at a limit while the input moves, and a model with these residuals errs more there than
/// elsewhere.
pub(super) fn saturates(
    record: &Record,
    residuals: &[Matrix],
    policy: &OutsidePolicy,
) -> Result<bool, Error> {
    let scaled = Units::of(record).scaled(record)?;
    let of = |output| {
        let clipped = saturation::clipped(&scaled, output, policy);
        saturation::is_unexplained(&clipped, residuals, output)
    };
    Ok((0..scaled.outputs().len()).any(of))
}

/// The limits of an output: its largest and its smallest value where it stands there while the input moves, each with whether it is
/// the smallest.
pub(super) fn limits(
    record: &Record,
    output: usize,
    policy: &OutsidePolicy,
) -> Result<Vec<(f64, bool)>, Error> {
    let scaled = Units::of(record).scaled(record)?;
    let [at_largest, at_smallest] = saturation::clipped(&scaled, output, policy).at;
    let columns = || record.experiments().iter().map(|run| run.output.column(output));
    let largest = columns().map(|column| column.max()).fold(f64::NEG_INFINITY, f64::max);
    let smallest = columns().map(|column| column.min()).fold(f64::INFINITY, f64::min);
    let all = [(at_largest, (largest, false)), (at_smallest, (smallest, true))];
    Ok(all.into_iter().filter_map(|(is_limit, limit)| is_limit.then_some(limit)).collect())
}

/// The record without the samples at which an output stands at a limit while the input moves: they are held out.
pub(super) fn within_limits(record: &Record, policy: &OutsidePolicy) -> Result<Record, Error> {
    let scaled = Units::of(record).scaled(record)?;
    let mut experiments = record.experiments().to_vec();
    for output in 0..record.outputs().len() {
        let runs = saturation::clipped(&scaled, output, policy).runs;
        for (experiment, runs) in experiments.iter_mut().zip(runs) {
            experiment.hold_out(runs);
        }
    }
    record.with_experiments(experiments)
}

/// Asks all questions.
pub(super) fn outside(of: &Situation, policy: &OutsidePolicy) -> Result<Answer, Error> {
    let rivals = RivalPolicy::default();
    let scaled = Units::of(of.record).scaled(of.record)?;
    let mut answer = Answer::default();
    let fed_back = feedback::inputs(&scaled, &rivals, policy);
    for &input in &fed_back {
        answer.notes.push(feedback::note(&scaled.inputs()[input].name));
    }
    if !of.is_structured || of.over_noise < policy.near_noise {
        return Ok(answer);
    }
    for (output, channel) in scaled.outputs().iter().enumerate() {
        let name = &channel.name;
        let ratio = integration::ratio(&scaled, output, &rivals, policy);
        if let Some(ratio) = ratio.filter(|ratio| *ratio > policy.integrated) {
            answer.reasons.push(format!(
                "the output {name} integrates the input: with the running integrals of the input, a regression on \
                 past inputs and plays leaves {ratio:.1} times smaller squares on data that it was not fitted to"
            ));
        }
        let clipped = saturation::clipped(&scaled, output, policy);
        if saturation::is_unexplained(&clipped, of.residuals, output) {
            let share = 100.0 * clipped.share();
            answer.reasons.push(format!(
                "the output {name} saturates: {share:.1} % of its samples stand exactly at its largest or smallest \
                 value while the input moves, and the model errs more there than elsewhere"
            ));
        }
        for (input, drive) in scaled.inputs().iter().enumerate() {
            if butterfly::is_butterfly(&scaled, input, output, policy) {
                let drive = &drive.name;
                answer.reasons.push(format!(
                    "the loop of {name} over {drive} is a butterfly: the output falls at one end of the input's range \
                     and rises at the other, and the loop crosses itself"
                ));
            }
        }
    }
    if let Some(winner) = winner::winner(of.test, of.rivals, policy) {
        let Fitted { name, detail, .. } = winner;
        answer.reasons.push(format!(
            "a simple model predicts held-out data better than this one: {name} ({detail})"
        ));
    }
    for input in fed_back {
        let name = &scaled.inputs()[input].name;
        answer
            .reasons
            .push(format!("the input {name} depends on past outputs, as it does under feedback"));
    }
    Ok(answer)
}
