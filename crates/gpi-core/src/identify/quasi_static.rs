//! Hysteresis behind a gain with a delay, where the input excites no more.

use super::hysteresis::fit;
use super::identification::{Identification, Round};
use super::linearization::{Freedom, Point};
use super::sensitivity::Derivatives;
use super::start::{Start, rescale};
use super::{Progress, report};
use crate::linear::{self, StateSpace};
use crate::{Error, Matrix};

impl Start<'_> {
    /// The linear part is a gain of plus or minus one with the delay that fits best.
    pub(super) fn quasi_static(
        mut self,
        delay: Option<usize>,
        supported: usize,
        progress: Progress,
    ) -> Result<Identification, Error> {
        const LONGEST_DELAY: usize = 7;
        /// As many states: a longer delay is better cut out of the record.
        const LONGEST_GIVEN: usize = 500;
        if let Some(delay) = delay.filter(|&delay| delay > LONGEST_GIVEN) {
            let requirement = format!("at most {LONGEST_GIVEN} samples; shift the output instead");
            return Err(Error::parameter("delay", delay, requirement));
        }
        let gain = linear::estimate(&self.record, 1, 0.0)?.markov.remove(0);
        let delays = delay.map_or(0..=LONGEST_DELAY, |delay| delay..=delay);
        let derivatives = Derivatives { thresholds: false, starts: self.unknown_past };
        let freedom = Freedom { derivatives, numerator: false };
        let mut rounds = Vec::new();
        let mut best: Option<(usize, f64, Point, StateSpace, Matrix)> = None;
        for delay in delays {
            report(progress, "delay", delay as f64 / (LONGEST_DELAY + 1) as f64)?;
            let mut linear = StateSpace::delayed_gain(&gain, delay);
            let mut point = self.point.clone();
            rescale(&mut point, &mut linear)?;
            let fitted = fit(point, &linear, &self.record, freedom, 15, progress)?;
            let (rms, offsets) = self.free_run(&fitted.point, &linear)?;
            rounds.push(Round { rms, order: linear.order(), taps: delay + 1 });
            if best.as_ref().is_none_or(|(_, least, ..)| rms < *least) {
                best = Some((delay, rms, fitted.point, linear, offsets));
            }
        }
        let Some((delay, _, point, linear, offsets)) = best else {
            return Err(Error::parameter("delay", "none", "at least one delay is tried"));
        };
        if supported <= 4 {
            self.notes.push(format!(
                "the input excites {supported} directions per channel only, a gain and a delay: the \
                 linear part is a delay of {delay} samples"
            ));
        }
        let none = (None, Vec::new(), 0);
        self.finish(point, linear, &offsets, none, supported, Some(delay), rounds)
    }
}
