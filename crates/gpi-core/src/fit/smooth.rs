//! A smooth density of plays on a fine grid, for a hysteresis that a few plays do not describe.
//!
//! A joint fit of few plays follows a record of one amplitude as well as any density of plays does, and then fails between the turning points
//! that it has not seen. Where the actuator has a smooth density, as piezoelectric ceramics do, many plays on a grid at equal distances
//! with the prior of [`crate::chain::prior`] predict other amplitudes better.
//!
//! The factors of the prior follow from the data. With the Gram matrix H of the data, the matrix K of a part of the prior, its
//! factor f and `A = H + sum f K`, the marginal likelihood (evidence) is largest where
//!
//! ```text
//! f = n gamma / x' K x,      gamma = rank K - f tr(A^-1 K)
//! ```
//!
//! gamma is the number of combinations of the unknowns that the data determine, and n the variance of the noise. The residual of a model that lacks something is
//! autocorrelated: it holds less information than white noise, so that n is its variance times the samples that a parameter takes
//! from it (see [`super::certainty`]). Both equations are iterated, on the quadratic model of the cost, between the steps of the fit.
//!
//! Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992.

use super::settings::SmoothSettings;
use crate::chain::bounds::range;
use crate::chain::hysteresis::{Parameters, Prior};
use crate::chain::point::{DynamicsFreedom, Point};
use crate::chain::prior::{PriorPart, add_prior};
use crate::fit::joint::{Refined, fit_options};
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::Prepared;
use crate::fit::problem::residual_rms;
use crate::fit::{Grid, RefineOptions};
use crate::linear::{Arrow, bounded};
use crate::optimize::Bounds;
use crate::progress::Progress;
use crate::{Error, Matrix};
use nalgebra::DVector;

/// The point with a smooth density of plays and a smooth envelope of every input, before a joint fit. The thresholds are kept where they
/// `are_given`.
pub(crate) fn smooth(
    point: &Point,
    prepared: &Prepared,
    are_given: bool,
    progress: Progress,
) -> Result<Point, Error> {
    let settings = &prepared.settings.smooth;
    let mut rich = point.clone();
    let noise = variance(point, prepared)?;
    for (input, span) in prepared.spans(point).into_iter().enumerate() {
        let has_weight = point.channels[input].weights.iter().any(|weight| *weight != 0.0);
        if span <= 0.0 || noise <= 0.0 || !has_weight {
            continue;
        }
        spread(&mut rich, input, 0.5 * span, settings);
        let channel = &mut rich.channels[input];
        if !are_given {
            let wanted = Grid::Count(settings.thresholds);
            bend(channel, wanted.thresholds(range(&prepared.record, input))?);
        }
        let mean = mean_weight(channel);
        channel.prior = Prior {
            weights: noise / (mean * mean).max(f64::MIN_POSITIVE),
            slopes: noise / settings.slopes.powi(2),
        };
    }
    let mut options = fit_options(prepared, &RefineOptions::default(), settings.steps);
    options.gain = settings.gain;
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Numerator;
    for _ in 0..settings.rounds {
        let fitted = fit(rich, &prepared.record, &options, "smooth density", progress)?;
        let priors = priors(&fitted, prepared, &options, progress)?;
        rich = fitted.point;
        let mut change: f64 = 0.0;
        for (channel, prior) in rich.channels.iter_mut().zip(priors) {
            if prior.weights > 0.0 && channel.prior.weights > 0.0 {
                change = change.max((prior.weights / channel.prior.weights).ln().abs());
            }
            channel.prior = prior;
        }
        if change < settings.change {
            break;
        }
    }
    Ok(fit(rich, &prepared.record, &options, "smooth density", progress)?.point)
}

/// How many combinations of the unknowns the prior determines: `sum f tr(A^-1 K)` over the free unknowns of a fit.
pub(crate) fn determined_by_prior(fitted: &Fitted, bounds: &Bounds) -> f64 {
    if !fitted.point.has_prior() {
        return 0.0;
    }
    let parts = fitted.point.prior(&fitted.table);
    let traces = traces(&fitted.linearization.gram, &parts, &bounds.free());
    parts.iter().zip(traces).map(|(part, trace)| part.factor * trace).sum()
}

fn mean_weight(channel: &Parameters) -> f64 {
    let all: f64 = channel.weights.iter().map(|weight| weight.abs()).sum();
    all / channel.weights.len() as f64
}

/// The mean square of the training residual, in units of the cost.
fn variance(point: &Point, prepared: &Prepared) -> Result<f64, Error> {
    let residuals = point.residuals(&prepared.record)?;
    let rms = residual_rms(&residuals, &prepared.record);
    Ok(rms.iter().map(|rms| rms * rms).sum::<f64>() / rms.len() as f64)
}

/// The priors of all inputs with the largest evidence on the quadratic model of a fit.
fn priors(
    fitted: &Fitted,
    prepared: &Prepared,
    options: &FitOptions,
    progress: Progress,
) -> Result<Vec<Prior>, Error> {
    let settings = &prepared.settings.smooth;
    let (point, table) = (&fitted.point, &fitted.table);
    let bounds = point.bounds(table, &prepared.record, options.freedom);
    let refined =
        Refined { fitted: fitted.clone(), options: options.clone(), outliers: 0, robust: false };
    let uncertainty = refined.uncertainty(&prepared.record, progress)?;
    let used = uncertainty.estimated as f64 - determined_by_prior(fitted, &bounds);
    let samples = (uncertainty.used / used.max(1.0)).max(1.0);
    let left = fitted.linearization.cost - point.penalty(table);
    let noise = samples * left / prepared.values();
    let mut parts = point.prior(table);
    // the data alone
    let mut gram = fitted.linearization.gram.clone();
    let mut descent = fitted.linearization.descent.clone();
    let values = DVector::from_vec(table.values(point));
    for part in &parts {
        gram.add_part(&(-part.factor * &part.matrix), &part.places);
    }
    descent += product(&parts, &values);
    // second differences and slopes are measured by the mean weight and by one
    let scales: Vec<[f64; 2]> = point.channels.iter().map(|own| [mean_weight(own), 1.0]).collect();
    for _ in 0..settings.iterations {
        let mut whole = gram.clone();
        add_prior(&parts, &mut whole);
        let rhs = &descent - product(&parts, &values);
        let step = bounded(&whole, &rhs, &bounds.lower, &bounds.upper);
        let moved = &values + &step;
        let is_inside = |&i: &usize| step[i] > bounds.lower[i] && step[i] < bounds.upper[i];
        let free: Vec<usize> = bounds.estimated().into_iter().filter(is_inside).collect();
        let traces = traces(&whole, &parts, &free);
        for (part, trace) in parts.iter_mut().zip(traces) {
            let count = part.places.iter().filter(|place| free.contains(place)).count();
            // straight weights cost nothing
            let rank = count.saturating_sub(if part.is_of_weights { 2 } else { 0 }) as f64;
            let gamma =
                (rank - part.factor * trace).clamp(settings.least, rank.max(settings.least));
            let expected = part.square(moved.as_slice()) / gamma;
            let least =
                (settings.finest * scales[part.input][usize::from(!part.is_of_weights)]).powi(2);
            let factor = noise / expected.max(least);
            part.factor = if factor.is_finite() { factor } else { part.factor };
        }
    }
    let of = |input: usize, is_of_weights: bool| {
        let found =
            parts.iter().find(|part| part.input == input && part.is_of_weights == is_of_weights);
        found.map_or(0.0, |part| part.factor)
    };
    Ok((0..point.channels.len())
        .map(|input| Prior { weights: of(input, true), slopes: of(input, false) })
        .collect())
}

/// `sum f K x` over parts of a prior.
fn product(parts: &[PriorPart], values: &DVector<f64>) -> DVector<f64> {
    let mut sum = DVector::zeros(values.len());
    for part in parts {
        let own = values.select_rows(&part.places);
        for (&place, value) in part.places.iter().zip((&part.matrix * own).iter()) {
            sum[place] += part.factor * value;
        }
    }
    sum
}

/// `tr(A^-1 K)` of each part, over the free unknowns.
fn traces(gram: &Arrow, parts: &[PriorPart], free: &[usize]) -> Vec<f64> {
    let whole = gram.restricted(free).to_dense();
    let scale = whole.diagonal().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
    let scaled = Matrix::from_fn(free.len(), free.len(), |i, j| {
        whole[(i, j)] / (scale[i] * scale[j]) + if i == j { ROUNDING } else { 0.0 }
    });
    let Some(factor) = scaled.cholesky() else { return vec![0.0; parts.len()] };
    let inverse = factor.inverse();
    let place = |unknown: usize| free.iter().position(|&own| own == unknown);
    let trace = |part: &PriorPart| {
        let places: Vec<Option<usize>> = part.places.iter().map(|&own| place(own)).collect();
        let mut sum = 0.0;
        for (i, row) in places.iter().enumerate() {
            for (j, column) in places.iter().enumerate() {
                if let (&Some(row), &Some(column)) = (row, column) {
                    let of = inverse[(row, column)] / (scale[row] * scale[column]);
                    sum += of * part.matrix[(i, j)];
                }
            }
        }
        sum
    };
    parts.iter().map(trace).collect()
}

/// Added to the diagonal of a Gram matrix of unit diagonal.
const ROUNDING: f64 = 1e-12;

/// Puts deadzones at other thresholds in place of those of an envelope. The nearest one takes over a slope.
fn bend(channel: &mut Parameters, thresholds: Vec<f64>) {
    let identity = Parameters::identity(channel.reading, thresholds, channel.half_widths.clone());
    let mut slopes = vec![0.0; identity.thresholds.len()];
    slopes[0] = channel.slopes[0];
    for (eta, slope) in channel.thresholds.iter().zip(&channel.slopes).skip(1) {
        let distance = |place: &usize| (identity.thresholds[*place] - eta).abs();
        let nearest = (1..slopes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(nearest) = nearest {
            slopes[nearest] += slope;
        }
    }
    (channel.thresholds, channel.slopes) = (identity.thresholds, slopes);
}

/// Puts plays at equal distances in place of those of an input. Each play's weight goes to its neighbours on the grid.
fn spread(point: &mut Point, input: usize, widest: f64, settings: &SmoothSettings) {
    let count = settings.half_widths;
    let step = widest / count as f64;
    let Parameters { half_widths, weights, .. } = &point.channels[input];
    let share = |r: f64| (r / step).clamp(0.0, (count - 1) as f64);
    let mut smooth = vec![0.0; count];
    smooth[0] = weights[0];
    for (&r, weight) in half_widths.iter().zip(weights).skip(1) {
        let place = share(r).max(1.0);
        let below = place.floor() as usize;
        let part = place - below as f64;
        smooth[below] += (1.0 - part) * weight;
        if part > 0.0 {
            smooth[below + 1] += part * weight;
        }
    }
    // the initial place of the nearest play
    let nearest = |grid: usize| {
        let distance = |place: &usize| (half_widths[*place] - grid as f64 * step).abs();
        (1..half_widths.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let nearest: Vec<Option<usize>> = (0..count).map(nearest).collect();
    for past in point.pasts.iter_mut().filter_map(|past| past.plays.as_mut()) {
        let sides = |place: &Option<usize>| place.map_or(0.0, |place| past[input][place]);
        past[input] = nearest.iter().map(sides).collect();
    }
    point.channels[input].half_widths = (0..count).map(|place| step * place as f64).collect();
    point.channels[input].weights = smooth;
}
