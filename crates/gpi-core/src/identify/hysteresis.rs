//! The hysteresis fitted behind given dynamics.

use super::linearization::{Freedom, Linearization, Point};
use super::sensitivity::{Derivatives, Parameters};
use super::{Grid, Progress, report};
use crate::linear::StateSpace;
use crate::{Channel, Error, Experiment, Hysteresis, Matrix, Record};

/// How a fit went: where it ended and how it got there.
pub(super) struct Fitted {
    pub point: Point,
    /// Sum of squares before every accepted step, then at the end.
    pub history: Vec<f64>,
    pub converged: bool,
}

/// Fits the weights (non-negative), slopes and whatever else is free to y, by Levenberg-Marquardt with
/// the weights solved for exactly at every point.
pub(super) fn fit(
    point: Point,
    linear: &StateSpace,
    record: &Record,
    freedom: Freedom,
    steps: usize,
    progress: Progress,
) -> Result<Fitted, Error> {
    /// An accepted step that gains less than this fraction of the cost is the last one.
    const GAIN: f64 = 1e-4;
    const LARGEST_DAMPING: f64 = 1e6;
    let ranges: Vec<_> = (0..record.inputs().len()).map(|input| range(record, input)).collect();
    let mut point = point;
    let mut linearize = |point: &Point, done: f64| {
        let mut check = || report(progress, "hysteresis", done);
        Linearization::new(point, linear, record, freedom, &mut check)
    };
    let mut current = linearize(&point, 0.0)?;
    let nonlinear =
        freedom.derivatives.starts || point.channels.iter().any(|c| !c.slopes.is_empty());
    let mut history = vec![current.cost];
    let mut damping = 1e-3;
    let mut converged = !nonlinear;
    for step in 0..steps {
        // Where not even a short step along the gradient helps, nothing is left to gain.
        converged |= damping > LARGEST_DAMPING;
        if converged {
            break;
        }
        let done = step as f64 / steps as f64;
        let trial = clamp_starts(current.step(&point, damping, &ranges), record);
        let linearization = linearize(&trial, done)?;
        if linearization.cost < current.cost {
            converged = linearization.cost > (1.0 - GAIN) * current.cost;
            (point, current) = (trial, linearization);
            history.push(current.cost);
            damping = (damping / 10.0_f64).max(1e-9);
        } else {
            damping *= 10.0;
        }
    }
    Ok(Fitted { point: current.with_best_weights(&point), history, converged })
}

/// Smallest and largest input of all experiments.
pub(super) fn range(record: &Record, input: usize) -> (f64, f64) {
    let columns = record.experiments().iter().map(|e| e.input.column(input));
    columns.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), column| {
        (low.min(column.min()), high.max(column.max()))
    })
}

/// Play i can only have been within its half-width of z; a hair inside, since a play that slides at
/// once forgets its start.
fn clamp_starts(mut point: Point, record: &Record) -> Point {
    const INSIDE: f64 = 1.0 - 1e-9;
    for (experiment, starts) in record.experiments().iter().zip(&mut point.starts) {
        for (input, plays) in starts.iter_mut().enumerate() {
            let z = point.channels[input].envelope(experiment.input[(0, input)]);
            for (start, r) in plays.iter_mut().zip(&point.channels[input].half_widths) {
                *start = start.clamp(z - INSIDE * r, z + INSIDE * r);
            }
        }
    }
    point
}

/// The first sample from which no play remembers its start: u has spanned twice the widest half-width.
pub(super) fn forgets_at(input: impl Iterator<Item = f64>, widest: f64) -> Option<usize> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (k, value) in input.enumerate() {
        (low, high) = (low.min(value), high.max(value));
        if high - low >= 2.0 * widest {
            return Some(k);
        }
    }
    None
}

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
    /// Whether the last step gained next to nothing; otherwise the step limit was reached.
    pub converged: bool,
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
/// let fit = fit_hysteresis(&u, &v, &grid, &Grid::Count(0), &mut |_, _| true)?;
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
    };
    let channel = |name: &str| vec![Channel::new(name, "")];
    let record = Record::new(vec![run], 1.0, channel("u"), channel("v"), vec![])?;
    record.require_moving()?;
    let (low, high) = range(&record, 0);
    let parameters = Parameters::identity(
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
    let starts = vec![vec![vec![parameters.envelope(u[0]); parameters.half_widths.len()]]];
    let mut point = Point { channels: vec![parameters], starts };
    // The weights start at the scale of v over u, whatever the units.
    let experiment = &record.experiments()[0];
    let gain = (experiment.output.variance() / experiment.input.variance()).sqrt();
    point.channels[0].weights[0] *= gain;
    let identity = StateSpace::delayed_gain(&Matrix::from_element(1, 1, 1.0), 0);
    let freedom =
        Freedom { derivatives: Derivatives { thresholds: false, starts: true }, numerator: false };
    let fitted = fit(point, &identity, &record, freedom, 60, progress)?;
    let channel = &fitted.point.channels[0];
    let start = &fitted.point.starts[0][0];
    let mut simulated = u.to_vec();
    channel.apply(start, &mut simulated);
    let errors: Vec<f64> = v.iter().zip(&simulated).map(|(v, fitted)| v - fitted).collect();
    let samples = errors.len() as f64;
    let offset = errors.iter().sum::<f64>() / samples;
    let squares: f64 = errors.iter().map(|error| (error - offset).powi(2)).sum();
    let plays = channel.half_widths.iter().zip(&channel.weights).zip(start);
    Ok(HysteresisFit {
        hysteresis: channel.to_operator()?,
        offset,
        start: plays.filter(|((r, p), _)| **r == 0.0 || **p != 0.0).map(|(_, f)| *f).collect(),
        rms: (squares / samples).sqrt(),
        history: fitted.history.iter().map(|cost| (cost / samples).sqrt()).collect(),
        converged: fitted.converged,
    })
}
