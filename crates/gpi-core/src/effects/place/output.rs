//! Behind G: the output stage, and the signals that are added before and after it.

use crate::effects::block::Block;

/// The time of one sample, and the other columns that were measured then.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Seconds since the first sample.
    pub time: f64,
    /// Sampling rate in Hz.
    pub rate: f64,
    /// The other measured columns.
    pub covariates: &'a [f64],
}

/// How a change of the displacement passes to the reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slope {
    /// It is multiplied by this factor.
    Times(f64),
    /// It does not pass: the reading keeps the changes of the sample before.
    Held,
}

/// An effect between the displacement and the reading.
pub trait OutputStage: Block + Sync {
    /// The output channel.
    fn output(&self) -> usize;

    /// The state before the displacement `first`. At rest (no `side`), the displacement has been constant. In motion, the reading stands
    /// `side` half-widths of the gap from the displacement (-1 to 1). Empty if the reading depends on the present displacement alone.
    fn rest(&self, _first: f64, _side: Option<f64>) -> Vec<f64> {
        Vec::new()
    }

    /// The reading for one sample of the displacement, and how changes pass.
    fn sense(&self, state: &mut [f64], displacement: f64, moment: Moment) -> (f64, Slope);

    /// Whether it makes the output steeper after a part that is flatter, when the direction has been reversed. No bank of stops with
    /// positive weights does that, so that a misfit of the hysteresis resembles it less than others.
    fn is_pinched(&self) -> bool {
        false
    }

    /// The lowest and the highest reading. At an end of its range, a sensor says nothing of the displacement.
    fn range(&self) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }
}

/// A signal that does not depend on the input.
pub trait Added: Block {
    /// The output channel.
    fn output(&self) -> usize;

    /// Whether it is a disturbance at the plant's output, before the sensor, and not only in the reading.
    fn moves_stage(&self) -> bool;

    /// Puts it before the output stage (true) or after it.
    fn set_moves_stage(&mut self, moves_stage: bool);

    /// The state before the first sample.
    fn rest(&self, _first: Moment) -> Vec<f64> {
        Vec::new()
    }

    /// The measured column that it is made of, if any: its place among the record's covariates, and its name.
    fn column(&self) -> Option<(usize, &str)> {
        None
    }

    /// The signal at one sample.
    fn add(&self, state: &mut [f64], moment: Moment) -> f64;
}
