//! A point fitted to a record.

use super::problem::Estimation;
use crate::chain::point::{Freedom, Point};
use crate::chain::table::Table;
use crate::optimize::{
    LeastSquares, Linearization, Loss, Minimum, SolverSettings, Status, levenberg_marquardt,
};
use crate::progress::{Progress, report};
use crate::{Error, Record};

/// Where a fit ended and how it got there.
#[derive(Clone)]
pub(crate) struct Fitted {
    pub point: Point,
    pub linearization: Linearization,
    /// The unknowns of the linearization.
    pub table: Table,
    /// The cost at the start and after every accepted step.
    pub history: Vec<f64>,
    pub status: Status,
}

/// What is free, how residuals count, and when to stop.
#[derive(Clone, Debug)]
pub(crate) struct FitOptions {
    pub freedom: Freedom,
    pub loss: Loss,
    /// The largest number of steps, accepted or not.
    pub steps: usize,
    /// A step that is predicted and found to gain less than this fraction of the cost is the last.
    pub gain: f64,
    /// The cost above which nobody asks for the fit, zero where any is of use.
    pub goal: f64,
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

    /// The same fit at another point of the same cost.
    pub(crate) fn at(
        &self,
        point: Point,
        record: &Record,
        options: &FitOptions,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let problem = Estimation::new(&point, record, options.freedom, &options.loss);
        let linearization = problem.linearize(&point, check)?;
        let (table, history) = (problem.table, self.history.clone());
        Ok(Self { point, linearization, table, history, status: self.status })
    }
}

/// Minimises the cost over everything that is free. `phase` is what the progress calls it.
pub(crate) fn fit(
    point: Point,
    record: &Record,
    options: &FitOptions,
    phase: &str,
    progress: Progress,
) -> Result<Fitted, Error> {
    let problem =
        Estimation::new(&point, record, options.freedom, &options.loss).for_solver(&point);
    let FitOptions { steps, gain, goal, .. } = *options;
    let settings = SolverSettings { steps, gain, goal, ..SolverSettings::default() };
    let mut check = |done: f64| report(progress, phase, done);
    let Minimum { point, mut linearization, history, status } =
        levenberg_marquardt(&problem, point, &settings, &mut check)?;
    if linearization.cost.is_nan() {
        // see `Loss::cost`
        linearization.cost = f64::INFINITY;
    }
    let table = problem.table.undo_delta_form(&mut linearization);
    Ok(Fitted { point, linearization, table, history, status })
}
