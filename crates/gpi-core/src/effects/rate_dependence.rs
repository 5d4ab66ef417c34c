//! Half-widths of the plays that grow with the speed of the drive.
//!
//! `r(k) = r (1 + a g(s)) + b g(s)` for every play of half-width r > 0, (E3) in the documentation's theory,
//! with the speed `s = |du/dt|`. The hysteresis loop opens with the speed: in proportion to the half-width
//! (a), by the same width for all plays (b), or both.
//!
//! `g(s) = s`, or with a [`SpeedLaw`] the transformation of Box and Cox (1964),
//! `g(s) = s_0 ((1 + s/s_0)^e - 1) / e`. Its slope at s = 0 is 1; beyond the knee s_0 it grows more slowly.
//! The law sees s through a first-order lag.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, PlayWidths, Proposal, Quantity, Situation, Stage, Units};

/// Half-widths grow with the speed s of the drive: `r (1 + a g(s)) + b g(s)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RateDependence {
    /// The input whose hysteresis it is.
    pub input: usize,
    /// a, in seconds per unit of the input.
    pub relative: f64,
    /// b, in seconds.
    pub absolute: f64,
    /// The law g; `g(s) = s` without it.
    pub law: Option<SpeedLaw>,
    /// The root mean square speed in the input's unit per second, which scales the steps.
    pub speed: f64,
    /// Half-width of the widest play.
    pub widest: f64,
}

/// The law of Box and Cox: linear for e = 1, close to a power s^e for e between 0 and 1 and s well above s_0,
/// logarithmic for e = 0, and bounded by s_0 for e = -1.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SpeedLaw {
    /// e.
    pub exponent: f64,
    /// s_0, in the input's unit per second.
    pub knee: f64,
    /// Time constant in seconds of the first-order lag of s.
    pub lag: f64,
}

impl SpeedLaw {
    fn growth(&self, speed: f64) -> f64 {
        let logarithm = (speed / self.knee).ln_1p();
        let bent = match self.exponent {
            0.0 => logarithm,
            e => (e * logarithm).exp_m1() / e,
        };
        self.knee * bent
    }
}

impl RateDependence {
    pub(super) const NAME: &'static str = "rate-dependence";
    pub(super) const WHAT: &'static str = "half-widths grow with the rate of the input";
    pub(super) const SYNONYMS: &'static [&'static str] = &[
        "rate-dependent",
        "rate dependent",
        "rate-dependent hysteresis",
        "rate",
        "frequency dependence",
    ];
    pub(super) const STAGE: Stage = Stage::Plays;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Speeds;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["speed"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        /// Exponents, and knees over the median speed.
        const LAWS: [(f64, f64); 4] = [(0.4, 0.03), (0.0, 0.1), (0.0, 1.0), (-1.0, 1.0)];
        /// Seconds.
        const LAGS: [f64; 2] = [0.0, 2.5e-3];
        let rate = situation.record.rate();
        let block = |input: usize| {
            let steps = situation.steps(input);
            let squares: f64 = steps.iter().map(|step| step * step).sum();
            let speed = rate * (squares / steps.len().max(1) as f64).sqrt();
            let usual = rate * steps.get(steps.len() / 2).copied().unwrap_or(0.0);
            let widest = situation.widest[input];
            let block = Self { input, relative: 0.0, absolute: 0.0, law: None, speed, widest };
            (block, usual)
        };
        let usable = |(block, usual): &(Self, f64)| *usual > 0.0 && block.widest > 0.0;
        let mut proposals = Vec::new();
        for (block, usual) in situation.inputs().map(block).filter(usable) {
            let straight = [vec![0], vec![1], vec![0, 1]];
            proposals.extend(straight.map(|places| Proposal::linear(block.clone(), places)));
            for (exponent, knee) in LAWS {
                for lag in LAGS {
                    let law = Some(SpeedLaw { exponent, knee: knee * usual, lag });
                    proposals.push(Proposal::linear(Self { law, ..block.clone() }, [0, 1]));
                }
            }
        }
        proposals
    }
}

impl Block for RateDependence {
    fn values(&self) -> Vec<f64> {
        let law = self.law.map(|law| [law.exponent, law.knee.ln(), law.lag]);
        [self.relative, self.absolute].into_iter().chain(law.into_iter().flatten()).collect()
    }

    fn set(&mut self, values: &[f64]) {
        (self.relative, self.absolute) = (values[0], values[1]);
        if let (Some(law), [exponent, knee, lag]) = (&mut self.law, &values[2..]) {
            *law = SpeedLaw { exponent: *exponent, knee: knee.exp(), lag: *lag };
        }
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let any = (f64::NEG_INFINITY, f64::INFINITY);
        let knee = self.speed.ln();
        let law = [(-2.0, 1.0), (knee - 12.0, knee + 5.0), (0.0, 0.05)];
        let law = self.law.map(|_| law).into_iter().flatten();
        [any, any].into_iter().chain(law).collect()
    }

    fn steps(&self) -> Vec<f64> {
        // g is smaller than s above the knee
        let speed = self.law.map_or(self.speed, |law| law.growth(self.speed));
        let law = self.law.map(|law| [1e-3, 1e-3, (1e-2 * law.lag).max(1e-5)]);
        let law = law.into_iter().flatten();
        [1e-4 / speed, 1e-4 * self.widest / speed].into_iter().chain(law).collect()
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let inverse =
            if units.input.is_empty() { "s".to_owned() } else { format!("s/{}", units.input) };
        let per_second = if units.input.is_empty() { "1" } else { units.input };
        let mut quantities = vec![
            Quantity::strength("relative_growth", inverse, self.relative),
            Quantity::strength("absolute_growth", "s", self.absolute),
        ];
        if let Some(law) = self.law {
            quantities.push(Quantity::new("exponent", "", law.exponent));
            quantities.push(Quantity::new("knee", format!("{per_second}/s"), law.knee));
            quantities.push(Quantity::new("lag", "s", law.lag));
        }
        quantities
    }

    fn flaw(&self) -> Option<String> {
        let (knee, lag) = self.law.map_or((1.0, 0.0), |law| (law.knee, law.lag));
        let speeds = positive(&[("speed", self.speed), ("knee", knee)]);
        speeds.or_else(|| (lag < 0.0).then(|| format!("its lag of {lag} s must not be negative")))
    }
}

impl PlayWidths for RateDependence {
    fn input(&self) -> usize {
        self.input
    }

    fn rest(&self) -> Vec<f64> {
        vec![0.0]
    }

    fn speed_seen(&self, seen: &mut [f64], speed: f64, rate: f64) -> f64 {
        let Some(law) = self.law else { return speed };
        let keep = if law.lag > 0.0 { (-1.0 / (law.lag * rate)).exp() } else { 0.0 };
        seen[0] = keep * seen[0] + (1.0 - keep) * speed;
        law.growth(seen[0])
    }

    fn width(&self, half_width: f64, speed_seen: f64) -> (f64, f64) {
        if half_width == 0.0 {
            return (0.0, 1.0);
        }
        let factor = 1.0 + self.relative * speed_seen;
        let width = half_width * factor + self.absolute * speed_seen;
        // the fit may try a negative growth, but no half-width is negative
        if width > 0.0 { (width, factor) } else { (0.0, 0.0) }
    }
}
