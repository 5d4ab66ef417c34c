//! Measured records: inputs, outputs and covariates of one actuator, with sampling rate and units.

mod channel;
mod experiment;
mod names;
mod slices;
mod time_axis;

pub use channel::Channel;
pub use experiment::Experiment;
pub use time_axis::TimeAxis;

pub(crate) use channel::require_finite;
pub(crate) use names::{require_names, require_texts};

use crate::{Error, Matrix};
use std::ops::Range;

/// Experiments with one actuator, all with the same channels and sampling rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    experiments: Vec<Experiment>,
    rate: f64,
    inputs: Vec<Channel>,
    outputs: Vec<Channel>,
    covariates: Vec<Channel>,
}

impl Record {
    /// A record of `experiments`, sampled at `rate` in Hz.
    ///
    /// ```
    /// use gpi_core::{Channel, Experiment, Matrix, Record};
    /// let signal = Matrix::from_fn(10, 1, |k, _| k as f64);
    /// let run = Experiment::new(signal.clone(), 2.0 * &signal);
    /// let channel = |name, unit| vec![Channel::new(name, unit)];
    /// let record = Record::new(vec![run], 1000.0, channel("u", "V"), channel("y", "um"), vec![])?;
    /// assert_eq!(record.samples(), 10);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// There is no experiment, input or output; the rate is not positive; the columns of an experiment differ in length,
    /// or in number from the channels; a sample is NaN or infinite; the warm-up leaves no scored sample; a name or a unit
    /// has a control character or a mark that changes the direction of writing.
    pub fn new(
        experiments: Vec<Experiment>,
        rate: f64,
        inputs: Vec<Channel>,
        outputs: Vec<Channel>,
        covariates: Vec<Channel>,
    ) -> Result<Self, Error> {
        Error::require_positive("rate", rate, "the sampling rate in Hz must be positive")?;
        for channels in [&inputs, &outputs, &covariates] {
            require_names(channels)?;
        }
        Error::require_samples(experiments.len(), 1, "a record holds at least one experiment")?;
        for experiment in &experiments {
            for (name, matrix, channels) in [
                ("input", &experiment.input, &inputs),
                ("output", &experiment.output, &outputs),
                ("covariates", &experiment.covariates, &covariates),
            ] {
                let rows = ("input", experiment.input.nrows());
                Error::require_equal("samples", rows, (name, matrix.nrows()))?;
                let columns = (name, matrix.ncols());
                Error::require_equal("channels", columns, ("channel names", channels.len()))?;
                require_finite(matrix, channels)?;
            }
            experiment.validate_scored()?;
        }
        for (name, channels) in [("inputs", &inputs), ("outputs", &outputs)] {
            Error::require(!channels.is_empty(), name, 0, "at least one channel is needed")?;
        }
        Ok(Self { experiments, rate, inputs, outputs, covariates })
    }

    /// The experiments, in the given order.
    pub fn experiments(&self) -> &[Experiment] {
        &self.experiments
    }

    /// Sampling rate in Hz.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// The input channels.
    pub fn inputs(&self) -> &[Channel] {
        &self.inputs
    }

    /// The output channels.
    pub fn outputs(&self) -> &[Channel] {
        &self.outputs
    }

    /// The other measured channels.
    pub fn covariates(&self) -> &[Channel] {
        &self.covariates
    }

    /// Number of samples of all experiments.
    pub fn samples(&self) -> usize {
        self.experiments.iter().map(|experiment| experiment.input.nrows()).sum()
    }

    /// Number of samples of the longest experiment.
    pub(crate) fn longest(&self) -> usize {
        self.experiments.iter().map(|experiment| experiment.input.nrows()).max().unwrap_or(0)
    }

    /// Number of scored samples of all experiments.
    pub fn scored(&self) -> usize {
        self.experiments.iter().map(Experiment::scored).sum()
    }

    /// Every range of scored samples as an experiment of its own, with up to `lead` samples before it as its warm-up.
    ///
    /// # Errors
    /// As for [`Record::new`].
    pub(crate) fn pieces(&self, lead: usize) -> Result<Self, Error> {
        let whole = |e: &Experiment| e.held_out.is_empty();
        if self.experiments.iter().all(whole) {
            return Ok(self.clone());
        }
        let piece = |experiment: &Experiment, run: Range<usize>| {
            let first = if whole(experiment) { 0 } else { run.start.saturating_sub(lead) };
            experiment.rows(first..run.end, run.start - first)
        };
        let runs = |e: &Experiment| e.scored_runs().map(|run| piece(e, run)).collect::<Vec<_>>();
        self.with_experiments(self.experiments.iter().flat_map(runs).collect())
    }

    /// The same channels and rate with other experiments, such as parts of this record's experiments.
    ///
    /// # Errors
    /// As for [`Record::new`].
    pub fn with_experiments(&self, experiments: Vec<Experiment>) -> Result<Self, Error> {
        let (inputs, outputs) = (self.inputs.clone(), self.outputs.clone());
        Self::new(experiments, self.rate, inputs, outputs, self.covariates.clone())
    }

    /// Splits every experiment in time: the first `fraction` of the samples behind its warm-up, and the rest.
    ///
    /// The rest keeps the first part as its warm-up. It is therefore simulated with its true past, and scored only
    /// where the first part has no sample.
    ///
    /// # Errors
    /// The fraction is outside (0, 1), or one part has no sample.
    pub fn split(&self, fraction: f64) -> Result<(Self, Self), Error> {
        let is_part = fraction > 0.0 && fraction < 1.0;
        Error::require(is_part, "fraction", fraction, "must lie between 0 and 1")?;
        let (mut first, mut rest) = (Vec::new(), Vec::new());
        for experiment in &self.experiments {
            let scored = experiment.input.nrows() - experiment.warmup;
            let cut = experiment.warmup + (scored as f64 * fraction).round() as usize;
            first.push(experiment.rows(0..cut, experiment.warmup));
            rest.push(Experiment { warmup: cut, ..experiment.clone() });
        }
        Ok((self.with_experiments(first)?, self.with_experiments(rest)?))
    }

    /// The record in which what is held out is scored, and nothing else.
    ///
    /// # Errors
    /// As for [`Record::new`]; an experiment holds nothing out.
    pub(crate) fn held_out_part(&self) -> Result<Self, Error> {
        let test = self.experiments.iter().map(|experiment| {
            let mut test = experiment.clone();
            test.warmup = experiment.held_out.first().map_or(0, |held| held.start);
            let starts = experiment.held_out.iter().map(|held| held.end);
            let rows = experiment.input.nrows();
            let next = experiment.held_out.iter().skip(1).map(|held| held.start);
            let gaps = starts.zip(next.chain(std::iter::once(rows)));
            test.held_out = gaps.filter(|(a, b)| a < b).map(|(a, b)| a..b).collect();
            test
        });
        self.with_experiments(test.collect())
    }

    /// Rejects inputs and outputs that are constant.
    pub(crate) fn require_moving(&self) -> Result<(), Error> {
        let select: [fn(&Experiment) -> &Matrix; 2] = [|e| &e.input, |e| &e.output];
        for (channels, select) in [&self.inputs, &self.outputs].into_iter().zip(select) {
            for (column, channel) in channels.iter().enumerate() {
                let value = select(&self.experiments[0])[(0, column)];
                let varies = |e: &Experiment| select(e).column(column).iter().any(|y| *y != value);
                if !self.experiments.iter().any(varies) {
                    return Err(Error::Constant { column: channel.name.clone(), value });
                }
            }
        }
        Ok(())
    }
}
