//! How long G may remember, where what is slower has a name of its own.

use crate::chain::point::Point;
use crate::effects::longest_lag;
use crate::fit::preparation::rescale;
use crate::linear::Sections;
use crate::{Error, Record};
use nalgebra::Complex;

/// The longest memory of a mechanical stage's dynamics, in samples.
pub(crate) struct Memory {
    lag: f64,
    swing: f64,
}

impl Memory {
    pub(crate) fn of(record: &Record) -> Self {
        /// Of the longest experiment.
        const PART: f64 = 0.05;
        let samples = record.experiments().iter().map(|e| e.input.nrows()).max().unwrap_or(0);
        let swing = PART * samples as f64;
        Self { lag: longest_lag(record.rate()), swing }
    }

    /// Whether a pole follows creep.
    pub(crate) fn is_slow_lag(&self, pole: &Complex<f64>) -> bool {
        pole.im == 0.0 && pole.re > 0.0 && -1.0 / pole.re.ln() > self.lag
    }

    /// Whether a pole follows creep or a disturbance.
    pub(crate) fn is_exceeded_by(&self, pole: &Complex<f64>) -> bool {
        let memory = -1.0 / pole.norm().max(f64::MIN_POSITIVE).ln();
        memory >= self.swing || self.is_slow_lag(pole)
    }
}

impl Point {
    /// The same without poles of G; `None` where it has no such poles, or none else.
    pub(crate) fn without(
        &self,
        unwanted: impl Fn(&Complex<f64>) -> bool,
    ) -> Result<Option<Self>, Error> {
        let own = &self.dynamics;
        // loops act on the states of G, which would be others
        if !own.poles().iter().any(&unwanted) || self.loops().next().is_some() {
            return Ok(None);
        }
        let mut dynamics = Sections::from_delayed_state_space(&own.to_state_space()?)?;
        dynamics.sections.retain(|section| !section.poles().iter().all(&unwanted));
        if dynamics.sections.is_empty() || dynamics.poles().iter().any(unwanted) {
            return Ok(None);
        }
        let mut point = self.clone();
        point.replace_dynamics(dynamics);
        rescale(&mut point);
        Ok(Some(point))
    }
}
