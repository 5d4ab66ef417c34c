//! The hysteresis fitted to a given intermediate signal v, without dynamics.
//!
//! `v = F(D(u)) + offset` is linear in the weights of the plays F, but a scale can move between F and D; the identity
//! in D has the weight 1, which fixes it. A play of half-width r does not depend on its initial state from the first
//! sample at which z has spanned 2 r, since its output has then touched z - r and z + r.

use crate::chain::bounds::range;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Freedom, Past, Point};
use crate::chain::sensitivity::Derivatives;
use crate::fit::Grid;
use crate::fit::minimize::{FitOptions, fit};
use crate::fit::settings::HysteresisSettings;
use crate::linear::Sections;
use crate::operators::Reading;
use crate::optimize::{Loss, Status};
use crate::progress::{Overall, Progress, Report};
use crate::{Channel, Error, Experiment, Hysteresis, Intersample, Matrix, Record};

/// A hysteresis fitted to an input and an intermediate signal.
#[derive(Clone, Debug, PartialEq)]
pub struct HysteresisFit {
    /// Envelope and plays; the identity's weight in the envelope is 1.
    pub hysteresis: Hysteresis,
    /// Constant that v carries on top.
    pub offset: f64,
    /// F(-1) of the fitted plays, in the order of their half-widths.
    pub start: Vec<f64>,
    /// Root mean square error, in the unit of v.
    pub rms: f64,
    /// Root mean square error before every accepted step, then at the end.
    pub history: Vec<f64>,
    /// How the fit ended.
    pub status: Status,
}

/// Fits envelope and plays, both at once, to an input u and an intermediate signal v.
///
/// `v(k) = sum_i p_i F_{r_i}[D[u]](k) + offset` with `D[u] = u + sum_j g_j Z_{eta_j}[u]` (one-sided
/// deadzones) and p_i >= 0: non-negative least squares for p inside Gauss-Newton for g and the plays'
/// start values. Half-widths placed by count spread over half the span of u.
///
/// ```
/// use gpi_core::identify::{Grid, fit_hysteresis};
/// use gpi_core::operators::{Operator, PlayBank};
/// let u: Vec<f64> = (0..2000).map(|k| 4.0 * (0.01 * k as f64).sin() * (1.0 - k as f64 / 4e3)).collect();
/// let bank = PlayBank::new(vec![0.0, 1.0, 2.0], vec![1.0, 0.5, 0.3])?;
/// let mut v = u.clone();
/// bank.in_place(&mut bank.rest(), &mut v);
/// let grid = Grid::Values(vec![0.0, 0.5, 1.0, 1.5, 2.0]);
/// let fit = fit_hysteresis(&u, &v, &grid, &Grid::Count(0), &mut |_| true)?;
/// assert!(fit.rms < 1e-6);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// Unequal lengths, samples that are not finite, a constant u, fewer samples than unknowns, grids out
/// of range.
pub fn fit_hysteresis(
    u: &[f64],
    v: &[f64],
    half_widths: &Grid,
    thresholds: &Grid,
    progress: Progress,
) -> Result<HysteresisFit, Error> {
    Error::require_equal("samples", ("u", u.len()), ("v", v.len()))?;
    let run = Experiment {
        input: Matrix::from_column_slice(u.len(), 1, u),
        output: Matrix::from_column_slice(v.len(), 1, v),
        covariates: Matrix::zeros(u.len(), 0),
        warmup: 0,
        held_out: vec![],
    };
    let channel = |name: &str| vec![Channel::new(name, "")];
    let record = Record::new(vec![run], 1.0, channel("u"), channel("v"), vec![])?;
    record.require_moving()?;
    let (low, high) = range(&record, 0);
    let mut parameters = Parameters::identity(
        Reading::OneSided,
        thresholds.thresholds((low, high))?,
        half_widths.half_widths(high - low)?,
    );
    let needed = 2 * (parameters.half_widths.len() + parameters.thresholds.len()) + 1;
    if u.len() < needed {
        let purpose = format!(
            "{} plays and {} deadzones",
            parameters.half_widths.len(),
            parameters.thresholds.len()
        );
        return Err(Error::TooFewSamples { samples: u.len(), needed, purpose });
    }
    let plays = Some(vec![vec![0.0; parameters.half_widths.len()]]);
    // The weights start at the scale of v over u, whatever the units.
    let experiment = &record.experiments()[0];
    let gain = (experiment.output.variance() / experiment.input.variance()).sqrt();
    parameters.weights[0] *= gain;
    let point = Point {
        channels: vec![parameters],
        dynamics: Sections::delayed_gain(&Matrix::from_element(1, 1, 1.0), 0),
        intersample: Intersample::default(),
        effects: Vec::new(),
        rate: 1.0,
        pasts: vec![Past { plays, has_unknown_state: true, ..Past::rest(0, 1) }],
        offsets: vec![Matrix::from_element(1, 1, experiment.output.mean())],
    };
    let freedom = Freedom {
        weights: true,
        offsets: true,
        derivatives: Derivatives { starts: true, ..Derivatives::default() },
        states: true,
        identity: false,
        dynamics: DynamicsFreedom::Nothing,
    };
    let settings = HysteresisSettings::default();
    settings.validate()?;
    let HysteresisSettings { steps, gain } = settings;
    let options = FitOptions { freedom, loss: Loss::squares(1), steps, gain, goal: 0.0 };
    let mut overall = Overall::new(progress, 1.0, 1.0, 1.0);
    let mut progress = |report: &Report| overall.take(report);
    let fitted = fit(point, &record, &options, "hysteresis", &mut progress)?;
    overall.finish();
    let channel = &fitted.point.channels[0];
    let z = channel.envelope(0.0, u[0]);
    let sides = fitted.point.pasts[0].plays.iter().flatten().flatten();
    let samples = u.len() as f64;
    let rms = |cost: f64| (cost / samples).sqrt();
    let plays = channel.half_widths.iter().zip(&channel.weights).zip(sides);
    Ok(HysteresisFit {
        hysteresis: channel.to_operator()?,
        offset: fitted.point.offsets[0][0],
        start: plays
            .filter(|((r, p), _)| **r == 0.0 || **p != 0.0)
            .map(|((r, _), side)| z + side * r)
            .collect(),
        rms: rms(fitted.linearization.cost),
        history: fitted.history.iter().map(|&cost| rms(cost)).collect(),
        status: fitted.status,
    })
}
