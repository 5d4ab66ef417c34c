//! Poles of G that are too slow for a mechanical stage: creep and disturbances have effects of their own.

use crate::chain::point::Point;
use crate::effects::longest_lag;
use crate::fit::preparation::rescale;
use crate::fit::settings::MemorySettings;
use crate::linear::{Section, Sections};
use crate::{Error, Record};
use nalgebra::Complex;

/// The longest time constants of a mechanical stage's dynamics, in samples.
pub(crate) struct Memory {
    /// Of real poles: a slower one is creep.
    lag: f64,
    /// Of all poles: a slower one is a disturbance.
    longest: f64,
}

impl Memory {
    pub(crate) fn of(record: &Record) -> Self {
        let samples = record.experiments().iter().map(|e| e.input.nrows()).max().unwrap_or(0);
        let longest = MemorySettings::default().part * samples as f64;
        Self { lag: longest_lag(record.rate()), longest }
    }

    /// Whether a pole is a lag as slow as creep, whose time constant `-1 / ln(pole)` exceeds that of the dynamics.
    pub(crate) fn is_slow_lag(&self, pole: &Complex<f64>) -> bool {
        pole.im == 0.0 && pole.re > 0.0 && -1.0 / pole.re.ln() > self.lag
    }

    /// Whether a pole is as slow as a disturbance, `-1 / ln|pole|` its time constant.
    pub(crate) fn is_disturbance(&self, pole: &Complex<f64>) -> bool {
        -1.0 / pole.norm().max(f64::MIN_POSITIVE).ln() >= self.longest
    }

    /// Whether a pole is as slow as creep or a disturbance.
    pub(crate) fn is_exceeded_by(&self, pole: &Complex<f64>) -> bool {
        self.is_disturbance(pole) || self.is_slow_lag(pole)
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
        let kept = |section: Section| {
            let poles = section.poles();
            let wanted: Vec<Complex<f64>> =
                poles.iter().copied().filter(|pole| !unwanted(pole)).collect();
            match wanted[..] {
                [] => None,
                // one of two real poles
                [pole] if poles.len() == 2 => Some(section.part(pole.re)),
                _ => Some(section),
            }
        };
        dynamics.sections = dynamics.sections.into_iter().filter_map(kept).collect();
        if dynamics.sections.is_empty() || dynamics.poles().iter().any(unwanted) {
            return Ok(None);
        }
        let mut point = self.clone();
        point.replace_dynamics(dynamics);
        rescale(&mut point);
        Ok(Some(point))
    }
}
