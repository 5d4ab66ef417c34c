//! Gauss-Newton steps with Levenberg's and Marquardt's damping, within bounds.

use super::{LeastSquares, Linearization, SolverSettings};
use crate::linear::{Arrow, bounded};

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// No step is left that would lower the cost by more than its tolerance.
    Converged,
    /// Steps that should lower the cost do not, however short. The cost has a kink here, where a play begins to
    /// turn at another sample, or the remaining gain is smaller than rounding errors.
    Stalled,
    /// The largest number of steps was taken, or those that are left would not be enough.
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

/// Where a minimisation ended and how it got there.
#[derive(Clone, Debug)]
pub(crate) struct Minimum<P> {
    pub point: P,
    pub linearization: Linearization,
    /// The cost at the start and after every accepted step.
    pub history: Vec<f64>,
    pub status: Status,
}

/// Minimises the cost of a problem from a point on. `check` is called with the fraction of the steps that are
/// done; its error ends the work.
///
/// Each step minimises the quadratic model within the bounds, with the diagonal of the Gram matrix raised by the
/// damping for unknowns in which the residuals are not linear. An accepted step lowers the damping as far as the
/// prediction was right (H. B. Nielsen, 1999), a rejected one raises it faster and faster. Where the problem's
/// curvature is approximate, it is kept for several steps and updated from gradients. A minimisation with a goal ends where its last steps
/// foresee that the goal is out of reach.
pub(crate) fn levenberg_marquardt<L: LeastSquares>(
    problem: &L,
    start: L::Point,
    settings: &SolverSettings,
    check: &mut dyn FnMut(f64) -> Result<(), L::Error>,
) -> Result<Minimum<L::Point>, L::Error> {
    debug_assert_eq!(settings.flaw(), None);
    let mut point = start;
    let mut current = problem.linearize(&point, &mut || check(0.0))?;
    let approximate = current.is_approximate();
    let steps = settings.steps * if approximate { settings.approximate_steps } else { 1 };
    let mut history = vec![current.cost];
    let mut damping = if approximate { settings.approximate_damping } else { settings.damping };
    let mut growth = 2.0;
    let mut status = Status::Limit;
    let mut bounds = problem.bounds(&point);
    for number in 1..=steps {
        let done = number as f64 / steps as f64;
        let gram = damped(&current, problem, damping);
        let step = bounded(&gram, &current.descent, &bounds.lower, &bounds.upper);
        let predicted = current.predicted(&step);
        // also where the bounds leave no way to go, or all is explained to the last digit
        if predicted <= settings.negligible * settings.gain * current.cost
            || current.cost <= problem.rounding()
        {
            status = Status::Converged;
            break;
        }
        if current.is_approximate() && predicted > current.cost {
            // no step gains more than the cost: the approximate curvature lacks a direction
            damping = (growth * damping).max(settings.least_raised_damping);
            growth *= 2.0;
            continue;
        }
        let trial = problem.step(&point, &step);
        // a step that leads nowhere need not be linearized
        check(done)?;
        if problem.evaluate(&trial)? < current.cost {
            let is_kept = current.age.is_some_and(|age| age < settings.oldest);
            let next = if is_kept {
                let gradient = problem.gradient(&trial, &mut || check(done))?;
                current.updated(&step, gradient, settings.least_curvature)
            } else {
                problem.linearize(&trial, &mut || check(done))?
            };
            let gained = current.cost - next.cost;
            let least = settings.gain * current.cost;
            (point, current) = (trial, next);
            bounds = problem.bounds(&point);
            history.push(current.cost);
            let ratio = gained / predicted;
            let reduction = (1.0 - (2.0 * ratio - 1.0).powi(3)).max(settings.least_reduction);
            damping = (damping * reduction).max(settings.least_damping);
            growth = 2.0;
            if gained < least && predicted < least {
                status = Status::Converged;
                break;
            }
            if settings.is_out_of_reach(&history, steps - number) {
                break;
            }
        } else if current.is_old() && growth > settings.patience {
            current = problem.linearize(&point, &mut || check(done))?;
            growth = 2.0;
        } else if damping > settings.largest_damping {
            status = Status::Stalled;
            break;
        } else {
            damping = (growth * damping).max(settings.least_raised_damping);
            growth *= 2.0;
        }
    }
    Ok(Minimum { point, linearization: current, history, status })
}

/// The Gram matrix with damping: `damping diag(gram)` is added, but for unknowns in which the residuals are linear.
fn damped<L: LeastSquares>(current: &Linearization, problem: &L, damping: f64) -> Arrow {
    let mut gram = current.gram.clone();
    let is_damped = |i: &usize| current.is_approximate() || !problem.is_linear(*i);
    let mut diagonal = gram.diagonal();
    for i in (0..gram.len()).filter(is_damped) {
        diagonal[i] *= 1.0 + damping;
    }
    gram.set_diagonal(&diagonal);
    gram
}
