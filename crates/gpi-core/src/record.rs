//! Measured records: what was driven, what was measured, when, and in which units.

use crate::{Error, Matrix};
use std::ops::Range;

/// Name and unit of a column; the unit is a label that results carry along.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Channel {
    /// The column's name, such as `u` or `y1`.
    pub name: String,
    /// The unit's symbol, empty when unknown.
    pub unit: String,
}

impl Channel {
    /// A channel from its name and unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// The name with the unit in brackets, for labels.
    pub fn label(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{} [{}]", self.name, self.unit)
        }
    }
}

/// One uninterrupted run of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// u, (samples, inputs).
    pub input: Matrix,
    /// y, (samples, outputs).
    pub output: Matrix,
    /// Other measured columns, (samples, covariates).
    pub covariates: Matrix,
    /// Samples at the start that drive the model but are not scored: its run-in.
    pub warmup: usize,
    /// Samples that drive the model but are not scored because they are kept for a test: ascending,
    /// apart from each other, behind the run-in.
    pub held_out: Vec<Range<usize>>,
}

/// Experiments of one actuator at one sampling rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    experiments: Vec<Experiment>,
    rate: f64,
    inputs: Vec<Channel>,
    outputs: Vec<Channel>,
    covariates: Vec<Channel>,
}

impl Record {
    /// A record of `experiments` sampled at `rate` in Hz.
    ///
    /// ```
    /// use gpi_core::{Channel, Experiment, Matrix, Record};
    /// let signal = Matrix::from_fn(10, 1, |k, _| k as f64);
    /// let run = Experiment {
    ///     input: signal.clone(),
    ///     output: 2.0 * &signal,
    ///     covariates: Matrix::zeros(10, 0),
    ///     warmup: 0,
    ///     held_out: vec![],
    /// };
    /// let record = Record::new(
    ///     vec![run], 1000.0, vec![Channel::new("u", "V")], vec![Channel::new("y", "um")], vec![],
    /// )?;
    /// assert_eq!(record.samples(), 10);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// No experiment, a rate that is not positive, columns that differ in length or number from the
    /// channels, samples that are NaN or infinite, a warm-up that leaves nothing.
    pub fn new(
        experiments: Vec<Experiment>,
        rate: f64,
        inputs: Vec<Channel>,
        outputs: Vec<Channel>,
        covariates: Vec<Channel>,
    ) -> Result<Self, Error> {
        if !(rate.is_finite() && rate > 0.0) {
            return Err(Error::parameter("rate", rate, "the sampling rate in Hz must be positive"));
        }
        if experiments.is_empty() {
            let purpose = "a record holds at least one experiment".to_owned();
            return Err(Error::TooFewSamples { samples: 0, needed: 1, purpose });
        }
        for experiment in &experiments {
            let rows = experiment.input.nrows();
            for (name, matrix, channels) in [
                ("input", &experiment.input, &inputs),
                ("output", &experiment.output, &outputs),
                ("covariates", &experiment.covariates, &covariates),
            ] {
                Error::require_equal("samples", ("input", rows), (name, matrix.nrows()))?;
                let columns = (name, matrix.ncols());
                Error::require_equal("channels", columns, ("channel names", channels.len()))?;
                require_finite(matrix, channels)?;
            }
            if experiment.warmup >= rows || experiment.scored() == 0 {
                let purpose = format!("a warm-up of {} samples and one more", experiment.warmup);
                let needed = experiment.warmup + 1;
                return Err(Error::TooFewSamples { samples: rows, needed, purpose });
            }
            let mut end = experiment.warmup;
            for held in &experiment.held_out {
                if held.start < end || held.end <= held.start || held.end > rows {
                    let requirement =
                        format!("ascending ranges between {} and {rows}", experiment.warmup);
                    return Err(Error::parameter("held_out", format!("{held:?}"), requirement));
                }
                end = held.end;
            }
        }
        for (name, channels) in [("inputs", &inputs), ("outputs", &outputs)] {
            if channels.is_empty() {
                return Err(Error::parameter(name, 0, "at least one channel is needed"));
            }
        }
        Ok(Self { experiments, rate, inputs, outputs, covariates })
    }

    /// The experiments, in the order they were given.
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

    /// Samples of all experiments together.
    pub fn samples(&self) -> usize {
        self.experiments.iter().map(|experiment| experiment.input.nrows()).sum()
    }

    /// Samples that are scored: all but the warm-ups and what is held out.
    pub fn scored(&self) -> usize {
        self.experiments.iter().map(Experiment::scored).sum()
    }

    /// Every scored run as an experiment of its own, with up to `lead` samples before it as its warm-up.
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
            let rows = |matrix: &Matrix| matrix.rows(first, run.end - first).into_owned();
            Experiment {
                input: rows(&experiment.input),
                output: rows(&experiment.output),
                covariates: rows(&experiment.covariates),
                warmup: run.start - first,
                held_out: Vec::new(),
            }
        };
        let runs = |e: &Experiment| e.scored_runs().map(|run| piece(e, run)).collect::<Vec<_>>();
        self.with_experiments(self.experiments.iter().flat_map(runs).collect())
    }

    /// The same channels and rate with other experiments, which were cut from this record.
    ///
    /// # Errors
    /// As for [`Record::new`].
    pub fn with_experiments(&self, experiments: Vec<Experiment>) -> Result<Self, Error> {
        let (inputs, outputs) = (self.inputs.clone(), self.outputs.clone());
        Self::new(experiments, self.rate, inputs, outputs, self.covariates.clone())
    }

    /// Splits every experiment in time: the first `fraction` of its samples, and the rest.
    ///
    /// The rest keeps the first part as its warm-up, so that it is simulated with its true past and
    /// scored only where no training sample lies.
    ///
    /// # Errors
    /// A fraction outside (0, 1), or one that leaves a part without samples.
    pub fn split(&self, fraction: f64) -> Result<(Self, Self), Error> {
        if !(fraction > 0.0 && fraction < 1.0) {
            return Err(Error::parameter("fraction", fraction, "must lie between 0 and 1"));
        }
        let cut = |experiment: &Experiment| {
            let scored = experiment.input.nrows() - experiment.warmup;
            experiment.warmup + (scored as f64 * fraction).round() as usize
        };
        let first = self.experiments.iter().map(|experiment| experiment.rows(cut(experiment)));
        let rest = self
            .experiments
            .iter()
            .map(|experiment| Experiment { warmup: cut(experiment), ..experiment.clone() });
        Ok((self.with_experiments(first.collect())?, self.with_experiments(rest.collect())?))
    }

    /// Refuses inputs that never move and outputs that never move.
    pub(crate) fn require_moving(&self) -> Result<(), Error> {
        let select: [fn(&Experiment) -> &Matrix; 2] = [|e| &e.input, |e| &e.output];
        for (channels, select) in [&self.inputs, &self.outputs].into_iter().zip(select) {
            for (column, channel) in channels.iter().enumerate() {
                let first = select(&self.experiments[0])[(0, column)];
                let moves = self
                    .experiments
                    .iter()
                    .any(|e| select(e).column(column).iter().any(|&value| value != first));
                if !moves {
                    return Err(Error::Constant { column: channel.name.clone(), value: first });
                }
            }
        }
        Ok(())
    }
}

impl Experiment {
    /// The first `count` samples.
    fn rows(&self, count: usize) -> Self {
        Self {
            input: self.input.rows(0, count).into_owned(),
            output: self.output.rows(0, count).into_owned(),
            covariates: self.covariates.rows(0, count).into_owned(),
            warmup: self.warmup,
            held_out: Vec::new(),
        }
    }

    /// How many samples are scored.
    pub fn scored(&self) -> usize {
        self.scored_runs().map(|run| run.len()).sum()
    }

    /// Runs of scored samples.
    pub fn scored_runs(&self) -> impl Iterator<Item = Range<usize>> {
        let starts = std::iter::once(self.warmup).chain(self.held_out.iter().map(|held| held.end));
        let rows = self.input.nrows();
        let ends = self.held_out.iter().map(|held| held.start).chain(std::iter::once(rows));
        starts.zip(ends).filter(|(start, end)| start < end).map(|(start, end)| start..end)
    }

    /// The same with one of so many parts of its scored samples scored, equal but for rounding.
    pub(crate) fn part(&self, number: usize, parts: usize) -> Self {
        let places: Vec<usize> = self.scored_runs().flatten().collect();
        let bound = |number: usize| number * places.len() / parts;
        let own = &places[bound(number)..bound(number + 1)];
        let (Some(first), Some(last)) = (own.first(), own.last()) else { return self.clone() };
        let mut part = self.clone();
        let inside = |held: &Range<usize>| *first < held.start && held.end <= *last;
        part.held_out.retain(inside);
        part.held_out.insert(0, self.warmup..*first);
        part.held_out.push(last + 1..self.input.nrows());
        part.held_out.retain(|held| !held.is_empty());
        part
    }

    /// The scored rows of a signal (samples, channels), run by run.
    pub(crate) fn scored_rows<'a>(
        &self,
        signal: &'a Matrix,
    ) -> impl Iterator<Item = nalgebra::DMatrixView<'a, f64>> {
        self.scored_runs().map(|run| signal.rows(run.start, run.len()))
    }
}

fn require_finite(matrix: &Matrix, channels: &[Channel]) -> Result<(), Error> {
    for (values, channel) in matrix.column_iter().zip(channels) {
        // counted first: a search would look at one sample after the other
        let count = values.iter().filter(|value| !value.is_finite()).count();
        if count > 0
            && let Some(row) = values.iter().position(|value| !value.is_finite())
        {
            let column = channel.name.clone();
            return Err(Error::NotFinite { column, row, count });
        }
    }
    Ok(())
}

/// What a column of time stamps says about the sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeAxis {
    /// Sampling rate in Hz.
    pub rate: f64,
    /// Largest deviation of a stamp's step from the mean step, as a fraction of it.
    pub jitter: f64,
}

impl TimeAxis {
    /// The largest deviation of a step that still counts as uniform, as a fraction of the step.
    ///
    /// Stamps are often rounded to a few digits; a tenth of a step is far above that and far below a
    /// missing sample.
    pub const TOLERANCE: f64 = 0.1;

    /// Reads the rate from time stamps in seconds.
    ///
    /// ```
    /// use gpi_core::TimeAxis;
    /// assert_eq!(TimeAxis::read(&[0.0, 0.5, 1.0])?.rate, 2.0);
    /// assert!(TimeAxis::read(&[0.0, 0.5, 1.0, 1.5, 3.5]).unwrap_err().to_string().contains("gap"));
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// Fewer than two stamps, stamps that are not finite or do not increase, gaps (a few steps longer
    /// than 1.5 usual steps), sampling that is not uniform.
    pub fn read(stamps: &[f64]) -> Result<Self, Error> {
        if stamps.len() < 2 {
            let purpose = "a rate needs two time stamps".to_owned();
            return Err(Error::TooFewSamples { samples: stamps.len(), needed: 2, purpose });
        }
        let bad = |stamp: &f64| !stamp.is_finite();
        if let Some(row) = stamps.iter().position(bad) {
            let count = stamps.iter().filter(|stamp| bad(stamp)).count();
            return Err(Error::NotFinite { column: "time".to_owned(), row, count });
        }
        let steps: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let backward = |step: &f64| *step <= 0.0;
        if let Some(row) = steps.iter().position(backward) {
            let count = steps.iter().filter(|step| backward(step)).count();
            let (before, after) = (stamps[row], stamps[row + 1]);
            return Err(Error::TimeNotIncreasing { row, before, after, count });
        }
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let (shortest, longest) = (sorted[0], sorted[sorted.len() - 1]);
        let deviates = |step: &f64| (step / median - 1.0).abs() > Self::TOLERANCE;
        let Some(row) = steps.iter().position(deviates) else {
            let duration = stamps[stamps.len() - 1] - stamps[0];
            let jitter = (longest / median - 1.0).max(1.0 - shortest / median);
            return Ok(Self { rate: steps.len() as f64 / duration, jitter });
        };
        // A clock that pauses is mended by cutting, one that jitters by resampling.
        let deviating = steps.iter().filter(|step| deviates(step)).count();
        let long = |step: &f64| *step > 1.5 * median;
        if deviating <= 1 + steps.len() / 20
            && let Some(row) = steps.iter().position(long)
        {
            let count = steps.iter().filter(|step| long(step)).count();
            let (time, gap) = (stamps[row], steps[row]);
            return Err(Error::TimeGap { row, time, gap, step: median, count });
        }
        Err(Error::TimeNotUniform { row, shortest, longest, median })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_that_runs_backwards_is_located() {
        let error = TimeAxis::read(&[0.0, 1.0, 2.0, 1.5, 2.5]).unwrap_err();
        let expected = Error::TimeNotIncreasing { row: 2, before: 2.0, after: 1.5, count: 1 };
        assert_eq!(error, expected);
    }

    #[test]
    fn jitter_is_not_a_gap() {
        let stamps: Vec<f64> =
            (0..100).map(|k| f64::from(k) + if k % 3 == 0 { 0.4 } else { 0.0 }).collect();
        assert!(matches!(TimeAxis::read(&stamps), Err(Error::TimeNotUniform { row: 0, .. })));
    }

    #[test]
    fn rounded_stamps_are_uniform() {
        let stamps: Vec<f64> = (0..1000).map(|k| (f64::from(k) / 0.3).round() / 1e3).collect();
        let axis = TimeAxis::read(&stamps);
        assert!(matches!(axis, Err(Error::TimeNotUniform { .. })), "a third of a step is not");
        let stamps: Vec<f64> =
            (0..1000).map(|k| (f64::from(k) / 0.3 * 100.0).round() / 1e5).collect();
        assert!((TimeAxis::read(&stamps).unwrap().rate - 300.0).abs() < 1e-3);
    }
}
