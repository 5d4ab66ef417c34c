//! The places of the chain in which effects act, one trait each.
//!
//! ```text
//! u -> InputStage -> envelope -> plays -> G -> + -> OutputStage -> + -> y
//!                                  |      |    |                   |
//!                          PlayWidths     |  Added               Added
//!                          PlayCurves     ParallelSections, ClosedLoops
//! ```
//!
//! An effect implements [`Block`] and the trait of its place. A [`Finding`] describes the residual and acts
//! nowhere.

mod dynamics;
mod input;
mod output;
mod plays;

pub use dynamics::{ClosedLoops, Coefficients, ParallelSections};
pub use input::InputStage;
pub use output::{Added, Moment, OutputStage, Slope};
pub use plays::{PlayCurves, PlayRead, PlayWidths};

use super::block::Block;
use super::quantity::{Quantity, Units};

/// Where an effect acts, in the order of the signal chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Between the commanded input and the hysteresis.
    Input,
    /// In the plays of the hysteresis.
    Plays,
    /// In parallel with the linear dynamics G, or in a loop around them.
    Dynamics,
    /// Added at the plant's output, before the sensor.
    Displaced,
    /// Between the displacement and the sensor's reading.
    Output,
    /// Added to the sensor's reading, whatever the input does.
    Added,
    /// In the residual: nothing is simulated.
    Noise,
}

/// A description of the residual. It has no estimated values, and nothing is simulated.
pub trait Finding {
    /// The output channel, where it describes one alone.
    fn output(&self) -> Option<usize>;

    /// What was found, with its units.
    fn quantities(&self, units: Units) -> Vec<Quantity>;
}

/// Declares [`Place`] and [`PlaceMut`]: the variant, the trait and the accessor of each block's place.
macro_rules! places {
    ($($(#[$doc:meta])* $place:ident($effect:ident), $accessor:ident;)*) => {
        /// An effect by the place in which it acts.
        #[derive(Clone, Copy)]
        pub enum Place<'a> {
            $($(#[$doc])* $place(&'a dyn $effect),)*
            /// Describes the residual.
            Finding(&'a dyn Finding),
        }

        /// The same, to be changed.
        pub enum PlaceMut<'a> {
            $($(#[$doc])* $place(&'a mut dyn $effect),)*
            /// Describes the residual.
            Finding(&'a mut dyn Finding),
        }

        impl<'a> Place<'a> {
            $(
                #[doc = concat!("The effect, if it is a [`Place::", stringify!($place), "`].")]
                pub fn $accessor(self) -> Option<&'a dyn $effect> {
                    if let Self::$place(own) = self { Some(own) } else { None }
                }
            )*

            /// The effect as a block; `None` for a finding.
            pub fn block(self) -> Option<&'a dyn Block> {
                match self {
                    $(Self::$place(own) => Some(own),)*
                    Self::Finding(_) => None,
                }
            }
        }

        impl<'a> PlaceMut<'a> {
            /// The effect as a block; `None` for a finding.
            pub fn block(self) -> Option<&'a mut dyn Block> {
                match self {
                    $(Self::$place(own) => Some(own),)*
                    Self::Finding(_) => None,
                }
            }
        }
    };
}

places! {
    /// Changes the drive before the hysteresis.
    Input(InputStage), input_stage;
    /// Changes the half-widths of the plays.
    Widths(PlayWidths), play_widths;
    /// Reads the plays through curves.
    Curves(PlayCurves), play_curves;
    /// Linear sections in parallel with G.
    Parallel(ParallelSections), parallel_sections;
    /// Loops that are closed around G.
    Loops(ClosedLoops), closed_loops;
    /// Changes the displacement on its way to the sensor's reading.
    Output(OutputStage), output_stage;
    /// Adds a signal before or after the output stage.
    Added(Added), added;
}

impl<'a> Place<'a> {
    /// The stage of the chain.
    pub fn stage(self) -> Stage {
        match self {
            Self::Input(_) => Stage::Input,
            Self::Widths(_) | Self::Curves(_) => Stage::Plays,
            Self::Parallel(_) | Self::Loops(_) => Stage::Dynamics,
            Self::Added(own) if own.moves_stage() => Stage::Displaced,
            Self::Output(_) => Stage::Output,
            Self::Added(_) => Stage::Added,
            Self::Finding(_) => Stage::Noise,
        }
    }

    /// The input channel, where the effect acts on one.
    pub fn input(self) -> Option<usize> {
        match self {
            Self::Input(own) => Some(own.input()),
            Self::Widths(own) => Some(own.input()),
            Self::Curves(own) => Some(own.input()),
            Self::Parallel(own) => Some(own.input()),
            Self::Loops(_) | Self::Output(_) | Self::Added(_) | Self::Finding(_) => None,
        }
    }

    /// The output channel, where the effect acts on one.
    pub fn output(self) -> Option<usize> {
        match self {
            Self::Output(own) => Some(own.output()),
            Self::Added(own) => Some(own.output()),
            Self::Finding(own) => own.output(),
            Self::Input(_) | Self::Widths(_) | Self::Curves(_) => None,
            Self::Parallel(_) | Self::Loops(_) => None,
        }
    }
}
