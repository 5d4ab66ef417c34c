//! A mode that the linear part lacks.
//!
//! `(b1 q^-1 + b2 q^-2) / (1 + a1 q^-1 + a2 q^-2)` from v to y in parallel with G, (E5) in the
//! documentation's theory, behind the dead time of G: one more mode, or two real poles.
//!
//! The poles `z = -a1/2 +- sqrt(a1^2/4 - a2)` are those of `s = rate ln z` in continuous time. A pair gives
//! the natural frequency `|s| / 2 pi` and the damping `-Re s / |s|`, real poles give time constants `-1/s`;
//! the static gain is `(b1 + b2) / (1 + a1 + a2)`.

use super::creep::longest_lag;
use super::flaws::{late, positive};
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Coefficients, ParallelSections, Proposal, Quantity, Situation, Stage, Units};

/// One more mode or two real poles in parallel with G: `(b1 q^-1 + b2 q^-2) / (1 + a1 q^-1 + a2 q^-2)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LinearDynamics {
    /// The input whose v drives it.
    pub input: usize,
    /// a1, a2.
    pub denominator: Vec<f64>,
    /// b1, b2.
    pub numerator: Vec<f64>,
    /// The sampling rate in Hz.
    pub rate: f64,
    /// The delay of v in samples: the dead time of G.
    pub dead_time: usize,
}

impl LinearDynamics {
    pub(super) const NAME: &'static str = "linear-dynamics";
    pub(super) const WHAT: &'static str = "a resonance or another pole that the linear part lacks";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["mode", "resonance", "dynamics", "order", "pole", "linear"];
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::JoinsG;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Speeds;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["past-input", "past-intermediate"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// Lightly damped modes between ten periods a record and close to half the sampling rate.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        const MODES: usize = 24;
        const DAMPING: f64 = 0.03;
        let rate = situation.record.rate();
        let (low, high) = ((10.0 / situation.duration()).max(1e-4 * rate), 0.45 * rate);
        if low >= high || situation.outputs().len() > 1 {
            return Vec::new();
        }
        let mode = move |input: usize, place: usize| {
            let frequency = low * (high / low).powf(place as f64 / (MODES - 1) as f64);
            let angle = std::f64::consts::TAU * frequency / rate;
            let radius = (-DAMPING * angle).exp();
            let denominator = vec![-2.0 * radius * angle.cos(), radius * radius];
            Self { input, denominator, numerator: vec![0.0; 2], rate, dead_time: 0 }
        };
        let modes = |input| (0..MODES).map(move |place| mode(input, place));
        situation.inputs().flat_map(modes).map(|mode| Proposal::linear(mode, 2..4)).collect()
    }
}

/// From this damping on, a pair of poles hardly rings, and its response is like that of two lags: a quality factor of 1. By hand.
const HARDLY_RINGS: f64 = 0.5;

/// The poles in continuous time: `s = rate ln z`.
enum Poles {
    /// Natural frequency in rad/s, and damping.
    Pair { natural: f64, damping: f64 },
    /// Time constants in s.
    Lags([f64; 2]),
}

impl LinearDynamics {
    /// `None` unless the denominator has two coefficients.
    fn poles(&self) -> Option<Poles> {
        let [a1, a2] = self.denominator[..] else { return None };
        let discriminant = 0.25 * a1 * a1 - a2;
        if discriminant < 0.0 {
            let (decay, angle) = (-0.5 * a2.ln(), (-0.5 * a1 / a2.sqrt()).acos());
            let natural = decay.hypot(angle);
            return Some(Poles::Pair { natural: self.rate * natural, damping: decay / natural });
        }
        let root = discriminant.sqrt();
        let time = |pole: f64| -1.0 / (self.rate * pole.abs().max(f64::MIN_POSITIVE).ln());
        Some(Poles::Lags([time(-0.5 * a1 + root), time(-0.5 * a1 - root)]))
    }
}

impl Block for LinearDynamics {
    fn values(&self) -> Vec<f64> {
        [&self.denominator[..], &self.numerator[..]].concat()
    }

    fn set(&mut self, values: &[f64]) {
        self.denominator.copy_from_slice(&values[..2]);
        self.numerator.copy_from_slice(&values[2..]);
    }

    fn steps(&self) -> Vec<f64> {
        // a step of the numerator changes the static gain by a ten-thousandth
        let gain = 1.0 + self.denominator.iter().sum::<f64>();
        vec![1e-6, 1e-6, 1e-4 * gain, 1e-4 * gain]
    }

    /// Whether its poles are faster than the lags of creep, or ring. A slow pair that hardly rings is a relaxation, which creep describes.
    fn is_plausible(&self, _: f64) -> bool {
        let longest = longest_lag(self.rate) / self.rate;
        match self.poles() {
            Some(Poles::Pair { natural, damping }) => {
                damping < HARDLY_RINGS || 1.0 / (natural * damping) <= longest
            }
            Some(Poles::Lags(times)) => times.iter().all(|&time| time <= longest),
            None => true,
        }
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        let Some(poles) = self.poles() else { return Vec::new() };
        let gain =
            self.numerator.iter().sum::<f64>() / (1.0 + self.denominator.iter().sum::<f64>());
        let [first, second] = match poles {
            Poles::Pair { natural, damping } => [
                Quantity::new("frequency", "Hz", natural / std::f64::consts::TAU),
                Quantity::new("damping", "", damping),
            ],
            Poles::Lags(times) => {
                [0, 1].map(|i: usize| Quantity::new(format!("time_constant[{i}]"), "s", times[i]))
            }
        };
        let unit = Units::ratio(units.output, units.input);
        vec![first, second, Quantity::strength("static_gain", unit, gain)]
    }

    fn flaw(&self) -> Option<String> {
        let (poles, gains) = (self.denominator.len(), self.numerator.len());
        if (poles, gains) != (2, 2) {
            return Some(format!("has {poles} and {gains} coefficients; both must be 2"));
        }
        late(self.dead_time).or_else(|| positive(&[("rate", self.rate)]))
    }
}

impl ParallelSections for LinearDynamics {
    fn input(&self) -> usize {
        self.input
    }

    fn sections(&self, _: f64) -> Vec<Coefficients> {
        vec![(self.denominator.clone(), self.numerator.clone())]
    }

    fn set_dead_time(&mut self, samples: usize) {
        self.dead_time = samples;
    }

    fn set_sections(&mut self, sections: &[Coefficients], _: f64) {
        (self.denominator, self.numerator) = sections[0].clone();
    }

    fn dead_time(&self) -> usize {
        self.dead_time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mode at a frequency in Hz.
    fn mode(frequency: f64, damping: f64) -> LinearDynamics {
        let rate = 1000.0;
        let natural = std::f64::consts::TAU * frequency / rate;
        let radius = (-damping * natural).exp();
        let angle = natural * (1.0 - damping * damping).sqrt();
        let denominator = vec![-2.0 * radius * angle.cos(), radius * radius];
        LinearDynamics { input: 0, denominator, numerator: vec![0.0; 2], rate, dead_time: 0 }
    }

    #[test]
    fn slow_poles_that_hardly_ring_are_no_mode() {
        assert!(mode(100.0, 0.02).is_plausible(20.0));
        assert!(mode(100.0, 0.7).is_plausible(20.0));
        assert!(mode(0.3, 0.02).is_plausible(20.0));
        assert!(!mode(0.3, 0.7).is_plausible(20.0));
        // real poles with time constants of 0.1 s and 10 ms, and of 10 ms and 5 ms
        let lags = |times: [f64; 2]| {
            let [p, q] = times.map(|time| (-1e-3 / time).exp());
            LinearDynamics { denominator: vec![-p - q, p * q], ..mode(1.0, 0.5) }
        };
        assert!(!lags([0.1, 0.01]).is_plausible(20.0));
        assert!(lags([0.01, 0.005]).is_plausible(20.0));
    }
}
