//! What an effect can do.

use super::{Effect, InnerLoop};

/// Where an effect stands in the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Between the commanded input and the hysteresis.
    Input,
    /// In the hysteresis.
    Plays,
    /// In or beside the linear dynamics.
    Dynamics,
    /// Added to the displacement: what moves the stage itself.
    Displaced,
    /// Between the displacement and the sensor's reading.
    Output,
    /// Added to the output, whatever the input does.
    Added,
    /// In what is left.
    Noise,
}

impl Stage {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Plays => "plays",
            Self::Dynamics => "dynamics",
            Self::Displaced => "displaced",
            Self::Output => "output",
            Self::Added => "added",
            Self::Noise => "noise",
        }
    }
}

/// A number that describes an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Such as `time_constant[0]`.
    pub name: String,
    /// Its unit, empty for a pure number.
    pub unit: String,
    /// Its value.
    pub value: f64,
}

impl Quantity {
    pub(crate) fn new(name: impl Into<String>, unit: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), unit: unit.into(), value }
    }
}

/// The units of the channels that an effect stands between.
#[derive(Clone, Copy, Debug)]
pub struct Units<'a> {
    /// The input's.
    pub input: &'a str,
    /// The output's.
    pub output: &'a str,
}

impl Units<'_> {
    /// `a/b` for two units, either of which may be unknown.
    pub(crate) fn ratio(above: &str, below: &str) -> String {
        match (above, below) {
            (_, "") => String::new(),
            ("", below) => format!("1/{below}"),
            (above, below) if above == below => String::new(),
            (above, below) => format!("{above}/{below}"),
        }
    }
}

/// One sample's place in time, and what else was measured then.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Seconds since the first sample.
    pub time: f64,
    /// Sampling rate in Hz.
    pub rate: f64,
    /// The other measured columns.
    pub covariates: &'a [f64],
}

/// How a change of a block's input shows at its output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slope {
    /// Times this factor.
    Times(f64),
    /// Not at all: the output stays, with the changes it has had.
    Held,
}

/// An effect in its place of the chain. What a stage does not do is the identity by default.
pub trait Block {
    /// The name in the catalogue.
    fn name(&self) -> &'static str;

    /// The channel that it acts on: an input of the hysteresis before the output stage, an output from
    /// there on.
    fn channel(&self) -> usize;

    /// What the data determine, in the units of [`Block::quantities`] or such that they follow.
    fn values(&self) -> Vec<f64>;

    /// Takes other values.
    fn set(&mut self, values: &[f64]);

    /// Smallest and largest sensible value of each.
    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(f64::NEG_INFINITY, f64::INFINITY); self.values().len()]
    }

    /// A small change of each value, in which the output changes linearly.
    fn steps(&self) -> Vec<f64>;

    /// Why these parameters make no block, where finite values do not suffice.
    fn flaw(&self) -> Option<String> {
        None
    }

    /// Whether a record of so many seconds can show it as it is, and no engineer would call it something
    /// else.
    fn is_plausible(&self, duration: f64) -> bool {
        let _ = duration;
        true
    }

    /// What an engineer would call its parameters.
    fn quantities(&self, units: Units) -> Vec<Quantity>;

    /// What the block remembers after its input has stood at `first`.
    fn rest(&self, first: f64, moment: Moment) -> Vec<f64> {
        let _ = (first, moment);
        Vec::new()
    }

    /// Input stage: the drive that reaches the hysteresis.
    fn drive(&self, state: &mut [f64], input: f64, moment: Moment) -> f64 {
        let _ = (state, moment);
        input
    }

    /// Input stage: samples by which the drive arrives late.
    fn late(&self) -> f64 {
        0.0
    }

    /// Input stage: the fastest drive that arrives as it is, in units of the input per second.
    fn fastest(&self) -> f64 {
        f64::INFINITY
    }

    /// Plays: what half-widths grow with at a speed `|du/dt|`, the sampling rate in Hz.
    fn speed_seen(&self, state: &mut [f64], speed: f64, rate: f64) -> f64 {
        let _ = (state, rate);
        speed
    }

    /// Plays: the half-width of a play at that [`Block::speed_seen`], and its derivative by `half_width`.
    fn width(&self, half_width: f64, speed_seen: f64) -> (f64, f64) {
        let _ = speed_seen;
        (half_width, 1.0)
    }

    /// Plays: what a play's place F is read as, and the derivative by F.
    fn read(&self, half_width: f64, place: f64) -> (f64, f64) {
        let _ = half_width;
        (place, 1.0)
    }

    /// Whether [`Block::read`] does anything.
    fn reads(&self) -> bool {
        false
    }

    /// Plays: adds the derivatives of [`Block::read`] by the values, times `weight`, to `slopes`.
    fn read_slopes(&self, half_width: f64, place: f64, weight: f64, slopes: &mut [f64]) {
        let _ = (half_width, place, weight, slopes);
    }

    /// Dynamics: sections beside G, each with denominator `1, a1, ..` and numerator `b1, ..`, in powers of
    /// the delay.
    fn sections(&self, rate: f64) -> Vec<(Vec<f64>, Vec<f64>)> {
        let _ = rate;
        Vec::new()
    }

    /// Takes what became of its sections, and the dead time of G in samples, which they share.
    fn set_sections(&mut self, sections: &[(Vec<f64>, Vec<f64>)], dead_time: usize, rate: f64) {
        let _ = (sections, dead_time, rate);
    }

    /// Samples by which v reaches its sections late.
    fn dead_time(&self) -> usize {
        0
    }

    /// Smallest and largest a1 of its first-order sections.
    fn section_bounds(&self, rate: f64) -> (f64, f64) {
        let _ = rate;
        (f64::NEG_INFINITY, f64::INFINITY)
    }

    /// Dynamics: loops that are closed around G. Their values come first, see [`InnerLoop`].
    fn loops(&self) -> &[InnerLoop] {
        &[]
    }

    /// The same, to be changed.
    fn loops_mut(&mut self) -> &mut [InnerLoop] {
        &mut []
    }

    /// Output stage: what the sensor shows, and how changes pass.
    fn sense(&self, state: &mut [f64], output: f64, moment: Moment) -> (f64, Slope) {
        let _ = (state, moment);
        (output, Slope::Times(1.0))
    }

    /// The same in the other place of the chain where it may stand, if there is one: before or behind the
    /// output stage.
    fn elsewhere(&self) -> Option<Effect> {
        None
    }

    /// Displaced or added: what comes on top.
    fn add(&self, state: &mut [f64], moment: Moment) -> f64 {
        let _ = (state, moment);
        0.0
    }

    /// Whether it acts on the output stage.
    fn stage(&self) -> Stage;
}
