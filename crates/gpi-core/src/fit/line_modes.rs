//! Modes of G that follow a line of the mains instead of the input.
//!
//! A mode that rings for long enough follows a sine that is added to the output, although no input drives it. Without the
//! output y_m of the mode, the rest of the model leaves `e + y_m`. A line explains that with three numbers,
//!
//! ```text
//! min over w, a, b of  sum_k (e(k) + y_m(k) - a cos w k - b sin w k)^2,
//! ```
//!
//! a and b of each experiment and output, w near the angle of the pole. A mode has three numbers more: its damping and its
//! two gains. By Schwarz's criterion (BIC) over N values, the line explains at least as much where
//!
//! ```text
//! N ln(squares with the line / squares with the mode) <= 3 ln N
//! ```
//!
//! A mode that the input drives rings down after each excitation, which no line does.
//!
//! Only modes are examined whose time constant is at least a part of the record: what decays faster cannot follow a line that
//! the input does not contain.

use super::problem::scored;
use super::settings::LineModeSettings;
use crate::chain::point::Point;
use crate::{Error, Matrix, Record};
use nalgebra::{Complex, Matrix2, Vector2};
use std::f64::consts::TAU;

/// Numbers that a mode has more than a line.
const MORE: f64 = 3.0;

/// Poles that are nearer are the same: realizing G anew moves them by rounding.
const SAME_POLE: f64 = 1e-6;

/// Whether a pole or its conjugate is another one.
pub(crate) fn is_same(own: &Complex<f64>, other: &Complex<f64>) -> bool {
    (own - other).norm().min((own - other.conj()).norm()) < SAME_POLE
}

/// The poles (upper half-plane) of the modes of G that follow a line rather than the input.
pub(crate) fn line_modes(point: &Point, record: &Record) -> Result<Vec<Complex<f64>>, Error> {
    let settings = LineModeSettings::default();
    let samples = record.longest() as f64;
    // loops act on the states of G
    if point.loops().next().is_some() {
        return Ok(Vec::new());
    }
    let rings = |place: usize| {
        let mut poles = point.dynamics.sections[place].poles().into_iter();
        let pole = poles.find(|pole| pole.im > 0.0)?;
        (-pole.norm().ln() * settings.part * samples <= 1.0).then_some((place, pole))
    };
    let modes: Vec<_> = (0..point.dynamics.sections.len()).filter_map(rings).collect();
    if modes.is_empty() {
        return Ok(Vec::new());
    }
    let residuals = point.residuals(record)?;
    let own: f64 = scored(&residuals, record).map(|run| run.norm_squared()).sum();
    let values = (record.scored() * record.outputs().len()) as f64;
    let most = own * (MORE * values.ln() / values).exp();
    let mut found = Vec::new();
    for (place, pole) in modes {
        let decay = -pole.norm().ln();
        let rest = point.without_output_of(place).residuals(record)?;
        let step = settings.step * TAU / samples;
        let reach = (settings.reach * decay).max(settings.bins * TAU / samples);
        let count = (reach / step).ceil() as i32;
        let beside = |angle: f64| beside_line(&rest, record, angle);
        let coarse = (-count..=count).map(|k| pole.arg() + f64::from(k) * step);
        let values = coarse.map(|angle| (angle, beside(angle)));
        let Some(nearest) = values.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        if least(&beside, nearest, step, settings.halvings) <= most {
            found.push(pole);
        }
    }
    Ok(found)
}

/// The least value of a function that has one minimum within `reach` of a place, by halving the reach; the value at the place
/// is known.
fn least(
    function: &impl Fn(f64) -> f64,
    (mut place, mut value): (f64, f64),
    mut reach: f64,
    halvings: usize,
) -> f64 {
    for _ in 0..halvings {
        reach *= 0.5;
        for other in [place - reach, place + reach] {
            let there = function(other);
            if there < value {
                (place, value) = (other, there);
                break;
            }
        }
    }
    value
}

/// The squares that the best sine of an angle (radians a sample) leaves of all scored values; its phase is kept within an
/// experiment.
fn beside_line(rest: &[Matrix], record: &Record, angle: f64) -> f64 {
    let turn = Complex::from_polar(1.0, angle);
    let mut left = 0.0;
    for (experiment, rest) in record.experiments().iter().zip(rest) {
        for column in rest.column_iter() {
            let mut normal = Matrix2::zeros();
            let (mut right, mut squares) = (Vector2::zeros(), 0.0);
            for run in experiment.scored_runs() {
                let mut phasor = Complex::from_polar(1.0, angle * run.start as f64);
                for &value in column.rows_range(run).iter() {
                    let row = Vector2::new(phasor.re, phasor.im);
                    normal += row * row.transpose();
                    right += row * value;
                    squares += value * value;
                    phasor *= turn;
                }
            }
            let explained =
                normal.try_inverse().map_or(0.0, |inverse| right.dot(&(inverse * right)));
            left += squares - explained;
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::{Grid, IdentifyOptions, identify};
    use crate::{Channel, Experiment};

    const RATE: f64 = 1e3;

    /// Steps and a slow sine, a hum of 50 Hz of the given amplitude, and a mode of 50 Hz that rings for so many samples.
    fn record(line: f64, ring: f64) -> Record {
        let mut random = 4711.0;
        let mut noise = || {
            random = (random * 16807.0) % 2_147_483_647.0;
            (random / 2_147_483_647.0 - 0.5) * 12.0_f64.sqrt()
        };
        let rows = 4000;
        let u = Matrix::from_fn(rows, 1, |k, _| {
            let step = [0.0, 1.0, 0.3, 0.8, -0.2, 0.6, -0.7, 0.4][k / (rows / 8)];
            step + 0.2 * (0.011 * k as f64).sin()
        });
        let (radius, angle) = ((-1.0 / ring).exp(), TAU * 50.0 / RATE);
        let (a1, a2) = (-2.0 * radius * angle.cos(), radius * radius);
        let (mut x1, mut x2, mut y) = (0.0, 0.0, Matrix::zeros(rows, 1));
        for k in 0..rows {
            let hum = line * (TAU * 50.0 / RATE * k as f64 + 0.4).sin();
            y[k] = u[k] + x1 + hum + 0.01 * noise();
            (x1, x2) = (x2 - a1 * x1 + 0.02 * u[k], -a2 * x1);
        }
        let channel = |name: &str| vec![Channel::new(name, "")];
        let run = vec![Experiment::new(u, y)];
        Record::new(run, RATE, channel("u"), channel("y"), vec![]).unwrap()
    }

    fn modes(record: &Record) -> Vec<f64> {
        let options = IdentifyOptions {
            half_widths: Some(Grid::Count(1)),
            thresholds: Some(Grid::Count(0)),
            ..IdentifyOptions::default()
        };
        let found = identify(record, &options, &mut |_| true).unwrap();
        let poles = found.model.linear().poles().unwrap();
        poles.iter().filter(|pole| pole.im > 0.0).map(|pole| pole.arg() * RATE / TAU).collect()
    }

    #[test]
    fn a_hum_is_no_mode_and_a_mode_is_one() {
        let near = |modes: &[f64]| modes.iter().any(|hertz| (hertz - 50.0).abs() < 1.0);
        assert!(!near(&modes(&record(0.05, 1e-9))), "the line is a mode");
        let found = modes(&record(0.0, 100.0));
        assert!(near(&found), "the mode is missing: {found:?}");
    }
}
