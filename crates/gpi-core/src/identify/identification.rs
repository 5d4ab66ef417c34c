//! What is asked of an identification, and what it answers.

use crate::Model;
use crate::chain::hysteresis::Elements;
use crate::fit::Grid;
use crate::fit::Refinement;
use crate::linear::Fir;
use crate::operators::Reading;

/// What [`identify`](super::identify) chooses (`None`) and what is given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdentifyOptions {
    /// Taps of the FIR estimate.
    pub taps: Option<usize>,
    /// Order of the linear dynamics.
    pub order: Option<usize>,
    /// Plays: how many, placed by the data, or their half-widths in the unit of the input, kept.
    pub half_widths: Option<Grid>,
    /// Deadzones: how many, placed by the data, or their thresholds in the unit of the input, kept.
    pub thresholds: Option<Grid>,
    /// The deadzone convention.
    pub reading: Reading,
    /// Plays or stops; those that the data ask for, where none are given.
    pub elements: Option<Elements>,
    /// Restricts the linear part to a gain with a delay of this many samples.
    pub delay: Option<usize>,
    /// As in [`RefineOptions`](crate::identify::RefineOptions).
    pub robust: Option<bool>,
    /// As in [`RefineOptions`](crate::identify::RefineOptions).
    pub offset_knots: usize,
}

/// For a search for effects, which refines the model later: slow poles are ruled out, the dense grid is left out, and grids
/// are those of the options.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quick {
    /// Whether there may be fewer plays and deadzones than that where the samples are few.
    pub fewer: [bool; 2],
}

/// One structure that was refined and compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Dead time of the linear part, in samples.
    pub delay: usize,
    /// Order of the linear part without its dead time.
    pub order: usize,
    /// Plays of each input, the linear term included.
    pub plays: usize,
    /// Deadzones of each input besides the identity.
    pub deadzones: usize,
    /// Root mean square residual on the training data.
    pub rms: f64,
    /// Parameters that were estimated.
    pub parameters: usize,
    /// The same counted in samples of white noise: the slower the residual of the best fit, the more
    /// each parameter takes from it (Takeuchi's `tr(H^-1 M) / variance` per parameter).
    pub used: f64,
    /// `N ln(rms^2) + used ln N` over N output values: BIC for an autocorrelated residual. The least is
    /// chosen.
    pub criterion: f64,
}

/// One pass of hysteresis and dynamics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Root mean square residual on the training data, in the output's unit.
    pub rms: f64,
    /// Order of G.
    pub order: usize,
    /// Taps of the FIR estimate behind it.
    pub taps: usize,
}

/// A model, and the results of the steps that led to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The refined model.
    pub model: Model,
    /// How it was refined, and how sure its parameters are.
    pub refinement: Refinement,
    /// The structures that were compared, in the order they were tried.
    pub candidates: Vec<Candidate>,
    /// Which of them was chosen.
    pub chosen: usize,
    /// The paper's first stage, u to y; `None` where the input allows no more than a gain and a delay.
    pub fir: Option<Fir>,
    /// Singular values of ERA's Hankel matrix in the best round.
    pub singular_values: Vec<f64>,
    /// Unstable poles that ERA reflected in the best round.
    pub reflected: usize,
    /// Taps that the input supports, `usize::MAX` where no limit was found.
    pub supported_taps: usize,
    /// Delay in samples where the linear part is a gain with a delay.
    pub delay: Option<usize>,
    /// The residual after each round.
    pub rounds: Vec<Round>,
    /// Samples at the start of each experiment that were not scored: the plays' unknown initial state.
    pub warmups: Vec<usize>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
}
