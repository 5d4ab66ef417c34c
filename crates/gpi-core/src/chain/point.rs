//! Everything that is estimated, as one point.

use crate::Matrix;
use crate::chain::hysteresis::{Derivatives, Parameters};
use crate::effects::{Effect, OutputStage, PlaceMut};
use crate::linear::Sections;
use nalgebra::DVector;

/// What was before the first sample of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Past {
    /// Where the plays stood between their lowest place beside z (-1) and their highest one (1),
    /// `[input][play]`; `None` when the actuator came from rest.
    pub plays: Option<Vec<Vec<f64>>>,
    /// Whether the experiment began in motion, so that `state` is to be fitted.
    pub moving: bool,
    /// By how much the state of the sections at the first scored sample differs from that of an
    /// actuator that stood still before the record.
    pub state: DVector<f64>,
}

/// All parameters of a model and of its experiments.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// One hysteresis an input.
    pub channels: Vec<Parameters>,
    /// G, and beside it the sections of effects.
    pub dynamics: Sections,
    /// In the order of the chain. Values of those that are sections stand in `dynamics`.
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
    /// Weights, slopes and offsets.
    pub weights: bool,
    /// Thresholds, half-widths, start values.
    pub derivatives: Derivatives,
    /// The slope of the deadzone of threshold 0. Held, it fixes the scale between envelope and plays;
    /// free, the half-widths fix it.
    pub identity: bool,
    pub dynamics: DynamicsFreedom,
}

impl Point {
    /// The point with one more effect, in its place of the chain.
    pub(crate) fn with_effect(&self, effect: Effect) -> Self {
        let mut point = self.clone();
        let place = point.effects.partition_point(|other| other.stage() <= effect.stage());
        let parallel = effect.place().parallel_sections();
        let parallel = parallel.map(|own| (own.input(), own.sections(point.rate)));
        let (input, sections) = parallel.unwrap_or_default();
        point.effects.insert(place, effect);
        for section in &mut point.dynamics.sections {
            section.beside = section.beside.map(|own| if own >= place { own + 1 } else { own });
        }
        for (a, b) in sections {
            let order = a.len();
            point.dynamics.push_beside(place, input, a, &b);
            for past in &mut point.pasts {
                past.state = past.state.clone().resize_vertically(past.state.len() + order, 0.0);
            }
        }
        point
    }

    /// The point without one of its effects.
    pub(crate) fn without_effect(&self, place: usize) -> Self {
        let mut point = self.clone();
        point.effects.remove(place);
        let kept: Vec<bool> =
            self.dynamics.sections.iter().map(|section| section.beside != Some(place)).collect();
        let states: Vec<bool> = self
            .dynamics
            .sections
            .iter()
            .zip(&kept)
            .flat_map(|(section, &kept)| std::iter::repeat_n(kept, section.order()))
            .collect();
        let mut flags = kept.iter();
        point.dynamics.sections.retain(|_| *flags.next().unwrap_or(&true));
        for section in &mut point.dynamics.sections {
            section.beside = section.beside.map(|own| if own > place { own - 1 } else { own });
        }
        for past in &mut point.pasts {
            let left = past.state.iter().zip(&states).filter(|(_, kept)| **kept);
            past.state = DVector::from_vec(left.map(|(value, _)| *value).collect());
        }
        point
    }

    /// The effects, with the values that stand in the dynamics.
    pub(crate) fn blocks(&self) -> Vec<Effect> {
        let mut effects = self.effects.clone();
        for (place, effect) in effects.iter_mut().enumerate() {
            let PlaceMut::Parallel(effect) = effect.place_mut() else { continue };
            let input = effect.input();
            let own = self.dynamics.sections.iter().filter(|s| s.beside == Some(place));
            let sections: Vec<_> = own
                .map(|s| (s.a.clone(), s.b.column(input).iter().copied().collect::<Vec<_>>()))
                .collect();
            if !sections.is_empty() {
                let dead_time = self.dynamics.delay;
                effect.set_sections(&sections, dead_time, self.rate);
            }
        }
        effects
    }

    /// The effects of the output stage.
    pub(crate) fn output_stages(&self) -> impl Iterator<Item = &dyn OutputStage> {
        self.effects.iter().filter_map(|effect| effect.place().output_stage())
    }
}
