//! Everything that is estimated, as one point, and where each unknown stands in a step away from it.

use crate::chain::hysteresis::{Derivatives, Parameters};
use crate::effects::{Effect, OutputStage, Place, PlaceMut};
use crate::linear::Sections;
use crate::{Matrix, Record};
use nalgebra::DVector;
use std::ops::Range;

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

/// Where each group of unknowns stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    pub weights: Vec<Range<usize>>,
    pub slopes: Vec<Range<usize>>,
    pub thresholds: Vec<Range<usize>>,
    pub half_widths: Vec<Range<usize>>,
    pub sections: Vec<SectionLayout>,
    /// One unknown for each element of D by columns, `None` where the held DC gain sets it.
    pub feedthrough: Vec<Option<usize>>,
    /// The values of each effect; none of those that are sections.
    pub effects: Vec<Range<usize>>,
    /// `[experiment]`, (knots, outputs) by columns.
    pub offsets: Vec<Range<usize>>,
    /// `[experiment][input]`.
    pub plays: Vec<Vec<Range<usize>>>,
    /// `[experiment]`, the sections' states one after the other.
    pub states: Vec<Range<usize>>,
    pub len: usize,
}

/// Where the unknowns of one section stand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SectionLayout {
    pub a: Range<usize>,
    /// (order, inputs) by columns.
    pub b: Range<usize>,
    /// (outputs, order) by columns; empty for one output. The reference output's row is not used.
    pub c: Range<usize>,
}

impl Layout {
    pub(crate) fn new(point: &Point, freedom: Freedom) -> Self {
        let mut end = 0;
        let mut take = |wanted: bool, count: usize| {
            let start = end;
            end += if wanted { count } else { 0 };
            start..end
        };
        let Freedom { derivatives, dynamics, .. } = freedom;
        let (inputs, outputs) = (point.channels.len(), point.dynamics.outputs());
        let channels = &point.channels;
        let weights = channels.iter().map(|c| take(true, c.weights.len())).collect();
        let slopes = channels.iter().map(|c| take(true, c.slopes.len())).collect();
        let thresholds =
            channels.iter().map(|c| take(derivatives.thresholds, c.slopes.len())).collect();
        let half_widths =
            channels.iter().map(|c| take(derivatives.half_widths, c.weights.len())).collect();
        let moves = dynamics != DynamicsFreedom::Nothing;
        let section = |n: usize, take: &mut dyn FnMut(bool, usize) -> Range<usize>| SectionLayout {
            a: take(dynamics == DynamicsFreedom::Everything, n),
            b: take(moves, n * inputs),
            c: take(moves && outputs > 1, n * outputs),
        };
        let sections =
            point.dynamics.sections.iter().map(|s| section(s.order(), &mut take)).collect();
        let mut feedthrough = Vec::new();
        for (input, held) in point.dynamics.held.iter().enumerate() {
            debug_assert_eq!(feedthrough.len(), input * outputs);
            for output in 0..outputs {
                let free = moves && output != held.0;
                feedthrough.push(free.then(|| take(true, 1).start));
            }
        }
        let effects = point.effects.iter().map(|effect| {
            take(effect.place().parallel_sections().is_none(), effect.values().len())
        });
        let effects = effects.collect();
        let offsets = point.offsets.iter().map(|knots| take(true, knots.len())).collect();
        let unknown = |past: &Past| derivatives.starts && past.plays.is_some();
        let plays = point
            .pasts
            .iter()
            .map(|past| channels.iter().map(|c| take(unknown(past), c.weights.len())).collect())
            .collect();
        let order = point.dynamics.order();
        let moved = |past: &Past| derivatives.starts && past.moving;
        let states = point.pasts.iter().map(|past| take(moved(past), order)).collect();
        let len = take(true, 0).end;
        Self {
            weights,
            slopes,
            thresholds,
            half_widths,
            sections,
            feedthrough,
            effects,
            offsets,
            plays,
            states,
            len,
        }
    }

    /// Unknowns that enter the output linearly when all others are kept.
    pub(crate) fn is_linear(&self, unknown: usize) -> bool {
        let among = |ranges: &[Range<usize>]| ranges.iter().any(|range| range.contains(&unknown));
        among(&self.weights) || among(&self.offsets) || among(&self.states)
    }
}

/// What a step may be, elementwise; a fixed unknown has both bounds at zero.
pub(crate) struct Bounds {
    pub lower: DVector<f64>,
    pub upper: DVector<f64>,
}

impl Point {
    /// The bounds of a step: weights stay positive, plays stay around z, thresholds on their side of
    /// zero and inside the range of u, half-widths in order.
    pub(crate) fn bounds(&self, layout: &Layout, record: &Record, freedom: Freedom) -> Bounds {
        /// Fraction of a gap to a neighbour, or of a range, that one step may take.
        const REACH: f64 = 0.4;
        let mut lower = DVector::from_element(layout.len, f64::NEG_INFINITY);
        let mut upper = DVector::from_element(layout.len, f64::INFINITY);
        let mut bound = |unknown: usize, low: f64, high: f64| {
            (lower[unknown], upper[unknown]) = (low.min(0.0), high.max(0.0));
        };
        for (input, channel) in self.channels.iter().enumerate() {
            for (weight, i) in channel.weights.iter().zip(layout.weights[input].clone()) {
                bound(i, -weight, f64::INFINITY);
            }
            if !freedom.weights {
                let held = layout.weights[input].clone().chain(layout.slopes[input].clone());
                held.for_each(|i| bound(i, 0.0, 0.0));
            }
            // The widest play that moves keeps its half-width: that is the scale of z.
            let widest = channel.weights.iter().rposition(|&weight| weight > 0.0).unwrap_or(0);
            if !freedom.identity || widest == 0 {
                bound(layout.slopes[input].start, 0.0, 0.0);
            }
            let (low, high) = range(record, input);
            let inside = 0.01 * (high - low);
            let etas = &channel.thresholds;
            for (place, i) in layout.thresholds[input].clone().enumerate().skip(1) {
                let eta = etas[place];
                // The nearest that it may come to: zero, the ends of the range, its neighbours.
                let (below, above) = if eta > 0.0 {
                    (low.max(0.0) + inside, high - inside)
                } else {
                    (low + inside, high.min(0.0) - inside)
                };
                let previous = if place > 1 { etas[place - 1] } else { f64::NEG_INFINITY };
                let next = etas.get(place + 1).copied().unwrap_or(f64::INFINITY);
                let below = below.max(eta + REACH * (previous - eta));
                let above = above.min(eta + REACH * (next - eta));
                bound(i, below - eta, above - eta);
            }
            if let Some(identity) = layout.thresholds[input].clone().next() {
                bound(identity, 0.0, 0.0);
            }
            let widths = &channel.half_widths;
            for (place, i) in layout.half_widths[input].clone().enumerate() {
                if place == 0 || (place >= widest && freedom.identity) {
                    bound(i, 0.0, 0.0);
                    continue;
                }
                let below = widths[place] - widths[place - 1];
                let above = widths.get(place + 1).map_or(below, |next| next - widths[place]);
                bound(i, -REACH * below, REACH * above);
            }
        }
        for (effect, unknowns) in self.effects.iter().zip(&layout.effects) {
            let Some(block) = effect.block() else { continue };
            let limits = block.values().into_iter().zip(block.bounds());
            for ((value, (low, high)), i) in limits.zip(unknowns.clone()) {
                if freedom.weights {
                    bound(i, low - value, high - value);
                } else {
                    bound(i, 0.0, 0.0);
                }
            }
        }
        for (section, unknowns) in self.dynamics.sections.iter().zip(&layout.sections) {
            let outputs = self.dynamics.outputs();
            let effect = section.beside.map(|effect| self.effects[effect].place());
            if let Some(own) = effect.and_then(Place::parallel_sections) {
                let (low, high) = own.section_bounds(self.rate);
                if let ([a1], true) = (&section.a[..], !unknowns.a.is_empty()) {
                    bound(unknowns.a.start, low - a1, high - a1);
                }
                // one input drives it
                let order = section.order();
                let others = unknowns.b.clone().enumerate();
                let drives = |place: usize| section.b.column(place / order).amax() != 0.0;
                for (place, i) in others.filter(|&(place, _)| place / order != own.input()) {
                    debug_assert!(!drives(place));
                    bound(i, 0.0, 0.0);
                }
            }
            for i in unknowns.c.clone().skip(section.reference).step_by(outputs) {
                bound(i, 0.0, 0.0);
            }
        }
        if !freedom.weights {
            layout.offsets.iter().flat_map(Clone::clone).for_each(|i| bound(i, 0.0, 0.0));
        }
        for (past, unknowns) in self.pasts.iter().zip(&layout.plays) {
            let sides = past.plays.iter().flatten().zip(unknowns);
            for (place, (side, i)) in
                sides.flat_map(|(sides, i)| sides.iter().zip(i.clone()).enumerate())
            {
                // a play of half-width zero has no side
                let free = if place == 0 { 0.0 } else { 1.0 };
                bound(i, free * (-1.0 - side), free * (1.0 - side));
            }
        }
        Bounds { lower, upper }
    }

    /// The unknowns that are not held.
    pub(crate) fn estimated(
        &self,
        layout: &Layout,
        record: &Record,
        freedom: Freedom,
    ) -> Vec<usize> {
        let Bounds { lower, upper } = self.bounds(layout, record, freedom);
        (0..layout.len).filter(|&i| lower[i] < upper[i]).collect()
    }

    /// Puts plays without weight at `sides` beside z in turn and, where half-widths may move, spreads
    /// them over the upper half below `limits` (one an input), where plays forget last; returns how
    /// many there are.
    pub(crate) fn put_idle_plays(&mut self, sides: &[f64], limits: Option<&[f64]>) -> usize {
        let mut moved = 0;
        for (input, channel) in self.channels.iter_mut().enumerate() {
            let is_idle = |&i: &usize| i > 0 && channel.weights[i] == 0.0;
            let idle: Vec<usize> = (0..channel.weights.len()).filter(is_idle).collect();
            moved += idle.len();
            for (number, &play) in idle.iter().enumerate() {
                let place = 0.5 + 0.5 * (number as f64 + 0.5) / idle.len() as f64;
                if let Some(limits) = limits {
                    channel.half_widths[play] = place * limits[input];
                }
            }
            let mut order: Vec<usize> = (0..channel.weights.len()).collect();
            order.sort_by(|&i, &j| channel.half_widths[i].total_cmp(&channel.half_widths[j]));
            let reorder = |values: &mut Vec<f64>| {
                *values = order.iter().map(|&place| values[place]).collect();
            };
            reorder(&mut channel.half_widths);
            reorder(&mut channel.weights);
            for places in self.pasts.iter_mut().filter_map(|past| past.plays.as_mut()) {
                for (&play, &side) in idle.iter().zip(sides.iter().cycle()) {
                    places[input][play] = side;
                }
                reorder(&mut places[input]);
            }
        }
        moved
    }

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

    /// The point one step away. A section whose poles would leave the unit circle goes as far as they
    /// stay inside.
    pub(crate) fn moved(&self, step: &DVector<f64>, layout: &Layout) -> Self {
        let mut moved = self.clone();
        let add = |values: &mut [f64], unknowns: &Range<usize>| {
            for (value, i) in values.iter_mut().zip(unknowns.clone()) {
                *value += step[i];
            }
        };
        for (input, channel) in moved.channels.iter_mut().enumerate() {
            add(&mut channel.weights, &layout.weights[input]);
            channel.weights.iter_mut().for_each(|weight| *weight = weight.max(0.0));
            add(&mut channel.slopes, &layout.slopes[input]);
            add(&mut channel.thresholds, &layout.thresholds[input]);
            add(&mut channel.half_widths, &layout.half_widths[input]);
        }
        for (section, unknowns) in moved.dynamics.sections.iter_mut().zip(&layout.sections) {
            let before = section.a.clone();
            let mut fraction = 1.0;
            loop {
                for ((a, before), i) in section.a.iter_mut().zip(&before).zip(unknowns.a.clone()) {
                    *a = before + fraction * step[i];
                }
                if section.is_stable() || fraction < 1e-6 {
                    break;
                }
                fraction *= 0.5;
            }
            if !section.is_stable() {
                section.a = before;
            }
            add(section.b.as_mut_slice(), &unknowns.b);
            add(section.c.as_mut_slice(), &unknowns.c);
        }
        for (element, unknown) in moved.dynamics.d.iter_mut().zip(&layout.feedthrough) {
            *element += unknown.map_or(0.0, |i| step[i]);
        }
        if layout.feedthrough.iter().any(Option::is_some) || !layout.sections.is_empty() {
            moved.dynamics.hold_gain();
        }
        for (effect, unknowns) in moved.effects.iter_mut().zip(&layout.effects) {
            let mut values = effect.values();
            add(&mut values, unknowns);
            if !unknowns.is_empty() {
                effect.set(&values);
            }
        }
        for (index, start) in moved.pasts.iter_mut().enumerate() {
            add(moved.offsets[index].as_mut_slice(), &layout.offsets[index]);
            add(start.state.as_mut_slice(), &layout.states[index]);
            let plays = start.plays.iter_mut().flatten().zip(&layout.plays[index]);
            plays.for_each(|(plays, unknowns)| add(plays, unknowns));
        }
        moved
    }
}

/// Smallest and largest input of all experiments.
pub(crate) fn range(record: &Record, input: usize) -> (f64, f64) {
    let columns = record.experiments().iter().map(|e| e.input.column(input));
    columns.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), column| {
        (low.min(column.min()), high.max(column.max()))
    })
}
