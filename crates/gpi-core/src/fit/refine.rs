//! Joint refinement of all parts of a model.

use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Freedom, Point};
use crate::chain::sensitivity::Derivatives;
use crate::chain::table::Table;
use crate::fit::certainty;
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::Prepared;
use crate::fit::representatives::representatives;
use crate::fit::sensitivities::names_and_values;
use crate::optimize::Loss;
use crate::optimize::Status;
use crate::progress::{Progress, report};
use crate::uncertainty::Bands;
use crate::uncertainty::covariance::Uncertainty;
use crate::uncertainty::noise_floor::NoiseFloor;
use crate::uncertainty::outliers;
use crate::{Error, Matrix, Model, Record};

/// What a refinement may move besides weights, deadzone weights, dynamics and offset, and how residuals
/// count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefineOptions {
    /// Whether the thresholds of the deadzones move; they stay on their side of zero.
    pub thresholds: bool,
    /// Whether the half-widths of the plays move; the widest one stays and sets the scale of z.
    pub half_widths: bool,
    /// Huber's loss instead of squares; decided by whether isolated outliers are found when `None`.
    pub robust: Option<bool>,
    /// Knots of a slowly varying offset of each experiment, linear between them; at most 1 is a
    /// constant. It is estimated so that it does not disturb the rest; the model keeps its mean.
    pub offset_knots: usize,
}

/// An estimated number.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Such as `u.weights[3]`: numbered as in the model.
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// Its standard deviation; 0 for a weight that is held at zero by its bound, NaN where the data do
    /// not determine it.
    pub deviation: f64,
}

/// How a model was refined, and how sure its parameters are.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// How it ended.
    pub status: Status,
    /// Root mean square residual at the start and after every step that was accepted.
    pub history: Vec<f64>,
    /// All that was estimated, with standard deviations from the residual's own colour.
    pub parameters: Vec<Parameter>,
    /// Covariance of these parameters.
    pub covariance: Matrix,
    /// Combinations of parameters that the data do not determine: names and shares, largest first.
    pub undetermined: Vec<Vec<(String, f64)>>,
    /// Root mean square residual of each output on the training data.
    pub residual_rms: Vec<f64>,
    /// Measured minus simulated outputs of each experiment, (samples, outputs), with the starts that
    /// were fitted; warm-ups included.
    pub residuals: Vec<Matrix>,
    /// The noise of each output, and what it was estimated from.
    pub noise_floor: NoiseFloor,
    /// Isolated outliers in the residual.
    pub outliers: usize,
    /// Whether Huber's loss was used.
    pub robust: bool,
    /// Standard deviations of whatever follows from the parameters.
    pub bands: Bands,
}

/// A refined point, before its uncertainty is worked out.
#[derive(Clone)]
pub(crate) struct Refined {
    pub fitted: Fitted,
    pub options: FitOptions,
    pub outliers: usize,
    pub robust: bool,
}

/// Refines a model on a record: Levenberg-Marquardt on the simulation error, with respect to all
/// weights, the poles and zeros of G, the offset, and the start of experiments whose past is unknown.
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
/// let (refined, how) = refine(&model(0.7, 0.5)?, &record, &RefineOptions::default(), &mut |_, _| true)?;
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
    let refined = joint(point, &prepared, options, f64::INFINITY, false, progress)?;
    let refinement = refined.finish(&prepared, progress)?;
    Ok((refinement.bands.point.to_model(record, &prepared.record, &prepared.means)?, refinement))
}

pub(crate) fn require_match(model: &Model, record: &Record) -> Result<(), Error> {
    let inputs = (("model", model.inputs().len()), ("record", record.inputs().len()));
    let outputs = (("model", model.outputs().len()), ("record", record.outputs().len()));
    Error::require_equal("inputs", inputs.0, inputs.1)?;
    Error::require_equal("outputs", outputs.0, outputs.1)?;
    if (model.rate() / record.rate() - 1.0).abs() > 1e-6 {
        let requirement = format!("the model runs at {} Hz; resample the record", model.rate());
        return Err(Error::parameter("rate", record.rate(), requirement));
    }
    Ok(())
}

/// Everything free that `options` and the record's past ask for, at most so many steps.
pub(crate) fn settings(prepared: &Prepared, options: &RefineOptions, steps: usize) -> FitOptions {
    let derivatives = Derivatives {
        thresholds: options.thresholds,
        half_widths: options.half_widths,
        starts: prepared.moving.contains(&true),
    };
    let dynamics = DynamicsFreedom::Everything;
    FitOptions {
        freedom: Freedom { weights: true, derivatives, identity: true, dynamics },
        loss: Loss::squares(prepared.means.len()),
        steps,
        // a tenth of what one more parameter of no use gains by chance
        gain: (0.1 / prepared.values()).clamp(1e-9, 1e-4),
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
    /// Steps in which a fit has to show that it is worth more.
    const FIRST_STEPS: usize = 15;
    /// Steps, accepted or not; fewer where one takes long, so that all take about a minute at most.
    const STEPS: std::ops::RangeInclusive<usize> = 40..=300;
    const PRODUCTS: f64 = 4e11;
    const QUICK: usize = 40;
    /// Where each step takes long.
    const QUICK_GAIN: f64 = 1e-3;
    /// Passes of Huber's loss, each with the scale that the one before found.
    const PASSES: usize = 3;
    let record = &prepared.record;
    let mut point = point;
    for offsets in &mut point.offsets {
        let first = offsets.row(0).into_owned();
        *offsets = Matrix::from_fn(options.offset_knots.max(1), first.len(), |_, o| first[o]);
    }
    let mut settings = settings(prepared, options, *STEPS.end());
    let needed = Table::new(&point, settings.freedom).len;
    let products = prepared.values() * (needed * needed) as f64;
    settings.steps = ((PRODUCTS / products) as usize).clamp(*STEPS.start(), *STEPS.end());
    if quick {
        settings.steps = settings.steps.min(QUICK);
        if representatives(&point, record, needed).is_some() {
            settings.gain = QUICK_GAIN;
        }
    }
    if record.scored() * record.outputs().len() < needed {
        let purpose = "all parameters of the refinement".to_owned();
        return Err(Error::TooFewSamples { samples: record.scored(), needed, purpose });
    }
    if prepared.means.len() > 1 {
        let deviations = outliers::deviations(&point.residuals(record)?, record);
        settings.loss.scales = balance(&deviations);
    }
    let mut history = Vec::new();
    if hopeless.is_finite() {
        let first = FitOptions { steps: FIRST_STEPS, ..settings.clone() };
        let fitted = fit(point, record, &first, "structure", progress)?;
        if fitted.linearization.cost > hopeless {
            return Ok(Refined { fitted, options: settings, outliers: 0, robust: false });
        }
        (point, history) = (fitted.point, fitted.history);
    }
    let mut fitted = fit(point, record, &settings, "refinement", progress)?.after(&history);
    /// Products of a quick fit beyond which idle plays are not tried elsewhere.
    const QUICK_PRODUCTS: f64 = 1e10;
    let revives = !quick || products * (settings.steps as f64) < QUICK_PRODUCTS;
    while revives && let Some(better) = revived(&fitted, prepared, &settings, progress)? {
        fitted = better;
    }
    /// One or two samples that stand apart do not pull a fit.
    const FEWEST: usize = 3;
    let residuals = fitted.point.residuals(record)?;
    let outliers = outliers::count(&residuals, record);
    drop(residuals);
    let robust = options.robust.unwrap_or(outliers >= FEWEST);
    if robust {
        for _ in 0..PASSES {
            // 95 % of the efficiency of least squares on Gaussian noise
            const TURN: f64 = 1.345;
            let deviations = outliers::deviations(&fitted.point.residuals(record)?, record);
            settings.loss.turns = deviations.iter().map(|deviation| TURN * deviation).collect();
            let again = fit(fitted.point, record, &settings, "refinement", progress)?;
            fitted = again.after(&fitted.history);
        }
    }
    Ok(Refined { fitted, options: settings, outliers, robust })
}

/// A better fit, if there is one, with the plays that fell out put elsewhere beside z: a play without
/// weight has no gradient by its unknown start, and from a wrong start it is of no use.
fn revived(
    fitted: &Fitted,
    prepared: &Prepared,
    settings: &FitOptions,
    progress: Progress,
) -> Result<Option<Fitted>, Error> {
    /// Part of the cost that a revived play must take to be worth another round.
    const WORTH: f64 = 1e-3;
    if !settings.freedom.derivatives.starts {
        return Ok(None);
    }
    let limits = prepared.spans(&fitted.point).iter().map(|span| 0.5 * span).collect::<Vec<_>>();
    let limits = settings.freedom.derivatives.half_widths.then_some(&limits[..]);
    let mut sides = [-0.6, 0.2, -0.2, 0.6];
    for _ in 0..sides.len() {
        sides.rotate_left(1);
        let mut point = fitted.point.clone();
        let idle = point.put_idle_plays(&sides, limits);
        if idle == 0 {
            return Ok(None);
        }
        let again = fit(point, &prepared.record, settings, "refinement", progress)?;
        if again.linearization.cost < (1.0 - WORTH) * fitted.linearization.cost {
            return Ok(Some(again.after(&fitted.history)));
        }
    }
    Ok(None)
}

/// Factors that bring outputs to one scale, of geometric mean one.
fn balance(deviations: &[f64]) -> Vec<f64> {
    if deviations.iter().any(|&deviation| deviation <= 0.0) {
        return vec![1.0; deviations.len()];
    }
    let mean = deviations.iter().map(|d| d.ln()).sum::<f64>() / deviations.len() as f64;
    deviations.iter().map(|deviation| mean.exp() / deviation).collect()
}

impl Refined {
    /// The information criterion's ingredients: the covariance.
    pub(crate) fn uncertainty(
        &self,
        record: &Record,
        progress: Progress,
    ) -> Result<Uncertainty, Error> {
        let residuals = self.fitted.point.residuals(record)?;
        let mut check = || report(progress, "uncertainty", 0.0);
        certainty::uncertainty(&self.fitted, record, &self.options, residuals, &mut check)
    }

    /// Drops plays and deadzones without weight and fits once more.
    fn drop_unused(&mut self, prepared: &Prepared, progress: Progress) -> Result<(), Error> {
        const STEPS: usize = 20;
        if self.fitted.point.drop_unused() {
            let start = self.fitted.point.clone();
            let options = FitOptions { steps: STEPS, ..self.options.clone() };
            let again = fit(start, &prepared.record, &options, "refinement", progress)?;
            self.fitted = again.after(&self.fitted.history);
        }
        Ok(())
    }

    /// Drops deadzones that another one or the identity replaces, as long as the fit stays as good.
    pub(crate) fn drop_undetermined(
        &mut self,
        prepared: &Prepared,
        progress: Progress,
    ) -> Result<(), Error> {
        const PASSES: usize = 5;
        /// By how much the cost may rise, in units of the residual's variance.
        const LOSS: f64 = 5.0;
        self.drop_unused(prepared, progress)?;
        for _ in 0..PASSES {
            let open = self.uncertainty(&prepared.record, progress)?.open;
            let mut simpler = self.clone();
            let table = &self.fitted.table;
            if !simpler.fitted.point.silence_deadzones(table, &open) {
                break;
            }
            simpler.drop_unused(prepared, progress)?;
            let allowed = 1.0 + LOSS / prepared.values();
            if simpler.fitted.linearization.cost > allowed * self.fitted.linearization.cost {
                break;
            }
            *self = simpler;
        }
        Ok(())
    }

    /// Drops plays and deadzones without weight, and works out how sure the rest is.
    pub(crate) fn finish(
        mut self,
        prepared: &Prepared,
        progress: Progress,
    ) -> Result<Refinement, Error> {
        let record = &prepared.record;
        let values = prepared.values();
        let status = self.fitted.status;
        self.bridge(prepared, progress)?;
        self.drop_unused(prepared, progress)?;
        let uncertainty = self.uncertainty(record, progress)?;
        let Fitted { point, table, history, .. } = self.fitted;
        let residuals = point.residuals(record)?;
        let estimated = point.bounds(&table, record, self.options.freedom).estimated();
        let (names, values_of) = names_and_values(&point, &table, prepared);
        let deviations = uncertainty.deviations();
        let parameter = |&i: &usize| Parameter {
            name: names[i].clone(),
            value: values_of[i],
            deviation: deviations[i],
        };
        let covariance = Matrix::from_fn(estimated.len(), estimated.len(), |i, j| {
            uncertainty.covariance[(estimated[i], estimated[j])]
        });
        let mut squares = vec![0.0; prepared.means.len()];
        for (residual, experiment) in residuals.iter().zip(record.experiments()) {
            for scored in experiment.scored_rows(residual) {
                for (sum, column) in squares.iter_mut().zip(scored.column_iter()) {
                    *sum += column.norm_squared();
                }
            }
        }
        let rms = |sum: f64| (sum / record.scored() as f64).sqrt();
        Ok(Refinement {
            status,
            history: history.iter().map(|cost| (cost / values).sqrt()).collect(),
            parameters: estimated.iter().map(parameter).collect(),
            covariance,
            undetermined: uncertainty.undetermined(&names),
            residual_rms: squares.into_iter().map(rms).collect(),
            noise_floor: NoiseFloor::estimate(record, &residuals),
            residuals,
            outliers: self.outliers,
            robust: self.robust,
            bands: Bands { point, table, uncertainty },
        })
    }
}
