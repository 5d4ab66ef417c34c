//! Why an effect is not named, and how that is said.

/// Why a trial is not accepted, or not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The input does not drive what the effect explains.
    Undriven,
    /// No more than superfluous parameters gain.
    Insignificant,
    /// The held-out blocks do not become better.
    Unconfirmed,
    /// Far from the noise, too small a part of the residual.
    Insubstantial,
    /// An expansion in many terms may follow what a finite number of plays leaves, which is hardly more than the noise.
    MisfitOfPlays,
    /// No machine has such values.
    Impossible,
    /// A mode that follows a line, creep or a disturbance.
    NotAMode,
    /// The rest of the model can do the same.
    NotItsOwn,
    /// It does not predict gaps between its knots.
    Gaps,
    /// Too large a part of the output for a model that is far from the noise.
    TooLarge,
    /// It resembles a misfit of the hysteresis, and the model is far from the noise.
    ResemblesMisfit,
    /// It acts on too few occasions for a model that is far from the noise.
    TooRare,
    /// It changes the dynamics of a stage that integrates, and leaves too much of the balance of forces.
    Integrates,
    /// It changes the dynamics of a stage whose output saturates.
    Saturates,
    /// It is a function of time whose knots are closer than a time constant of the dynamics.
    AsFastAsLags,
    /// It is a function of time that changes when the motion of the input does.
    FollowsInput,
    /// It is a smooth function of time, and levels between jumps explain more.
    Jumps,
    /// A function of time that was refused for what it follows explains more.
    Surpassed,
    /// It is a function of time that leaves much of an error that is far above the noise.
    FollowsTheRest,
    /// It is a limit that shows where the output stands at its limits only.
    ClipsOnly,
    /// It is a spring inside a mechanical loop, and the dynamics have no resonance.
    NoResonance,
    /// The model without it, fitted from where the trial ended, explains as much.
    LongerFit,
    /// Another effect explains as much.
    Confounded,
    /// Another effect explains more.
    Inferior,
}

impl Refusal {
    /// What is said of the effect, after its name; `taken` is the one that was accepted instead.
    pub(super) fn in_words(self, taken: &str) -> String {
        match self {
            Self::Undriven => "would only represent a decay that the input does not drive".to_owned(),
            Self::Insignificant => "does not reduce the error by more than the significance threshold".to_owned(),
            Self::Unconfirmed => "is not confirmed by the held-out blocks".to_owned(),
            Self::Insubstantial => {
                "removes only a small part of a residual that is far above the noise".to_owned()
            }
            Self::MisfitOfPlays => {
                "has many terms, which may represent the misfit of a finite number of plays: the error of the model is already close to the noise".to_owned()
            }
            Self::Impossible => "would need parameter values that no real machine has".to_owned(),
            Self::NotAMode => {
                "would represent a spectral line, creep or a disturbance instead of a mode of the stage".to_owned()
            }
            Self::NotItsOwn => "adds nothing to the output that the rest of the model cannot represent".to_owned(),
            Self::Gaps => "predicts the output between its knots much worse than it fits the samples at the knots".to_owned(),
            Self::TooLarge => {
                "would add a large part of the output, but the error of the model would still be far above the noise".to_owned()
            }
            Self::ResemblesMisfit => {
                "acts like a misfit of the hysteresis, and the error of the model would still be far above the noise".to_owned()
            }
            Self::TooRare => {
                "acts a few times only in this record, and the error of the model would still be far above the noise".to_owned()
            }
            Self::Integrates => {
                "would change the dynamics of a stage that integrates its input, and leaves too much of the balance of forces unexplained".to_owned()
            }
            Self::Saturates => {
                "would change the dynamics of a stage whose output saturates, where the model errs most".to_owned()
            }
            Self::AsFastAsLags => {
                "is a function of time that changes as fast as the dynamics, and may follow what they lack".to_owned()
            }
            Self::FollowsInput => {
                "is a function of time that follows how the input moves, so that the input causes what it explains".to_owned()
            }
            Self::Jumps => {
                "is a smooth function of time, and what it follows jumps from one level to another".to_owned()
            }
            Self::Surpassed => "explains less than a function of time that was refused".to_owned(),
            Self::FollowsTheRest => {
                "is a function of time that may follow what the model lacks: the error of the model would still be far above the noise".to_owned()
            }
            Self::ClipsOnly => {
                "explains no more than a sensor that clips: only the samples at which the output stands at its limits".to_owned()
            }
            Self::NoResonance => "would act inside a mechanical loop, and the dynamics have no resonance".to_owned(),
            Self::LongerFit => "reduces the error no more than a longer fit of the model without it".to_owned(),
            Self::Confounded => format!("explains as much as {taken}"),
            Self::Inferior => format!("explains less than {taken}"),
        }
    }
}
