//! A model's chain with its effects, a block of samples at a time.

use crate::effects::{Block, Effect, InnerLoop, Moment, Quantity, Stage, Units};
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
        let block = effect.block();
        let unit = |channels: &'_ [Channel]| {
            let own = channels.get(block.channel()).or(channels.first());
            own.map_or(String::new(), |channel| channel.unit.clone())
        };
        let (input, output) = (unit(self.inputs()), unit(self.outputs()));
        block.quantities(Units { input: &input, output: &output })
    }

    pub(crate) fn validate_effects(&self) -> Result<(), Error> {
        for effect in &self.effects {
            let block = effect.block();
            let channels = match block.stage() {
                Stage::Input | Stage::Plays => self.inputs().len(),
                Stage::Dynamics if !block.sections(1.0).is_empty() => self.inputs().len(),
                _ => self.outputs().len(),
            };
            let requirement = |what: String| Error::parameter("effects", effect.name(), what);
            if block.channel() >= channels {
                let what = format!("acts on channel {} of {channels}", block.channel());
                return Err(requirement(what));
            }
            for inner in block.loops() {
                let (states, inputs) = (self.linear().order(), self.inputs().len());
                if let Some(flaw) = inner.flaw(states, inputs, self.outputs().len()) {
                    return Err(requirement(flaw));
                }
            }
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
        let rest = |effect: &Effect| {
            let block = effect.block();
            match block.stage() {
                Stage::Input => block.rest(input[block.channel()], self.moment(0, &[])),
                Stage::Plays => block.rest(0.0, self.moment(0, &[])),
                Stage::Dynamics => standing(block, v, self.rate()),
                // the first sample tells
                _ => Vec::new(),
            }
        };
        state.effects = self.effects.iter().map(rest).collect();
    }

    fn at_stage<'a>(
        &'a self,
        states: &'a mut [Vec<f64>],
        stage: Stage,
    ) -> impl Iterator<Item = (&'a dyn Block, &'a mut Vec<f64>)> {
        let pairs = self.effects.iter().map(Effect::block).zip(states);
        pairs.filter(move |(block, _)| block.stage() == stage)
    }

    /// The drive that reaches the hysteresis.
    pub(crate) fn drive_from(&self, state: &mut ModelState, input: &Matrix) -> Matrix {
        let mut drive = input.clone();
        let first = state.sample;
        for (block, memory) in self.at_stage(&mut state.effects, Stage::Input) {
            for (k, value) in drive.column_mut(block.channel()).iter_mut().enumerate() {
                *value = block.drive(memory, *value, self.moment(first + k, &[]));
            }
        }
        drive
    }

    /// What plays that stand are read as; `v` without effects.
    pub(crate) fn read_plays(&self, input: usize, state: &GpiState<f64, Vec<f64>>, v: f64) -> f64 {
        let effects = self.effects.iter().map(Effect::block);
        let blocks: Vec<&dyn Block> =
            effects.filter(|block| block.reads() && block.channel() == input).collect();
        if blocks.is_empty() {
            return v;
        }
        let bank = self.hysteresis()[input].plays();
        let plays = bank.half_widths().iter().zip(bank.weights()).zip(state.plays.plays());
        let read = |r, place| blocks.iter().fold(place, |place, block| block.read(r, place).0);
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
        let acts = |block: &dyn Block| block.stage() == Stage::Plays && block.channel() == input;
        let mut blocks: Vec<(&dyn Block, &mut Vec<f64>, f64)> = self
            .effects
            .iter()
            .map(Effect::block)
            .zip(memories)
            .filter(|(block, _)| acts(*block))
            .map(|(block, memory)| (block, memory, 0.0))
            .collect();
        if blocks.is_empty() {
            hysteresis.in_place(state, signal);
            return Ok(());
        }
        let (envelope, bank) = (hysteresis.envelope(), hysteresis.plays());
        let mut places = state.plays.plays().to_vec();
        for value in signal {
            let speed = (*value - state.envelope.previous).abs() * self.rate();
            for (block, memory, speed_seen) in &mut blocks {
                *speed_seen = block.speed_seen(memory, speed, self.rate());
            }
            let z = envelope.step(&mut state.envelope, *value);
            *value = 0.0;
            let plays = bank.half_widths().iter().zip(bank.weights()).zip(&mut places);
            for ((&r, weight), place) in plays {
                let width = blocks
                    .iter()
                    .fold(r, |width, (block, _, speed_seen)| block.width(width, *speed_seen).0);
                *place = play(width, z, *place);
                let read = blocks.iter().fold(*place, |place, (block, ..)| block.read(r, place).0);
                *value += weight * read;
            }
        }
        state.plays = bank.state_from(places)?;
        Ok(())
    }

    /// G and what stands beside it and in its loop.
    pub(crate) fn respond_from(&self, state: &mut ModelState, v: &Matrix) -> Result<Matrix, Error> {
        let blocks = self.effects.iter().map(Effect::block);
        let loops: Vec<&InnerLoop> = blocks.flat_map(Block::loops).collect();
        let linear = self.linear();
        let mut output = if loops.is_empty() {
            linear.simulate_from(&mut state.linear, v)?
        } else {
            Matrix::zeros(v.nrows(), linear.outputs())
        };
        let rate = self.rate();
        for (block, memory) in self.at_stage(&mut state.effects, Stage::Dynamics) {
            let mut column = output.column_mut(0);
            for (value, &v) in
                column.iter_mut().zip(v.column(block.channel().min(v.ncols() - 1)).iter())
            {
                *value += beside(block, memory, v, rate);
            }
        }
        if !loops.is_empty() {
            self.circulate(state, v, &mut output);
        }
        Ok(output)
    }

    /// Adds what G makes of v with its loops closed.
    fn circulate(&self, state: &mut ModelState, v: &Matrix, output: &mut Matrix) {
        let linear = self.linear();
        let blocks = self.effects.iter().map(Effect::block).zip(&mut state.effects);
        let mut loops: Vec<(&InnerLoop, &mut [f64])> = Vec::new();
        for (block, memory) in blocks.filter(|(block, _)| !block.loops().is_empty()) {
            memory.resize(block.loops().iter().map(|inner| inner.law.stops()).sum(), 0.0);
            let mut rest = &mut memory[..];
            for inner in block.loops() {
                let (own, others) = rest.split_at_mut(inner.law.stops());
                loops.push((inner, own));
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
        for (block, memory) in self.at_stage(&mut state.effects, Stage::Output) {
            let mut column = output.column_mut(block.channel());
            if memory.is_empty() {
                *memory = block.rest(column[0], self.moment(0, &[]));
            }
            for (k, value) in column.iter_mut().enumerate() {
                *value = block.sense(memory, *value, self.moment(first + k, &[])).0;
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
        for (block, memory) in self.at_stage(&mut state.effects, stage) {
            if memory.is_empty() {
                *memory = block.rest(0.0, self.moment(0, at(0)));
            }
            for (k, value) in output.column_mut(block.channel()).iter_mut().enumerate() {
                *value += block.add(memory, self.moment(first + k, at(k)));
            }
        }
    }
}

/// The delay line and the states of a block's sections after v has stood.
fn standing(block: &dyn Block, v: &DVector<f64>, rate: f64) -> Vec<f64> {
    let sections = block.sections(rate);
    if sections.is_empty() {
        return Vec::new();
    }
    let v = v[block.channel()];
    let mut states = vec![v; block.dead_time()];
    for (a, b) in sections {
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
fn beside(block: &dyn Block, memory: &mut [f64], v: f64, rate: f64) -> f64 {
    let (line, states) = memory.split_at_mut(block.dead_time());
    let mut delayed = v;
    if let Some(last) = line.last().copied() {
        line.rotate_right(1);
        line[0] = v;
        delayed = last;
    }
    let (mut sum, mut first) = (0.0, 0);
    for (a, b) in block.sections(rate) {
        let own = &mut states[first..first + a.len()];
        sum += own[0];
        advance(&a, own, |state| b[state] * delayed);
        first += a.len();
    }
    sum
}
