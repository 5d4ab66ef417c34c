//! Creep that hides in G: slow poles that came when something else was fitted.

use super::search::Search;
use crate::Error;
use crate::Progress;
use crate::chain::point::Point;
use crate::fit::memory::Memory;
use crate::fit::minimize::fit;

/// What a search had before lags were taken out of its G.
pub(super) struct Before {
    point: Point,
    cost: f64,
    rounds: usize,
}

impl Search<'_> {
    /// Takes lags as slow as creep out of G, so that the next round can name what they follow; says whether
    /// there were any.
    pub(super) fn shed_lags(&mut self, progress: Progress) -> Result<bool, Error> {
        let may_creep = self.allowed.iter().any(|entry| entry.name == "creep")
            && self.point.effects.iter().all(|effect| effect.name() != "creep");
        if !may_creep || self.order_is_given || self.before.is_some() {
            return Ok(false);
        }
        let memory = Memory::of(&self.prepared.record);
        let Some(point) = self.point.without(|pole| memory.is_slow_lag(pole))? else {
            return Ok(false);
        };
        let fitted = fit(point, &self.prepared.record, &self.options, "slow poles", progress)?;
        let before = std::mem::replace(&mut self.point, fitted.point);
        let rounds = self.rounds.len();
        self.before = Some(Before { point: before, cost: self.cost, rounds });
        self.cost = fitted.linearization.cost;
        self.is_rich = false;
        Ok(true)
    }

    /// Goes back to what was before lags were taken out, where no effect explains as much as they did.
    pub(super) fn settle_lags(&mut self) -> Result<(), Error> {
        /// How much larger the residual's squares may be with an effect in place of lags.
        const WORSE: f64 = 1.05;
        let Some(before) = self.before.take() else { return Ok(()) };
        if self.rounds.len() == before.rounds || self.cost > WORSE * before.cost {
            self.rounds.truncate(before.rounds);
            self.point = before.point;
            self.repair()?;
        }
        Ok(())
    }
}
