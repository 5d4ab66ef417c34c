//! A restoring force with hysteresis.
//!
//! Bouc and Wen's force acts inside the mechanics, (E16) in the documentation's theory: `x+ = A x + B v + E w`,
//! `dw = dz - (beta |dz| w + gamma dz |w|) |w|^(n-1)`, z a displacement. As a force that opposes the displacement it makes the
//! mechanics stiff for small motion and softer (or, for gamma < -beta, stiffer) for large motion, and it dissipates
//! energy whatever the speed. With gamma = 0 and n = 1 it is Dahl's friction, which slides once the displacement has moved by several
//! times 1 / beta.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{ClosedLoops, Drives, InnerLoop, Law, Proposal, Sees, Situation, Stage};

/// A loop around G through Bouc and Wen's force: `x+ = A x + B v + E w`, w the force of [`Law::BoucWen`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HystereticStiffness {
    /// The loops, at least one.
    pub loops: Vec<InnerLoop>,
}

impl HystereticStiffness {
    pub(super) const NAME: &'static str = "hysteretic-stiffness";
    pub(super) const WHAT: &'static str =
        "hysteretic stiffness: the restoring force inside the mechanics has hysteresis";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["bouc-wen", "hysteretic spring", "hysteretic damping", "elastoplastic"];
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["amplitude", "level-to-level"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        /// beta times the root mean square of z: half of it, and a force that saturates within each stroke. The fit
        /// finds gamma, and beta from either.
        const SHARPNESS: [f64; 2] = [0.5, 4.0];
        // a first-order lag has no mass that a force could act on
        if situation.dynamics.order() < 2 || situation.outputs().len() > 1 {
            return Vec::new();
        }
        let (order, rms) = (situation.dynamics.order(), situation.rms(0));
        if rms <= 0.0 {
            return Vec::new();
        }
        let around = |sharpness: f64| {
            let law = Law::BoucWen { beta: sharpness / rms, gamma: 0.0, exponent: 1.0 };
            let inner =
                InnerLoop { sees: Sees::Output(0), law, drives: Drives::States(vec![0.0; order]) };
            Proposal::linear(HystereticStiffness { loops: vec![inner] }, 0..order)
        };
        SHARPNESS.map(around).to_vec()
    }
}

impl ClosedLoops for HystereticStiffness {
    fn loops(&self) -> &[InnerLoop] {
        &self.loops
    }

    fn loops_mut(&mut self) -> &mut Vec<InnerLoop> {
        &mut self.loops
    }
}
