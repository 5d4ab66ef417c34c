//! Models that begin at the balance of forces.
//!
//! The balance ([`super::force_balance`]) gives mass, damping, stiffness and forces in units of the input. A model that begins there has
//! the other effects of the present one, and no plays and deadzones: before the dynamics, they stand for a force inside them.

use super::force_balance::{Balance, balance};
use super::policy::BalancePolicy;
use super::state::SearchState;
use crate::chain::point::Point;
use crate::effects::{Drives, Effect, Entry, OutputKind, PlaceMut, Proposal, Situation};
use crate::fit::preparation::rescale;
use crate::linear::Sections;
use crate::{Experiment, Matrix, Record};

/// A model without its hysteresis.
pub(super) struct Straight {
    point: Point,
    /// The gain of the straight envelope before the dynamics.
    gain: f64,
    /// As in [`Section::growth`](crate::linear::Section::growth).
    growth: f64,
}

impl Straight {
    /// Of a model of the record of `state`; `None` where the straight envelope has no gain.
    pub(super) fn of(state: &SearchState, point: &Point) -> Option<Self> {
        let record = &state.prepared.record;
        let point = point.without_hysteresis(record);
        let gain = point.channels[0].slope();
        let slowest = state.setup.policy.balance.slowest;
        let growth = (slowest / record.scored() as f64).exp();
        (gain != 0.0).then_some(Self { point, gain, growth })
    }

    /// The delay of the dynamics.
    pub(super) fn delay(&self) -> usize {
        self.point.dynamics.delay
    }

    /// The linear mechanics of a balance behind the straight envelope.
    pub(super) fn dynamics(&self, own: &Balance) -> Option<Sections> {
        own.dynamics(self.gain, self.delay(), self.growth).ok()
    }

    /// A model at a balance with the loops of an effect, and the effect with the forces that the balance gives it. They enter where the
    /// input does.
    pub(super) fn at_balance(
        &self,
        state: &SearchState,
        own: &Balance,
        mut effect: Effect,
    ) -> Option<(Point, Effect)> {
        let dynamics = self.dynamics(own)?;
        if let PlaceMut::Loops(closed) = effect.place_mut() {
            for (inner, found) in closed.loops_mut().iter_mut().zip(&own.forces) {
                let found = self.gain * found;
                match &mut inner.drives {
                    Drives::States(column) => {
                        *column = dynamics.driven_by(0).map(|b| -found * b).collect();
                    }
                    Drives::Input { force, .. } => *force = found,
                }
            }
        }
        Some((self.with(state, dynamics, Some(effect.clone())), effect))
    }

    /// The model with other dynamics and one more effect, if there is one.
    pub(super) fn with(
        &self,
        state: &SearchState,
        dynamics: Sections,
        effect: Option<Effect>,
    ) -> Point {
        let mut point = state.prepared.point(dynamics);
        point.channels.clone_from(&self.point.channels);
        state.prepared.settle(&mut point);
        let effects = self.point.effects.iter().cloned().chain(effect);
        let mut point = effects.fold(point, |point, effect| point.with_effect(effect));
        rescale(&mut point);
        point
    }
}

/// The balance with the block of an effect whose forces explain most, if that is enough, and the block.
pub(super) fn best(
    record: &Record,
    delay: usize,
    proposals: Vec<Proposal<Effect>>,
    policy: &BalancePolicy,
) -> Option<(Balance, Effect)> {
    let of = |proposal: Proposal<Effect>| {
        let loops = proposal.block.place().closed_loops()?.loops();
        Some((balance(record, delay, loops, policy)?, proposal.block))
    };
    let better = |known: (Balance, Effect), next: (Balance, Effect)| {
        if next.0.explained > known.0.explained { next } else { known }
    };
    let found = proposals.into_iter().filter_map(of).reduce(better);
    found.filter(|(own, _)| own.explained >= policy.least)
}

/// The proposals of an effect for a mass of these dynamics that moves as measured.
pub(super) fn proposals(
    record: &Record,
    dynamics: &Sections,
    entry: &Entry,
) -> Vec<Proposal<Effect>> {
    let of = |signal: fn(&Experiment) -> &Matrix| -> Vec<Matrix> {
        let scored = |experiment: &Experiment| {
            let rows: Vec<usize> = experiment.scored_runs().flatten().collect();
            signal(experiment).select_rows(&rows)
        };
        record.experiments().iter().map(scored).collect()
    };
    let (inputs, outputs) = (of(|own| &own.input), of(|own| &own.output));
    (entry.proposals)(&Situation {
        record,
        drives: &inputs,
        intermediates: &inputs,
        displacements: &outputs,
        residuals: &outputs,
        dynamics,
        loops: Vec::new(),
        kind: OutputKind::Displacement,
        widest: vec![0.0],
        places: vec![Situation::range(&inputs, 0)],
    })
}
