//! The catalogue of effects: what a declared model (envelope, plays, G, white noise) may lack.
//!
//! Every effect is a block in its own place of the chain, steps sample by sample, is saved in model files
//! and has its parameters refined together with the rest of the model. To add one, write its file and name
//! it in the catalogue below.

mod amplifier_slew;
mod backlash;
mod block;
mod coloured_noise;
mod covariate;
mod creep;
mod delay;
mod drift;
mod gain_drift;
mod hysteresis_shape;
mod inner_loop;
mod knots;
mod linear_dynamics;
mod loop_signals;
mod outliers;
mod output_nonlinearity;
mod periodic_disturbance;
mod properties;
mod rate_dependence;
mod situation;
mod stiffness;

pub use amplifier_slew::AmplifierSlew;
pub use backlash::Backlash;
pub use block::{Block, Moment, Quantity, Slope, Stage, Units};
pub use coloured_noise::ColouredNoise;
pub use covariate::Covariate;
pub use creep::Creep;
pub use delay::Delay;
pub use drift::Drift;
pub use gain_drift::GainDrift;
pub use hysteresis_shape::HysteresisShape;
pub use inner_loop::{InnerLoop, Law, Sees};
pub use linear_dynamics::LinearDynamics;
pub use outliers::Outliers;
pub use output_nonlinearity::OutputNonlinearity;
pub use periodic_disturbance::PeriodicDisturbance;
pub use properties::{FreeOrder, SeparatedBy, Signature};
pub use rate_dependence::{RateDependence, SpeedLaw};
pub use stiffness::Stiffness;

pub(crate) use creep::longest_lag;
pub(crate) use situation::{Candidate, Situation};

/// Declares [`Effect`], one variant an effect, and [`CATALOGUE`].
macro_rules! catalogue {
    ($($effect:ident),* $(,)?) => {
        /// An effect of the catalogue with its parameters.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "name", rename_all = "kebab-case")]
        pub enum Effect {
            $(#[doc = concat!("See [`", stringify!($effect), "`].")] $effect($effect)),*
        }

        impl Effect {
            /// The block itself.
            pub fn block(&self) -> &dyn Block {
                match self { $(Self::$effect(block) => block),* }
            }

            pub(crate) fn block_mut(&mut self) -> &mut dyn Block {
                match self { $(Self::$effect(block) => block),* }
            }

            /// Its entry in the catalogue.
            pub fn entry(&self) -> &'static Entry {
                match self { $(Self::$effect(_) => const { &catalogue!(@entry $effect) }),* }
            }
        }

        $(impl From<$effect> for Effect {
            fn from(block: $effect) -> Self {
                Self::$effect(block)
            }
        })*

        /// All effects, in the order of the chain.
        pub const CATALOGUE: &[Entry] = &[$(catalogue!(@entry $effect)),*];
    };
    (@entry $effect:ident) => {
        Entry {
            name: $effect::NAME,
            what: $effect::WHAT,
            stage: $effect::STAGE,
            driven: $effect::DRIVEN,
            repeats: $effect::REPEATS,
            signature: $effect::SIGNATURE,
            free_order: $effect::FREE_ORDER,
            separated_by: $effect::SEPARATED_BY,
            shown_by: $effect::SHOWN_BY,
            explains_autocorrelation: $effect::EXPLAINS_AUTOCORRELATION,
            candidates: $effect::candidates,
        }
    };
}

catalogue! {
    Delay,
    AmplifierSlew,
    RateDependence,
    HysteresisShape,
    LinearDynamics,
    Creep,
    Stiffness,
    OutputNonlinearity,
    GainDrift,
    Backlash,
    Drift,
    PeriodicDisturbance,
    Covariate,
    Outliers,
    ColouredNoise,
}

/// What the catalogue says of one effect.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Its name in every report and file.
    pub name: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
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
    /// The blocks that the search tries before a base model.
    pub(crate) candidates: fn(&Situation) -> Vec<Candidate>,
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_struct("Entry").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Effect {
    /// Its name, such as `creep`.
    pub fn name(&self) -> &'static str {
        self.block().name()
    }
}
