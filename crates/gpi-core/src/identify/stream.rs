//! One experiment streamed through the hysteresis of every input, through G, and through all of their
//! derivatives.

use super::free_run::Sensing;
use super::point::{Layout, Past, Point};
use super::sensitivity::{Derivatives, Sensitivity};
use crate::effects::Stage;
use crate::linear::{Section, Sections};
use crate::{Error, Experiment, Matrix};
use nalgebra::DVector;

/// Samples that are handed on at once.
const BLOCK: usize = 1024;

/// Residuals and derivatives of a run of scored samples of one experiment.
pub(crate) struct Rows<'a> {
    /// For each output, (unknowns, samples).
    pub regressors: &'a [Matrix],
    /// Measured minus simulated, (outputs, samples).
    pub residuals: &'a Matrix,
}

/// Streams one experiment and hands its rows on block by block.
pub(crate) struct Stream<'a> {
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
    /// The drive that reaches the hysteresis.
    drive: Matrix,
    /// Derivatives by the values of effects, `[effect][value]`.
    effects: Vec<Vec<Matrix>>,
    /// What effects add to the displacement, (samples, outputs).
    displaced: Matrix,
    /// What effects add to the output, (samples, outputs).
    added: Matrix,
    feedback: Feedback,
}

/// How changes go around the loop of a displacement that acts back.
struct Feedback {
    /// Whether anything does.
    closed: bool,
    /// What each state of G changes by with each unknown, (unknowns, order).
    tangents: Matrix,
    /// What the displacement drives each state with, and the slope, (order, 2).
    drives: Matrix,
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
    pub(crate) fn new(
        point: &'a Point,
        layout: &'a Layout,
        wanted: Derivatives,
        experiment: &'a Experiment,
        index: usize,
    ) -> Result<Self, Error> {
        let Past { plays, state, .. } = &point.pasts[index];
        let sensitivities: Vec<_> = point
            .channels
            .iter()
            .enumerate()
            .map(|(input, channel)| {
                let start = plays.as_ref().map(|plays| &plays[input][..]);
                Sensitivity::new(channel, start, wanted, point.beside(input))
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
        let closed = point.loops().next().is_some();
        let order = point.dynamics.order();
        let feedback = Feedback {
            closed,
            tangents: Matrix::zeros(if closed { layout.len } else { 0 }, order),
            drives: Matrix::zeros(order, 2),
        };
        let added = |stage| {
            let mut added = Matrix::zeros(experiment.input.nrows(), outputs);
            point.add(stage, experiment, &mut added);
            added
        };
        Ok(Self {
            drive: point.drive(experiment),
            effects: point.effect_columns(experiment, index)?,
            displaced: added(Stage::Displaced),
            added: added(Stage::Added),
            feedback,
            sections: sections.collect(),
            point,
            layout,
            experiment,
            index,
            sensitivities,
            columns: sizes.iter().map(|&size| DVector::zeros(size)).collect(),
            responses: sizes.iter().map(|&size| Matrix::zeros(size, outputs)).collect(),
        })
    }

    /// Hands the rows of all scored samples on.
    pub(crate) fn run(
        &mut self,
        consume: &mut dyn FnMut(Rows) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let outputs = self.point.dynamics.outputs();
        let (warmup, samples) = (self.experiment.warmup, self.experiment.input.nrows());
        let block = BLOCK.min(self.experiment.scored());
        let mut scored = self.experiment.scored_runs().peekable();
        let mut regressors = vec![Matrix::zeros(self.layout.len, block); outputs];
        let mut residuals = Matrix::zeros(outputs, block);
        let mut filled = 0;
        let mut sensing: Vec<Sensing> = Vec::new();
        // Also before the first scored sample, where the displacement leaves traces.
        let traced = self.feedback.closed || self.point.at_stage(Stage::Output).next().is_some();
        let mut unscored = vec![0.0; if traced { self.layout.len } else { 0 }];
        for k in 0..samples {
            while scored.next_if(|run| run.end <= k).is_some() {}
            let counts = scored.peek().is_some_and(|run| run.contains(&k));
            let at = k.saturating_sub(self.point.dynamics.delay);
            for (input, sensitivity) in self.sensitivities.iter_mut().enumerate() {
                // what the delay brings in first is the time in which nothing moved
                if at > 0 || k == 0 {
                    let u = self.drive[(at, input)];
                    sensitivity.step(u, self.columns[input].as_mut_slice());
                }
            }
            if k == 0 {
                self.sections.iter_mut().for_each(|section| section.stand(&self.columns));
            }
            if k == warmup {
                self.sections.iter_mut().for_each(|state| state.free += &state.start);
            }
            if counts || traced {
                self.respond();
            }
            if k == 0 {
                let first = |output| {
                    let first = self.displacement(output) + self.displaced[(0, output)];
                    Sensing::new(self.point, output, first, self.layout.len)
                };
                sensing = (0..outputs).map(first).collect();
            }
            let moment = self.point.moment(k, &[]);
            for output in 0..outputs {
                if counts || (traced && k >= warmup) {
                    let mut own = regressors[output].column_mut(filled.min(block - 1));
                    let row = if counts { own.as_mut_slice() } else { &mut unscored[..] };
                    let displacement = self.fill(output, row);
                    self.turn(output, displacement, Some(row));
                    let displaced = displacement + self.displaced[(k, output)];
                    let sensed = sensing[output].step(displaced, Some(row), moment);
                    if counts {
                        let simulated = sensed + self.fill_added(output, k, row);
                        let measured = self.experiment.output[(k, output)];
                        residuals[(output, filled)] = measured - simulated;
                    }
                } else if traced {
                    let displacement = self.displacement(output);
                    self.turn(output, displacement, None);
                    let displaced = displacement + self.displaced[(k, output)];
                    sensing[output].step(displaced, None, moment);
                }
            }
            if counts {
                filled += 1;
            }
            self.sections.iter_mut().for_each(|section| section.step(&self.columns));
            if k >= warmup || self.feedback.closed {
                self.sections.iter_mut().for_each(SectionState::relax);
                self.kick();
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

    /// The displacement of one output.
    fn displacement(&self, output: usize) -> f64 {
        let driven: f64 = self.responses.iter().map(|response| response[(0, output)]).sum();
        let own = |state: &SectionState| (state.section.c.row(output) * &state.free)[0];
        driven + self.sections.iter().map(own).sum::<f64>()
    }

    /// Adds what has come around the loop to a row, and takes what acts back from this sample.
    fn turn(&mut self, output: usize, displacement: f64, row: Option<&mut [f64]>) {
        if !self.feedback.closed {
            return;
        }
        self.feedback.drives.fill(0.0);
        for effect in self.point.loops().filter(|e| e.block().channel() == output) {
            for (i, (drive, slope)) in effect.block().feedback(displacement).into_iter().enumerate()
            {
                self.feedback.drives[(i, 0)] += drive;
                self.feedback.drives[(i, 1)] += slope;
            }
        }
        let Some(row) = row else { return };
        let (tangents, drives) = (&mut self.feedback.tangents, &self.feedback.drives);
        let mut first = 0;
        for SectionState { section, .. } in &self.sections {
            for j in 0..section.order() {
                let c = section.c[(output, j)];
                if c != 0.0 {
                    let column = tangents.column(first + j);
                    row.iter_mut().zip(column.iter()).for_each(|(value, own)| *value += c * own);
                }
            }
            first += section.order();
        }
        let mut first = 0;
        for SectionState { section, matrix, .. } in &self.sections {
            let n = section.order();
            let mut own = tangents.columns_mut(first, n);
            let moved = &own * matrix.transpose();
            own.copy_from(&moved);
            for j in 0..n {
                let slope = drives[(first + j, 1)];
                let mut column = own.column_mut(j);
                column.iter_mut().zip(row.iter()).for_each(|(own, value)| *own += slope * value);
            }
            first += n;
        }
    }

    /// Drives the states with what acts back.
    fn kick(&mut self) {
        if !self.feedback.closed {
            return;
        }
        let mut first = 0;
        for state in &mut self.sections {
            let order = state.section.order();
            state.free += self.feedback.drives.view((first, 0), (order, 1));
            first += order;
        }
    }

    /// Writes the derivatives of what is added behind the output stage, and by the values of effects;
    /// returns what is added.
    fn fill_added(&self, output: usize, k: usize, row: &mut [f64]) -> f64 {
        let layout = self.layout;
        let mut added = self.added[(k, output)];
        let knots = &self.point.offsets[self.index];
        for (column, offsets) in knots.column_iter().enumerate() {
            let first = layout.offsets[self.index].start + column * knots.nrows();
            row[first..first + knots.nrows()].fill(0.0);
            if column == output {
                for (knot, weight) in hats(k, self.experiment.input.nrows(), knots.nrows()) {
                    row[first + knot] = weight;
                    added += weight * offsets[knot];
                }
            }
        }
        for (columns, unknowns) in self.effects.iter().zip(&layout.effects) {
            for (column, i) in columns.iter().zip(unknowns.clone()) {
                row[i] = column[(k, output)];
            }
        }
        added
    }

    /// Writes the derivatives of the displacement of one output; returns the displacement itself.
    fn fill(&self, output: usize, row: &mut [f64]) -> f64 {
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
            // what stands beside G is no part of the held gain
            let own = |still: f64| if section.beside.is_none() { still } else { 0.0 };
            for (j, i) in unknowns.a.clone().enumerate() {
                let still: f64 = own(held.iter().map(|&(k, v)| standing[(0, k)] * v).sum());
                row[i] = gain[(output, j)] * still - state.seen(output, j, state.fed_back);
            }
            for (place, i) in unknowns.b.clone().enumerate() {
                let (input, j) = (place / order, place % order);
                let still = own(held.iter().find(|h| h.0 == input).map_or(0.0, |h| h.1));
                row[i] = state.seen(output, j, state.driven[input]) - gain[(output, j)] * still;
            }
            for (place, i) in unknowns.c.clone().enumerate() {
                let j = place / outputs;
                let still: f64 = own(held.iter().map(|&(k, v)| standing[(j, k)] * v).sum());
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
pub(crate) fn hats(k: usize, samples: usize, knots: usize) -> impl Iterator<Item = (usize, f64)> {
    let place = k as f64 / (samples.max(2) - 1) as f64 * (knots - 1) as f64;
    let left = (place as usize).min(knots.saturating_sub(2));
    let right = place - left as f64;
    [(left, 1.0 - right), (left + 1, right)].into_iter().take(knots.min(2))
}
