//! A model's chain with its effects, a block of samples at a time.
//!
//! ```text
//! drive = I(u);   v = GPI(drive) with effects on its plays;   displacement = G v + sections in parallel, loops closed;
//! y = H(displacement + added before) + added after
//! ```
//!
//! A block of samples starts from a [`ModelState`] and leaves the state behind its last sample, so that blocks of any
//! length give the same output as the whole record. Each stage reads the block once, from the first sample to the last,
//! before the next one begins. With loops, G and the loops alternate sample by sample, because w(k) drives the states
//! for k + 1.
//!
//! G here is a state space whose dead time is a shift register among the states; a loop sees the v that leaves it. The
//! estimator's [`super::point::Point`] has the same chain with G in sections and its dead time apart.

use super::between::held_inputs;
use super::hysteresis::Parameters;
use super::plays::Plays;
use super::stages::Stages;
use crate::effects::{
    ClosedLoops, Coefficients, Effect, InnerLoop, ParallelSections, Place, Quantity, SteadyForce,
    Units,
};
use crate::linear::advance;
use crate::model::{Model, ModelState};
use crate::operators::{GpiState, Operator};
use crate::{Channel, Error, Matrix};
use nalgebra::DVector;

impl Model {
    /// The same model with effects, which stand in their places of the chain, without [`Model::estimates`].
    ///
    /// ```
    /// use gpi_core::effects::AmplifierSlew;
    /// use gpi_core::linear::StateSpace;
    /// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
    /// use gpi_core::{Channel, Matrix, Model};
    /// let gain = |value| Matrix::from_element(1, 1, value);
    /// let linear = StateSpace::new(Matrix::zeros(0, 0), Matrix::zeros(0, 1), Matrix::zeros(1, 0), gain(1.0))?;
    /// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
    /// let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0], vec![2.0])?);
    /// let channel = |name| vec![Channel::new(name, "")];
    /// let model = Model::new(10.0, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])?;
    /// let slow = model.with_effects(vec![AmplifierSlew { input: 0, limit: 10.0 }.into()])?;
    /// let step = Matrix::from_column_slice(4, 1, &[0.0, 2.5, 2.5, 2.5]);
    /// assert_eq!(slow.simulate(&step)?.as_slice(), [0.0, 2.0, 4.0, 5.0]);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// An effect on a channel that the model does not have, or of another number of states.
    pub fn with_effects(mut self, effects: Vec<Effect>) -> Result<Self, Error> {
        self.effects = effects;
        // they belong to the model with its own effects
        self.estimates = None;
        self.prediction = None;
        self.validate_effects()?;
        Ok(self)
    }

    /// The effects, in the order in which they were given. Those of one place of the chain act one after the other in
    /// this order; the places themselves have a fixed order.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// The model without the effects that the input does not drive.
    pub(crate) fn driven(&self) -> Self {
        let mut driven = self.clone();
        driven.effects.retain(|effect| effect.entry().driven && !effect.is_added());
        driven
    }

    /// Rejects covariates that lack a measured column which an effect is made of; `names` are those of the columns that
    /// are there, in their order.
    ///
    /// # Errors
    /// The effect and the missing column.
    pub fn require_covariates(&self, names: &[&str]) -> Result<(), Error> {
        for effect in &self.effects {
            let Some((place, needed)) = effect.place().added().and_then(|own| own.column()) else {
                continue;
            };
            let found = names.get(place).copied();
            if found.is_none_or(|found| !found.is_empty() && found != needed) {
                let requirement = format!(
                    "the effect `{}` of the model needs the measured column `{needed}` as column {place}",
                    effect.name()
                );
                let value = found.map_or_else(|| format!("{} columns", names.len()), str::to_owned);
                return Err(Error::parameter("covariates", value, requirement));
            }
        }
        Ok(())
    }

    /// What an engineer would call an effect's parameters, with the units of this model's channels: those of the
    /// channel on which the effect acts.
    ///
    /// ```
    /// use gpi_core::effects::{Backlash, Effect};
    /// use gpi_core::linear::StateSpace;
    /// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
    /// use gpi_core::{Channel, Matrix, Model};
    /// # fn main() -> Result<(), gpi_core::Error> {
    /// # let gain = Matrix::from_element(1, 1, 1.0);
    /// # let linear = StateSpace::new(Matrix::zeros(0, 0), Matrix::zeros(0, 1), Matrix::zeros(1, 0), gain)?;
    /// # let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
    /// # let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0], vec![2.0])?);
    /// let (u, y) = (vec![Channel::new("drive", "V")], vec![Channel::new("position", "um")]);
    /// let model = Model::new(10.0, u, y, vec![gpi], linear, vec![0.0])?;
    /// let gap: Effect = Backlash { output: 0, half_width: 0.2, missing: None }.into();
    /// let quantities = model.quantities(&gap);
    /// assert_eq!((quantities[0].value, &quantities[0].unit[..]), (0.4, "um"));
    /// # Ok(())
    /// # }
    /// ```
    pub fn quantities(&self, effect: &Effect) -> Vec<Quantity> {
        let place = effect.place();
        let channel = place.input().or(place.output()).unwrap_or(0);
        let unit = |channels: &'_ [Channel]| {
            let own = channels.get(channel).or(channels.first());
            own.map_or(String::new(), |channel| channel.unit.clone())
        };
        let (input, output) = (unit(self.inputs()), unit(self.outputs()));
        let gains = |drives: &[f64]| self.linear().gains_from_states(drives);
        let force = |inner: &InnerLoop| {
            let behind = self.linear().behind_dead_time().0;
            let b = held_inputs(&behind, self.intersample())?;
            let poles = behind.poles().ok()?;
            let over_stiffness = inner.relative_force(&b, gains)?;
            let sensitivity = self.linear().dc_gain().ok()?[(0, 0)]
                * Parameters::from_operator(&self.hysteresis()[0]).slope();
            let offset = self.offsets()[0];
            Some(SteadyForce::new(over_stiffness, sensitivity, &poles, self.rate(), offset))
        };
        let gain =
            self.linear().dc_gain().map_or(f64::NAN, |gain| gain[(place.output().unwrap_or(0), 0)]);
        let stiffness =
            gain * Parameters::from_operator(&self.hysteresis()[0]).slope_after_reversal();
        effect.quantities(Units { input: &input, output: &output, stiffness }, &force)
    }

    pub(crate) fn validate_effects(&self) -> Result<(), Error> {
        self.intersample.validate()?;
        for effect in &self.effects {
            let place = effect.place();
            let (inputs, outputs) = (self.inputs().len(), self.outputs().len());
            let requirement = |what: String| Error::parameter("effects", effect.name(), what);
            for (channel, channels) in [(place.input(), inputs), (place.output(), outputs)] {
                if let Some(channel) = channel.filter(|&channel| channel >= channels) {
                    return Err(requirement(format!("acts on channel {channel} of {channels}")));
                }
            }
            for inner in place.closed_loops().map_or(&[][..], ClosedLoops::loops) {
                let behind = self.linear().behind_dead_time().0.order();
                let states = (self.linear().order(), behind);
                if let Some(flaw) = inner.flaw(states, inputs, outputs) {
                    return Err(requirement(flaw));
                }
            }
            let Some(block) = effect.block() else { continue };
            if block.values().iter().any(|value| !value.is_finite()) {
                return Err(requirement("its values must be finite".to_owned()));
            }
            if let Some(flaw) = block.flaw() {
                return Err(requirement(flaw));
            }
        }
        self.between().map(|_| ())
    }

    /// The states of the effects after a constant input and v.
    pub(crate) fn rest_effects(&self, state: &mut ModelState, input: &[f64], v: &DVector<f64>) {
        let rest = |effect: &Effect| match effect.place() {
            Place::Input(own) => own.rest(input[own.input()]),
            Place::Widths(own) => own.rest(),
            Place::Parallel(own) => standing(own, v, self.rate()),
            // the first sample tells
            _ => Vec::new(),
        };
        state.effects = self.effects.iter().map(rest).collect();
    }

    /// The stages before the hysteresis and after the dynamics, from a sample on.
    fn stages(&self, first: usize) -> Stages<'_> {
        Stages { effects: &self.effects, rate: self.rate(), first }
    }

    /// The drive that reaches the hysteresis.
    pub(crate) fn drive_from(&self, state: &mut ModelState, input: &Matrix) -> Matrix {
        let mut drive = input.clone();
        self.stages(state.sample).drive(&mut state.effects, &mut drive);
        drive
    }

    /// The plays of an input at the places of a state, with the effects on them.
    fn plays<'a>(&'a self, input: usize, state: &GpiState<f64, Vec<f64>>) -> Plays<'a> {
        let bank = self.hysteresis()[input].plays();
        let bank = (bank.half_widths(), bank.weights());
        let mut plays = Plays::new(bank, &self.effects, input, self.rate());
        plays.places.copy_from_slice(state.plays.plays());
        plays
    }

    /// v of plays in steady state, which is `v` without effects.
    pub(crate) fn read_plays(&self, input: usize, state: &GpiState<f64, Vec<f64>>, v: f64) -> f64 {
        let plays = self.plays(input, state);
        if plays.are_curved() { plays.held() } else { v }
    }

    /// v of one input, with the effects on its plays.
    pub(crate) fn play_from(
        &self,
        input: usize,
        state: &mut GpiState<f64, Vec<f64>>,
        memories: &mut [Vec<f64>],
        signal: &mut [f64],
    ) -> Result<(), Error> {
        let hysteresis = &self.hysteresis()[input];
        let mut plays = self.plays(input, state);
        if plays.are_plain() {
            hysteresis.in_place(state, signal);
            return Ok(());
        }
        plays.exchange(memories);
        for value in signal {
            plays.drive_changes(*value - state.envelope.previous);
            let z = hysteresis.envelope().step(&mut state.envelope, *value);
            *value = plays.step(z, |_, _| {});
        }
        plays.exchange(memories);
        state.plays = hysteresis.plays().state_from(plays.places)?;
        Ok(())
    }

    /// G, its loops, and the sections in parallel with G.
    pub(crate) fn respond_from(&self, state: &mut ModelState, v: &Matrix) -> Result<Matrix, Error> {
        let has_loops = self.effects.iter().any(|effect| effect.place().closed_loops().is_some());
        let linear = self.linear();
        let mut output = if !has_loops {
            linear.simulate_from(&mut state.linear, v)?
        } else {
            Matrix::zeros(v.nrows(), linear.outputs())
        };
        let rate = self.rate();
        let stages = self.stages(0);
        for (own, memory) in stages.at(&mut state.effects, Place::parallel_sections) {
            let sections = own.sections(rate);
            let mut column = output.column_mut(0);
            for (value, &v) in column.iter_mut().zip(v.column(own.input()).iter()) {
                *value += in_parallel(own.dead_time(), &sections, memory, v);
            }
        }
        if has_loops {
            self.circulate(state, v, &mut output)?;
        }
        Ok(output)
    }

    /// The output stage, and what is added before and after it.
    pub(crate) fn read_from(
        &self,
        state: &mut ModelState,
        output: &mut Matrix,
        covariates: &Matrix,
    ) {
        self.stages(state.sample).read(&mut state.effects, covariates, output);
    }
}

/// The delay line and the states of an effect's sections after a constant v.
fn standing(own: &dyn ParallelSections, v: &DVector<f64>, rate: f64) -> Vec<f64> {
    let v = v[own.input()];
    let mut states = vec![v; own.dead_time()];
    for (a, b) in own.sections(rate) {
        match a[..] {
            [a1, a2] => {
                let x1 = (b[0] + b[1]) * v / (1.0 + a1 + a2);
                states.extend([x1, b[1] * v - a2 * x1]);
            }
            _ => states.push(b[0] * v / (1.0 + a[0])),
        }
    }
    states
}

/// One sample of sections in parallel with G, behind a dead time; `memory` holds the delay line, then the states.
fn in_parallel(dead_time: usize, sections: &[Coefficients], memory: &mut [f64], v: f64) -> f64 {
    let (line, states) = memory.split_at_mut(dead_time);
    let mut delayed = v;
    if let Some(last) = line.last().copied() {
        line.rotate_right(1);
        line[0] = v;
        delayed = last;
    }
    let (mut sum, mut first) = (0.0, 0);
    for (a, b) in sections {
        let own = &mut states[first..first + a.len()];
        sum += own[0];
        advance(a, own, |state| b[state] * delayed);
        first += a.len();
    }
    sum
}
