//! One experiment streamed through the hysteresis of every input, through G, and through all of their
//! derivatives.

use super::point::{Layout, Past, Point};
use super::sensitivity::{Derivatives, Sensitivity};
use crate::linear::{Section, Sections};
use crate::{Error, Experiment, Matrix};
use nalgebra::DVector;

/// Samples that are handed on at once.
const BLOCK: usize = 1024;

/// Residuals and derivatives of a run of scored samples of one experiment.
pub(super) struct Rows<'a> {
    /// For each output, (unknowns, samples).
    pub regressors: &'a [Matrix],
    /// Measured minus simulated, (outputs, samples).
    pub residuals: &'a Matrix,
}

/// Streams one experiment and hands its rows on block by block.
pub(super) struct Stream<'a> {
    point: &'a Point,
    layout: &'a Layout,
    experiment: &'a Experiment,
    index: usize,
    sensitivities: Vec<Sensitivity<'a>>,
    /// v and its derivatives, of each input.
    columns: Vec<DVector<f64>>,
    /// Each of these columns through G, `[input]` (columns, outputs).
    responses: Vec<Matrix>,
    sections: Vec<SectionState<'a>>,
}

/// What one section remembers.
struct SectionState<'a> {
    section: &'a Section,
    /// States that belong to the columns of each input, (columns, order).
    columns: Vec<Matrix>,
    /// v of each input through 1 / denominator: this sample's and the next one's.
    driven: Vec<[f64; 2]>,
    /// The first state through 1 / denominator.
    fed_back: [f64; 2],
    /// What the state differs by at the first scored sample, and the free response to it.
    start: DVector<f64>,
    free: DVector<f64>,
    /// A^k, the derivative of the free response.
    propagated: Matrix,
    matrix: Matrix,
    /// What v = 1 for ever leads to in the state, (order, inputs).
    standing: Matrix,
    /// DC gain from a drive of each state to the outputs, (outputs, order).
    gain: Matrix,
}

impl<'a> SectionState<'a> {
    fn new(section: &'a Section, sizes: &[usize], start: DVector<f64>) -> Self {
        let order = section.order();
        let identity = Matrix::identity(order, order);
        Self {
            section,
            columns: sizes.iter().map(|&size| Matrix::zeros(size, order)).collect(),
            driven: vec![[0.0; 2]; sizes.len()],
            fed_back: [0.0; 2],
            start,
            free: DVector::zeros(order),
            matrix: section.matrix(),
            standing: section.standing(&section.b),
            gain: &section.c * section.standing(&identity),
            propagated: identity,
        }
    }

    /// Before the record the inputs stood at these columns.
    fn stand(&mut self, columns: &[DVector<f64>]) {
        let denominator = 1.0 + self.section.a.iter().sum::<f64>();
        for (input, column) in columns.iter().enumerate() {
            self.columns[input] = column * self.standing.column(input).transpose();
            self.driven[input] = [column[0] / denominator; 2];
        }
        let first: f64 = self.columns.iter().map(|states| states[(0, 0)]).sum();
        self.fed_back = [first / denominator; 2];
    }

    /// The state itself.
    fn state(&self, j: usize) -> f64 {
        self.free[j] + self.columns.iter().map(|states| states[(0, j)]).sum::<f64>()
    }

    /// How a signal that drives state j shows at an output, from the signal through 1 / denominator.
    fn seen(&self, output: usize, j: usize, [now, next]: [f64; 2]) -> f64 {
        let c = |j: usize| self.section.c[(output, j)];
        match (&self.section.a[..], j) {
            ([_, a2], 0) => c(0) * next - c(1) * a2 * now,
            ([a1, _], _) => c(0) * now + c(1) * (next + a1 * now),
            _ => c(0) * now,
        }
    }

    fn step(&mut self, columns: &[DVector<f64>]) {
        let advance = |[now, next]: [f64; 2], drive: f64| match self.section.a[..] {
            [a1, a2] => [next, drive - a1 * next - a2 * now],
            _ => [drive - self.section.a[0] * now, 0.0],
        };
        self.fed_back = advance(self.fed_back, self.state(0));
        for (driven, column) in self.driven.iter_mut().zip(columns) {
            *driven = advance(*driven, column[0]);
        }
        for (input, (states, column)) in self.columns.iter_mut().zip(columns).enumerate() {
            let b = self.section.b.column(input);
            let rows = column.len();
            let column = column.as_slice();
            match self.section.a[..] {
                [a1, a2] => {
                    let (first, second) = states.as_mut_slice().split_at_mut(rows);
                    for ((x1, x2), &value) in first.iter_mut().zip(second).zip(column) {
                        let before = *x1;
                        *x1 = *x2 - a1 * before + b[0] * value;
                        *x2 = b[1] * value - a2 * before;
                    }
                }
                _ => {
                    for (x, &value) in states.as_mut_slice().iter_mut().zip(column) {
                        *x = b[0] * value - self.section.a[0] * *x;
                    }
                }
            }
        }
    }

    /// Moves the free response on.
    fn relax(&mut self) {
        self.free = &self.matrix * &self.free;
        self.propagated = &self.matrix * &self.propagated;
    }
}

impl<'a> Stream<'a> {
    pub(super) fn new(
        point: &'a Point,
        layout: &'a Layout,
        wanted: Derivatives,
        experiment: &'a Experiment,
        index: usize,
    ) -> Self {
        let Past { plays, state, .. } = &point.pasts[index];
        let sensitivities: Vec<_> = point
            .channels
            .iter()
            .enumerate()
            .map(|(input, channel)| {
                let start = plays.as_ref().map(|plays| &plays[input][..]);
                Sensitivity::new(channel, start, wanted)
            })
            .collect();
        let sizes: Vec<_> =
            point.channels.iter().map(|c| Sensitivity::columns(c, wanted)).collect();
        let Sections { sections, .. } = &point.dynamics;
        let outputs = point.dynamics.outputs();
        let mut first = 0;
        let sections = sections.iter().map(|section| {
            let free = state.rows(first, section.order()).into_owned();
            first += section.order();
            SectionState::new(section, &sizes, free)
        });
        Self {
            sections: sections.collect(),
            point,
            layout,
            experiment,
            index,
            sensitivities,
            columns: sizes.iter().map(|&size| DVector::zeros(size)).collect(),
            responses: sizes.iter().map(|&size| Matrix::zeros(size, outputs)).collect(),
        }
    }

    /// Hands the rows of all scored samples on.
    pub(super) fn run(
        &mut self,
        consume: &mut dyn FnMut(Rows) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let outputs = self.point.dynamics.outputs();
        let (warmup, samples) = (self.experiment.warmup, self.experiment.input.nrows());
        let block = BLOCK.min(samples - warmup);
        let mut regressors = vec![Matrix::zeros(self.layout.len, block); outputs];
        let mut residuals = Matrix::zeros(outputs, block);
        let mut filled = 0;
        for k in 0..samples {
            let at = k.saturating_sub(self.point.dynamics.delay);
            for (input, sensitivity) in self.sensitivities.iter_mut().enumerate() {
                // what the delay brings in first is the time in which nothing moved
                if at > 0 || k == 0 {
                    let u = self.experiment.input[(at, input)];
                    sensitivity.step(u, self.columns[input].as_mut_slice());
                }
            }
            if k == 0 {
                self.sections.iter_mut().for_each(|section| section.stand(&self.columns));
            }
            if k == warmup {
                self.sections.iter_mut().for_each(|state| state.free.copy_from(&state.start));
            }
            if k >= warmup {
                self.respond();
                for (output, regressor) in regressors.iter_mut().enumerate() {
                    let mut row = regressor.column_mut(filled);
                    let simulated = self.fill(output, k, row.as_mut_slice());
                    residuals[(output, filled)] = self.experiment.output[(k, output)] - simulated;
                }
                filled += 1;
            }
            self.sections.iter_mut().for_each(|section| section.step(&self.columns));
            if k >= warmup {
                self.sections.iter_mut().for_each(SectionState::relax);
            }
            if filled == block || (k + 1 == samples && filled > 0) {
                if filled < block {
                    regressors.iter_mut().for_each(|r| r.resize_horizontally_mut(filled, 0.0));
                    residuals.resize_horizontally_mut(filled, 0.0);
                }
                consume(Rows { regressors: &regressors, residuals: &residuals })?;
                filled = 0;
            }
        }
        Ok(())
    }

    /// Takes the columns of every input through G.
    fn respond(&mut self) {
        let d = &self.point.dynamics.d;
        for (input, response) in self.responses.iter_mut().enumerate() {
            for (output, mut values) in response.column_iter_mut().enumerate() {
                values.axpy(d[(output, input)], &self.columns[input], 0.0);
                for state in &self.sections {
                    for (j, column) in state.columns[input].column_iter().enumerate() {
                        let c = state.section.c[(output, j)];
                        if c != 0.0 {
                            values.axpy(c, &column, 1.0);
                        }
                    }
                }
            }
        }
    }

    /// Writes the derivatives of one output sample; returns the output itself.
    fn fill(&self, output: usize, k: usize, row: &mut [f64]) -> f64 {
        let layout = self.layout;
        let mut simulated = 0.0;
        for (input, response) in self.responses.iter().enumerate() {
            let values = response.column(output);
            simulated += values[0];
            let mut first = 1;
            // the order in which the sensitivities are streamed
            for unknowns in [
                &layout.weights[input],
                &layout.slopes[input],
                &layout.thresholds[input],
                &layout.half_widths[input],
                &layout.plays[self.index][input],
            ] {
                let values = &values.as_slice()[first..first + unknowns.len()];
                row[unknowns.clone()].copy_from_slice(values);
                first += unknowns.len();
            }
            // no unknowns where the start is known, but the columns are there
            debug_assert!(first <= values.len());
        }
        simulated += self.fill_sections(output, row);
        let outputs = self.point.dynamics.outputs();
        for (column, &unknown) in layout.feedthrough.iter().enumerate() {
            if let Some(i) = unknown {
                row[i] = if column % outputs == output { self.v(column / outputs) } else { 0.0 };
            }
        }
        let knots = &self.point.offsets[self.index];
        for (column, offsets) in knots.column_iter().enumerate() {
            let first = layout.offsets[self.index].start + column * knots.nrows();
            row[first..first + knots.nrows()].fill(0.0);
            if column == output {
                for (knot, weight) in hats(k, self.experiment.input.nrows(), knots.nrows()) {
                    row[first + knot] = weight;
                    simulated += weight * offsets[knot];
                }
            }
        }
        simulated
    }

    /// The same for the sections' own unknowns; returns the free response.
    fn fill_sections(&self, output: usize, row: &mut [f64]) -> f64 {
        let (layout, outputs) = (self.layout, self.point.dynamics.outputs());
        // What the held DC gains take back through D: their inputs and v.
        let held: Vec<(usize, f64)> = self
            .point
            .dynamics
            .held
            .iter()
            .enumerate()
            .filter(|(_, held)| held.0 == output)
            .map(|(input, _)| (input, self.v(input)))
            .collect();
        let mut free_response = 0.0;
        let mut first_state = layout.states[self.index].start;
        let starts = !layout.states[self.index].is_empty();
        for (state, unknowns) in self.sections.iter().zip(&layout.sections) {
            let SectionState { section, gain, standing, .. } = state;
            let order = section.order();
            for (j, i) in unknowns.a.clone().enumerate() {
                let still: f64 = held.iter().map(|&(k, v)| standing[(0, k)] * v).sum();
                row[i] = gain[(output, j)] * still - state.seen(output, j, state.fed_back);
            }
            for (place, i) in unknowns.b.clone().enumerate() {
                let (input, j) = (place / order, place % order);
                let still = held.iter().find(|h| h.0 == input).map_or(0.0, |h| h.1);
                row[i] = state.seen(output, j, state.driven[input]) - gain[(output, j)] * still;
            }
            for (place, i) in unknowns.c.clone().enumerate() {
                let j = place / outputs;
                let still: f64 = held.iter().map(|&(k, v)| standing[(j, k)] * v).sum();
                row[i] = if place % outputs == output { state.state(j) - still } else { 0.0 };
            }
            let c = section.c.row(output);
            free_response += (c * &state.free)[0];
            if starts {
                let derivatives = c * &state.propagated;
                row[first_state..first_state + order].copy_from_slice(derivatives.as_slice());
                first_state += order;
            }
        }
        free_response
    }

    /// The present v of an input.
    fn v(&self, input: usize) -> f64 {
        self.columns[input][0]
    }
}

/// The knots beside sample k of `samples`, with their weights in linear interpolation.
pub(super) fn hats(k: usize, samples: usize, knots: usize) -> impl Iterator<Item = (usize, f64)> {
    let place = k as f64 / (samples.max(2) - 1) as f64 * (knots - 1) as f64;
    let left = (place as usize).min(knots.saturating_sub(2));
    let right = place - left as f64;
    [(left, 1.0 - right), (left + 1, right)].into_iter().take(knots.min(2))
}
