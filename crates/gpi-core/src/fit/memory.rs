//! Poles of G that are too slow for a mechanical stage: creep and disturbances have effects of their own.
//!
//! Let `G = F + S`, S the poles without resonance that are slower than the longest lag of the dynamics, F all else. Creep and drift
//! add to a response that is there at once. If `|F v| < c |G v|` (norms over the record, v counted from its first sample), the plant
//! itself is slow, such as a tank that fills, and S is neither. If the same holds with the poles as S that the record does not show
//! to settle, the plant integrates its input, and these poles belong to it. Otherwise, if `|F(1)| < c |G(1)|` with the real poles alone as S, S is
//! not creep, but it may be a disturbance.

use crate::chain::point::Point;
use crate::effects::{Coefficients, Effect, PlaceMut, longest_lag};
use crate::fit::preparation::{Prepared, rescale};
use crate::fit::settings::MemorySettings;
use crate::linear::{Sections, resonates};
use crate::{Error, Matrix, Record};
use nalgebra::Complex;

/// The longest time constants of a mechanical stage's dynamics, in samples.
pub(crate) struct Memory {
    /// Of real poles: a slower one is creep.
    lag: f64,
    /// Of all poles: a slower one is a disturbance.
    longest: f64,
    /// Of the real poles of a plant that is slow itself.
    of_slow_plant: f64,
    /// c, the least part of the movement that is there at once.
    at_once: f64,
    /// The fewest samples that show a plant to be slow.
    enough: usize,
}

impl Memory {
    pub(crate) fn of(record: &Record) -> Self {
        let samples = record.longest() as f64;
        let MemorySettings { part, of_slow_plant, at_once, enough } = MemorySettings::default();
        let (longest, of_slow_plant) = (part * samples, of_slow_plant * samples);
        Self { lag: longest_lag(record.rate()), longest, of_slow_plant, at_once, enough }
    }

    /// The lags of G as slow as creep, whose time constant `-1 / ln(pole)` exceeds that of the dynamics, or that of a plant
    /// that is slow itself; none where they carry most of the DC gain, which creep does not.
    pub(crate) fn slow_lags(
        &self,
        point: &Point,
        prepared: &Prepared,
    ) -> Result<Vec<Complex<f64>>, Error> {
        let is_slow_plant = self.is_slow_plant(point, prepared)?;
        self.lags_of(point, prepared, is_slow_plant)
    }

    /// The same, where it is known whether the plant is slow.
    fn lags_of(
        &self,
        point: &Point,
        prepared: &Prepared,
        is_slow_plant: bool,
    ) -> Result<Vec<Complex<f64>>, Error> {
        let own = &point.dynamics;
        let is_slow = |pole: &Complex<f64>| is_lag(pole) && time_constant(pole) > self.lag;
        let limit = if is_slow_plant {
            // an integrator
            let integrates = self.is_carried_beyond(self.of_slow_plant, point, prepared)?;
            if integrates { f64::INFINITY } else { self.of_slow_plant }
        } else if own.with_poles(|pole| !is_slow(pole)).dc_gain().norm()
            < self.at_once * own.dc_gain().norm()
        {
            f64::INFINITY
        } else {
            self.lag
        };
        let exceeds = |pole: &Complex<f64>| is_lag(pole) && time_constant(pole) > limit;
        Ok(own.poles().into_iter().filter(exceeds).collect())
    }

    /// Whether a pole is as slow as a disturbance, `-1 / ln|pole|` its time constant.
    pub(crate) fn is_disturbance(&self, pole: &Complex<f64>) -> bool {
        time_constant(pole) >= self.longest
    }

    /// The poles of G that are as slow as creep or a disturbance.
    pub(crate) fn exceeded_by(
        &self,
        point: &Point,
        prepared: &Prepared,
    ) -> Result<Vec<Complex<f64>>, Error> {
        let is_slow_plant = self.is_slow_plant(point, prepared)?;
        let lags = self.lags_of(point, prepared, is_slow_plant)?;
        let is_slow = |pole: &Complex<f64>| {
            let is_own = is_slow_plant && is_lag(pole);
            lags.contains(pole) || self.is_disturbance(pole) && !is_own
        };
        Ok(point.dynamics.poles().into_iter().filter(is_slow).collect())
    }

    /// The fewest samples that show a plant to be slow.
    pub(crate) fn enough(&self) -> usize {
        self.enough
    }

    /// Whether poles that are slower than the lags of a mechanical stage, and do not resonate, carry the movement.
    pub(crate) fn is_slow_plant(&self, point: &Point, prepared: &Prepared) -> Result<bool, Error> {
        self.is_carried_beyond(self.lag, point, prepared)
    }

    /// Whether poles that are slower than a time constant, and do not resonate, carry the movement.
    fn is_carried_beyond(
        &self,
        longest: f64,
        point: &Point,
        prepared: &Prepared,
    ) -> Result<bool, Error> {
        let is_fast = |pole: &Complex<f64>| resonates(pole) || time_constant(pole) <= longest;
        if prepared.record.longest() < self.enough || point.dynamics.poles().iter().all(is_fast) {
            return Ok(false);
        }
        let [fast, _, all] = squares_moved(point, prepared, is_fast)?;
        Ok(fast < self.at_once.powi(2) * all)
    }
}

/// The part of the movement that poles without resonance which are slower than a time constant in samples carry: `|S v| / |G v|`.
pub(crate) fn part_of_slower(
    longest: f64,
    point: &Point,
    prepared: &Prepared,
) -> Result<f64, Error> {
    let is_fast = |pole: &Complex<f64>| resonates(pole) || time_constant(pole) <= longest;
    if point.dynamics.poles().iter().all(is_fast) {
        return Ok(0.0);
    }
    let [_, slow, all] = squares_moved(point, prepared, is_fast)?;
    Ok((slow / all.max(f64::MIN_POSITIVE)).sqrt())
}

/// The squares of what the fast part F of G and the rest of it, S, make of v, counted from its first sample, and of both together.
fn squares_moved(
    point: &Point,
    prepared: &Prepared,
    is_fast: impl Fn(&Complex<f64>) -> bool,
) -> Result<[f64; 3], Error> {
    let whole = point.dynamics.to_state_space()?;
    let fast = point.dynamics.with_poles(is_fast).to_state_space()?;
    let mut sums = [0.0; 3];
    for experiment in prepared.driven(point)?.experiments() {
        let v = &experiment.input;
        let moved = Matrix::from_fn(v.nrows(), v.ncols(), |k, input| v[(k, input)] - v[(0, input)]);
        let (fast, all) = (fast.simulate(&moved)?, whole.simulate(&moved)?);
        sums[0] += fast.norm_squared();
        sums[1] += (&all - fast).norm_squared();
        sums[2] += all.norm_squared();
    }
    Ok(sums)
}

/// Whether a pole is that of a lag: real and positive.
fn is_lag(pole: &Complex<f64>) -> bool {
    pole.im == 0.0 && pole.re > 0.0
}

/// The time constant of a pole in samples, `-1 / ln|pole|`.
pub(crate) fn time_constant(pole: &Complex<f64>) -> f64 {
    -1.0 / pole.norm().max(f64::MIN_POSITIVE).ln()
}

impl Point {
    /// The same without poles of G; `None` where it has no such poles, or none else. Beside loops, which act on the states of its
    /// sections, whole sections are taken out, and poles that share one with others stay.
    pub(crate) fn without(
        &self,
        unwanted: impl Fn(&Complex<f64>) -> bool,
    ) -> Result<Option<Self>, Error> {
        if self.loops().next().is_some() {
            return Ok(self.without_sections(unwanted));
        }
        let Some((_, rest)) = self.split(unwanted)? else { return Ok(None) };
        let mut point = self.clone();
        point.replace_dynamics(rest);
        rescale(&mut point);
        Ok(Some(point))
    }

    /// The same with lags of G as the sections of an effect in parallel with it, which it does not have yet. The output changes only with
    /// the initial states of G, which are zero. `None` beside loops, where G has no such lags, or none else, and where it has several
    /// inputs or outputs.
    pub(crate) fn with_lags_in(
        &self,
        mut effect: Effect,
        is_lag: impl Fn(&Complex<f64>) -> bool,
    ) -> Result<Option<Self>, Error> {
        if self.loops().next().is_some() || self.dynamics.d.len() > 1 {
            return Ok(None);
        }
        let Some((whole, rest)) = self.split(&is_lag)? else { return Ok(None) };
        let lags: Vec<Coefficients> = whole
            .poles()
            .iter()
            .filter(|pole| is_lag(pole))
            .flat_map(|lag| whole.with_poles(|pole| pole == lag).sections)
            .map(|section| (section.a, (section.c * section.b).as_slice().to_vec()))
            .collect();
        let PlaceMut::Parallel(own) = effect.place_mut() else { return Ok(None) };
        own.set_sections(&lags, self.rate);
        let mut point = self.clone();
        point.replace_dynamics(rest);
        let mut point = point.with_effect(effect);
        rescale(&mut point);
        Ok(Some(point))
    }

    /// G with its delay counted, and the same without unwanted poles; `None` where it has no such poles, or none else.
    fn split(
        &self,
        unwanted: impl Fn(&Complex<f64>) -> bool,
    ) -> Result<Option<(Sections, Sections)>, Error> {
        if !self.dynamics.poles().iter().any(&unwanted) {
            return Ok(None);
        }
        let whole = Sections::from_delayed_state_space(&self.dynamics.to_state_space()?)?;
        let rest = whole.with_poles(|pole| !unwanted(pole));
        let is_part = !rest.sections.is_empty() && !rest.poles().iter().any(unwanted);
        Ok(is_part.then_some((whole, rest)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Creep;
    use crate::fit::Grid;
    use crate::identify::IdentifyOptions;
    use crate::identify::procedure::prepare;
    use crate::linear::StateSpace;
    use crate::{Channel, Experiment};

    /// `d + sum_i gain_i (1 - p_i) / (z - p_i)`.
    fn lags(d: f64, terms: &[(f64, f64)]) -> Sections {
        let a =
            Matrix::from_fn(terms.len(), terms.len(), |i, j| if i == j { terms[i].1 } else { 0.0 });
        let b = Matrix::from_fn(terms.len(), 1, |i, _| 1.0 - terms[i].1);
        let c = Matrix::from_fn(1, terms.len(), |_, j| terms[j].0);
        let system = StateSpace::new(a, b, c, Matrix::from_element(1, 1, d)).unwrap();
        Sections::from_state_space(&system, 0).unwrap()
    }

    fn record() -> Record {
        let signal = Matrix::from_fn(20_000, 1, |k, _| (0.01 * k as f64).sin());
        let run = Experiment::new(signal.clone(), signal);
        let channel = |name| vec![Channel::new(name, "")];
        Record::new(vec![run], 1000.0, channel("u"), channel("y"), vec![]).unwrap()
    }

    /// The slow lags, and all poles that are too slow, of a stage without hysteresis at a sine of 628 samples.
    fn found(dynamics: Sections) -> [Vec<Complex<f64>>; 2] {
        let record = record();
        let options = IdentifyOptions {
            half_widths: Some(Grid::Count(1)),
            thresholds: Some(Grid::Count(0)),
            ..IdentifyOptions::default()
        };
        let prepared = prepare(&record, &options).unwrap();
        let (point, memory) = (prepared.point(dynamics), Memory::of(&record));
        [
            memory.slow_lags(&point, &prepared).unwrap(),
            memory.exceeded_by(&point, &prepared).unwrap(),
        ]
    }

    #[test]
    fn a_slow_lag_beside_a_fast_response_is_creep() {
        // 0.9 at once or within 5 samples, 0.2 within 200 samples
        let [lag, all] = found(lags(0.4, &[(0.5, 0.8), (0.2, 0.995)]));
        assert!(lag.len() == 1 && (lag[0].re - 0.995).abs() < 1e-9, "{lag:?}");
        assert_eq!(lag, all);
        assert!(found(lags(0.4, &[(0.5, 0.8)])).concat().is_empty());
    }

    #[test]
    fn the_part_of_slower_poles_is_that_of_what_they_add() {
        let record = record();
        let prepared = prepare(&record, &IdentifyOptions::default()).unwrap();
        let part = |longest: f64, dynamics| {
            part_of_slower(longest, &prepared.point(dynamics), &prepared).unwrap()
        };
        // a lag of 200 samples, exp(-1 / 200), of a tenth beside 0.9 at once, at a sine of 628 samples
        let creep = || lags(0.9, &[(0.1, (-1.0_f64 / 200.0).exp())]);
        let own = part(100.0, creep());
        assert!((0.03..0.07).contains(&own), "{own}");
        assert_eq!(part(300.0, creep()), 0.0);
        // a tank is nothing but its lag
        assert_eq!(part(100.0, lags(0.0, &[(1.0, (-1.0_f64 / 200.0).exp())])), 1.0);
    }

    #[test]
    fn lags_become_those_of_an_effect_without_a_change_of_the_output() {
        let (record, creep) = (record(), || Creep {
            input: 0,
            time_constants: vec![1.0],
            gains: vec![0.0],
            dead_time: 0,
        });
        let prepared = prepare(&record, &IdentifyOptions::default()).unwrap();
        // the two slow lags are one section of G
        let before = prepared.point(lags(0.5, &[(0.3, 0.8), (0.1, 0.99), (0.2, 0.998)]));
        let after = before.with_lags_in(creep().into(), |pole| pole.re > 0.9).unwrap().unwrap();
        assert_eq!((after.dynamics.order(), after.order()), (1, 3));
        let difference: f64 = before
            .residuals(&record)
            .unwrap()
            .iter()
            .zip(&after.residuals(&record).unwrap())
            .map(|(before, after)| (before - after).amax())
            .fold(0.0, f64::max);
        assert!(difference < 1e-9, "{difference}");
        let mut lags = after.effects[0].values();
        lags[..2].sort_by(f64::total_cmp);
        let time = |pole: f64| -1e-3 / pole.ln();
        assert!((lags[0] - time(0.99)).abs() < 1e-9 && (lags[1] - time(0.998)).abs() < 1e-9);
        // all but 0.8 of the gain of 1.1 is theirs
        assert!((lags[2] + lags[3] - 0.3 / 0.8).abs() < 1e-9, "{lags:?}");
        assert!(before.with_lags_in(creep().into(), |pole| pole.re > 0.999).unwrap().is_none());
        assert!(before.with_lags_in(creep().into(), |_| true).unwrap().is_none());
    }

    #[test]
    fn the_lags_of_a_slow_plant_are_its_dynamics() {
        // two tanks in a row: nothing is there at once
        assert!(found(lags(0.0, &[(3.0, 0.995), (-2.0, 0.9925)])).concat().is_empty());
        // nor where the lag is a tenth of the record
        assert!(found(lags(0.0, &[(1.0, 0.9995)])).concat().is_empty());
        // nor where the output integrates the input
        assert!(found(lags(0.0, &[(1e4, 1.0 - 1e-8)])).concat().is_empty());
        // but a lag that has hardly moved anything is a disturbance, even if its gain is large
        let [_, wandering] = found(lags(0.5, &[(1.0, 0.9995)]));
        assert_eq!(wandering.len(), 1);
    }
}
