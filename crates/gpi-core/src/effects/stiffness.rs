//! A resonance that moves with amplitude.

use super::{Block, Candidate, InnerLoop, Law, Quantity, Sees, Situation, Stage, Units};

/// Loops around G: a restoring force that is not in proportion to the displacement acts inside the
/// mechanics, `x+ = A x + B v + E w`, `w = law(S x + T v)`.
///
/// Powers of the displacement make Duffing's oscillator (a cube) or directions that differ (a square); stops
/// make hysteresis inside the loop, which softens the mechanics and damps them as the amplitude grows.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Stiffness {
    /// At least one.
    pub loops: Vec<InnerLoop>,
}

impl Stiffness {
    pub(super) const NAME: &'static str = "stiffness";
    pub(super) const WHAT: &'static str =
        "the resonance moves with amplitude: nonlinearity inside the mechanical loop";
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        let order = situation.order;
        // A lag has no resonance to move.
        if order < 2 || situation.outputs().len() > 1 {
            return Vec::new();
        }
        // half the span of the displacement
        let scale = |output| 0.5 * situation.span(output);
        let power = |output, exponent| InnerLoop {
            sees: Sees::Output(output),
            law: Law::Power { exponent, scale: scale(output) },
            drives: vec![0.0; order],
        };
        let block = |output| Self { loops: [2, 3].map(|m| power(output, m)).to_vec() };
        let moving = situation.outputs().filter(|&output| scale(output) > 0.0);
        moving
            .map(block)
            .flat_map(|block| {
                [order..2 * order, 0..2 * order]
                    .map(|places| Candidate::linear(block.clone(), places))
            })
            .collect()
    }
}

/// A run of values of a loop.
enum Group<'a> {
    /// As they are.
    Plain(&'a mut Vec<f64>),
    /// Positive numbers by their logarithms.
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
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        Self::STAGE
    }

    fn channel(&self) -> usize {
        match self.loops.first().map(|inner| &inner.sees) {
            Some(Sees::Output(output)) => *output,
            _ => 0,
        }
    }

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
            let seen = match &inner.sees {
                Sees::Output(_) => 0,
                Sees::Mixture { states, inputs } => states.len() + inputs.len(),
            };
            bounds.extend(free(inner.drives.len() + seen));
            if let Law::Stops { half_widths, weights } = &inner.law {
                // the widest stop sets the scales of z and of w
                let held = |last: Option<f64>| last.map(|value| (value, value));
                let others = half_widths.len().saturating_sub(1);
                bounds.extend(free(others));
                bounds.extend(held(half_widths.last().map(|r| r.ln())));
                bounds.extend(free(others));
                bounds.extend(held(weights.last().copied()));
            }
        }
        bounds
    }

    fn loops(&self) -> &[InnerLoop] {
        &self.loops
    }

    fn loops_mut(&mut self) -> &mut [InnerLoop] {
        &mut self.loops
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let mut found = Vec::new();
        for (q, inner) in self.loops.iter().enumerate() {
            let mut list = |what: &str, values: &[f64]| {
                let named = values.iter().enumerate();
                let quantity = |(i, &value)| Quantity::new(format!("{what}[{q}][{i}]"), "", value);
                found.extend(named.map(quantity));
            };
            list("drive", &inner.drives);
            if let Sees::Mixture { states, inputs } = &inner.sees {
                list("seen_state", states);
                list("seen_input", inputs);
            }
            if let Law::Stops { half_widths, weights } = &inner.law {
                list("half_width", half_widths);
                list("weight", weights);
            }
        }
        found
    }
}
