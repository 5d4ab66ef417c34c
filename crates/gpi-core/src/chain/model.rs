//! A model's chain with its effects, a block of samples at a time.

use crate::effects::{
    ClosedLoops, Effect, InnerLoop, Moment, ParallelSections, Place, PlayCurves, Quantity, Stage,
    Units,
};
use crate::linear::advance;
use crate::model::{Model, ModelState};
use crate::operators::{GpiState, Operator, play};
use crate::{Channel, Error, Matrix};
use nalgebra::DVector;

impl Model {
    /// The same model with effects, which stand in their places of the chain.
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
        self.validate_effects()?;
        Ok(self)
    }

    /// The effects, in the order of the chain.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// What an engineer would call an effect's parameters, with the units of this model's channels.
    pub fn quantities(&self, effect: &Effect) -> Vec<Quantity> {
        let place = effect.place();
        let channel = place.input().or(place.output()).unwrap_or(0);
        let unit = |channels: &'_ [Channel]| {
            let own = channels.get(channel).or(channels.first());
            own.map_or(String::new(), |channel| channel.unit.clone())
        };
        let (input, output) = (unit(self.inputs()), unit(self.outputs()));
        effect.quantities(Units { input: &input, output: &output })
    }

    pub(crate) fn validate_effects(&self) -> Result<(), Error> {
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
                if let Some(flaw) = inner.flaw(self.linear().order(), inputs, outputs) {
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
        Ok(())
    }

    fn moment<'a>(&self, sample: usize, covariates: &'a [f64]) -> Moment<'a> {
        Moment { time: sample as f64 / self.rate(), rate: self.rate(), covariates }
    }

    /// What the effects remember of an input and a v that have stood.
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

    /// The effects that `choose` selects, with their states.
    fn at<'a, T>(
        &'a self,
        states: &'a mut [Vec<f64>],
        choose: impl Fn(Place<'a>) -> Option<T>,
    ) -> impl Iterator<Item = (T, &'a mut Vec<f64>)> {
        let pairs = self.effects.iter().zip(states);
        pairs.filter_map(move |(effect, state)| Some((choose(effect.place())?, state)))
    }

    /// The drive that reaches the hysteresis.
    pub(crate) fn drive_from(&self, state: &mut ModelState, input: &Matrix) -> Matrix {
        let mut drive = input.clone();
        for (effect, memory) in self.at(&mut state.effects, Place::input_stage) {
            for value in drive.column_mut(effect.input()).iter_mut() {
                *value = effect.drive(memory, *value, self.rate());
            }
        }
        drive
    }

    /// The curves through which the plays of an input are read.
    fn play_curves(&self, input: usize) -> Vec<&dyn PlayCurves> {
        let curves = self.effects.iter().filter_map(|effect| effect.place().play_curves());
        curves.filter(|own| own.input() == input).collect()
    }

    /// What plays that stand are read as; `v` without effects.
    pub(crate) fn read_plays(&self, input: usize, state: &GpiState<f64, Vec<f64>>, v: f64) -> f64 {
        let curves = self.play_curves(input);
        if curves.is_empty() {
            return v;
        }
        let bank = self.hysteresis()[input].plays();
        let plays = bank.half_widths().iter().zip(bank.weights()).zip(state.plays.plays());
        let read = |r, place| curves.iter().fold(place, |place, own| own.read(r, place).0);
        plays.map(|((&r, weight), &place)| weight * read(r, place)).sum()
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
        let curves = self.play_curves(input);
        let widths = self.at(memories, Place::play_widths).filter(|(own, _)| own.input() == input);
        let mut widths: Vec<_> = widths.map(|(own, memory)| (own, memory, 0.0)).collect();
        if widths.is_empty() && curves.is_empty() {
            hysteresis.in_place(state, signal);
            return Ok(());
        }
        let (envelope, bank) = (hysteresis.envelope(), hysteresis.plays());
        let mut places = state.plays.plays().to_vec();
        for value in signal {
            let speed = (*value - state.envelope.previous).abs() * self.rate();
            for (own, memory, speed_seen) in &mut widths {
                *speed_seen = own.speed_seen(memory, speed, self.rate());
            }
            let z = envelope.step(&mut state.envelope, *value);
            *value = 0.0;
            let plays = bank.half_widths().iter().zip(bank.weights()).zip(&mut places);
            for ((&r, weight), place) in plays {
                let width = widths
                    .iter()
                    .fold(r, |width, (own, _, speed_seen)| own.width(width, *speed_seen).0);
                *place = play(width, z, *place);
                let read = curves.iter().fold(*place, |place, own| own.read(r, place).0);
                *value += weight * read;
            }
        }
        state.plays = bank.state_from(places)?;
        Ok(())
    }

    /// G and what stands beside it and in its loop.
    pub(crate) fn respond_from(&self, state: &mut ModelState, v: &Matrix) -> Result<Matrix, Error> {
        let has_loops = self.effects.iter().any(|effect| effect.place().closed_loops().is_some());
        let linear = self.linear();
        let mut output = if !has_loops {
            linear.simulate_from(&mut state.linear, v)?
        } else {
            Matrix::zeros(v.nrows(), linear.outputs())
        };
        let rate = self.rate();
        for (own, memory) in self.at(&mut state.effects, Place::parallel_sections) {
            let mut column = output.column_mut(0);
            for (value, &v) in column.iter_mut().zip(v.column(own.input()).iter()) {
                *value += beside(own, memory, v, rate);
            }
        }
        if has_loops {
            self.circulate(state, v, &mut output);
        }
        Ok(output)
    }

    /// Adds what G makes of v with its loops closed.
    fn circulate(&self, state: &mut ModelState, v: &Matrix, output: &mut Matrix) {
        let linear = self.linear();
        let mut loops: Vec<(&InnerLoop, &mut [f64])> = Vec::new();
        for (own, memory) in self.at(&mut state.effects, Place::closed_loops) {
            memory.resize(own.loops().iter().map(|inner| inner.law.stops()).sum(), 0.0);
            let mut rest = &mut memory[..];
            for inner in own.loops() {
                let (places, others) = rest.split_at_mut(inner.law.stops());
                loops.push((inner, places));
                rest = others;
            }
        }
        let mut drive = vec![0.0; linear.order()];
        for k in 0..v.nrows() {
            let now = v.row(k).transpose();
            let before = state.linear.clone();
            let own = linear.step(&mut state.linear, &now);
            let displacement = output.row(k).transpose() + own;
            output.set_row(k, &displacement.transpose());
            drive.fill(0.0);
            for (inner, places) in &mut loops {
                let z =
                    inner.sees.signal(before.as_slice(), now.as_slice(), displacement.as_slice());
                let w = inner.law.step(places, z, &mut vec![0.0; inner.law.marks()]);
                let first = linear.order() - inner.drives.len();
                let driven = drive[first..].iter_mut().zip(&inner.drives);
                driven.for_each(|(sum, drive)| *sum += drive * w);
            }
            state.linear.iter_mut().zip(&drive).for_each(|(x, drive)| *x += drive);
        }
    }

    /// The output stage, and what is added before and behind it.
    pub(crate) fn read_from(
        &self,
        state: &mut ModelState,
        output: &mut Matrix,
        covariates: &Matrix,
    ) {
        let first = state.sample;
        self.add_from(Stage::Displaced, state, output, covariates);
        for (effect, memory) in self.at(&mut state.effects, Place::output_stage) {
            let mut column = output.column_mut(effect.output());
            if memory.is_empty() {
                *memory = effect.rest(column[0]);
            }
            for (k, value) in column.iter_mut().enumerate() {
                *value = effect.sense(memory, *value, self.moment(first + k, &[])).0;
            }
        }
        self.add_from(Stage::Added, state, output, covariates);
    }

    fn add_from(
        &self,
        stage: Stage,
        state: &mut ModelState,
        output: &mut Matrix,
        covariates: &Matrix,
    ) {
        let first = state.sample;
        let rows = covariates.transpose();
        let width = rows.nrows();
        let at = |k: usize| &rows.as_slice()[k * width..(k + 1) * width];
        let moves_stage = stage == Stage::Displaced;
        let added = self.at(&mut state.effects, Place::added);
        for (effect, memory) in added.filter(|(effect, _)| effect.moves_stage() == moves_stage) {
            if memory.is_empty() {
                *memory = effect.rest(self.moment(0, at(0)));
            }
            for (k, value) in output.column_mut(effect.output()).iter_mut().enumerate() {
                *value += effect.add(memory, self.moment(first + k, at(k)));
            }
        }
    }
}

/// The delay line and the states of a block's sections after v has stood.
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

/// One sample of a block's sections in observer form.
fn beside(effect: &dyn ParallelSections, memory: &mut [f64], v: f64, rate: f64) -> f64 {
    let (line, states) = memory.split_at_mut(effect.dead_time());
    let mut delayed = v;
    if let Some(last) = line.last().copied() {
        line.rotate_right(1);
        line[0] = v;
        delayed = last;
    }
    let (mut sum, mut first) = (0.0, 0);
    for (a, b) in effect.sections(rate) {
        let own = &mut states[first..first + a.len()];
        sum += own[0];
        advance(&a, own, |state| b[state] * delayed);
        first += a.len();
    }
    sum
}
