//! Everything that is estimated, as one point.
//!
//! A point determines the simulated output of every experiment of a record. For experiment e,
//!
//! ```text
//! y_e = H(G * v(I(u_e)) + loops + sections in parallel, x_e) + sum of added signals + offset_e(t)
//! ```
//!
//! with the hysteresis of each input ([`Parameters`]), G in [`Sections`], and the effects by place. What belongs to an
//! experiment alone is its initial state ([`Past`]) and its offset, piecewise linear through knots.
//!
//! The state vector x of an experiment has one segment for the sections of G, then one for those of each effect in
//! parallel with G, in the order of the chain. Methods that insert or remove an effect splice the segment of every
//! experiment, so that the other initial states keep their values.

use crate::chain::between::{Between, held_inputs};
use crate::chain::hysteresis::{Elements, Parameters};
use crate::chain::sensitivity::Derivatives;
use crate::effects::{
    Coefficients, Effect, InnerLoop, OutputKind, OutputStage, PlaceMut, SteadyForce,
};
use crate::linear::{Section, Sections};
use crate::{Intersample, Matrix};
use nalgebra::{Complex, DVector};
use std::ops::Range;

/// The initial state of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Past {
    /// The initial places of the plays, as fractions of their half-widths from z (-1 to 1), `[input][play]`; `None` when
    /// the actuator came from rest.
    pub plays: Option<Vec<Vec<f64>>>,
    /// Where each output's reading stands in its gap, if it has one, as a fraction of the half-width from the displacement (-1 to 1);
    /// used where the initial state is unknown.
    pub gaps: DVector<f64>,
    /// Whether the initial state is unknown, so that `gaps` and `state` are to be fitted.
    pub has_unknown_state: bool,
    /// By how much the state of all [`Point::sections`] at the first scored sample differs from the steady
    /// state before the record.
    pub state: DVector<f64>,
}

impl Past {
    /// At rest, before so many states and outputs.
    pub(crate) fn rest(states: usize, outputs: usize) -> Self {
        Self {
            plays: None,
            gaps: DVector::zeros(outputs),
            has_unknown_state: false,
            state: DVector::zeros(states),
        }
    }

    /// Where the reading of an output stands in its gap, if that is unknown.
    pub(crate) fn side(&self, output: usize) -> Option<f64> {
        self.has_unknown_state.then(|| self.gaps[output])
    }
}

/// All parameters of a model and of its experiments.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// One hysteresis an input.
    pub channels: Vec<Parameters>,
    pub dynamics: Sections,
    /// How loops around G are computed between samples.
    pub intersample: Intersample,
    /// In the order of the chain.
    pub effects: Vec<Effect>,
    /// Sampling rate in Hz.
    pub rate: f64,
    /// One an experiment.
    pub pasts: Vec<Past>,
    /// The additive term at evenly spaced knots of each experiment, (knots, outputs); one knot is a
    /// constant.
    pub offsets: Vec<Matrix>,
}

/// What is free of the linear dynamics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DynamicsFreedom {
    Nothing,
    /// Everything but the poles.
    Numerator,
    Everything,
}

/// Which parameters are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Freedom {
    /// Weights, slopes and the values of effects.
    pub weights: bool,
    pub offsets: bool,
    /// Thresholds, half-widths, initial places of plays.
    pub derivatives: Derivatives,
    /// Unknown initial states of the sections.
    pub states: bool,
    /// The slope of the deadzone of threshold 0. Held, it fixes the scale between envelope and plays;
    /// free, the half-widths fix it.
    pub identity: bool,
    pub dynamics: DynamicsFreedom,
}

impl Point {
    /// Everything linear that v drives: the sections of G, then those of effects in parallel with G.
    pub(crate) fn sections(&self) -> Vec<Section> {
        let shape = self.dynamics.d.shape();
        let parallel = self.effects.iter().filter_map(|effect| effect.place().parallel_sections());
        let parallel = parallel.flat_map(|own| {
            let one = move |coefficients| Section::from_one_input(coefficients, own.input(), shape);
            own.sections(self.rate).into_iter().map(one)
        });
        self.dynamics.sections.iter().cloned().chain(parallel).collect()
    }

    /// The outputs whose reading a gap may hold.
    pub(crate) fn gapped(&self) -> Vec<usize> {
        let own = self.output_stages().filter(|own| !own.rest(0.0, None).is_empty());
        let mut outputs: Vec<usize> = own.map(OutputStage::output).collect();
        outputs.sort_unstable();
        outputs.dedup();
        outputs
    }

    /// The states of all sections.
    pub(crate) fn order(&self) -> usize {
        self.states_before(self.effects.len())
    }

    /// The states of G and of the effects before a place.
    pub(crate) fn states_before(&self, place: usize) -> usize {
        let states = |effect| orders(effect, self.rate).iter().sum::<usize>();
        self.dynamics.order() + self.effects[..place].iter().map(states).sum::<usize>()
    }

    /// The sections of an effect are changed.
    pub(crate) fn change_sections(
        &mut self,
        place: usize,
        change: impl FnOnce(&mut Vec<Coefficients>),
    ) {
        let rate = self.rate;
        if let PlaceMut::Parallel(own) = self.effects[place].place_mut() {
            let mut sections = own.sections(rate);
            change(&mut sections);
            own.set_sections(&sections, rate);
        }
    }

    /// The point with one more effect, in its place of the chain.
    pub(crate) fn with_effect(&self, effect: Effect) -> Self {
        let mut point = self.clone();
        let place = point.effects.partition_point(|other| other.stage() <= effect.stage());
        let (first, count) = (self.states_before(place), orders(&effect, self.rate).iter().sum());
        point.effects.insert(place, effect);
        point.splice_states(first..first, &vec![0.0; count]);
        point
    }

    /// The point without one of its effects.
    pub(crate) fn without_effect(&self, place: usize) -> Self {
        let mut point = self.clone();
        point.splice_states(self.states_before(place)..self.states_before(place + 1), &[]);
        point.effects.remove(place);
        point
    }

    /// The point with the sections of an effect as a part of G.
    pub(crate) fn with_effect_in_dynamics(&self, place: usize) -> Self {
        let mut point = self.without_effect(place);
        let (own, effects) = (self.dynamics.order(), self.states_before(place));
        for (past, before) in point.pasts.iter_mut().zip(&self.pasts) {
            let states = &before.state.as_slice()[effects..self.states_before(place + 1)];
            let mut all = past.state.as_slice().to_vec();
            all.splice(own..own, states.iter().copied());
            past.state = DVector::from_vec(all);
        }
        let first: usize = self.effects[..place].iter().map(|e| orders(e, self.rate).len()).sum();
        let first = self.dynamics.sections.len() + first;
        let count = orders(&self.effects[place], self.rate).len();
        point.dynamics.sections.extend(self.sections().drain(first..first + count));
        let more = point.dynamics.order() - own;
        point.loops_mut().for_each(|inner| inner.add_states(more));
        point
    }

    /// Whether G has a motion between the samples, where loops are computed in several steps from one to the next: no pole of
    /// it is zero or negative.
    pub(crate) fn moves_between_samples(&self) -> bool {
        let loops: Vec<_> = self.loops().collect();
        loops.is_empty() || Between::around(&self.dynamics, &loops, self.intersample).is_some()
    }

    /// The point without a section of G, whose DC gain D takes where it is held.
    pub(crate) fn without_section(&self, section: usize) -> Self {
        let mut point = self.clone();
        let sections = &mut point.dynamics.sections;
        let first: usize = sections[..section].iter().map(Section::order).sum();
        let own = first..first + sections.remove(section).order();
        point.dynamics.hold_gain();
        point.splice_states(own.clone(), &[]);
        point.loops_mut().for_each(|inner| inner.drop_states(own.clone()));
        point
    }

    /// The point without the sections of G all of whose poles are unwanted; `None` where there are none, or none else. What loops drive and
    /// see of the other sections stays.
    pub(crate) fn without_sections(
        &self,
        unwanted: impl Fn(&Complex<f64>) -> bool,
    ) -> Option<Self> {
        let is_unwanted = |section: &Section| section.poles().iter().all(&unwanted);
        let sections = &self.dynamics.sections;
        let dropped: Vec<usize> =
            (0..sections.len()).rev().filter(|&own| is_unwanted(&sections[own])).collect();
        let is_part = !dropped.is_empty() && dropped.len() < sections.len();
        is_part.then(|| {
            dropped.into_iter().fold(self.clone(), |point, section| point.without_section(section))
        })
    }

    /// Lets loops take no more than the whole excess over a limit away in a step. What exceeds it would otherwise be thrown back, and the
    /// derivatives of such a motion grow from step to step.
    pub(crate) fn bound_limits(&mut self) {
        let (c, steps) = (self.dynamics.c(), self.intersample.substeps as f64);
        for inner in self.loops_mut().filter(|inner| inner.law.limits()) {
            inner.take_at_most(steps, &c);
        }
    }

    /// The loops that effects close around G, to be changed.
    pub(crate) fn loops_mut(&mut self) -> impl Iterator<Item = &mut InnerLoop> {
        let loops = self.effects.iter_mut().filter_map(|effect| match effect.place_mut() {
            PlaceMut::Loops(closed) => Some(closed.loops_mut()),
            _ => None,
        });
        loops.flatten()
    }

    pub(super) fn splice_states(&mut self, range: Range<usize>, values: &[f64]) {
        for past in &mut self.pasts {
            let mut all = past.state.as_slice().to_vec();
            all.splice(range.clone(), values.iter().copied());
            past.state = DVector::from_vec(all);
        }
    }

    /// The effects as a model has them: with the dead time of G.
    pub(crate) fn blocks(&self) -> Vec<Effect> {
        let mut effects = self.effects.clone();
        for effect in &mut effects {
            if let PlaceMut::Parallel(own) = effect.place_mut() {
                own.set_dead_time(self.dynamics.delay);
            }
        }
        effects
    }

    /// The force of a loop in steady state, where it is known.
    pub(crate) fn steady_force(&self, inner: &InnerLoop) -> Option<SteadyForce> {
        let behind = Sections { delay: 0, ..self.dynamics.clone() }.to_state_space().ok()?;
        let b = held_inputs(&behind, self.intersample)?;
        let gains = |drives: &[f64]| Some(self.dynamics.gains_from_states(drives));
        let over_stiffness = inner.relative_force(&b, gains)?;
        let sensitivity = self.dynamics.dc_gain()[(0, 0)] * self.channels[0].slope();
        let offset =
            self.offsets.iter().map(|own| own[(0, 0)]).sum::<f64>() / self.offsets.len() as f64;
        let poles = self.dynamics.poles();
        Some(SteadyForce::new(over_stiffness, sensitivity, &poles, self.rate, offset))
    }

    /// What the output of the hysteresis is, by its elements.
    pub(crate) fn output_kind(&self) -> OutputKind {
        let has_stops = |channel: &Parameters| channel.elements == Elements::Stops;
        if !self.channels.iter().any(has_stops) {
            OutputKind::Displacement
        } else if self.channels.iter().all(|own| has_stops(own) && own.thresholds.len() == 1) {
            OutputKind::Force
        } else {
            OutputKind::Other
        }
    }

    /// The slope of an output over the first input, where its direction has just been reversed, in steady state.
    pub(crate) fn stiffness(&self, output: usize) -> f64 {
        self.dynamics.dc_gain()[(output, 0)] * self.channels[0].slope_after_reversal()
    }

    /// The effects of the output stage.
    pub(crate) fn output_stages(&self) -> impl Iterator<Item = &dyn OutputStage> {
        self.effects.iter().filter_map(|effect| effect.place().output_stage())
    }
}

/// The orders of the sections of an effect.
fn orders(effect: &Effect, rate: f64) -> Vec<usize> {
    let sections = effect.place().parallel_sections().map(|own| own.sections(rate));
    sections.unwrap_or_default().iter().map(|(a, _)| a.len()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::looped::{model, record, run};
    use crate::effects::{Drives, Sees};
    use crate::fit::preparation::Prepared;

    #[test]
    fn a_section_is_left_out_of_all_that_loops_see_and_drive() {
        let model = model();
        let record = record(&model, vec![run(1.5, 0.3, 0, vec![])]);
        let channels = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::new(&record, channels).unwrap();
        let mut point = prepared.point_of(&model).unwrap();
        point.pasts[0].state = DVector::from_column_slice(&[1.0, 2.0, 3.0]);
        // a pair and a single pole; they are left out in turn
        let orders: Vec<usize> = point.dynamics.sections.iter().map(Section::order).collect();
        assert_eq!(orders, [2, 1]);
        let is_real = |pole: &Complex<f64>| pole.im == 0.0;
        let pair = point.without_sections(is_real).unwrap();
        assert_eq!(pair.dynamics.sections, point.dynamics.sections[..1]);
        assert!(
            point.without_sections(|_| true).is_none() && pair.without_sections(is_real).is_none()
        );
        for (section, left) in [(0, 2..3), (1, 0..2)] {
            let without = point.without_section(section);
            let states = &point.pasts[0].state.as_slice()[left.clone()];
            assert_eq!(without.pasts[0].state.as_slice(), states);
            for (inner, before) in without.loops().zip(point.loops()) {
                assert_eq!(inner.drives.states(), left.len());
                if let (Drives::States(column), Drives::States(whole)) =
                    (&inner.drives, &before.drives)
                {
                    assert_eq!(column[..], whole[left.clone()]);
                }
                if let (Sees::Mixture { states, .. }, Sees::Mixture { states: whole, .. }) =
                    (&inner.sees, &before.sees)
                {
                    assert_eq!(states[..], whole[left.clone()]);
                }
            }
            for (input, held) in point.dynamics.held.iter().enumerate() {
                let (output, gain) = held.unwrap();
                assert!((without.dynamics.dc_gain()[(output, input)] - gain).abs() < 1e-12);
            }
        }
    }
}
