//! Whether a slow function of time bridges gaps between its knots.
//!
//! A function of time with many knots follows whatever the model lacks, slow or not. One that is really there is smooth
//! on the scale of its knots, so that it is known inside a gap from its two sides. Gaps somewhat longer than the
//! spacing of the knots are taken from the record, one after the other. For each, the knots are fitted again without
//! the gap, and the residual inside the gap is compared with that of the fit to everything. With D the derivatives of
//! the output by the knots' values and e the residual, and with the gap's own parts of `D'D` and `D'e` taken away,
//!
//! ```text
//! delta = (D'D - D_g'D_g + h diag(D'D))^-1 (D'e - D_g'e_g),      e_gap = e_g - D_g delta.
//! ```
//!
//! h is small and keeps knots where they are that only the gap determines.
//!
//! The squares inside the gap follow from the same products, without the rows of D:
//!
//! ```text
//! |e_gap|^2 = e_g'e_g - 2 delta' D_g'e_g + delta' D_g'D_g delta
//! ```
//!
//! The sum over all gaps is compared with the sum of `e_g'e_g`. D is taken from differences and the knots alone are
//! fitted again; all other parameters are held. That is exact where the output is linear in the knots: for a drift and
//! for a gain that drifts, unless a curve or a gap stands behind them.
//!
//! Products are summed by cells, a third of a gap each, so that gaps begin in every cell at the price of one pass over
//! the record. A gap is used where whole cells lie on both sides of it, since next to a block that is held out it would
//! be longer.

use crate::chain::point::Point;
use crate::effects::Block;
use crate::explain::state::SearchState;
use crate::fit::memory::part_of_slower;
use crate::{Error, Experiment, Matrix, Record};
use nalgebra::{Cholesky, DVector};

/// Whether the function of time may follow what the dynamics lack. Knots at a distance h follow frequencies up to `1 / (2 h)`, and a
/// pole without resonance of time constant T has its corner at `1 / (2 pi T)`: knots are as fast as it where `h < pi T`. Such poles matter
/// where they carry a part of the movement: a lag of little gain leaves little that knots could follow.
pub(super) fn is_as_fast_as_lags(
    state: &SearchState,
    point: &Point,
    place: usize,
) -> Result<bool, Error> {
    let longest = spacing(&state.prepared.record, point, place) / std::f64::consts::PI;
    let carried = part_of_slower(longest, point, &state.prepared)?;
    Ok(carried > state.setup.policy.examination.carried_by_lags)
}

/// The distance of the knots, in samples.
fn spacing(record: &Record, point: &Point, place: usize) -> f64 {
    record.longest() as f64 / point.effects[place].values().len().max(1) as f64
}

/// Whether the error inside the gaps is larger than that of the fit by more than a factor.
pub(super) fn are_missed(state: &SearchState, point: &Point, place: usize) -> Result<bool, Error> {
    let policy = &state.setup.policy.examination;
    let record = &state.prepared.record;
    let knots = point.effects[place].values().len();
    if knots < policy.fewest_knots {
        return Ok(false);
    }
    let spacing = spacing(record, point, place);
    let residuals = point.residuals(record)?;
    let cell = policy.gap * spacing / CELLS as f64;
    let mut cells: Vec<Products> = Vec::new();
    for (index, experiment) in record.experiments().iter().enumerate() {
        let columns = columns(point, place, experiment, index)?;
        for k in experiment.scored_runs().flatten() {
            let own = (k as f64 / cell) as usize;
            if cells.len() <= own {
                cells.resize_with(own + 1, || Products::new(knots));
            }
            for (output, weight) in state.setup.options.loss.scales.iter().enumerate() {
                let row = DVector::from_fn(knots, |i, _| weight * columns[i][(k, output)]);
                cells[own].add(&row, weight * residuals[index][(k, output)]);
            }
        }
    }
    let mut all = Products::new(knots);
    cells.iter().for_each(|cell| all.add_all(cell));
    let most = cells.iter().map(|cell| cell.samples).max().unwrap_or(0);
    let is_whole = |cell: &Products| cell.samples as f64 > policy.whole * most as f64;
    let (mut fitted, mut bridged) = (0.0, 0.0);
    // beside what is held out anyway, a gap would be longer
    for window in cells.windows(CELLS + 2) {
        if is_whole(&window[0]) && is_whole(&window[CELLS + 1]) {
            let mut gap = Products::new(knots);
            window[1..=CELLS].iter().for_each(|cell| gap.add_all(cell));
            fitted += gap.residual;
            bridged += gap.predicted_from(&all, policy.held);
        }
    }
    Ok(bridged > policy.bridged * policy.bridged * fitted)
}

/// Cells of a gap: gaps begin in every cell, and a whole one lies on each side.
const CELLS: usize = 3;

/// Derivatives of the output by each knot's value, (samples, outputs).
fn columns(
    point: &Point,
    place: usize,
    experiment: &Experiment,
    index: usize,
) -> Result<Vec<Matrix>, Error> {
    let effect = &point.effects[place];
    let known = point.signals(experiment, index)?;
    let here = point.output_from(effect.stage(), &known, experiment, index)?;
    let steps = effect.block().map_or_else(Vec::new, Block::steps);
    let column = |(knot, step): (usize, f64)| {
        let mut moved = point.clone();
        let mut values = effect.values();
        values[knot] += step;
        moved.effects[place].set(&values);
        Ok((moved.output_from(effect.stage(), &known, experiment, index)? - &here) / step)
    };
    steps.into_iter().enumerate().map(column).collect()
}

/// Sums over the samples of a gap.
struct Products {
    samples: usize,
    /// `D'D`.
    gram: Matrix,
    /// `D'e`.
    descent: DVector<f64>,
    /// `e'e`.
    residual: f64,
}

impl Products {
    fn new(knots: usize) -> Self {
        Self {
            samples: 0,
            gram: Matrix::zeros(knots, knots),
            descent: DVector::zeros(knots),
            residual: 0.0,
        }
    }

    fn add(&mut self, row: &DVector<f64>, residual: f64) {
        self.samples += 1;
        self.gram.ger(1.0, row, row, 1.0);
        self.descent.axpy(residual, row, 1.0);
        self.residual += residual * residual;
    }

    fn add_all(&mut self, other: &Self) {
        self.samples += other.samples;
        self.gram += &other.gram;
        self.descent += &other.descent;
        self.residual += other.residual;
    }

    /// The squares inside this gap after a fit to everything else.
    fn predicted_from(&self, all: &Self, held: f64) -> f64 {
        let mut gram = &all.gram - &self.gram;
        // a knot that nothing outside determines stays where it is
        let power = all.gram.diagonal();
        for (i, own) in power.iter().enumerate() {
            gram[(i, i)] += held * own + f64::EPSILON * power.max();
        }
        let Some(factor) = Cholesky::new(gram) else { return self.residual };
        let delta = factor.solve(&(&all.descent - &self.descent));
        let bent = (&self.gram * &delta).dot(&delta);
        self.residual - 2.0 * delta.dot(&self.descent) + bent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_predicted_as_by_a_fit_without_it() {
        // y = 2 + 3 t with a step in the gap: the line of the other samples misses it by the step
        let mut all = Products::new(2);
        let mut gap = Products::new(2);
        for k in 0..30 {
            let row = DVector::from_vec(vec![1.0, f64::from(k)]);
            let is_inside = (10..15).contains(&k);
            let y = 2.0 + 3.0 * f64::from(k) + if is_inside { 0.5 } else { 0.0 };
            all.add(&row, y);
            if is_inside {
                gap.add(&row, y);
            }
        }
        assert!((gap.predicted_from(&all, 0.0) - 5.0 * 0.25).abs() < 1e-6);
    }
}
