//! A resonance that moves with the amplitude.
//!
//! A restoring force that is not proportional to the displacement acts inside the mechanics, (E7) in the
//! documentation's theory: `x+ = A x + B v + E w`, `w = law(S x + T v)`, see [`InnerLoop`].
//!
//! - Powers of the displacement are Duffing's oscillator (a cube) or a force that differs between the two
//!   directions (a square). Beside both, the next two powers are the start of another law, such as that of a spring that
//!   softens up to a limit.
//! - Stops are hysteresis inside the loop: the mechanics become softer and more damped as the amplitude
//!   grows.
//! - Beside powers, a force that grows with the speed up to a limit: damping that depends on the amplitude.
//!
//! Around several outputs, the signals `S x + T v` are mixtures: of the displacements first, then of what
//! drives them (see `loop_signals`).

use super::loop_signals::{LoopSignal, Shape, families};
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, ClosedLoops, Drives, InnerLoop, Law, Proposal, Sees, Situation, Stage};
use crate::Matrix;

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
            let has = |law: fn(&Law) -> bool| situation.loops.iter().any(|inner| law(&inner.law));
            if !has(|law| matches!(law, Law::Power { .. })) {
                return powers(situation, [2, 3]);
            }
            let mut more = Vec::new();
            if !has(|law| matches!(law, Law::Power { exponent: 4.., .. })) {
                more.extend(powers(situation, [4, 5]));
            }
            if !has(|law| matches!(law, Law::Damping { .. })) {
                more.extend(damping(situation));
            }
            return more;
        }
        let families = families(situation).into_iter();
        families.flat_map(|(shape, signals)| around(shape, &signals, situation)).collect()
    }
}

/// An odd power of the displacement alone, and with the even power below it.
fn powers(situation: &Situation, exponents: [i32; 2]) -> Vec<Proposal<Stiffness>> {
    let order = situation.dynamics.order();
    // half the span of the displacement
    let scale = 0.5 * situation.span(0);
    if scale <= 0.0 {
        return Vec::new();
    }
    let power = |exponent| InnerLoop {
        sees: Sees::Output(0),
        law: Law::Power { exponent, scale },
        drives: Drives::States(vec![0.0; order]),
    };
    let block = Stiffness { loops: exponents.map(power).to_vec() };
    [order..2 * order, 0..2 * order].map(|places| Proposal::linear(block.clone(), places)).to_vec()
}

/// A damping that depends on the speed.
fn damping(situation: &Situation) -> Vec<Proposal<Stiffness>> {
    /// The scale over the root mean square of the change in a sample: a limit that each cycle reaches, and one that is hardly reached.
    const SCALES: [f64; 3] = [0.1, 0.5, 2.0];
    let order = situation.dynamics.order();
    let changes = situation.displacements.iter().map(|signal| {
        let column = signal.column(0);
        column.iter().zip(column.iter().skip(1)).map(|(a, b)| (b - a).powi(2)).sum::<f64>()
    });
    let samples: usize = situation.displacements.iter().map(Matrix::nrows).sum();
    let rms = (changes.sum::<f64>() / samples as f64).sqrt();
    let around = |scale: f64| {
        let inner = InnerLoop {
            sees: Sees::Output(0),
            law: Law::Damping { scale: scale * rms },
            drives: Drives::States(vec![0.0; order]),
        };
        Proposal::linear(Stiffness { loops: vec![inner] }, 0..order)
    };
    if rms > 0.0 { SCALES.map(around).to_vec() } else { Vec::new() }
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
        drives: Drives::States(vec![0.0; order]),
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

impl ClosedLoops for Stiffness {
    fn loops(&self) -> &[InnerLoop] {
        &self.loops
    }

    fn loops_mut(&mut self) -> &mut Vec<InnerLoop> {
        &mut self.loops
    }
}
