//! The model linearized around its hysteresis parameters, gathered into normal equations.

use super::sensitivity::{Derivatives, Parameters, Sensitivity};
use crate::linear::{NormalEquations, StateSpace, bounded};
use crate::{Error, Experiment, Matrix, Record};
use nalgebra::DVector;
use std::ops::Range;

/// The hysteresis parameters of every input, and the play outputs before every experiment.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// One set of parameters an input.
    pub channels: Vec<Parameters>,
    /// F(-1) of the plays, `[experiment][input][play]`.
    pub starts: Vec<Vec<Vec<f64>>>,
}

/// Which parameters besides the weights and slopes are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Freedom {
    /// Thresholds and start values.
    pub derivatives: Derivatives,
    /// Columns that let G's numerator move (its DC gain kept), so that the weights need not make up
    /// for an error of G. They are solved for and thrown away.
    pub numerator: bool,
}

/// Where each group of unknowns stands in the normal equations.
struct Layout {
    weights: Vec<Range<usize>>,
    /// Offsets, free responses and numerator: linear, and of no further use.
    linear_end: usize,
    offsets: usize,
    free: usize,
    numerator: usize,
    slopes: Vec<Range<usize>>,
    thresholds: Vec<Range<usize>>,
    starts: Vec<Vec<Range<usize>>>,
    len: usize,
}

impl Layout {
    fn new(point: &Point, linear: &StateSpace, record: &Record, freedom: Freedom) -> Self {
        let mut end = 0;
        let mut take = |count: usize| {
            end += count;
            end - count..end
        };
        let (order, outputs) = (linear.order(), linear.outputs());
        let count = record.experiments().len();
        let weights = point.channels.iter().map(|c| take(c.half_widths.len())).collect();
        let offsets = take(count * outputs).start;
        let free = take(count * outputs * order).start;
        let numerator = take(if freedom.numerator { outputs * order } else { 0 });
        let linear_end = numerator.end;
        let slopes = point.channels.iter().map(|c| take(c.slopes.len())).collect();
        let moved = |zones: usize| {
            if freedom.derivatives.thresholds { zones } else { 0 }
        };
        let thresholds = point.channels.iter().map(|c| take(moved(c.slopes.len()))).collect();
        let started = |plays: usize| if freedom.derivatives.starts { plays } else { 0 };
        let starts = (0..count)
            .map(|_| point.channels.iter().map(|c| take(started(c.half_widths.len()))).collect())
            .collect();
        let numerator = numerator.start;
        let len = take(0).end;
        Self { weights, linear_end, offsets, free, numerator, slopes, thresholds, starts, len }
    }
}

/// Normal equations for steps away from a [`Point`], and the cost that its weights can reach.
pub(super) struct Linearization {
    equations: NormalEquations,
    layout: Layout,
    freedom: Freedom,
    /// Sum of squares with the best weights, offsets and free responses.
    pub cost: f64,
    best_weights: DVector<f64>,
}

/// Samples that are filtered and added at once.
const BLOCK: usize = 1024;

impl Linearization {
    /// Streams the record through the hysteresis, its derivatives and G.
    pub(super) fn new(
        point: &Point,
        linear: &StateSpace,
        record: &Record,
        freedom: Freedom,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let layout = Layout::new(point, linear, record, freedom);
        let mut equations = NormalEquations::zeros(layout.len, 1);
        for (index, experiment) in record.experiments().iter().enumerate() {
            check()?;
            let mut stream = Stream::new(point, linear, experiment, index, freedom.derivatives);
            stream.run(&layout, &mut equations, freedom, check)?;
        }
        let lower = lower_bounds(point, &layout);
        let end = layout.linear_end;
        let gram = equations.gram.view((0, 0), (end, end)).into_owned();
        let rhs = equations.rhs.view((0, 0), (end, 1)).column(0).into_owned();
        let best_weights = bounded(&gram, &rhs, &lower.rows(0, end).into_owned());
        let explained = 2.0 * best_weights.dot(&rhs) - best_weights.dot(&(gram * &best_weights));
        let cost = (equations.squares[0] - explained).max(0.0);
        Ok(Self { equations, layout, freedom, cost, best_weights })
    }

    /// The point with the weights that fit best, all else kept.
    pub(super) fn with_best_weights(&self, point: &Point) -> Point {
        let mut moved = point.clone();
        for (channel, range) in moved.channels.iter_mut().zip(&self.layout.weights) {
            for (weight, step) in channel.weights.iter_mut().zip(range.clone()) {
                *weight = (*weight + self.best_weights[step]).max(0.0);
            }
        }
        moved
    }

    /// A Levenberg-Marquardt step; `damping` acts on what is not linear.
    pub(super) fn step(&self, point: &Point, damping: f64, range: &[(f64, f64)]) -> Point {
        let Layout { weights, slopes, thresholds, starts, linear_end, len, .. } = &self.layout;
        let mut gram = self.equations.gram.clone();
        for i in *linear_end..*len {
            gram[(i, i)] *= 1.0 + damping;
        }
        let lower = lower_bounds(point, &self.layout);
        let step = bounded(&gram, &self.equations.rhs.column(0).into_owned(), &lower);
        let mut moved = point.clone();
        for (index, channel) in moved.channels.iter_mut().enumerate() {
            for (weight, i) in channel.weights.iter_mut().zip(weights[index].clone()) {
                *weight = (*weight + step[i]).max(0.0);
            }
            for (slope, i) in channel.slopes.iter_mut().zip(slopes[index].clone()) {
                *slope += step[i];
            }
            let (low, high) = range[index];
            let longest = 0.5 * (high - low) / (channel.thresholds.len() + 1) as f64;
            let inside = 0.01 * (high - low);
            for (threshold, i) in channel.thresholds.iter_mut().zip(thresholds[index].clone()) {
                let target = (*threshold + step[i].clamp(-longest, longest))
                    .clamp(low + inside, high - inside);
                // A deadzone that crossed zero would change its side.
                if target * *threshold > 0.0 {
                    *threshold = target;
                }
            }
        }
        if self.freedom.derivatives.starts {
            for (experiment, ranges) in moved.starts.iter_mut().zip(starts) {
                for (plays, range) in experiment.iter_mut().zip(ranges) {
                    for (start, i) in plays.iter_mut().zip(range.clone()) {
                        *start += step[i];
                    }
                }
            }
        }
        moved
    }
}

/// Weights may fall to zero, everything else is free.
fn lower_bounds(point: &Point, layout: &Layout) -> DVector<f64> {
    let mut lower = DVector::from_element(layout.len, f64::NEG_INFINITY);
    for (channel, range) in point.channels.iter().zip(&layout.weights) {
        for (weight, i) in channel.weights.iter().zip(range.clone()) {
            lower[i] = -weight;
        }
    }
    lower
}

/// One experiment on its way through the hysteresis of every input and through G.
struct Stream<'a> {
    linear: &'a StateSpace,
    experiment: &'a Experiment,
    index: usize,
    sensitivities: Vec<Sensitivity<'a>>,
    /// Columns of one sample of each input: v, weights, slopes, thresholds, starts.
    columns: Vec<DVector<f64>>,
    /// States of G for each of these columns, (order, columns).
    states: Vec<Matrix>,
    /// What a unit of v of each input leaves in the state, (order, inputs).
    static_states: Matrix,
    /// State of the response to an impulse before the record.
    free: DVector<f64>,
}

impl<'a> Stream<'a> {
    fn new(
        point: &'a Point,
        linear: &'a StateSpace,
        experiment: &'a Experiment,
        index: usize,
        wanted: Derivatives,
    ) -> Self {
        let sensitivities: Vec<_> = point
            .channels
            .iter()
            .zip(&point.starts[index])
            .map(|(parameters, start)| Sensitivity::new(parameters, start, wanted))
            .collect();
        let sizes: Vec<_> =
            point.channels.iter().map(|c| Sensitivity::columns(c, wanted)).collect();
        let static_state = |input: usize| {
            let unit = DVector::from_fn(linear.inputs(), |i, _| f64::from(u8::from(i == input)));
            linear.equilibrium(&unit)
        };
        let static_states =
            Matrix::from_columns(&(0..linear.inputs()).map(static_state).collect::<Vec<_>>());
        Self {
            linear,
            experiment,
            index,
            sensitivities,
            columns: sizes.iter().map(|&size| DVector::zeros(size)).collect(),
            states: sizes.iter().map(|&size| Matrix::zeros(linear.order(), size)).collect(),
            static_states,
            free: linear.b().column_sum(),
        }
    }

    fn run(
        &mut self,
        layout: &Layout,
        equations: &mut NormalEquations,
        freedom: Freedom,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (outputs, order) = (self.linear.outputs(), self.linear.order());
        let (warmup, samples) = (self.experiment.warmup, self.experiment.input.nrows());
        let mut regressors = vec![Matrix::zeros(layout.len, BLOCK); outputs];
        let mut targets = vec![Matrix::zeros(1, BLOCK); outputs];
        let mut filled = 0;
        let mut scratch: Vec<Matrix> = self.states.clone();
        let mut responses: Vec<Matrix> =
            self.columns.iter().map(|c| Matrix::zeros(outputs, c.len())).collect();
        for k in 0..samples {
            for (input, sensitivity) in self.sensitivities.iter_mut().enumerate() {
                let u = self.experiment.input[(k, input)];
                sensitivity.step(u, self.columns[input].as_mut_slice());
                let (columns, state) = (&self.columns[input], &mut self.states[input]);
                if k == 0 {
                    // before the record the actuator stood still
                    state.ger(1.0, &self.static_states.column(input), columns, 0.0);
                }
                if k >= warmup {
                    let response = &mut responses[input];
                    response.ger(1.0, &self.linear.d().column(input), columns, 0.0);
                    response.gemm(1.0, self.linear.c(), state, 1.0);
                }
            }
            if k >= warmup {
                for output in 0..outputs {
                    let mut row = regressors[output].column_mut(filled);
                    let simulated =
                        self.fill(layout, freedom, output, &responses, row.as_mut_slice());
                    targets[output][filled] = self.experiment.output[(k, output)] - simulated;
                }
                filled += 1;
            }
            for (input, state) in self.states.iter_mut().enumerate() {
                let next = &mut scratch[input];
                next.ger(1.0, &self.linear.b().column(input), &self.columns[input], 0.0);
                if order > 0 {
                    next.gemm(1.0, self.linear.a(), state, 1.0);
                }
                std::mem::swap(state, next);
            }
            self.free = self.linear.a() * &self.free;
            if filled == BLOCK || (k + 1 == samples && filled > 0) {
                check()?;
                for (regressor, target) in regressors.iter().zip(&targets) {
                    equations.add(
                        &regressor.columns(0, filled).into_owned(),
                        &target.columns(0, filled).into_owned(),
                    );
                }
                filled = 0;
            }
        }
        Ok(())
    }

    /// Writes the derivatives of one output sample; returns the output itself, without offset.
    fn fill(
        &self,
        layout: &Layout,
        freedom: Freedom,
        output: usize,
        responses: &[Matrix],
        row: &mut [f64],
    ) -> f64 {
        let (order, outputs) = (self.linear.order(), self.linear.outputs());
        let mut simulated = 0.0;
        for (input, response) in responses.iter().enumerate() {
            let (n, zones) = (layout.weights[input].len(), layout.slopes[input].len());
            let moved = layout.thresholds[input].len();
            let at = |column: usize| response[(output, column)];
            simulated += at(0);
            let groups = [
                (layout.weights[input].clone(), 1),
                (layout.slopes[input].clone(), 1 + n),
                (layout.thresholds[input].clone(), 1 + n + zones),
                (layout.starts[self.index][input].clone(), 1 + n + zones + moved),
            ];
            for (unknowns, first) in groups {
                for (column, unknown) in unknowns.enumerate() {
                    row[unknown] = at(first + column);
                }
            }
        }
        row[layout.offsets + self.index * outputs + output] = 1.0;
        if self.experiment.warmup == 0 {
            let first = layout.free + (self.index * outputs + output) * order;
            row[first..first + order].copy_from_slice(self.free.as_slice());
        }
        if freedom.numerator {
            let first = layout.numerator + output * order;
            for state in 0..order {
                row[first + state] = (0..self.columns.len())
                    .map(|input| {
                        let still = self.static_states[(state, input)] * self.columns[input][0];
                        self.states[input][(state, 0)] - still
                    })
                    .sum();
            }
        }
        simulated
    }
}
