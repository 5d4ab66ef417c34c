//! A loop that is closed around the linear dynamics.

/// `w = law(z)`, and `w(k)` drives the states of G for sample k + 1: `x+ = A x + B v + E w`.
///
/// No loop is algebraic, because w acts one sample later. With [`Law::Stops`] and [`Law::Dahl`] w is bounded, so that a stable
/// G stays bounded for any gain of the loop; with [`Law::BoucWen`] it is where `beta + gamma > 0`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct InnerLoop {
    /// The signal z.
    pub sees: Sees,
    /// The law from z to w.
    pub law: Law,
    /// What w drives.
    pub drives: Drives,
}

/// Where w enters G: a column of E.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Drives {
    /// By the states of G; those of its dead time, which come first, are not driven.
    States(Vec<f64>),
    /// `E = -force b` with the column b of B by which an input enters the states behind the dead time: w is a force where the input is
    /// one, and takes away so much of v.
    Input {
        /// The input.
        input: usize,
        /// In the unit of v over that of w.
        force: f64,
        /// The number of states behind the dead time.
        states: usize,
    },
}

impl Drives {
    /// The number of states that are driven.
    pub(crate) fn states(&self) -> usize {
        match self {
            Self::States(column) => column.len(),
            Self::Input { states, .. } => *states,
        }
    }

    /// The column of E, from the columns of B behind the dead time.
    pub(crate) fn column(&self, b: &[Vec<f64>]) -> Vec<f64> {
        match self {
            Self::States(column) => column.clone(),
            // sections in parallel with G come behind its states
            Self::Input { input, force, states } => {
                b[*input].iter().take(*states).map(|b| -force * b).collect()
            }
        }
    }
}

/// The input z of a loop's law.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sees {
    /// z is this output's displacement.
    Output(usize),
    /// `z = S x + T v`.
    Mixture {
        /// A row of S, by the states of G; those of its dead time are not seen.
        states: Vec<f64>,
        /// A row of T, by the inputs of G as they come out of its dead time.
        inputs: Vec<f64>,
    },
}

/// The static or hysteretic law of a loop.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// `w = (z/scale)^exponent scale`.
    Power {
        /// 2, 3, ..
        exponent: i32,
        /// In the unit of z.
        scale: f64,
    },
    /// `w = sum_i g_i (z - F_{r_i}(z))`: a sum of stops with the plays F (Prandtl's model of elastoplasticity).
    Stops {
        /// r_i, in the unit of z.
        half_widths: Vec<f64>,
        /// g_i; the last one is 1 and fixes the scale of w.
        weights: Vec<f64>,
    },
    /// `dw = dz - (beta |dz| w + gamma dz |w|) |w|^(n-1)`: the restoring force of Bouc and Wen, which contains Dahl's friction
    /// (gamma = 0, n = 1).
    ///
    /// Y.-K. Wen, *Method for random vibration of hysteretic systems*, J. Eng. Mech. Div. ASCE 102, 1976.
    BoucWen {
        /// By how much the force opposes a motion in either direction, in 1 over the unit of z to the power n.
        beta: f64,
        /// By how much loading softens (gamma > 0) or stiffens (gamma < 0) it, in the unit of beta.
        gamma: f64,
        /// n, at least 1: how suddenly the force reaches its limit.
        exponent: f64,
    },
    /// `df = (dz - |dz| f) / distance`: Dahl's friction f, between -1 and 1. Over a change of one direction f approaches its
    /// sign as `exp(-|dz| / distance)`; Coulomb's friction is the limit of a short distance. w is f, or
    /// `w(k) = m(k) + f(k) - f(k - 1)` with the mean m of f over the last sample.
    ///
    /// P. R. Dahl, *Solid friction damping of mechanical vibrations*, AIAA Journal 14, 1976.
    Dahl {
        /// The break-away distance in the unit of z, positive: the force over the stiffness of the contact at rest.
        distance: f64,
        /// Whether w is exact in the mean: where f changes its sign within a sample, and w acts like an input that is held.
        averaged: bool,
    },
    /// `w(k) = |z(k) - z(k - 1)|`: the speed without its sign. A force in proportion to it is the part of viscous friction by
    /// which the two directions differ. With several steps a sample, the change of a step counts times their number.
    Speed,
    /// `w(k) = scale tanh((z(k) - z(k - 1)) / scale)`: a force that grows with the speed up to a limit. Beside the linear damping in G,
    /// it is damping that depends on the speed. Changes count as for the speed.
    Damping {
        /// The change of z in a sample at which the force is near its limit, in the unit of z, positive.
        scale: f64,
    },
    /// `w = max(z - limit, 0)`, or `w = min(z - limit, 0)` of a lower limit: by how much z exceeds a limit. A loop that takes w away from
    /// what moves z keeps it at the limit, as an end stop or the rim of a tank does.
    Excess {
        /// In the unit of z.
        limit: f64,
        /// Whether z exceeds it downwards.
        is_lower: bool,
    },
}

impl Law {
    /// The number of values that it remembers: the places of the plays of stops; the force and the last two z where it follows the
    /// path of z; the last z where it depends on the speed.
    pub(crate) fn memories(&self) -> usize {
        match self {
            Self::Power { .. } | Self::Excess { .. } => 0,
            Self::Stops { half_widths, .. } => half_widths.len(),
            Self::BoucWen { .. } | Self::Dahl { .. } => 3,
            Self::Speed | Self::Damping { .. } => 1,
        }
    }

    /// The number of values to which w does not respond linearly: the half-widths of stops; beta, gamma and the exponent; the
    /// break-away distance; the scale of a damping; a limit.
    pub(crate) fn shapes(&self) -> usize {
        match self {
            Self::Power { .. } | Self::Speed => 0,
            Self::Stops { half_widths, .. } => half_widths.len(),
            Self::BoucWen { .. } => 3,
            Self::Dahl { .. } | Self::Damping { .. } | Self::Excess { .. } => 1,
        }
    }

    /// Whether it dissipates energy by a force that must oppose the displacement.
    pub(crate) fn is_dissipative(&self) -> bool {
        matches!(self, Self::BoucWen { .. } | Self::Dahl { .. })
    }

    /// Whether its force changes by as much as z right after z has reversed, as that of a spring does.
    pub(crate) fn is_hysteretic_spring(&self) -> bool {
        matches!(self, Self::BoucWen { .. })
    }

    /// Whether it is a limit of what it sees.
    pub(crate) fn limits(&self) -> bool {
        matches!(self, Self::Excess { .. })
    }

    /// The number of weights of a sum.
    pub(crate) fn weights(&self) -> usize {
        if let Self::Stops { weights, .. } = self { weights.len() } else { 0 }
    }

    /// The number of marks that a step leaves for derivatives.
    pub(crate) fn marks(&self) -> usize {
        match self {
            Self::Power { .. } | Self::Speed | Self::Excess { .. } => 1,
            Self::Damping { .. } => 2,
            Self::Stops { half_widths, .. } => half_widths.len().max(1),
            Self::BoucWen { .. } => 4 + self.shapes(),
            // those of the force that is remembered, too
            Self::Dahl { .. } => 2 * (4 + self.shapes()),
        }
    }

    /// The number of its values that are estimated.
    pub(crate) fn values(&self) -> usize {
        self.shapes() + self.weights()
    }

    /// Whether w depends on the past of z.
    pub(crate) fn has_memory(&self) -> bool {
        self.memories() > 0
    }
}

impl InnerLoop {
    /// The number of values by which it enters G: what it drives, and what it sees.
    pub(crate) fn linear_values(&self) -> usize {
        let drives = if let Drives::States(column) = &self.drives { column.len() } else { 1 };
        let seen = match &self.sees {
            Sees::Output(_) => 0,
            Sees::Mixture { states, inputs } => states.len() + inputs.len(),
        };
        drives + seen
    }

    /// The same, in the order in which they are estimated.
    pub(crate) fn linear_values_mut(&mut self) -> Vec<&mut f64> {
        let mut all: Vec<&mut f64> = match &mut self.drives {
            Drives::States(column) => column.iter_mut().collect(),
            Drives::Input { force, .. } => vec![force],
        };
        if let Sees::Mixture { states, inputs } = &mut self.sees {
            all.extend(states.iter_mut().chain(inputs));
        }
        all
    }

    /// Takes states of G into account that it neither drives nor sees, behind its own.
    pub(crate) fn add_states(&mut self, count: usize) {
        match &mut self.drives {
            Drives::States(column) => column.resize(column.len() + count, 0.0),
            Drives::Input { states, .. } => *states += count,
        }
        if let Sees::Mixture { states, .. } = &mut self.sees {
            states.resize(states.len() + count, 0.0);
        }
    }

    /// Leaves out states of G.
    pub(crate) fn drop_states(&mut self, states: std::ops::Range<usize>) {
        match &mut self.drives {
            Drives::States(column) => drop(column.drain(states.clone())),
            Drives::Input { states: own, .. } => *own -= states.len(),
        }
        if let Sees::Mixture { states: own, .. } = &mut self.sees {
            own.drain(states);
        }
    }

    /// Shortens its column of E so that a unit of w takes no more than `most` away from z: `-S E <= most`, S the row of what it sees, or that
    /// of C.
    pub(crate) fn take_at_most(&mut self, most: f64, c: &crate::Matrix) {
        let Drives::States(column) = &mut self.drives else { return };
        let seen = |state: usize| match &self.sees {
            Sees::Output(output) => c[(*output, state)],
            Sees::Mixture { states, .. } => states[state],
        };
        let taken = -column.iter().enumerate().map(|(j, drive)| drive * seen(j)).sum::<f64>();
        if taken > most {
            column.iter_mut().for_each(|drive| *drive *= most / taken);
        }
    }

    /// The force of w = 1 on the displacement that the loop sees, relative to the linear stiffness: positive where it opposes the
    /// displacement. `b` are the columns of B behind the dead time, and `gains` the outputs in steady state where a column of E is added
    /// to the states; `None` where z is no displacement, or nothing stands still.
    ///
    /// From `y = g v + h w` in steady state, `y / g = v + (h / g) w`: the linear stiffness is 1 / g, and w opposes y with the
    /// force `-h / g`.
    pub(crate) fn relative_force(
        &self,
        b: &[Vec<f64>],
        gains: impl Fn(&[f64]) -> Option<nalgebra::DVector<f64>>,
    ) -> Option<f64> {
        let Sees::Output(output) = self.sees else { return None };
        gains(&self.drives.column(b)).map(|gains| -gains[output]).filter(|force| force.is_finite())
    }

    /// Why it is invalid around a G of so many states, so many of them behind the dead time, inputs and outputs; `None` where it
    /// is valid.
    pub(crate) fn flaw(
        &self,
        (states, behind): (usize, usize),
        inputs: usize,
        outputs: usize,
    ) -> Option<String> {
        let drives = self.drives.states();
        if let Drives::Input { input, .. } = self.drives
            && input >= inputs
        {
            return Some(format!("drives input {input} of {inputs}"));
        }
        if matches!(self.drives, Drives::Input { .. }) && drives != behind {
            return Some(format!("drives {drives} states, but {behind} are behind the dead time"));
        }
        if drives > states {
            return Some(format!("drives {drives} states, but the dynamics have {states}"));
        }
        if drives > behind {
            return Some(format!("drives {drives} states, but {behind} are behind the dead time"));
        }
        match &self.sees {
            Sees::Output(output) if *output >= outputs => {
                return Some(format!("sees output {output} of {outputs}"));
            }
            Sees::Mixture { states, .. } if states.len() != drives => {
                return Some(format!("sees {} states, but drives {drives}", states.len()));
            }
            Sees::Mixture { inputs: seen, .. } if seen.len() != inputs => {
                return Some(format!("sees {} inputs, but the dynamics have {inputs}", seen.len()));
            }
            _ => {}
        }
        match &self.law {
            Law::Power { exponent, scale } if *exponent < 2 || *scale <= 0.0 => Some(format!(
                "the power {exponent} of scale {scale} must be at least 2, the scale positive"
            )),
            Law::Stops { half_widths, weights } if half_widths.len() != weights.len() => Some(
                format!("has {} half-widths, but {} weights", half_widths.len(), weights.len()),
            ),
            Law::Stops { half_widths, .. }
                if half_widths.iter().any(|r| r.is_nan() || *r <= 0.0) =>
            {
                Some("the half-widths of its stops must be positive".to_owned())
            }
            Law::BoucWen { beta, .. } if beta.is_nan() || *beta < 0.0 => {
                Some(format!("has beta = {beta}, but a force that dissipates energy has beta >= 0"))
            }
            Law::Dahl { distance, .. } if distance.is_nan() || *distance <= 0.0 => {
                Some(format!("has the break-away distance {distance}, but it must be positive"))
            }
            Law::Damping { scale } if scale.is_nan() || *scale <= 0.0 => {
                Some(format!("has the scale {scale} of its damping, but it must be positive"))
            }
            Law::Excess { limit, .. } if !limit.is_finite() => {
                Some(format!("has the limit {limit}, but it must be finite"))
            }
            Law::BoucWen { exponent, .. } if exponent.is_nan() || *exponent < 1.0 => {
                Some(format!("has the exponent {exponent}, but it must be at least 1"))
            }
            _ => None,
        }
    }
}
