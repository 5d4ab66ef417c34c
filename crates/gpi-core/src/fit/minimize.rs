//! Gauss-Newton with Levenberg and Marquardt's damping, within bounds.

use crate::chain::point::{Freedom, Point};
use crate::fit::linearization::{Linearization, Weighting};
use crate::linear::bounded;
use crate::progress::{Progress, report};
use crate::{Error, Record};

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// No step is left that would lower the cost by more than its tolerance.
    Converged,
    /// Steps that should lower the cost do not, however short: the cost has a kink here, where a play
    /// begins to turn at another sample, or rounding hides what is left.
    Stalled,
    /// The largest number of steps was taken.
    Limit,
}

impl Status {
    /// The word for it: `converged`, `stalled` or `limit`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Stalled => "stalled",
            Self::Limit => "limit",
        }
    }
}

/// Where a fit ended and how it got there.
#[derive(Clone)]
pub(crate) struct Fitted {
    pub point: Point,
    pub linearization: Linearization,
    /// The cost at the start and after every accepted step.
    pub history: Vec<f64>,
    pub status: Status,
}

/// What is free, how residuals count, and when to options.
#[derive(Clone, Debug)]
pub(crate) struct FitOptions {
    pub freedom: Freedom,
    pub weighting: Weighting,
    /// Linearizations, accepted or not.
    pub steps: usize,
    /// A step that is predicted and found to gain less than this fraction of the cost is the last.
    pub gain: f64,
}

impl Fitted {
    /// The same fit with what came before it in its history. Where the loss has changed, the earlier
    /// costs are brought to the scale of the later ones: both know the cost of the point between.
    pub(crate) fn after(mut self, before: &[f64]) -> Self {
        if let (Some(last), Some(first)) = (before.last(), self.history.first()) {
            let scale = if *last > 0.0 { first / last } else { 1.0 };
            let earlier = before[..before.len() - 1].iter().map(|cost| scale * cost);
            self.history.splice(0..0, earlier);
        }
        self
    }
}

/// Minimises the cost over everything that is free.
pub(crate) fn fit(
    point: Point,
    record: &Record,
    options: &FitOptions,
    stage: &str,
    progress: Progress,
) -> Result<Fitted, Error> {
    const LARGEST_DAMPING: f64 = 1e6;
    /// Steps with a curvature of few experiments, most of which keep it, for one of the others.
    const CHEAP: usize = 3;
    /// Growth of the damping after which a curvature of earlier points is given up.
    const PATIENCE: f64 = 8.0;
    let linearize = |point: &Point, done: f64, progress: Progress| {
        let mut check = || report(progress, stage, done);
        Linearization::new(point, record, options.freedom, &options.weighting, &mut check)
    };
    let mut point = point;
    let mut current = linearize(&point, 0.0, progress)?;
    let steps = options.steps * if current.is_of_few() { CHEAP } else { 1 };
    let mut history = vec![current.cost];
    // a curvature of few experiments promises too much in directions that these hardly move
    let mut damping: f64 = if current.is_of_few() { 1e-2 } else { 1e-4 };
    let mut growth = 2.0;
    let mut status = Status::Limit;
    // What rounding leaves of the outputs' squares.
    let outputs = record.experiments().iter().flat_map(|e| e.output.column_iter().enumerate());
    let squares =
        outputs.map(|(o, column)| options.weighting.outputs[o].powi(2) * column.norm_squared());
    let exact = 1e-25 * squares.sum::<f64>();
    for step in 1..=steps {
        let done = step as f64 / steps as f64;
        let layout = &current.layout;
        let bounds = point.bounds(layout, record, options.freedom);
        let mut gram = current.equations.gram.clone();
        let is_damped = |i: &usize| current.is_of_few() || !layout.is_linear(*i);
        for i in (0..layout.len).filter(is_damped) {
            gram[(i, i)] *= 1.0 + damping;
        }
        let change = bounded(&gram, &current.descent(), &bounds.lower, &bounds.upper);
        let predicted = current.predicted(&change);
        // Also where the bounds leave nothing to go, or all is explained to the last digit.
        if predicted <= 1e-3 * options.gain * current.cost || current.cost <= exact {
            status = Status::Converged;
            break;
        }
        if current.is_of_few() && predicted > current.cost {
            // no step takes more than there is: the curvature of few experiments lacks a direction
            damping = (growth * damping).max(1e-9);
            growth *= 2.0;
            continue;
        }
        let trial = point.moved(&change, layout);
        // a step that leads nowhere need not be linearized
        report(progress, stage, done)?;
        let cost = options.weighting.cost(&trial.residuals(record)?, record);
        if cost < current.cost {
            let mut check = || report(progress, stage, done);
            let linearization = current.moved(&change, &trial, record, options, &mut check)?;
            let gained = current.cost - linearization.cost;
            let small =
                gained < options.gain * current.cost && predicted < options.gain * current.cost;
            (point, current) = (trial, linearization);
            history.push(current.cost);
            // Nielsen's rule: as far as the prediction was right, less damping.
            let ratio = gained / predicted;
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(0.1)).max(1e-15);
            growth = 2.0;
            if small {
                status = Status::Converged;
                break;
            }
        } else if current.is_old() && growth > PATIENCE {
            current = linearize(&point, done, progress)?;
            growth = 2.0;
        } else if damping > LARGEST_DAMPING {
            status = Status::Stalled;
            break;
        } else {
            damping = (growth * damping).max(1e-9);
            growth *= 2.0;
        }
    }
    Ok(Fitted { point, linearization: current, history, status })
}
