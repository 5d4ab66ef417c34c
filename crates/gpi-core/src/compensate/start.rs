//! Where the stage stands before the drive begins.
//!
//! At rest at an input, z is known, but the output of a play of half-width r may be any `F = z + s r` with `-1 <= s <= 1`: it
//! depends on how the stage came there. Three things decide what is known of s:
//!
//! - a state: everything is known,
//! - an input of zero: the plays are at rest, as in an identification,
//! - a measured output at rest: the mean of s over the plays' weights is known.
//!
//! Otherwise the stage is taken as raised from zero to the input once, and [`Start::others`] says where else it may stand.

use super::solve::zero_of;
use crate::operators::Operator;
use crate::{Error, Matrix, Model, ModelState};

/// Where the plays may stand within their gaps, as s for the narrower and for the wider half of them: reached from above,
/// from below, in the middle of every gap as after a decaying oscillation, half-way, and after a small reversal at the end of
/// a wide one.
const PLACES: [[f64; 2]; 7] =
    [[1.0, 1.0], [-1.0, -1.0], [0.0, 0.0], [0.5, 0.5], [-0.5, -0.5], [1.0, -1.0], [-1.0, 1.0]];

/// Shift of s that moves every play to the same end of its gap.
const FULL: f64 = 2.0;

/// Part of the interval of outputs at rest by which a measured output may lie outside of it.
const OUTSIDE: f64 = 1e-6;

/// Where the stage stands before the drive begins.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// At rest at an input, one value for each input.
    Input(Vec<f64>),
    /// At rest at an input, with a measured output, for a model of one input and one output.
    Output {
        /// The input at rest, in its unit.
        input: f64,
        /// The output at rest, in its unit.
        output: f64,
    },
    /// At the input at which a known state was left, one value for each input.
    State {
        /// The last input, each in its unit.
        input: Vec<f64>,
        /// The state, as of [`Model::start`] or [`Model::simulate_from`].
        state: ModelState,
    },
}

impl Start {
    /// The input before the drive begins.
    pub(super) fn input(&self) -> &[f64] {
        match self {
            Self::Input(input) | Self::State { input, .. } => input,
            Self::Output { input, .. } => std::slice::from_ref(input),
        }
    }

    /// Refuses a start that the model cannot have.
    pub(super) fn validate(&self, model: &Model) -> Result<(), Error> {
        let inputs = ("model", model.inputs().len());
        Error::require_equal("inputs", ("start", self.input().len()), inputs)?;
        let requirement = "the input before the drive begins must be finite";
        let finite = self.input().iter().all(|value| value.is_finite());
        Error::require(finite, "start", format!("{:?}", self.input()), requirement)?;
        match self {
            Self::Input(_) => Ok(()),
            Self::Output { output, .. } => {
                let requirement = "the output at rest must be finite";
                Error::require(output.is_finite(), "start_output", output, requirement)?;
                let requirement =
                    "it determines the state only for one input and one output; give `start_state`";
                let one = inputs.1 == 1 && model.outputs().len() == 1;
                Error::require(one, "start_output", output, requirement)?;
                reachable(model, self.input()[0], *output)
            }
            Self::State { input, state } => {
                let (expected, linear) = (model.start(input)?, state.linear.len());
                let states = ("model", expected.linear.len());
                Error::require_equal("states", ("start_state", linear), states)
            }
        }
    }

    /// The same for a model that has a part of the effects of `whole`, and its dynamics or none.
    pub(super) fn of_part(&self, whole: &Model, part: &Model) -> Self {
        let Self::State { input, state } = self else { return self.clone() };
        let mut state = state.clone();
        let memories = whole.effects().iter().zip(&state.effects);
        let kept = memories.filter(|(effect, _)| part.effects().contains(effect));
        state.effects = kept.map(|(_, memory)| memory.clone()).collect();
        let order = part.linear().order();
        state.linear = state.linear.resize_vertically(order, 0.0);
        Self::State { input: input.clone(), state }
    }

    /// The state before the drive begins.
    pub(super) fn state(&self, model: &Model) -> Result<ModelState, Error> {
        match self {
            Self::Input(input) => model.start(input),
            Self::Output { input, output } => matched(model, *input, [0.0, 0.0], *output),
            Self::State { state, .. } => Ok(state.clone()),
        }
    }

    /// Other states in which the stage may be, as far as is known; none where the state is known.
    pub(super) fn others(&self, model: &Model) -> Result<Vec<ModelState>, Error> {
        match self {
            Self::State { .. } => Ok(Vec::new()),
            Self::Input(input) if input.iter().all(|&value| value == 0.0) => Ok(Vec::new()),
            Self::Input(input) => {
                PLACES.iter().map(|&places| standing(model, input, places, 0.0)).collect()
            }
            Self::Output { input, output } => {
                PLACES.iter().map(|&places| matched(model, *input, places, *output)).collect()
            }
        }
    }
}

/// The state at rest at an input with the narrower and the wider plays at given places of their gaps, moved by `shift`.
fn standing(
    model: &Model,
    input: &[f64],
    [narrow, wide]: [f64; 2],
    shift: f64,
) -> Result<ModelState, Error> {
    let mut state = model.start(input)?;
    let mut v = nalgebra::DVector::zeros(input.len());
    for (channel, hysteresis) in model.hysteresis().iter().enumerate() {
        let own = &mut state.hysteresis[channel];
        let plays = hysteresis.plays();
        let z = hysteresis.envelope().step(&mut own.envelope.clone(), input[channel]);
        let mut sorted = plays.half_widths().to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let place = |&r: &f64| {
            let s = if r < middle { narrow } else { wide };
            z + (s + shift).clamp(-1.0, 1.0) * r
        };
        own.plays = plays.state_from(plays.half_widths().iter().map(place).collect())?;
        let read = hysteresis.plays().step(&mut own.plays.clone(), z);
        v[channel] = model.read_plays(channel, own, read);
    }
    state.linear = model.linear().equilibrium(&v);
    model.rest_effects(&mut state, input, &v);
    Ok(state)
}

/// Refuses an output at rest that no place of the plays leads to.
fn reachable(model: &Model, input: f64, output: f64) -> Result<(), Error> {
    let end = |shift: f64| shown(model, input, [0.0, 0.0], shift);
    let (low, high) = (end(-FULL)?, end(FULL)?);
    let (least, most) = (low.min(high), low.max(high));
    let slack = OUTSIDE * (most - least).max(output.abs());
    let requirement = format!(
        "in the model, a stage that rests at an input of {input} has an output between {least:.6} and {most:.6}; \
         check the input, or leave the output out"
    );
    let inside = least - slack <= output && output <= most + slack;
    Error::require(inside, "start_output", output, requirement)
}

/// The output at rest in this state, for a model of one input and one output.
fn shown(model: &Model, input: f64, places: [f64; 2], shift: f64) -> Result<f64, Error> {
    let mut state = standing(model, &[input], places, shift)?;
    Ok(model.simulate_from(&mut state, &Matrix::from_element(1, 1, input))?[0])
}

/// The state of these places, moved by a common shift, in which the output at rest is the measured one.
fn matched(model: &Model, input: f64, places: [f64; 2], output: f64) -> Result<ModelState, Error> {
    let shown = |shift: f64| shown(model, input, places, shift);
    let sign = if shown(FULL)? < shown(-FULL)? { -1.0 } else { 1.0 };
    let missing = |shift: f64| shown(shift).map_or(f64::NAN, |y| sign * (y - output));
    standing(model, &[input], places, zero_of(missing, 0.0, 0.1, [-FULL, FULL]))
}
