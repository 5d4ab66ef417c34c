//! Inversion of the hysteresis: exactly, or sample by sample if effects act on its plays.

use super::backlash::{continued, rising};
use super::solve::zero_of;
use crate::effects::{Effect, Stage};
use crate::operators::{GpiState, Operator};
use crate::{Error, Matrix, Model, ModelState};

/// A sample is out of reach if v misses the wanted value by more than this fraction of the largest v: far above the
/// error of the search, which ends at the precision of `f64`.
const NEAR: f64 = 1e-9;

/// First step of the search for the first sample, as a fraction of the largest v; later ones start with the last change.
const FIRST_STEP: f64 = 1e-3;

/// Least first step of the search, as a fraction of the largest v, for samples at which u does not change.
const LEAST_STEP: f64 = 1e-6;

/// The drive (samples, inputs) for v (samples, inputs), and the number of samples at a limit; from a state, or from the
/// steady state at the first drive.
pub(super) fn undone(
    model: &Model,
    v: &Matrix,
    limits: &[[f64; 2]],
    begins: Option<&ModelState>,
) -> Result<(Matrix, usize), Error> {
    let (mut drive, mut out_of_reach) = (v.clone(), 0);
    for (input, (mut column, &limits)) in drive.column_iter_mut().zip(limits).enumerate() {
        let hysteresis = &model.hysteresis()[input];
        let acts = |effect: &Effect| {
            effect.stage() == Stage::Plays && effect.place().input() == Some(input)
        };
        let rising = rising(hysteresis)?;
        let inverse = rising.inverse_within(limits[0], limits[1])?;
        if model.effects().iter().any(acts) {
            let plays = begins.map(|state| Plays::of(model, input, state.clone()));
            out_of_reach += follow(model, input, column.as_mut_slice(), inverse.drive(), plays)?;
        } else {
            let mut state = match begins {
                Some(state) => rising.inverse_state(&continued(hysteresis, state, input)?)?,
                None => inverse.rest(),
            };
            inverse.in_place(&mut state, column.as_mut_slice());
            out_of_reach += state.out_of_reach as usize;
        }
    }
    Ok((drive, out_of_reach))
}

/// The hysteresis of one input with the effects on its plays.
#[derive(Clone)]
struct Plays<'a> {
    model: &'a Model,
    input: usize,
    state: GpiState<f64, Vec<f64>>,
    memories: Vec<Vec<f64>>,
}

impl<'a> Plays<'a> {
    /// The steady state in which this input is `u` and all others are zero.
    fn at_steady_state(model: &'a Model, input: usize, u: f64) -> Result<Self, Error> {
        let mut inputs = vec![0.0; model.inputs().len()];
        inputs[input] = u;
        Ok(Self::of(model, input, model.start(&inputs)?))
    }

    /// Those of a state.
    fn of(model: &'a Model, input: usize, state: ModelState) -> Self {
        let ModelState { mut hysteresis, effects: memories, .. } = state;
        Self { model, input, state: hysteresis.swap_remove(input), memories }
    }

    /// v for the next sample.
    fn step(&mut self, u: f64) -> Result<f64, Error> {
        let mut signal = [u];
        self.model.play_from(self.input, &mut self.state, &mut self.memories, &mut signal)?;
        Ok(signal[0])
    }
}

/// Replaces v of an input by u, and counts the samples for which no u between the limits exists.
fn follow<'a>(
    model: &'a Model,
    input: usize,
    signal: &mut [f64],
    limits: [f64; 2],
    mut plays: Option<Plays<'a>>,
) -> Result<usize, Error> {
    let size = signal.iter().fold(f64::MIN_POSITIVE, |size, v| size.max(v.abs()));
    let mut before = plays.as_ref().map_or(0.0, |plays| plays.state.envelope.previous);
    let (mut out_of_reach, mut stride) = (0, FIRST_STEP * size);
    for value in signal {
        let wanted = *value;
        let reached = |u: f64| {
            let mut own = match &plays {
                Some(plays) => plays.clone(),
                None => Plays::at_steady_state(model, input, u)?,
            };
            Ok::<_, Error>((own.step(u)?, own))
        };
        let missing = |u: f64| reached(u).map_or(f64::NAN, |(v, _)| v - wanted);
        let u = zero_of(missing, before, stride, limits);
        let (v, own) = reached(u)?;
        plays = Some(own);
        out_of_reach += usize::from((v - wanted).abs() > NEAR * size);
        stride = (u - before).abs().max(LEAST_STEP * size);
        before = u;
        *value = u;
    }
    Ok(out_of_reach)
}
