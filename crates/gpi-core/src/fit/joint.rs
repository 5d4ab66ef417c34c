//! The joint fit of all parts of a point.
//!
//! It minimises `sum_k,o s_o^2 e_o(k)^2`, e the residual of the free run. The factors s bring the outputs to one scale:
//! they are the inverse of the first residual's robust standard deviation, of geometric mean one. Two kinds of fits
//! follow where they are needed:
//!
//! - A play of weight zero has no gradient with respect to its unknown initial state. Such plays are placed elsewhere
//!   between z - r and z + r, and the fit is repeated as long as it becomes better.
//! - Where isolated outliers are found, the squares become Huber's loss, which is linear beyond `t = 1.345 sigma`, with
//!   sigma the robust standard deviation of the previous residual (P. J. Huber, Robust Statistics, 1981).

use crate::chain::point::{DynamicsFreedom, Freedom, Point};
use crate::chain::sensitivity::Derivatives;
use crate::chain::table::Table;
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::Prepared;
use crate::fit::refinement::RefineOptions;
use crate::fit::representatives::representatives;
use crate::fit::settings::JointSettings;
use crate::optimize::Loss;
use crate::progress::Progress;
use crate::uncertainty::outliers;
use crate::{Error, Matrix};

/// A refined point, before its uncertainty is computed.
#[derive(Clone)]
pub(crate) struct Refined {
    pub fitted: Fitted,
    pub options: FitOptions,
    pub outliers: usize,
    pub robust: bool,
}

/// Everything free that `options` and the unknown initial states ask for, at most so many steps.
pub(crate) fn fit_options(
    prepared: &Prepared,
    options: &RefineOptions,
    steps: usize,
) -> FitOptions {
    let JointSettings { gain, least_gain, largest_gain, .. } = prepared.settings.joint;
    let is_unknown = prepared.has_unknown_state.contains(&true);
    let derivatives = Derivatives {
        thresholds: options.thresholds,
        half_widths: options.half_widths,
        starts: is_unknown,
    };
    let dynamics = DynamicsFreedom::Everything;
    FitOptions {
        freedom: Freedom {
            weights: true,
            offsets: true,
            derivatives,
            states: is_unknown,
            identity: true,
            dynamics,
        },
        loss: Loss::squares(prepared.means.len()),
        steps,
        gain: (gain / prepared.values()).clamp(least_gain, largest_gain),
        goal: 0.0,
    }
}

/// Refines all parts of a point at once.
///
/// `hopeless` is a cost: a fit that has not come below it after a few steps is left there. A `quick` one
/// takes few steps, for a model that is refined again when more is known.
pub(crate) fn joint(
    point: Point,
    prepared: &Prepared,
    options: &RefineOptions,
    hopeless: f64,
    quick: bool,
    progress: Progress,
) -> Result<Refined, Error> {
    let own = &prepared.settings.joint;
    let record = &prepared.record;
    let mut point = point;
    for offsets in &mut point.offsets {
        let first = offsets.row(0).into_owned();
        *offsets = Matrix::from_fn(options.offset_knots.max(1), first.len(), |_, o| first[o]);
    }
    let mut fit_options = fit_options(prepared, options, own.most_steps);
    let needed = Table::new(&point, fit_options.freedom).len;
    let products = prepared.values() * (needed * needed) as f64;
    fit_options.steps =
        ((own.products / products) as usize).clamp(own.fewest_steps, own.most_steps);
    if quick {
        fit_options.steps = fit_options.steps.min(own.quick_steps);
        if representatives(&point, record, needed).is_some() {
            fit_options.gain = own.quick_gain;
        }
    }
    if record.scored() * record.outputs().len() < needed {
        let purpose = "all parameters of the refinement".to_owned();
        return Err(Error::TooFewSamples { samples: record.scored(), needed, purpose });
    }
    if prepared.means.len() > 1 {
        let deviations = outliers::deviations(&point.residuals(record)?, record);
        fit_options.loss.scales = balance(&deviations);
    }
    let mut history = Vec::new();
    if hopeless.is_finite() {
        let first = FitOptions { steps: own.first_steps, ..fit_options.clone() };
        let fitted = fit(point, record, &first, "grids", progress)?;
        if fitted.linearization.cost > hopeless {
            return Ok(Refined { fitted, options: fit_options, outliers: 0, robust: false });
        }
        (point, history) = (fitted.point, fitted.history);
    }
    let mut fitted = fit(point, record, &fit_options, "refinement", progress)?.after(&history);
    let revives = !quick || products * (fit_options.steps as f64) < own.quick_products;
    for _ in 0..if revives { own.revivals } else { 0 } {
        let Some(better) = revived(&fitted, prepared, &fit_options, progress)? else { break };
        fitted = better;
    }
    let residuals = fitted.point.residuals(record)?;
    let outliers = outliers::count(&residuals, record);
    drop(residuals);
    let robust = options.robust.unwrap_or(outliers >= own.outliers);
    if robust {
        for _ in 0..own.passes {
            let deviations = outliers::deviations(&fitted.point.residuals(record)?, record);
            fit_options.loss.turns =
                deviations.iter().map(|deviation| own.turn * deviation).collect();
            let again = fit(fitted.point, record, &fit_options, "refinement", progress)?;
            fitted = again.after(&fitted.history);
        }
    }
    Ok(Refined { fitted, options: fit_options, outliers, robust })
}

/// A better fit, if there is one, with the plays of weight zero placed elsewhere between z - r and z + r.
fn revived(
    fitted: &Fitted,
    prepared: &Prepared,
    fit_options: &FitOptions,
    progress: Progress,
) -> Result<Option<Fitted>, Error> {
    if !fit_options.freedom.derivatives.starts {
        return Ok(None);
    }
    let limits = prepared.spans(&fitted.point).iter().map(|span| 0.5 * span).collect::<Vec<_>>();
    let limits = fit_options.freedom.derivatives.half_widths.then_some(&limits[..]);
    let mut sides = [-0.6, 0.2, -0.2, 0.6];
    for _ in 0..sides.len() {
        sides.rotate_left(1);
        let mut point = fitted.point.clone();
        let idle = point.put_idle_plays(&sides, limits);
        if idle == 0 {
            return Ok(None);
        }
        let again = fit(point, &prepared.record, fit_options, "refinement", progress)?;
        if again.linearization.cost
            < (1.0 - prepared.settings.joint.worth) * fitted.linearization.cost
        {
            return Ok(Some(again.after(&fitted.history)));
        }
    }
    Ok(None)
}

/// Factors that bring outputs to one scale, of geometric mean one.
pub(crate) fn balance(deviations: &[f64]) -> Vec<f64> {
    if deviations.iter().any(|&deviation| deviation <= 0.0) {
        return vec![1.0; deviations.len()];
    }
    let mean = deviations.iter().map(|d| d.ln()).sum::<f64>() / deviations.len() as f64;
    deviations.iter().map(|deviation| mean.exp() / deviation).collect()
}
