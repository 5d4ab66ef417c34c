//! The refinement of a model on a record, as users call it.
//!
//! The unknowns theta of all parts are estimated at once from the simulation (output) error,
//! `min sum_k |W (y(k) - y_hat(k; theta))|^2`, by Levenberg and Marquardt's method with exact sensitivities
//! (L. Ljung, System Identification, 1999, sections 3.4 and 10.2). Products of gains along the chain would not be
//! identifiable, so each has one home: G keeps its DC gain, the identity's weight in the envelope is held, and the
//! widest half-width fixes the scale of z. The steps have files of their own: prepare the record
//! (`preparation`), fit (`joint`), simplify and report (`finish`).

use crate::chain::hysteresis::Parameters;
use crate::fit::initial_state::settled_anew;
use crate::fit::joint::joint;
use crate::fit::preparation::{Prepared, require_match};
use crate::fit::refinement::{RefineOptions, Refinement};
use crate::progress::{Overall, Progress, ProgressSettings, Report};
use crate::{Error, Model, Record};

/// Refines a model on a record: Levenberg-Marquardt on the simulation error, with respect to all
/// weights, the poles and zeros of G, the offset, and the initial state of experiments where it is unknown.
///
/// `min sum_k |y(k) - y_hat(k)|^2`, y_hat the free run from the input alone. The scale is fixed by
/// construction: G keeps its DC gain (plus or minus one), the half-widths fix the scale of z. Weights of
/// plays stay non-negative, poles inside the unit circle. Outputs count by the inverse of their
/// residual's root mean square. Sensitivities are streamed: memory does not grow with samples times
/// parameters.
///
/// ```
/// use gpi_core::identify::{RefineOptions, refine};
/// use gpi_core::linear::StateSpace;
/// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
/// use gpi_core::{Channel, Experiment, Matrix, Model, Record};
/// let model = |weight: f64, pole: f64| {
///     let scalar = |value| Matrix::from_element(1, 1, value);
///     let linear = StateSpace::new(scalar(pole), scalar(1.0 - pole), scalar(1.0), scalar(0.0))?;
///     let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
///     let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0, 1.0], vec![1.0, weight])?);
///     let channel = |name| vec![Channel::new(name, "")];
///     Model::new(1.0, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])
/// };
/// let input = Matrix::from_fn(2000, 1, |k, _| 4.0 * (0.01 * k as f64).sin() * (0.07 * k as f64).cos());
/// let output = model(0.5, 0.6)?.simulate(&input)?;
/// let run = Experiment { input, output, covariates: Matrix::zeros(2000, 0), warmup: 500, held_out: vec![] };
/// let record = Record::new(vec![run], 1.0, vec![Channel::new("u", "")], vec![Channel::new("y", "")], vec![])?;
/// let (refined, how) = refine(&model(0.7, 0.5)?, &record, &RefineOptions::default(), &mut |_| true)?;
/// assert!((refined.hysteresis()[0].plays().weights()[1] - 0.5).abs() < 1e-6);
/// assert!((how.history.last().unwrap() / how.history[0]) < 1e-6);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// Channels or rates that differ, an unstable model, fewer samples than parameters,
/// [`Error::Interrupted`] when `progress` returned false.
pub fn refine(
    model: &Model,
    record: &Record,
    options: &RefineOptions,
    progress: Progress,
) -> Result<(Model, Refinement), Error> {
    require_match(model, record)?;
    record.require_moving()?;
    let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
    let prepared = Prepared::new(record, channels)?;
    let point = prepared.point_of(model)?;
    if !point.dynamics.is_stable() {
        return Err(Error::Unstable {
            modulus: model.linear().spectral_radius()?,
            remedy: "a refinement starts from a stable model",
        });
    }
    let mut overall = Overall::new(progress, 1.0, 1.0, ProgressSettings::usual()?.last);
    let mut progress = |report: &Report| overall.take(report);
    // the model's parameters would follow what a wrong initial state leaves
    let point = settled_anew(point, &prepared, &mut progress)?;
    let refined = joint(point, &prepared, options, f64::INFINITY, false, &mut progress)?;
    let refinement = refined.finish(&prepared, &mut progress)?;
    overall.finish();
    let model = refinement.bands.point.to_model(record, &prepared.record, &prepared.means)?;
    let estimates = refinement.estimates(&model)?;
    Ok((model.with_estimates(estimates), refinement))
}
