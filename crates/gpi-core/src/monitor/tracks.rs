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
    /// Draws of the output's differences that uncertain parameters make possible; their squares add up to the variance.
    pub draws: Vec<Matrix>,
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
    /// Mean square of each output's part that only depends on the time of the training record, which is unknown here.
    pub of_time: Vec<f64>,
}

impl Tracks {
    /// For a first run of samples (samples, inputs): the machine has stood at the first one. `driven` is the model without
    /// the effects that are functions of the time of its training record; `neighbours` are models in which one quantity
    /// has moved, `draws` those of `drawn_models`.
    pub(super) fn new(
        (model, driven): (&Model, &Model),
        (neighbours, draws): (&[Model], &[(Model, f64)]),
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
        let draws = (draws.iter())
            .map(|(neighbour, factor)| Ok((Track::standing(neighbour, &first)?, *factor)));
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
        let share = (self.draws.len() as f64).sqrt().recip();
        let draw = |(track, factor): &mut (Track, f64)| {
            Ok::<_, Error>((track.outputs(input, covariates)? - &predicted) * (*factor * share))
        };
        let draws = self.draws.iter_mut().map(draw).collect::<Result<_, _>>()?;
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
        Ok(Outputs { predicted, derivatives, draws, start })
    }
}
