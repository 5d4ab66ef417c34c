//! Mechanical play (backlash) after G.
//!
//! If the output is a displacement, it follows the displacement x only while the gap of width 2 b is closed: (E10) in the
//! documentation's theory, the play operator of half-width b. If the output is a force that passes the gap, such as that of a friction
//! damper, the part s of its stiffness is missing while the gap is open: (E18), a dead zone of half-width b.
//!
//! ```text
//! y(k) = max(x(k) - b, min(x(k) + b, y(k-1)))       displacement
//! y(k) = x(k) - s max(-b, min(b, x(k)))             force
//! ```
//!
//! A force leads the displacement that causes it, and a displacement lags behind its cause: the output is a force where the
//! hysteresis consists of stops ([`OutputKind`]).

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{
    Block, Moment, OutputKind, OutputStage, Proposal, Quantity, Situation, Slope, Stage, Units,
};
use crate::operators::play;

/// A gap: a displacement follows only while it is closed, `y(k) = max(x(k) - b, min(x(k) + b, y(k-1)))`, and a force hardly grows while it is open,
/// `y(k) = x(k) - s max(-b, min(b, x(k)))`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Backlash {
    /// The output behind the gap.
    pub output: usize,
    /// b, half the gap, in the output's unit.
    pub half_width: f64,
    /// s, the part of the stiffness that is missing while the gap is open, of an output that is a force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<f64>,
}

/// s of a proposal: most of the stiffness. By hand: the fit changes it. Below the least one, there is hardly a gap.
const MISSING: f64 = 0.8;
const LEAST_MISSING: f64 = 0.01;

impl Backlash {
    pub(super) const NAME: &'static str = "backlash";
    pub(super) const WHAT: &'static str = "mechanical play after the dynamics";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["gap", "dead play", "lost motion", "free play", "clearance"];
    pub(super) const STAGE: Stage = Stage::Output;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["direction"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// Half-widths between a ten-thousandth and a fifth of the span, or between a hundredth and two fifths of that of a force.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        const COUNT: usize = 12;
        let (missing, least, most): (_, f64, f64) = match situation.kind {
            OutputKind::Displacement => (None, 1e-4, 0.2),
            OutputKind::Force => (Some(MISSING), 1e-2, 0.4),
            OutputKind::Other => return Vec::new(),
        };
        let blocks = |output| {
            let span = situation.span(output);
            (0..COUNT).map(move |i| {
                let fraction = least * (most / least).powf(i as f64 / (COUNT - 1) as f64);
                Proposal::finite(Self { output, half_width: fraction * span, missing })
            })
        };
        situation.outputs().flat_map(blocks).collect()
    }
}

impl Block for Backlash {
    fn values(&self) -> Vec<f64> {
        [self.half_width].into_iter().chain(self.missing).collect()
    }

    fn set(&mut self, values: &[f64]) {
        self.half_width = values[0];
        self.missing = values.get(1).copied();
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let half_width = (0.3 * self.half_width, 3.0 * self.half_width);
        [half_width].into_iter().chain(self.missing.map(|_| (LEAST_MISSING, 1.0))).collect()
    }

    fn steps(&self) -> Vec<f64> {
        [1e-5 * self.half_width].into_iter().chain(self.missing.map(|_| 1e-5)).collect()
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let gap = 2.0 * self.half_width;
        match self.missing {
            None => vec![Quantity::strength("gap", units.output, gap)],
            Some(missing) => vec![
                Quantity::strength("gap", units.input, gap / units.stiffness),
                Quantity::strength("missing_stiffness", "", missing),
            ],
        }
    }

    fn flaw(&self) -> Option<String> {
        let part = |missing: &f64| !(*missing > 0.0 && *missing <= 1.0);
        positive(&[("half_width", self.half_width)]).or_else(|| {
            let missing = self.missing.filter(part)?;
            Some(format!("its part of the stiffness that is missing, {missing}, must be above 0 and at most 1"))
        })
    }
}

impl OutputStage for Backlash {
    fn output(&self) -> usize {
        self.output
    }

    /// The latest output. At first it is as near to zero as the gap lets it be, or in motion at `first + side b`. A force remembers nothing.
    fn rest(&self, first: f64, side: Option<f64>) -> Vec<f64> {
        let at_rest = || play(self.half_width, first, 0.0);
        let latest = side.map_or_else(at_rest, |side| first + side * self.half_width);
        if self.missing.is_none() { vec![latest] } else { Vec::new() }
    }

    fn is_pinched(&self) -> bool {
        self.missing.is_some()
    }

    fn sense(&self, state: &mut [f64], output: f64, _: Moment) -> (f64, Slope) {
        let Some(missing) = self.missing else {
            let before = state[0];
            state[0] = play(self.half_width, output, before);
            let slope = if state[0] == before { Slope::Held } else { Slope::Times(1.0) };
            return (state[0], slope);
        };
        let inside = output.clamp(-self.half_width, self.half_width);
        let slope = if inside == output { 1.0 - missing } else { 1.0 };
        (output - missing * inside, Slope::Times(slope))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_lacks_a_part_of_its_stiffness_while_the_gap_is_open() {
        let own = Backlash { output: 0, half_width: 0.5, missing: Some(0.75) };
        let moment = Moment { time: 0.0, rate: 1.0, covariates: &[] };
        let sense = |force: f64| own.sense(&mut own.rest(force, None), force, moment);
        assert_eq!(sense(0.25), (0.0625, Slope::Times(0.25)));
        assert_eq!(sense(2.0), (2.0 - 0.375, Slope::Times(1.0)));
        assert_eq!(sense(-2.0), (-2.0 + 0.375, Slope::Times(1.0)));
        let units = Units { input: "mm", output: "N", stiffness: 4.0 };
        let [gap, missing] = &own.quantities(units)[..] else { panic!() };
        assert_eq!((gap.value, &gap.unit[..], missing.value), (0.25, "mm", 0.75));
    }
}
