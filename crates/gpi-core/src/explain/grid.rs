//! Half-widths and thresholds that the residual asks for.

use super::projection::{LEFT, Projection};
use super::score::Base;
use crate::chain::bounds::range;
use crate::chain::free_run::Signals;
use crate::chain::point::Point;
use crate::effects::Stage;
use crate::fit::preparation::Prepared;
use crate::fit::refine::RefineOptions;
use crate::{Error, Experiment, Matrix};
use nalgebra::DVector;

/// A play or a deadzone that an input's hysteresis may get.
#[derive(Clone, Copy)]
enum Place {
    Play { input: usize, half_width: f64 },
    Deadzone { input: usize, threshold: f64 },
}

impl Place {
    fn added_to(self, point: &Point, weight: f64) -> Point {
        match self {
            Self::Play { input, half_width } => point.with_play(input, half_width, weight),
            Self::Deadzone { input, threshold } => point.with_deadzone(input, threshold, weight),
        }
    }
}

/// The base point with those plays and deadzones more, without weight yet, that would take most of the
/// residual, each after the others (orthogonal matching pursuit); how many they are.
pub(crate) fn enriched(
    base: &Base,
    prepared: &Prepared,
    moving: &RefineOptions,
) -> Result<(Point, usize), Error> {
    /// At once.
    const MOST: usize = 8;
    /// Of the residual's squares: less is not worth a play.
    const LEAST: f64 = 1e-3;
    /// A weight beside which the output changes linearly.
    const PROBE: f64 = 1e-4;
    let places = places(base, prepared, moving);
    let columns = |known: &Signals, here: &Matrix, experiment: &Experiment, index: usize| {
        let column = |place: &Place| {
            let point = place.added_to(base.point, PROBE);
            Ok(point.output_from(Stage::Plays, known, experiment, index)? - here)
        };
        places.iter().map(column).collect()
    };
    let Projection { mut left, mut score, squares, cost } = base.project(places.len(), &columns)?;
    let chance = (2.0 * prepared.values().ln() / prepared.values()).max(LEAST) * cost;
    let mut point = base.point.clone();
    let mut added = 0;
    while added < MOST {
        let usable = |&i: &usize| {
            // a play's weight is not negative
            let sign = matches!(places[i], Place::Deadzone { .. }) || score[i] > 0.0;
            sign && left[(i, i)] > LEFT * squares[i]
        };
        let gain = |i: usize| score[i] * score[i] / left[(i, i)];
        let best = (0..places.len()).filter(usable).max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
        let Some(best) = best.filter(|&i| gain(i) > chance) else { break };
        point = places[best].added_to(&point, 0.0);
        added += 1;
        deflate(&mut left, &mut score, best);
    }
    Ok((point, added))
}

/// Takes one column out of the others.
fn deflate(left: &mut Matrix, score: &mut DVector<f64>, taken: usize) {
    let column = left.column(taken) / left[(taken, taken)].sqrt();
    let own = score[taken] / left[(taken, taken)].sqrt();
    score.axpy(-own, &column, 1.0);
    left.ger(-1.0, &column, &column, 1.0);
}

/// Where plays and deadzones may come: dense where half-widths are small.
fn places(base: &Base, prepared: &Prepared, moving: &RefineOptions) -> Vec<Place> {
    const PLAYS: usize = 40;
    const DEADZONES: usize = 32;
    let spans = prepared.spans(base.point);
    let mut places = Vec::new();
    for (input, span) in spans.into_iter().enumerate() {
        if moving.half_widths {
            let half_width = |i: usize| 0.5 * span * (i as f64 / PLAYS as f64).powf(1.5);
            places.extend((1..=PLAYS).map(|i| Place::Play { input, half_width: half_width(i) }));
        }
        if moving.thresholds {
            let (low, high) = range(base.record, input);
            let step = (high - low) / (DEADZONES + 1) as f64;
            let threshold = |i: usize| low + i as f64 * step;
            let nonzero = (1..=DEADZONES).map(threshold).filter(|&eta| eta.abs() > 0.1 * step);
            places.extend(nonzero.map(|threshold| Place::Deadzone { input, threshold }));
        }
    }
    places
}
