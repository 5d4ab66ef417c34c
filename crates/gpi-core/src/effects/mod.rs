//! The catalogue of effects: what a declared model (envelope, plays, G, white noise) may lack.
//!
//! Every effect acts in its own place of the chain, is simulated sample by sample, is saved in model files
//! and has its parameters estimated together with the rest of the model. To add one, write its file (the
//! constants that describe it, `proposals`, [`Block`] and the trait of its [`Place`]) and name the file, the
//! type and the place in one line of the catalogue below.

mod block;
mod flaws;
mod inner_loop;
mod knots;
mod loop_signals;
mod loop_values;
mod names;
mod place;
mod properties;
mod proposal;
mod quantity;
mod situation;
mod steady_force;

pub use block::Block;
pub use inner_loop::{Drives, InnerLoop, Law, Sees};
pub use place::{
    Added, ClosedLoops, Coefficients, Finding, InputStage, Moment, OutputStage, ParallelSections,
    Place, PlaceMut, PlayCurves, PlayRead, PlayWidths, Slope, Stage,
};
pub use properties::{FreeOrder, SeparatedBy, Signature};
pub use quantity::{Quantity, Units};
pub use rate_dependence::SpeedLaw;
pub use steady_force::SteadyForce;

pub(crate) use creep::longest_lag;
pub(crate) use names::entries;
pub(crate) use proposal::Proposal;
pub(crate) use situation::{OutputKind, Situation};

/// Declares the module of each effect, [`Effect`] with one variant an effect, and [`CATALOGUE`].
macro_rules! catalogue {
    ($($file:ident::$effect:ident: $place:ident),* $(,)?) => {
        $(mod $file;
        pub use $file::$effect;)*

        /// An effect of the catalogue with its parameters.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "name", rename_all = "kebab-case")]
        pub enum Effect {
            $(#[doc = concat!("See [`", stringify!($effect), "`].")] $effect($effect)),*
        }

        impl Effect {
            /// The place in which it acts, and how.
            pub fn place(&self) -> Place<'_> {
                match self { $(Self::$effect(own) => Place::$place(own)),* }
            }

            /// The same, to be changed.
            pub fn place_mut(&mut self) -> PlaceMut<'_> {
                match self { $(Self::$effect(own) => PlaceMut::$place(own)),* }
            }

            /// Its entry in the catalogue.
            pub fn entry(&self) -> &'static Entry {
                match self { $(Self::$effect(_) => &$effect::ENTRY),* }
            }
        }

        $(impl From<$effect> for Effect {
            fn from(block: $effect) -> Self {
                Self::$effect(block)
            }
        })*

        $(impl $effect {
            const ENTRY: Entry = Entry {
                name: $effect::NAME,
                what: $effect::WHAT,
                synonyms: $effect::SYNONYMS,
                stage: $effect::STAGE,
                driven: $effect::DRIVEN,
                repeats: $effect::REPEATS,
                signature: $effect::SIGNATURE,
                free_order: $effect::FREE_ORDER,
                separated_by: $effect::SEPARATED_BY,
                shown_by: $effect::SHOWN_BY,
                explains_autocorrelation: $effect::EXPLAINS_AUTOCORRELATION,
                is_expansion: $effect::IS_EXPANSION,
                proposals: proposals!($effect: $place),
            };
        })*

        /// All effects, in the order of the chain.
        pub const CATALOGUE: &[Entry] = &[$($effect::ENTRY),*];
    };
}

/// The function that proposes an effect's blocks. Findings propose none.
macro_rules! proposals {
    ($effect:ident: Finding) => {
        |_| Vec::new()
    };
    ($effect:ident: $place:ident) => {
        |situation| Proposal::all($effect::proposals(situation))
    };
}

catalogue! {
    delay::Delay: Input,
    amplifier_slew::AmplifierSlew: Input,
    rate_dependence::RateDependence: Widths,
    hysteresis_shape::HysteresisShape: Curves,
    linear_dynamics::LinearDynamics: Parallel,
    creep::Creep: Parallel,
    stiffness::Stiffness: Loops,
    hysteretic_stiffness::HystereticStiffness: Loops,
    friction::Friction: Loops,
    saturation::Saturation: Loops,
    output_nonlinearity::OutputNonlinearity: Output,
    gain_drift::GainDrift: Output,
    backlash::Backlash: Output,
    drift::Drift: Added,
    periodic_disturbance::PeriodicDisturbance: Added,
    covariate::Covariate: Added,
    outliers::Outliers: Finding,
    coloured_noise::ColouredNoise: Finding,
}

/// What the catalogue says of one effect.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Its name in every report and file.
    pub name: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
    /// Other words that people use for it, in lower case. A wrong name that is one of them gets its name as a suggestion.
    pub synonyms: &'static [&'static str],
    /// Where it stands in the chain.
    pub stage: Stage,
    /// Whether the input (or another measured column) drives it, so that it is the same in another
    /// experiment; drift and disturbances are not.
    pub driven: bool,
    /// Whether a model may have it more than once: two lines, two columns, a finer function of time.
    pub repeats: bool,
    /// How surely a residual tells it from a bad fit.
    pub signature: Signature,
    /// How it relates to linear dynamics of free order.
    pub free_order: FreeOrder,
    /// Which experiment separates it from the effects that look like it.
    pub separated_by: SeparatedBy,
    /// Names of the residual tests that point to it.
    pub shown_by: &'static [&'static str],
    /// Whether a residual's autocorrelation is explained once it is found.
    pub explains_autocorrelation: bool,
    /// Whether it is a truncated expansion of an unknown function of the motion. What it leaves follows the motion, too.
    pub is_expansion: bool,
    /// The blocks that the search tries on a base model; none of a finding.
    pub(crate) proposals: fn(&Situation) -> Vec<Proposal<Effect>>,
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_struct("Entry").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Effect {
    /// Its name, such as `creep`.
    pub fn name(&self) -> &'static str {
        self.entry().name
    }

    /// The stage of the chain.
    pub fn stage(&self) -> Stage {
        self.place().stage()
    }

    /// Whether it is added to the response to the input.
    pub(crate) fn is_added(&self) -> bool {
        self.place().added().is_some()
    }

    /// What every effect that acts in the chain has; `None` for a finding.
    pub fn block(&self) -> Option<&dyn Block> {
        self.place().block()
    }

    /// The estimated values; none of a finding.
    pub fn values(&self) -> Vec<f64> {
        self.block().map_or_else(Vec::new, Block::values)
    }

    /// Takes other values, as many as [`Effect::values`] returns.
    pub(crate) fn set(&mut self, values: &[f64]) {
        if let Some(block) = self.place_mut().block() {
            block.set(values);
        }
    }

    /// The parameters as an engineer reads them, with their units. `forces` are those of loops in steady state, where they
    /// are known (see [`ClosedLoops::in_steady_state`]).
    pub fn quantities(
        &self,
        units: Units,
        forces: &dyn Fn(&InnerLoop) -> Option<SteadyForce>,
    ) -> Vec<Quantity> {
        match self.place() {
            Place::Finding(own) => own.quantities(units),
            Place::Loops(own) => {
                let mut found = own.in_steady_state(units, forces);
                found.extend(own.quantities(units));
                found
            }
            place => place.block().map_or_else(Vec::new, |own| own.quantities(units)),
        }
    }

    /// Whether it is a limit of what moves inside the dynamics, and no force.
    pub(crate) fn limits(&self) -> bool {
        let closed = self.place().closed_loops();
        closed.is_some_and(|closed| closed.loops().iter().all(|inner| inner.law.limits()))
    }

    /// The same slow function of time through every second of its knots, if it has fewer.
    pub(crate) fn coarser(&self) -> Option<Self> {
        let mut coarser = self.clone();
        coarser.place_mut().block().is_some_and(Block::coarsen).then_some(coarser)
    }

    /// The same without the terms of a sum that make its values implausible, if there are any and others are left.
    pub(crate) fn plausible_part(&self, duration: f64) -> Option<Self> {
        let mut part = self.clone();
        let is_dropped = |block: &mut dyn Block| block.drop_implausible(duration);
        part.place_mut().block().is_some_and(is_dropped).then_some(part)
    }

    /// The same without the state in which its record began.
    pub(crate) fn without_start(&self) -> Self {
        let mut own = self.clone();
        if let Some(block) = own.place_mut().block() {
            block.forget_start();
        }
        own
    }

    /// The same on the other side of the output stage, if it is an added signal.
    pub(crate) fn elsewhere(&self) -> Option<Self> {
        let mut moved = self.clone();
        let PlaceMut::Added(own) = moved.place_mut() else { return None };
        own.set_moves_stage(!own.moves_stage());
        Some(moved)
    }
}

impl Proposal<Effect> {
    /// Proposals of one kind of block as those of effects.
    pub(crate) fn all<B: Into<Effect>>(found: Vec<Proposal<B>>) -> Vec<Self> {
        let effect = |Proposal { block, probes, linear }: Proposal<B>| Self {
            block: block.into(),
            probes: probes.into_iter().map(Into::into).collect(),
            linear,
        };
        found.into_iter().map(effect).collect()
    }

    /// The same on the other side of the output stage, if it is an added signal.
    pub(crate) fn elsewhere(&self) -> Option<Self> {
        let probes: Option<Vec<Effect>> = self.probes.iter().map(Effect::elsewhere).collect();
        Some(Self { block: self.block.elsewhere()?, probes: probes?, linear: self.linear })
    }

    /// The effect with the values that a least squares fit of the probes' columns gives.
    pub(crate) fn start(&self, coefficients: &[f64]) -> Effect {
        let mut effect = self.block.clone();
        if self.linear {
            let mut values = effect.values();
            let zero = values.clone();
            for (probe, coefficient) in self.probes.iter().zip(coefficients) {
                for ((value, zero), moved) in values.iter_mut().zip(&zero).zip(probe.values()) {
                    *value += coefficient * (moved - zero);
                }
            }
            effect.set(&values);
        }
        effect
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{Section, Sections};
    use crate::{Channel, Experiment, Matrix, Record};

    /// Calls `ask` with a situation around a section of this denominator.
    fn situation(denominator: [f64; 2], ask: impl FnOnce(&Situation)) {
        let signal = |f: fn(f64) -> f64| Matrix::from_fn(1000, 1, |k, _| f(k as f64));
        let (input, covariates) = (signal(|k| (0.01 * k * k).sin()), signal(|k| (0.03 * k).cos()));
        let run =
            Experiment { output: input.clone(), input, covariates, warmup: 0, held_out: vec![] };
        let channel = |name| vec![Channel::new(name, "")];
        let signals = [run.input.clone()];
        let record =
            Record::new(vec![run], 100.0, channel("u"), channel("y"), channel("x")).unwrap();
        let (b, c) = (Matrix::from_element(2, 1, 0.1), Matrix::from_row_slice(1, 2, &[1.0, 0.0]));
        let mode = Section { a: denominator.to_vec(), b, c, reference: 0, growth: 1.0 };
        ask(&Situation {
            record: &record,
            drives: &signals,
            intermediates: &signals,
            displacements: &signals,
            residuals: &signals,
            dynamics: &Sections { sections: vec![mode], ..Sections::default() },
            loops: Vec::new(),
            kind: OutputKind::Displacement,
            widest: vec![0.5],
            places: vec![(-1.0, 1.0)],
        });
    }

    #[test]
    fn the_stage_of_every_entry_is_that_of_its_place() {
        let agrees = |effect: &Effect, entry: &Entry| {
            assert_eq!((effect.name(), effect.stage()), (entry.name, entry.stage));
            assert_eq!(serde_json::to_value(effect).unwrap()["name"], entry.name);
        };
        let mut proposed = std::collections::BTreeSet::new();
        let mut check = |situation: &Situation| {
            for entry in CATALOGUE {
                for proposal in (entry.proposals)(situation) {
                    proposed.insert(entry.name);
                    agrees(&proposal.block, entry);
                    if let Some(moved) = proposal.block.elsewhere() {
                        assert_eq!(moved.stage(), Stage::Displaced);
                        assert_eq!(moved.elsewhere(), Some(proposal.block));
                    }
                }
            }
        };
        // a resonance, and two real poles
        situation([-1.2, 0.6], &mut check);
        situation([-1.7, 0.72], &mut check);
        for entry in CATALOGUE {
            assert_eq!(
                proposed.contains(entry.name),
                entry.stage != Stage::Noise,
                "{}",
                entry.name
            );
        }
        let (coefficients, innovation, deviation) = (vec![0.5], 1.0, 1.2);
        let findings: [Effect; 2] = [
            Outliers { count: 1, samples: 10, size: 1.0 }.into(),
            ColouredNoise { output: 0, coefficients, innovation, deviation }.into(),
        ];
        findings.iter().for_each(|effect| agrees(effect, effect.entry()));
    }

    #[test]
    fn a_spring_goes_on_with_the_next_powers_and_with_its_damping() {
        let entry = CATALOGUE.iter().find(|entry| entry.name == "stiffness").unwrap();
        let inner =
            |law| InnerLoop { sees: Sees::Output(0), law, drives: Drives::States(vec![0.1, 0.2]) };
        // the exponents of each proposal, 0 for a damping
        let proposed = |laws: &[Law]| -> Vec<Vec<i32>> {
            let loops: Vec<InnerLoop> = laws.iter().cloned().map(inner).collect();
            let mut found = Vec::new();
            situation([-1.2, 0.6], |situation| {
                let loops = loops.iter().collect();
                let situation = Situation { loops, places: vec![], widest: vec![], ..*situation };
                let exponent = |inner: &InnerLoop| match inner.law {
                    Law::Power { exponent, .. } => exponent,
                    _ => 0,
                };
                found.extend((entry.proposals)(&situation).into_iter().map(|one| {
                    let closed = one.block.place().closed_loops().unwrap();
                    closed.loops().iter().map(exponent).collect::<Vec<_>>()
                }));
            });
            found.dedup();
            found
        };
        let power = |exponent| Law::Power { exponent, scale: 1.0 };
        let damping = Law::Damping { scale: 0.1 };
        assert_eq!(proposed(&[]), [[2, 3]]);
        assert_eq!(proposed(&[power(2), power(3)]), [vec![4, 5], vec![0]]);
        assert_eq!(proposed(&[power(2), power(3), damping.clone()]), [[4, 5]]);
        let all = [power(2), power(3), power(4), power(5), damping];
        assert!(proposed(&all).is_empty());
    }
}
