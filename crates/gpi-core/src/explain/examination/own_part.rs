//! A Wald test of the part of an effect that nothing else in the model can do.
//!
//! Let c be what the effect adds to the output and M the projection off the sensitivities by all other parameters of
//! the model. Where the effect is absent, M c is what the noise makes of the effect's q parameters, and
//!
//! ```text
//! W = |M c|^2 / (s^2 kappa)
//! ```
//!
//! is chi-square with q degrees of freedom: s^2 is the residual's variance, and
//! `kappa = 1 + 2 sum_k r_k` counts its autocorrelation r, up to the first lag at which it is negligible. Standard
//! deviations of single parameters do not show this: those of knots and of lags with poles that are free too are large
//! although all of them together are certain.

use super::contribution::contribution;
use crate::chain::free_run::Signals;
use crate::chain::group::Group;
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::effects::Stage;
use crate::explain::base::Base;
use crate::explain::policy::ExaminationPolicy;
use crate::explain::residual::significance::{chi_square_tail, exceeded_with};
use crate::explain::state::SearchState;
use crate::fit::representatives::representatives;
use crate::{Error, Experiment, Matrix, Record};

/// Whether W is beyond chance for the effect at a place of a point with these training squares.
pub(super) fn is_beyond_chance(
    state: &SearchState,
    point: &Point,
    place: usize,
    cost: f64,
) -> Result<bool, Error> {
    let policy = &state.setup.policy.examination;
    let is_in_plays = point.effects[place].stage() == Stage::Plays;
    let setup = state.setup;
    let options = if is_in_plays { &setup.moving_grids } else { &setup.options };
    let record = &state.prepared.record;
    let table = Table::new(point, options.freedom);
    let own: usize =
        table.rows().filter(|(group, _)| is_of(*group, place)).map(|(_, row)| row.len()).sum();
    let variance = cost / state.prepared.values();
    let errors = options.loss.all_errors(&point.residuals(record)?);
    let kappa = autocorrelation(&errors, record, &options.loss.scales, policy);
    let few = representatives(point, record, table.len);
    let alone = few.map(|few| few.alone(point, record)).transpose()?;
    let (point, record) = alone.as_ref().map_or((point, record), |(p, r)| (p, r));
    let others = |group| !is_of(group, place);
    let base = Base::of(point, record, options.freedom, &options.loss, others)?;
    let without = point.without_effect(place);
    let columns = |known: &Signals, _: &Matrix, experiment: &Experiment, index: usize| {
        Ok(vec![contribution(point, &without, known, experiment, index)?.0])
    };
    let left = base.project(&[1], &columns)?.left[(0, 0)];
    let least = exceeded_with(policy.chance, |value| chi_square_tail(value, own.max(1) as f64));
    Ok(left > least * variance * kappa)
}

/// Whether a group of parameters is the effect's own.
fn is_of(group: Group, place: usize) -> bool {
    match group {
        Group::Effect { place: own }
        | Group::ParallelDenominator { place: own, .. }
        | Group::ParallelNumerator { place: own, .. } => own == place,
        _ => false,
    }
}

/// kappa of the residuals, their outputs weighted as in the fit.
fn autocorrelation(
    residuals: &[Matrix],
    record: &Record,
    weights: &[f64],
    policy: &ExaminationPolicy,
) -> f64 {
    let covariance = |lag: usize| -> f64 {
        let of = |(residual, experiment): (&Matrix, &Experiment)| -> f64 {
            let run = |rows: nalgebra::DMatrixView<f64>| -> f64 {
                let columns = rows.column_iter().zip(weights);
                let products = columns.map(|(column, weight)| {
                    let later = column.iter().skip(lag);
                    weight * weight * later.zip(column.iter()).map(|(a, b)| a * b).sum::<f64>()
                });
                products.sum()
            };
            experiment.scored_rows(residual).map(run).sum()
        };
        residuals.iter().zip(record.experiments()).map(of).sum()
    };
    let variance = covariance(0).max(f64::MIN_POSITIVE);
    let longest = record.scored() / policy.parts;
    let correlations = (1..longest).map(|lag| covariance(lag) / variance);
    1.0 + 2.0 * correlations.take_while(|r| *r > policy.negligible).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;

    #[test]
    fn slow_noise_counts_as_fewer_samples() {
        // e(k) = a e(k-1) + w(k) has kappa = (1 + a) / (1 - a), less what is below the negligible correlation
        let mut seed = 7_u64;
        let mut white = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut last = 0.0;
        let residual = Matrix::from_fn(100_000, 1, |_, _| {
            last = 0.8 * last + white();
            last
        });
        let channel = || vec![Channel::new("a", "")];
        let (input, covariates) = (residual.clone(), Matrix::zeros(100_000, 0));
        let run =
            Experiment { input, output: residual.clone(), covariates, warmup: 0, held_out: vec![] };
        let record = Record::new(vec![run], 1.0, channel(), channel(), vec![]).unwrap();
        let kappa = autocorrelation(&[residual], &record, &[2.0], &ExaminationPolicy::default());
        assert!((kappa - 9.0).abs() < 0.9, "{kappa}");
    }
}
