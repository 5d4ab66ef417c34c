//! Slow relaxation driven by v.
//!
//! `y += sum_i c_i L_i v`, (E6) in the documentation's theory: first-order lags L_i of unit gain and time
//! constants T_i in parallel with G. After a step of v the output goes on by c_i within a few T_i. At the
//! sampling interval Ts,
//!
//! ```text
//! L_i = (1 - z_i) q^-1 / (1 - z_i q^-1),      z_i = exp(-Ts / T_i).
//! ```

use super::flaws::{late, positive};
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Coefficients, ParallelSections, Proposal, Quantity, Situation, Stage, Units};

/// The output relaxes after the fast motion: `y += sum_i c_i L_i v` with first-order lags L_i of unit gain.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Creep {
    /// The input whose v drives it.
    pub input: usize,
    /// T_i in seconds.
    pub time_constants: Vec<f64>,
    /// c_i, relative to the displacement that follows v without the lags (the DC gain of G is 1).
    pub gains: Vec<f64>,
    /// The delay of v in samples: the dead time of G.
    pub dead_time: usize,
}

/// The shortest time constant of creep in seconds: faster lags belong to the dynamics.
fn shortest(rate: f64) -> f64 {
    const SECONDS: f64 = 0.03;
    const SAMPLES: f64 = 5.0;
    SECONDS.max(SAMPLES / rate)
}

/// The longest time constant of the dynamics in samples: slower lags are creep.
pub(crate) fn longest_lag(rate: f64) -> f64 {
    shortest(rate) * rate
}

/// A longer time constant in seconds is a drift proportional to the integral of v.
const LONGEST: f64 = 3e3;

impl Creep {
    pub(super) const NAME: &'static str = "creep";
    pub(super) const WHAT: &'static str = "slow relaxation driven by the actuator's own motion";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["relaxation", "slow relaxation", "after-effect", "aftereffect", "viscoelasticity"];
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::Shared;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::HidesInSlowPoles;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Rests;
    pub(super) const SHOWN_BY: &'static [&'static str] =
        &["past-input", "past-intermediate", "trend"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    /// One, two, three and five lags between the shortest time constant and the record's length. Creep that grows with the
    /// logarithm of time needs about two for each decade.
    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        const MORE: f64 = 5.0 / 3.0;
        let (low, high) = (MORE * shortest(situation.record.rate()), situation.duration());
        if situation.outputs().len() > 1 || high < 4.0 * low {
            return Vec::new();
        }
        let between = |fraction: f64| low * (high / low).powf(fraction);
        let mut sets: Vec<Vec<f64>> = (0..9).map(|i| vec![between(f64::from(i) / 8.0)]).collect();
        sets.push(vec![between(0.3), between(0.8)]);
        sets.push(vec![between(0.15), between(0.5), between(0.85)]);
        sets.push([0.1, 0.3, 0.5, 0.7, 0.9].map(between).to_vec());
        let block = |input, time_constants: &Vec<f64>| {
            let gains = vec![0.0; time_constants.len()];
            let block = Self { input, gains, time_constants: time_constants.clone(), dead_time: 0 };
            let lags = time_constants.len();
            Proposal::linear(block, lags..2 * lags)
        };
        situation.inputs().flat_map(|input| sets.iter().map(move |set| block(input, set))).collect()
    }
}

impl Block for Creep {
    fn values(&self) -> Vec<f64> {
        [&self.time_constants[..], &self.gains[..]].concat()
    }

    fn set(&mut self, values: &[f64]) {
        let (times, gains) = values.split_at(values.len() / 2);
        self.time_constants.copy_from_slice(times);
        self.gains.copy_from_slice(gains);
    }

    fn steps(&self) -> Vec<f64> {
        let times = self.time_constants.iter().map(|time| 1e-5 * time);
        times.chain(self.gains.iter().map(|_| 1e-3)).collect()
    }

    /// Creep follows the motion, and is smaller: the gains add up to more than 1e-6 and less than 1. Lags of the other direction, which
    /// a fit may bring beside one that is hardly faster, are a small part.
    fn is_possible(&self) -> bool {
        /// Of the gains of the other direction over the whole. By hand.
        const AGAINST: f64 = 0.5;
        /// Least sum of the gains. Where G integrates, its gain in steady state is very large, and the gain of any lag beside it is
        /// smaller than this. By hand: no machine creeps so little that a record shows it.
        const LEAST: f64 = 1e-6;
        let total: f64 = self.gains.iter().sum();
        let against: f64 = -self.gains.iter().filter(|gain| **gain < 0.0).sum::<f64>();
        total > LEAST && total < 1.0 && against <= AGAINST * total
    }

    /// All lags relax in one direction, and none is slower than the record, which would be a trend.
    fn is_plausible(&self, duration: f64) -> bool {
        self.gains.windows(2).all(|pair| pair[0] * pair[1] >= 0.0)
            && self.time_constants.iter().all(|&time| time < duration)
    }

    /// Drops the lags that relax in the other direction than the whole, and those that are slower than the record.
    fn drop_implausible(&mut self, duration: f64) -> bool {
        let total: f64 = self.gains.iter().sum();
        let lags = self.time_constants.iter().copied().zip(self.gains.iter().copied());
        let stays = |&(time, gain): &(f64, f64)| gain * total >= 0.0 && time < duration;
        let (times, gains): (Vec<f64>, Vec<f64>) = lags.filter(stays).unzip();
        if times.is_empty() || times.len() == self.time_constants.len() {
            return false;
        }
        (self.time_constants, self.gains) = (times, gains);
        true
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let mut quantities = Vec::new();
        for (i, (&time, &gain)) in self.time_constants.iter().zip(&self.gains).enumerate() {
            quantities.push(Quantity::new(format!("time_constant[{i}]"), "s", time));
            quantities.push(Quantity::strength(format!("gain[{i}]"), "", gain));
        }
        quantities
    }

    fn flaw(&self) -> Option<String> {
        let (times, gains) = (self.time_constants.len(), self.gains.len());
        if times != gains {
            return Some(format!("has {times} time constants, but {gains} gains"));
        }
        let times = self.time_constants.iter().map(|&time| ("time_constants", time));
        late(self.dead_time).or_else(|| positive(&times.collect::<Vec<_>>()))
    }
}

impl ParallelSections for Creep {
    fn input(&self) -> usize {
        self.input
    }

    fn sections(&self, rate: f64) -> Vec<Coefficients> {
        let lag = |(time, gain): (&f64, &f64)| {
            let pole = (-1.0 / (time * rate)).exp();
            (vec![-pole], vec![gain * (1.0 - pole)])
        };
        self.time_constants.iter().zip(&self.gains).map(lag).collect()
    }

    fn set_dead_time(&mut self, samples: usize) {
        self.dead_time = samples;
    }

    fn set_sections(&mut self, sections: &[Coefficients], rate: f64) {
        let lag = |(a, b): &Coefficients| (-1.0 / (rate * (-a[0]).ln()), b[0] / (1.0 + a[0]));
        (self.time_constants, self.gains) = sections.iter().map(lag).unzip();
    }

    fn dead_time(&self) -> usize {
        self.dead_time
    }

    fn section_bounds(&self, rate: f64) -> (f64, f64) {
        let a1 = |time: f64| -(-1.0 / (time * rate)).exp();
        (a1(LONGEST), a1(shortest(rate)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn creep_goes_on_in_one_direction_and_shows_within_the_record() {
        let creep = |times: &[f64], gains: &[f64]| Creep {
            input: 0,
            time_constants: times.to_vec(),
            gains: gains.to_vec(),
            dead_time: 0,
        };
        assert!(creep(&[0.2, 3.0], &[0.03, 0.01]).is_plausible(20.0));
        assert!(creep(&[0.2], &[-0.03]).is_plausible(20.0));
        assert!(!creep(&[0.2, 3.0], &[0.03, -0.01]).is_plausible(20.0));
        assert!(!creep(&[0.2, 375.0], &[0.03, 0.01]).is_plausible(20.0));
    }

    #[test]
    fn creep_does_not_come_from_lags_against_each_other() {
        let is_possible = |gains: &[f64]| {
            let times = vec![0.5; gains.len()];
            Creep { input: 0, time_constants: times, gains: gains.to_vec(), dead_time: 0 }
                .is_possible()
        };
        assert!(is_possible(&[0.03, 0.01]));
        assert!(is_possible(&[0.03, -0.005]));
        assert!(!is_possible(&[0.03, -0.02]));
        assert!(!is_possible(&[-0.03]));
        assert!(!is_possible(&[1.1]));
        // the gain beside an integrator
        assert!(!is_possible(&[1e-7]));
    }

    #[test]
    fn lags_of_the_other_direction_and_trends_are_dropped() {
        let creep = |times: &[f64], gains: &[f64]| Creep {
            input: 0,
            time_constants: times.to_vec(),
            gains: gains.to_vec(),
            dead_time: 0,
        };
        let mut own = creep(&[0.2, 3.0, 375.0], &[0.03, -0.01, 0.02]);
        assert!(own.drop_implausible(20.0));
        assert_eq!(own, creep(&[0.2], &[0.03]));
        assert!(!own.drop_implausible(20.0));
        assert!(!creep(&[375.0], &[0.03]).drop_implausible(20.0));
    }
}
