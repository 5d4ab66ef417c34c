//! Poles of G that are too slow for a mechanical stage: creep and disturbances have effects of their own.
//!
//! Let `G = F + S`, S the real poles that are slower than the longest lag of the dynamics, F all else. Creep adds to a response
//! that is there at once, and its gain is at most that of this response. Where `|F(1)| < c |G(1)|` (Frobenius norms), S is not
//! creep: the plant itself is slow, such as a tank that fills.

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
    /// c, the least part of the gain that is there at once.
    at_once: f64,
}

impl Memory {
    pub(crate) fn of(record: &Record) -> Self {
        let samples = record.longest();
        let MemorySettings { part, at_once } = MemorySettings::default();
        Self { lag: longest_lag(record.rate()), longest: part * samples as f64, at_once }
    }

    /// The lags of G as slow as creep, whose time constant `-1 / ln(pole)` exceeds that of the dynamics; none where the
    /// plant itself is slow.
    pub(crate) fn slow_lags(&self, dynamics: &Sections) -> Vec<Complex<f64>> {
        let is_slow = |pole: &Complex<f64>| is_lag(pole) && time_constant(pole) > self.lag;
        let at_once = dynamics.dc_gain() - dynamics.dc_gain_of(&is_slow);
        if at_once.norm() < self.at_once * dynamics.dc_gain().norm() {
            return Vec::new();
        }
        dynamics.poles().into_iter().filter(is_slow).collect()
    }

    /// Whether a pole is as slow as a disturbance, `-1 / ln|pole|` its time constant.
    pub(crate) fn is_disturbance(&self, pole: &Complex<f64>) -> bool {
        time_constant(pole) >= self.longest
    }

    /// The poles of G that are as slow as creep or a disturbance.
    pub(crate) fn exceeded_by(&self, dynamics: &Sections) -> Vec<Complex<f64>> {
        let lags = self.slow_lags(dynamics);
        let is_slow = |pole: &Complex<f64>| self.is_disturbance(pole) || lags.contains(pole);
        dynamics.poles().into_iter().filter(is_slow).collect()
    }
}

/// Whether a pole is that of a lag: real and positive.
pub(crate) fn is_lag(pole: &Complex<f64>) -> bool {
    pole.im == 0.0 && pole.re > 0.0
}

/// The time constant of a pole in samples, `-1 / ln|pole|`.
pub(crate) fn time_constant(pole: &Complex<f64>) -> f64 {
    -1.0 / pole.norm().max(f64::MIN_POSITIVE).ln()
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
        let kept = |section: &Section| section.with_poles(|pole| !unwanted(pole));
        dynamics.sections = dynamics.sections.iter().filter_map(kept).collect();
        if dynamics.sections.is_empty() || dynamics.poles().iter().any(unwanted) {
            return Ok(None);
        }
        let mut point = self.clone();
        point.replace_dynamics(dynamics);
        rescale(&mut point);
        Ok(Some(point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::StateSpace;
    use crate::{Channel, Experiment, Matrix};

    /// `d + sum_i gain_i (1 - p_i) / (z - p_i)`.
    fn lags(d: f64, terms: &[(f64, f64)]) -> Sections {
        let a =
            Matrix::from_fn(terms.len(), terms.len(), |i, j| if i == j { terms[i].1 } else { 0.0 });
        let b = Matrix::from_fn(terms.len(), 1, |i, _| 1.0 - terms[i].1);
        let c = Matrix::from_fn(1, terms.len(), |_, j| terms[j].0);
        let system = StateSpace::new(a, b, c, Matrix::from_element(1, 1, d)).unwrap();
        Sections::from_state_space(&system, 0).unwrap()
    }

    fn memory() -> Memory {
        let signal = Matrix::from_fn(20_000, 1, |k, _| (0.01 * k as f64).sin());
        let run = Experiment::new(signal.clone(), signal);
        let channel = |name| vec![Channel::new(name, "")];
        Memory::of(&Record::new(vec![run], 1000.0, channel("u"), channel("y"), vec![]).unwrap())
    }

    #[test]
    fn a_slow_lag_beside_a_fast_response_is_creep() {
        let memory = memory();
        // 0.9 at once or within 5 samples, 0.2 within 200 samples
        let creeping = lags(0.4, &[(0.5, 0.8), (0.2, 0.995)]);
        let found = memory.slow_lags(&creeping);
        assert!(found.len() == 1 && (found[0].re - 0.995).abs() < 1e-9, "{found:?}");
        assert_eq!(memory.exceeded_by(&creeping), found);
        assert!(memory.slow_lags(&lags(0.4, &[(0.5, 0.8)])).is_empty());
    }

    #[test]
    fn the_lags_of_a_slow_plant_are_its_dynamics() {
        let memory = memory();
        // two tanks in a row: nothing is there at once
        let slow = lags(0.0, &[(3.0, 0.995), (-2.0, 0.9925)]);
        assert!((slow.dc_gain()[(0, 0)] - 1.0).abs() < 1e-9);
        assert!(memory.exceeded_by(&slow).is_empty());
        // but a lag of more than a twentieth of the record is a disturbance
        let wandering = lags(0.1, &[(0.9, 0.9995)]);
        assert_eq!(memory.exceeded_by(&wandering).len(), 1);
    }
}
