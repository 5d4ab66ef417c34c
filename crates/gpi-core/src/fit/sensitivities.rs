//! The derivatives that a refinement uses, for experiment design, other optimizers and checks.

use crate::chain::group::Group;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::Point;
use crate::chain::stream::Stream;
use crate::chain::table::Table;
use crate::fit::joint::fit_options;
use crate::fit::preparation::{Prepared, require_match};
use crate::fit::problem::Estimation;
use crate::fit::refinement::RefineOptions;
use crate::optimize::{LeastSquares, Loss};
use crate::progress::{Progress, report};
use crate::{Error, Matrix, Model, Record};
use nalgebra::DVector;

/// Derivatives of a model's simulated output with respect to everything that a refinement moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivities {
    /// What each column is the derivative by, as in [`Parameter`](crate::identify::Parameter).
    pub names: Vec<String>,
    /// The values at which the derivatives were taken.
    pub values: Vec<f64>,
    /// For each experiment and output, (scored samples, parameters).
    pub jacobians: Vec<Vec<Matrix>>,
    /// Half the gradient of the sum of squared residuals.
    pub gradient: DVector<f64>,
    /// Half its Hessian in the Gauss-Newton approximation: `J^T J`.
    pub hessian: Matrix,
    /// Sum of squared residuals.
    pub cost: f64,
}

/// Derivatives of the simulated output of `model` on a record by its parameters; `J` is built in full,
/// so for records that fit into memory as many times as there are parameters.
///
/// G is held to its DC gain: where `section[i]` or `feedthrough` change, the element of D that belongs to
/// the largest DC gain of the input makes up for it. If forces act inside the mechanics and all elements of D of an input are zero,
/// they stay zero, and the first weight of this input is held instead.
///
/// # Errors
/// As for [`refine`](crate::identify::refine).
pub fn sensitivities(
    model: &Model,
    record: &Record,
    options: &RefineOptions,
    progress: Progress,
) -> Result<Sensitivities, Error> {
    require_match(model, record)?;
    let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
    let prepared = Prepared::new(record, channels)?;
    let mut point = prepared.point_of(model)?;
    for offsets in &mut point.offsets {
        *offsets = Matrix::zeros(options.offset_knots.max(1), prepared.means.len());
        for (output, mut column) in offsets.column_iter_mut().enumerate() {
            column.fill(model.offsets()[output] - prepared.means[output]);
        }
    }
    let freedom = fit_options(&prepared, options, 1).freedom;
    let table = Table::new(&point, freedom);
    let kept = point.bounds(&table, &prepared.record, freedom).estimated();
    let mut jacobians = Vec::new();
    for (index, experiment) in prepared.record.experiments().iter().enumerate() {
        let samples = experiment.scored();
        let mut own = vec![Matrix::zeros(samples, kept.len()); prepared.means.len()];
        let mut first = 0;
        Stream::new(&point, &table, freedom.derivatives, experiment, index)?.run(&mut |rows| {
            report(progress, "sensitivities", 0.0)?;
            for (jacobian, regressor) in own.iter_mut().zip(rows.regressors) {
                for (column, &i) in kept.iter().enumerate() {
                    let values = regressor.row(i).transpose();
                    jacobian.view_mut((first, column), (values.len(), 1)).copy_from(&values);
                }
            }
            first += rows.residuals.ncols();
            Ok(())
        })?;
        jacobians.push(own);
    }
    let loss = Loss::squares(prepared.means.len());
    let mut check = || report(progress, "sensitivities", 1.0);
    let problem = Estimation::new(&point, &prepared.record, freedom, &loss);
    let found = problem.linearize(&point, &mut check)?;
    let (names, values) = names_and_values(&point, &table, &prepared);
    Ok(Sensitivities {
        names: kept.iter().map(|&i| names[i].clone()).collect(),
        values: kept.iter().map(|&i| values[i]).collect(),
        jacobians,
        gradient: DVector::from_fn(kept.len(), |i, _| -found.descent[kept[i]]),
        hessian: found.gram.select(&kept),
        cost: found.cost,
    })
}

/// Names and values of all unknowns, offsets with the means that were taken from the outputs.
pub(crate) fn names_and_values(
    point: &Point,
    table: &Table,
    prepared: &Prepared,
) -> (Vec<String>, Vec<f64>) {
    let mut values = table.values(point);
    for experiment in 0..point.offsets.len() {
        let unknowns = table.range(Group::Offsets { experiment });
        let knots = unknowns.len() / prepared.means.len();
        for (place, i) in unknowns.clone().enumerate() {
            values[i] += prepared.means[place / knots];
        }
    }
    (table.names(point, &prepared.record), values)
}
