//! The linear dynamics from their own input v to y.

use crate::identify::settings::{BLOCK, IdentifySettings, RealizationPolicy};
use crate::linear::{self, Hankel, NormalEquations, Sections, StateSpace, bounded};
use crate::{Error, Experiment, Matrix, Record};
use nalgebra::DVector;

/// G, and how it explains y from v.
#[derive(Clone)]
pub(crate) struct Dynamics {
    /// ERA's singular values, and the poles it reflected.
    pub singular_values: Vec<f64>,
    pub reflected: usize,
    pub refit: Refit,
}

impl Dynamics {
    /// G in the form that is refined.
    pub(crate) fn sections(&self) -> Result<Sections, Error> {
        Sections::from_state_space(&self.refit.system, 0)
    }
}

/// C, D, offsets and free responses fitted to y with the poles kept.
#[derive(Clone)]
pub(crate) struct Refit {
    pub system: StateSpace,
    /// Root mean square over all outputs.
    pub rms: f64,
    criterion: f64,
}

/// The impulse response of a record whose input is v, from which G of any order is realized.
pub(crate) struct Response {
    taps: usize,
    hankel: Hankel,
}

impl Response {
    /// Least squares for so many taps, regularized where the input hardly excites them.
    pub(crate) fn estimate(
        record: &Record,
        taps: usize,
        settings: &IdentifySettings,
    ) -> Result<Self, Error> {
        let markov = linear::impulse_response(record, taps, settings.alternation.ridge)?;
        let hankel = Hankel::new(&markov, None)?;
        if hankel.rank() == 0 && markov[0].amax() == 0.0 {
            return Err(Error::NoResponse { taps, samples: record.scored() });
        }
        Ok(Self { taps, hankel })
    }

    /// G of its record. ERA gives the poles of each candidate order, least squares on y the zeros; the order is the one
    /// with the least BIC, if it is not given.
    pub(crate) fn realize(
        &self,
        record: &Record,
        order: Option<usize>,
        policy: &RealizationPolicy,
        check: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<Dynamics, Error> {
        let RealizationPolicy { small, largest, worth } = *policy;
        let Self { taps, hankel } = self;
        let orders: Vec<usize> = match order {
            Some(order) => vec![order],
            None => {
                let suggested = hankel.suggested_order();
                let rich = suggested > small && suggested <= largest;
                (1..=small).chain(rich.then_some(suggested)).collect()
            }
        };
        let mut best: Option<(usize, Refit)> = None;
        let mut refusal = None;
        let mut singular_values = Vec::new();
        // Reflected poles indicate states that only describe noise.
        let better = |reflected: usize, refit: &Refit, (least, best): &(usize, Refit)| {
            (reflected > 0, refit.criterion) < (*least > 0, best.criterion)
        };
        for order in orders.into_iter().filter(|&n| order.is_some() || n <= hankel.rank()) {
            check()?;
            let realized = hankel.realize(order).and_then(|era| {
                let refit = refit(record, era.system.clone())?;
                Ok((era, refit))
            });
            let (era, refit) = match realized {
                Ok(found) => found,
                Err(error) => {
                    refusal = Some(error);
                    continue;
                }
            };
            singular_values = era.singular_values;
            let is_worth =
                |(_, best): &(usize, Refit)| order <= small || refit.rms < worth * best.rms;
            let is_better = |best| is_worth(best) && better(era.reflected, &refit, best);
            if best.as_ref().is_none_or(is_better) {
                best = Some((era.reflected, refit));
            }
        }
        match (best, refusal) {
            (Some((reflected, refit)), _) => Ok(Dynamics { singular_values, reflected, refit }),
            (None, Some(error)) => Err(error),
            (None, None) => Err(Error::NoResponse { taps: *taps, samples: record.scored() }),
        }
    }

    /// Number of taps.
    pub(crate) fn taps(&self) -> usize {
        self.taps
    }
}

/// Fits C, D, an offset and a free response for each output by least squares, A and B kept.
pub(crate) fn refit(record: &Record, system: StateSpace) -> Result<Refit, Error> {
    let (order, inputs, outputs) = (system.order(), system.inputs(), system.outputs());
    let begins = |experiment: &Experiment| experiment.warmup == 0;
    // its offset, and its free response where no run-in hides it
    let own = |experiment: &Experiment| if begins(experiment) { 1 + order } else { 1 };
    let unknowns = order + inputs + record.experiments().iter().map(own).sum::<usize>();
    let mut next = order + inputs;
    let mut equations = NormalEquations::zeros(unknowns, outputs);
    for experiment in record.experiments() {
        let first = next;
        next += own(experiment);
        let states = states(&system, experiment);
        let samples = experiment.input.nrows();
        let mut free = system.b().column_sum();
        let mut row = vec![0.0; unknowns];
        let mut start = experiment.warmup;
        while start < samples {
            let rows = BLOCK.min(samples - start);
            let mut regressor = Matrix::zeros(unknowns, rows);
            for (k, mut column) in (start..).zip(regressor.column_iter_mut()) {
                row[..order].copy_from_slice(states.column(k).as_slice());
                for input in 0..inputs {
                    row[order + input] = experiment.input[(k, input)];
                }
                row[first] = 1.0;
                if begins(experiment) {
                    row[first + 1..next].copy_from_slice(free.as_slice());
                    free = system.a() * &free;
                }
                column.copy_from_slice(&row);
            }
            equations.add(&regressor, &experiment.output.rows(start, rows).transpose());
            start += rows;
        }
    }
    let free = DVector::from_element(unknowns, f64::INFINITY);
    let solutions: Vec<DVector<f64>> = (0..outputs)
        .map(|output| {
            let rhs = equations.rhs.column(output).into_owned();
            bounded(&equations.gram.clone().into(), &rhs, &-&free, &free)
        })
        .collect();
    let x = Matrix::from_columns(&solutions);
    let squares = equations.residual_squares(&x);
    let samples = record.scored() as f64;
    let parameters = (order * (inputs + outputs) + inputs * outputs) as f64;
    let deviance: f64 = squares.iter().map(|sum| samples * (sum / samples).max(1e-300).ln()).sum();
    let c = x.rows(0, order).transpose();
    let d = x.rows(order, inputs).transpose();
    Ok(Refit {
        system: StateSpace::new(system.a().clone(), system.b().clone(), c, d)?,
        rms: (squares.sum() / (samples * outputs as f64)).sqrt(),
        criterion: deviance + parameters * samples.ln(),
    })
}

/// The states (order, samples) of a model in steady state before the record.
fn states(system: &StateSpace, experiment: &Experiment) -> Matrix {
    let input = experiment.input.transpose();
    let drive = system.b() * &input;
    let mut states = Matrix::zeros(system.order(), input.ncols());
    let mut state = system.equilibrium(&input.column(0).into_owned());
    let mut next = state.clone();
    for k in 0..input.ncols() {
        states.set_column(k, &state);
        next.copy_from(&drive.column(k));
        if system.order() > 0 {
            next.gemv(1.0, system.a(), &state, 1.0);
        }
        std::mem::swap(&mut state, &mut next);
    }
    states
}
