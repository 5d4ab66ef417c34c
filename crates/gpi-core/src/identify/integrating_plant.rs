//! The dynamics of a plant whose output integrates its input, such as a motor-driven slide or a hydraulic cylinder.
//!
//! No impulse response of such a plant decays. That of its rate does, so that hysteresis and dynamics are estimated from
//!
//! ```text
//! y(k+1) - y(k) = G' v(k),    and    G = p G' / (z - p),   p = exp(-1 / T)
//! ```
//!
//! with T far longer than the longest experiment: a pole at one has no DC gain, by which the dynamics are scaled. The joint fit moves it.

use crate::chain::point::Point;
use crate::fit::Grid;
use crate::fit::memory::Memory;
use crate::fit::preparation::{Prepared, rescale};
use crate::identify::alternation::{self, Taps};
use crate::identify::identification::IdentifyOptions;
use crate::identify::realization::refit;
use crate::identify::settings::IdentifySettings;
use crate::identify::structure::StructureSearch;
use crate::linear::{Sections, StateSpace};
use crate::progress::Progress;
use crate::{Error, Experiment, Matrix, Record};

/// The hysteresis and the dynamics that the rate of the output shows, integrated; `None` where `estimate`, a first estimate, is not slow,
/// or where a given order leaves nothing to the rate.
pub(super) fn seed(
    estimate: &Point,
    (half_widths, taps): (&Grid, Taps),
    options: &IdentifyOptions,
    prepared: &Prepared,
    settings: &IdentifySettings,
    progress: Progress,
) -> Result<Option<Point>, Error> {
    let outputs = prepared.record.outputs().len();
    let of_rate = options.order.map(|order| order.saturating_sub(outputs));
    let memory = Memory::of(&prepared.record);
    let time = settings.slow.integrator * prepared.record.longest() as f64;
    let is_slow = memory.is_slow_plant(estimate, prepared)?;
    if of_rate == Some(0) || !is_slow && !follows_integral(estimate, prepared, time)? {
        return Ok(None);
    }
    let rate = differences(&prepared.record)?;
    let mut alone = Prepared::new(&rate, prepared.channels.clone())?;
    let mut taps = taps;
    let start = alternation::seed(&mut alone, half_widths, &mut taps, of_rate, settings, progress)?;
    let mut search = StructureSearch::new(
        &alone,
        &settings.structure,
        &IdentifyOptions { order: of_rate, ..options.clone() },
        None,
    );
    search.climb(&start.point, progress)?;
    if of_rate.is_none() {
        search.orders(&mut taps, settings, progress)?;
    }
    if let Some(best) = search.best() {
        search.without_plays(&best, progress)?;
    }
    let Some(found) = search.best() else { return Ok(None) };
    // differences have most of their noise near half the rate, where a pole may follow it
    let found = found.without(|pole| memory.is_disturbance(pole))?.unwrap_or(found);
    let system = found.dynamics.to_state_space()?;
    let system = integrated(&system, time)?;
    let mut point = prepared.point(Sections::from_delayed_state_space(&system)?);
    point.channels = found.channels;
    rescale(&mut point);
    prepared.settle(&mut point);
    prepared.free_run(&mut point)?;
    Ok(Some(point))
}

/// Whether the integrals of the inputs, lags of a time constant in samples, leave less than an estimate.
fn follows_integral(estimate: &Point, prepared: &Prepared, time: f64) -> Result<bool, Error> {
    let (inputs, outputs) = (prepared.record.inputs().len(), prepared.record.outputs().len());
    let pole = (-1.0 / time).exp();
    let integrals = StateSpace::new(
        pole * Matrix::identity(inputs, inputs),
        Matrix::identity(inputs, inputs),
        Matrix::zeros(outputs, inputs),
        Matrix::zeros(outputs, inputs),
    )?;
    let integral = refit(&prepared.record, integrals)?;
    Ok(integral.rms < prepared.free_run(&mut estimate.clone())?)
}

/// What the outputs gain from each sample to the next. A difference is scored where both samples are.
fn differences(record: &Record) -> Result<Record, Error> {
    let of = |experiment: &Experiment| {
        let rows = experiment.output.nrows() - 1;
        let next = experiment.output.rows(1, rows).into_owned();
        let mut shorter = experiment.rows(0..rows, experiment.warmup);
        shorter.output = next - &shorter.output;
        shorter.hold_out(
            experiment.held_out.iter().map(|held| held.start.saturating_sub(1)..held.end.min(rows)),
        );
        shorter
    };
    let is_long = |experiment: &&Experiment| experiment.output.nrows() > experiment.warmup + 1;
    record.with_experiments(record.experiments().iter().filter(is_long).map(of).collect())
}

/// A system followed by a lag of DC gain `time` on each output, in samples: `x(k+1) = p (x(k) + y(k))`.
fn integrated(system: &StateSpace, time: f64) -> Result<StateSpace, Error> {
    let (order, outputs) = (system.order(), system.outputs());
    let pole = (-1.0 / time).exp();
    let mut a = Matrix::zeros(order + outputs, order + outputs);
    a.view_mut((0, 0), (order, order)).copy_from(system.a());
    a.view_mut((order, 0), (outputs, order)).copy_from(&(pole * system.c()));
    a.view_mut((order, order), (outputs, outputs)).fill_diagonal(pole);
    let mut b = Matrix::zeros(order + outputs, system.inputs());
    b.rows_mut(0, order).copy_from(system.b());
    b.rows_mut(order, outputs).copy_from(&(pole * system.d()));
    let mut c = Matrix::zeros(outputs, order + outputs);
    c.columns_mut(order, outputs).fill_with_identity();
    StateSpace::new(a, b, c, Matrix::zeros(outputs, system.inputs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Channel;
    use crate::identify::procedure::prepare;
    use crate::identify::settings::AlternationPolicy;

    /// A valve of dead band 0.2 and a cylinder with a mode, or the mode alone.
    fn record(integrates: bool) -> Record {
        let drive = |k: usize| {
            let t = k as f64;
            1.5 * (0.013 * t).sin() + (0.0047 * t + 1.0).sin() + 0.5 * (0.11 * t).sin()
        };
        let (mut q, mut p, mut x, mut seed) = (0.0, 0.0, 0.0, 1_u64);
        let (mut u, mut y) = (Vec::new(), Vec::new());
        for k in 0..6000 {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let noise = (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0;
            u.push(drive(k));
            y.push(if integrates { x } else { q } + 2e-3 * noise);
            let width = if integrates { 0.2 } else { 0.0 };
            let v = (drive(k).abs() - width).max(0.0) * drive(k).signum();
            x += 0.02 * q;
            (q, p) = (q + p, p + 0.1 * (v - q) - 0.15 * p);
        }
        let column = |values| Matrix::from_vec(6000, 1, values);
        let run = Experiment::new(column(u), column(y));
        let channel = |name| vec![Channel::new(name, "")];
        Record::new(vec![run], 1000.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    fn found(integrates: bool, order: Option<usize>) -> Option<Point> {
        let record = record(integrates);
        let options = IdentifyOptions { order, ..IdentifyOptions::default() };
        let prepared = prepare(&record, &options).unwrap();
        let column = |values: [f64; 2]| Matrix::from_column_slice(2, 1, &values);
        let a = Matrix::from_row_slice(2, 2, &[1.0, 1.0, -0.1, 0.85]);
        let c = column([1.0, 0.0]).transpose();
        let mode = StateSpace::new(a, column([0.0, 0.1]), c, Matrix::zeros(1, 1)).unwrap();
        let estimate = prepared.point(Sections::from_state_space(&mode, 0).unwrap());
        let taps = Taps { count: 60, largest: 200 };
        let settings = IdentifySettings::default();
        let grid = Grid::Count(AlternationPolicy::default().half_widths);
        let start = (&grid, taps);
        seed(&estimate, start, &options, &prepared, &settings, &mut |_| true).unwrap()
    }

    #[test]
    fn the_rate_shows_the_mode_of_a_plant_that_integrates() {
        for order in [None, Some(3)] {
            let poles = found(true, order).unwrap().dynamics.poles();
            // the roots of z^2 - 1.85 z + 0.95
            let mode = num_complex::Complex64::new(0.925, 0.307);
            assert!(poles.iter().any(|pole| (pole - mode).norm() < 0.02), "{poles:?}");
            assert!(poles.iter().any(|pole| (pole - 1.0).norm() < 1e-6), "{poles:?}");
        }
    }

    #[test]
    fn a_stage_that_holds_its_place_is_no_plant_that_integrates() {
        assert!(found(false, None).is_none());
        assert!(found(true, Some(1)).is_none(), "the order leaves nothing to the rate");
    }

    #[test]
    fn differences_are_scored_where_both_samples_are() {
        let column = |values: &[f64]| Matrix::from_column_slice(values.len(), 1, values);
        let run = Experiment::new(
            column(&[0.0; 8]),
            column(&[1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0, 29.0]),
        );
        let mut run = Experiment { warmup: 1, ..run };
        run.hold_out(std::iter::once(4..6));
        let channel = |name| vec![Channel::new(name, "")];
        let record = Record::new(vec![run], 1.0, channel("u"), channel("y"), vec![]).unwrap();
        let rate = differences(&record).unwrap();
        let experiment = &rate.experiments()[0];
        assert_eq!(experiment.output, column(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]));
        assert_eq!(experiment.scored_runs().collect::<Vec<_>>(), [1..3, 6..7]);
    }
}
