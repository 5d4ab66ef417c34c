//! Creep that hides in G: slow poles that came when something else was fitted.

use super::search::Search;
use crate::effects::longest_lag;
use crate::identify::Progress;
use crate::identify::levenberg_marquardt::fit;
use crate::identify::point::Point;
use crate::identify::preparation::rescale;
use crate::linear::Sections;
use crate::{Error, Record};
use nalgebra::DVector;

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
        let Some(point) = without_lags(&self.point, &self.prepared.record)? else {
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

/// The point without the slow lags of G; `None` where it has none, or nothing else.
fn without_lags(point: &Point, record: &Record) -> Result<Option<Point>, Error> {
    let longest = longest_lag(record.rate());
    let slow = |pole: &nalgebra::Complex<f64>| {
        pole.im == 0.0 && pole.re > 0.0 && -1.0 / pole.re.ln() > longest
    };
    let own = point.dynamics.own();
    // what acts back drives the states of G as they are
    if !own.poles().iter().any(slow) || point.loops().next().is_some() {
        return Ok(None);
    }
    let mut sections = Sections::from_delayed_state_space(&own.to_state_space()?)?;
    sections.sections.retain(|section| !section.poles().iter().all(slow));
    if sections.sections.is_empty() || sections.poles().iter().any(slow) {
        return Ok(None);
    }
    let order = sections.order();
    let beside = point.dynamics.sections.iter().filter(|section| section.beside.is_some());
    sections.sections.extend(beside.cloned());
    let mut faster = point.clone();
    for past in &mut faster.pasts {
        let kept = past.state.len() - own.order();
        let states = past.state.rows(own.order(), kept).into_owned();
        past.state = DVector::zeros(order + kept);
        past.state.rows_mut(order, kept).copy_from(&states);
    }
    faster.dynamics = sections;
    rescale(&mut faster);
    Ok(Some(faster))
}
