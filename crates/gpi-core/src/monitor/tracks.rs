//! The model and its neighbours, all driven by the same input.

use super::settings::MonitorSettings;
use crate::{Error, Matrix, Model, ModelState};

/// A model and where it is.
#[derive(Clone, Debug)]
struct Track {
    model: Model,
    state: ModelState,
}

impl Track {
    /// A model that has stood at a constant input (one value for each input).
    fn standing(model: &Model, input: &[f64]) -> Result<Self, Error> {
        Ok(Self { model: model.clone(), state: model.start(input)? })
    }

    fn outputs(&mut self, input: &Matrix, covariates: &Matrix) -> Result<Matrix, Error> {
        self.model.simulate_with(&mut self.state, input, covariates)
    }
}

/// A run of samples of the model and of its neighbours, each (samples, outputs).
pub(super) struct Outputs {
    /// The model's output.
    pub predicted: Matrix,
    /// Of each neighbour, the output's derivative by its relative change.
    pub derivatives: Vec<Matrix>,
    /// Mean square of the output's differences that uncertain parameters make possible.
    pub parameters: Matrix,
    /// The largest square of the differences that the unknown start makes possible.
    pub start: Matrix,
}

/// The simulations of a monitor.
#[derive(Clone, Debug)]
pub(super) struct Tracks {
    model: Track,
    moved: Vec<Track>,
    step: f64,
    /// Neighbours by the covariance of the parameters, each with the factor that makes its difference one draw.
    draws: Vec<(Track, f64)>,
    /// The machine may have stood at the ends of its range, or at zero, until just before the first sample.
    starts: Vec<Track>,
    deviations: f64,
    /// Mean square of each output's part that only depends on the time of the training record, which is unknown here.
    pub of_time: Vec<f64>,
}

impl Tracks {
    /// For a first run of samples (samples, inputs): the machine has stood at the first one. `driven` is the model without
    /// the effects that are functions of the time of its training record; `neighbours` are models in which one quantity
    /// has moved.
    pub(super) fn new(
        (model, driven, neighbours): (&Model, &Model, &[Model]),
        settings: &MonitorSettings,
        input: &Matrix,
        covariates: &Matrix,
    ) -> Result<Self, Error> {
        let whole = |model: &Model| model.simulate_beside(input, covariates);
        let of_time = whole(model)? - whole(driven)?;
        let of_time = of_time.column_iter().map(|own| own.norm_squared() / own.len() as f64);
        let (model, of_time) = (driven, of_time.collect());
        let row = |pick: fn(f64, f64) -> f64| -> Vec<f64> {
            input.column_iter().map(|u| u.iter().copied().reduce(pick).unwrap_or(0.0)).collect()
        };
        let first = row(|first, _| first);
        let moved = neighbours.iter().map(|neighbour| Track::standing(neighbour, &first));
        let draws = (0..settings.draws)
            .filter_map(|draw| drawn(model, draw))
            .map(|(neighbour, factor)| Ok((Track::standing(&neighbour, &first)?, factor)));
        let ends = [row(|low, u| low.min(u).min(0.0)), row(|high, u| high.max(u).max(0.0))];
        Ok(Self {
            model: Track::standing(model, &first)?,
            moved: moved.collect::<Result<_, Error>>()?,
            step: settings.step,
            draws: draws.collect::<Result<_, Error>>()?,
            starts: ends
                .iter()
                .map(|end| Track::standing(model, end))
                .collect::<Result<_, Error>>()?,
            deviations: settings.deviations,
            of_time,
        })
    }

    /// Runs all of them. A start whose output differs by less than `forgotten` (one value for each output) in the whole run
    /// is not simulated any longer.
    pub(super) fn run(
        &mut self,
        input: &Matrix,
        covariates: &Matrix,
        forgotten: &[f64],
    ) -> Result<Outputs, Error> {
        let predicted = self.model.outputs(input, covariates)?;
        let step = self.step;
        let derivative = |track: &mut Track| {
            Ok::<_, Error>((track.outputs(input, covariates)? - &predicted) / step)
        };
        let derivatives = self.moved.iter_mut().map(derivative).collect::<Result<_, _>>()?;
        let mut parameters = Matrix::zeros(predicted.nrows(), predicted.ncols());
        let share = self.deviations.powi(2) / self.draws.len().max(1) as f64;
        for (track, factor) in &mut self.draws {
            let difference = track.outputs(input, covariates)? - &predicted;
            parameters += difference.map(|d| share * (d * *factor).powi(2));
        }
        let mut lasting = Vec::new();
        let mut start = Matrix::zeros(predicted.nrows(), predicted.ncols());
        for mut track in self.starts.drain(..) {
            let difference = track.outputs(input, covariates)? - &predicted;
            let differs =
                |(column, least): (usize, &f64)| difference.column(column).amax() > *least;
            if forgotten.iter().enumerate().any(differs) {
                lasting.push(track);
            }
            start.zip_apply(&difference, |most, d| *most = most.max(d * d));
        }
        self.starts = lasting;
        Ok(Outputs { predicted, derivatives, parameters, start })
    }
}

/// A model of the uncertain parameters, a small step from the model so that it is valid, and the factor from this step to one
/// draw; `None` without a covariance, or if no step is valid.
///
/// With axes d_k of the covariance and signs s_k, `sum_k s_k d_k` has this covariance over all signs (M. F. Hutchinson,
/// *A stochastic estimator of the trace*, 1990).
fn drawn(model: &Model, draw: usize) -> Option<(Model, f64)> {
    let prediction = model.prediction()?;
    let numbers = model.numbers();
    let mut change = vec![0.0; numbers.len()];
    for (axis, parts) in prediction.axes.iter().enumerate() {
        let sign = if hash(draw, axis) & 1 == 0 { 1.0 } else { -1.0 };
        for (&place, &part) in prediction.numbers.iter().zip(parts) {
            change[place] += sign * f64::from(part);
        }
    }
    // a whole draw may leave the valid models: poles beyond the unit circle, half-widths below zero
    [0.1, -0.1, 0.01, -0.01, 1e-3, -1e-3].into_iter().find_map(|step| {
        let there: Vec<f64> = numbers.iter().zip(&change).map(|(n, d)| n + step * d).collect();
        let neighbour = model.with_numbers(&there).ok()?;
        let stable = neighbour.linear().spectral_radius().ok()? < 1.0;
        stable.then_some((neighbour, 1.0 / step))
    })
}

/// Bits that look random (G. Steele and others, *Fast splittable pseudorandom number generators*, 2014).
fn hash(draw: usize, axis: usize) -> u64 {
    let mut z = (draw as u64) << 32 | axis as u64;
    z = z.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
