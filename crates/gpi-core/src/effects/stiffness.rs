//! A resonance that moves with the amplitude.
//!
//! A restoring force that is not proportional to the displacement acts inside the mechanics, (E7) in the
//! documentation's theory: `x+ = A x + B v + E w`, `w = law(S x + T v)`, see [`InnerLoop`].
//!
//! - Powers of the displacement are Duffing's oscillator (a cube) or a force that differs between the two
//!   directions (a square).
//! - Stops are hysteresis inside the loop: the mechanics become softer and more damped as the amplitude
//!   grows.
//!
//! Around several outputs, the signals `S x + T v` are mixtures: of the displacements first, then of what
//! drives them (see `loop_signals`).
//!
//! The values of a loop are its column of E, its rows of S and T, the logarithms of its half-widths and its
//! weights. The product of E, the scale of the signal and the scale of w is what the output shows; therefore
//! the largest element of S and T (powers) or the widest half-width and the last weight (stops) are held.

use super::loop_signals::{LoopSignal, Shape, families};
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{
    Block, ClosedLoops, InnerLoop, Law, Proposal, Quantity, Sees, Situation, Stage, Units,
};

/// Nonlinear loops around G: `x+ = A x + B v + E w`, `w = law(S x + T v)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Stiffness {
    /// The loops, at least one.
    pub loops: Vec<InnerLoop>,
}

impl Stiffness {
    pub(super) const NAME: &'static str = "stiffness";
    pub(super) const WHAT: &'static str =
        "nonlinear stiffness: the resonance frequency depends on the amplitude";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["spring", "duffing", "nonlinear stiffness", "moving resonance", "hardening", "softening"];
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["amplitude", "level-to-level"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        // a first-order lag has no resonance
        if situation.dynamics.order() < 2 {
            return Vec::new();
        }
        if situation.outputs().len() == 1 {
            return if situation.loops.is_empty() { powers(situation) } else { Vec::new() };
        }
        let families = families(situation).into_iter();
        families.flat_map(|(shape, signals)| around(shape, &signals, situation)).collect()
    }
}

/// A cube of the displacement alone, and a cube with a square.
fn powers(situation: &Situation) -> Vec<Proposal<Stiffness>> {
    let order = situation.dynamics.order();
    // half the span of the displacement
    let scale = 0.5 * situation.span(0);
    if scale <= 0.0 {
        return Vec::new();
    }
    let power = |exponent| InnerLoop {
        sees: Sees::Output(0),
        law: Law::Power { exponent, scale },
        drives: vec![0.0; order],
    };
    let block = Stiffness { loops: [2, 3].map(power).to_vec() };
    [order..2 * order, 0..2 * order].map(|places| Proposal::linear(block.clone(), places)).to_vec()
}

/// Loops through these signals.
fn around(
    shape: Shape,
    signals: &[LoopSignal],
    situation: &Situation,
) -> Option<Proposal<Stiffness>> {
    /// Half-widths over the root mean square.
    const HALF_WIDTHS: [f64; 3] = [0.15, 0.5, 1.5];
    let order = situation.dynamics.order();
    let moving = signals.iter().filter(|signal| signal.rms() > 0.0);
    let law = |rms: f64| match shape {
        Shape::Stops => Law::Stops {
            half_widths: HALF_WIDTHS.map(|r| r * rms).to_vec(),
            weights: vec![1.0; HALF_WIDTHS.len()],
        },
        Shape::Square => Law::Power { exponent: 2, scale: rms },
    };
    let inner = moving.map(|signal| InnerLoop {
        sees: signal.sees(),
        law: law(signal.rms()),
        drives: vec![0.0; order],
    });
    let block = Stiffness { loops: inner.collect() };
    let mut first = 0;
    let mut places = Vec::new();
    for inner in &block.loops {
        places.extend(first..first + order);
        first += values_of(inner);
    }
    (!places.is_empty()).then(|| Proposal::linear(block, places))
}

/// The number of values of a loop.
fn values_of(inner: &InnerLoop) -> usize {
    Stiffness { loops: vec![inner.clone()] }.values().len()
}

/// Values of a loop that have the same form.
enum Group<'a> {
    /// The numbers themselves.
    Plain(&'a mut Vec<f64>),
    /// The logarithms of positive numbers.
    Logarithms(&'a mut Vec<f64>),
}

/// The values of a loop, in order.
fn groups(inner: &mut InnerLoop) -> Vec<Group<'_>> {
    let mut groups = vec![Group::Plain(&mut inner.drives)];
    if let Sees::Mixture { states, inputs } = &mut inner.sees {
        groups.extend([Group::Plain(states), Group::Plain(inputs)]);
    }
    if let Law::Stops { half_widths, weights } = &mut inner.law {
        groups.extend([Group::Logarithms(half_widths), Group::Plain(weights)]);
    }
    groups
}

impl Block for Stiffness {
    fn values(&self) -> Vec<f64> {
        let mut values = Vec::new();
        for inner in &mut self.loops.clone() {
            for group in groups(inner) {
                match group {
                    Group::Plain(own) => values.extend(own.iter().copied()),
                    Group::Logarithms(own) => values.extend(own.iter().map(|value| value.ln())),
                }
            }
        }
        values
    }

    fn set(&mut self, values: &[f64]) {
        let mut rest = values.iter().copied();
        for group in self.loops.iter_mut().flat_map(groups) {
            match group {
                Group::Plain(own) => {
                    own.iter_mut().zip(&mut rest).for_each(|(own, new)| *own = new);
                }
                Group::Logarithms(own) => {
                    own.iter_mut().zip(&mut rest).for_each(|(own, new)| *own = new.exp());
                }
            }
        }
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-6; self.values().len()]
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let free = |count: usize| vec![(f64::NEG_INFINITY, f64::INFINITY); count];
        let mut bounds = Vec::new();
        for inner in &self.loops {
            bounds.extend(free(inner.drives.len()));
            if let Sees::Mixture { states, inputs } = &inner.sees {
                let seen = || states.iter().chain(inputs);
                bounds.extend(free(states.len() + inputs.len()));
                let largest =
                    seen().copied().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
                // a power's scale is in its drives as well
                if let (Some((place, value)), Law::Power { .. }) = (largest, &inner.law) {
                    let first = bounds.len() - seen().count();
                    bounds[first + place] = (value, value);
                }
            }
            if let Law::Stops { half_widths, weights } = &inner.law {
                /// Largest distance of a half-width from the widest one, in logarithms: a factor of a thousand.
                const REACH: f64 = 6.9;
                /// The largest step of a logarithm or a weight.
                const STEP: f64 = 0.7;
                let near = |value: f64| (value - STEP, value + STEP);
                // the widest stop sets the scales of z and of w
                let held = |last: Option<f64>| last.map(|value| (value, value));
                let widest = half_widths.last().map(|r| r.ln());
                let others = half_widths.len().saturating_sub(1);
                let width = |r: &f64| {
                    let (low, high) = near(r.ln());
                    let scale = widest.unwrap_or(0.0);
                    (low.max(scale - REACH), high.min(scale + REACH))
                };
                bounds.extend(half_widths.iter().take(others).map(width));
                bounds.extend(held(widest));
                bounds.extend(weights.iter().take(others).map(|weight| near(*weight)));
                bounds.extend(held(weights.last().copied()));
            }
        }
        bounds
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let mut found = Vec::new();
        for (q, inner) in self.loops.iter().enumerate() {
            let mut list = |what: &str, values: &[f64], zero_is_absence: bool| {
                let named = values.iter().enumerate();
                let quantity = |(i, &value)| {
                    let name = format!("{what}[{q}][{i}]");
                    Quantity { zero_is_absence, ..Quantity::new(name, "", value) }
                };
                found.extend(named.map(quantity));
            };
            list("drive", &inner.drives, true);
            if let Sees::Mixture { states, inputs } = &inner.sees {
                list("seen_state", states, false);
                list("seen_input", inputs, false);
            }
            if let Law::Stops { half_widths, weights } = &inner.law {
                list("half_width", half_widths, false);
                list("weight", weights, true);
            }
        }
        found
    }
}

impl ClosedLoops for Stiffness {
    fn loops(&self) -> &[InnerLoop] {
        &self.loops
    }

    fn loops_mut(&mut self) -> &mut [InnerLoop] {
        &mut self.loops
    }
}
