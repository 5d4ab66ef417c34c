//! Friction inside the mechanics.
//!
//! Dry friction acts on the moving part, (E17) in the documentation's theory: `x+ = A x + B v + E w`, w between -1 and 1 by
//! Dahl's model `dw = (dz - |dz| w) / d` of the displacement z. It opposes a steady motion with a constant force (Coulomb's
//! friction), and below the break-away distance d it is a spring. Viscous friction is a part of G; where the two
//! directions differ in it, the speed without its sign drives the states too.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{ClosedLoops, Drives, InnerLoop, Law, Proposal, Sees, Situation, Stage};

/// Loops around G through Dahl's friction and the speed: `x+ = A x + B v + E w`, w of [`Law::Dahl`] and of [`Law::Speed`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Friction {
    /// The loops, at least one.
    pub loops: Vec<InnerLoop>,
}

impl Friction {
    pub(super) const NAME: &'static str = "friction";
    pub(super) const WHAT: &'static str =
        "friction: a force inside the mechanics opposes the motion whatever its speed";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["coulomb", "dry friction", "dahl", "lugre", "stiction", "presliding"];
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
        /// Break-away distances over the root mean square of z: a part of each stroke, and nearly none of it.
        const DISTANCES: [f64; 3] = [0.3, 0.03, 1e-3];
        let (order, rms) = (situation.dynamics.order(), situation.rms(0));
        // a first-order lag has no mass that a force could act on
        if order < 2 || situation.outputs().len() > 1 || situation.inputs().len() > 1 || rms <= 0.0
        {
            return Vec::new();
        }
        // near a resonance, the force and the held input act on the states in different proportions; without one, the data do not
        // determine the proportions, and those of the input are taken
        let drives = if situation.dynamics.has_resonance() {
            Drives::States(vec![0.0; order])
        } else {
            Drives::Input { input: 0, force: 0.0, states: order }
        };
        let (parts, averaged) = match &drives {
            Drives::States(_) => (order, false),
            Drives::Input { .. } => (1, true),
        };
        let inner = |law| InnerLoop { sees: Sees::Output(0), law, drives: drives.clone() };
        let around = |distance: f64| {
            let dahl = inner(Law::Dahl { distance: distance * rms, averaged });
            let symmetric = Friction { loops: vec![dahl.clone()] };
            let asymmetric = Friction { loops: vec![dahl, inner(Law::Speed)] };
            // the break-away distance stands between and is not linear
            let both = (0..parts).chain(parts + 1..2 * parts + 1);
            [Proposal::linear(symmetric, 0..parts), Proposal::linear(asymmetric, both)]
        };
        DISTANCES.into_iter().flat_map(around).collect()
    }
}

impl ClosedLoops for Friction {
    fn loops(&self) -> &[InnerLoop] {
        &self.loops
    }

    fn loops_mut(&mut self) -> &mut Vec<InnerLoop> {
        &mut self.loops
    }
}
