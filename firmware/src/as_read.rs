//! The same compensator as a reader of the formulas would write it: what the others are compared with.

use crate::actuator::{CREEP_GAINS, CREEP_RATES, INVERSE_DEADZONES, INVERSE_PLAYS, OFFSET};

/// Where plays and lags stand.
#[derive(Clone, Debug, Default)]
pub struct AsRead {
    places: [f32; INVERSE_PLAYS.len()],
    lags: [f32; CREEP_RATES.len()],
}

impl AsRead {
    /// The drive for a sample of the reference, without limits.
    pub fn step(&mut self, reference: f32) -> f32 {
        let mut v = reference - OFFSET;
        for (gain, lag) in CREEP_GAINS.iter().zip(&self.lags) {
            v -= gain * lag;
        }
        for (rate, lag) in CREEP_RATES.iter().zip(&mut self.lags) {
            *lag += rate * (v - *lag);
        }
        let mut z = 0.0;
        for ((half_width, weight), place) in INVERSE_PLAYS.iter().zip(&mut self.places) {
            if v - *place > *half_width {
                *place = v - half_width;
            } else if v - *place < -half_width {
                *place = v + half_width;
            }
            z += weight * *place;
        }
        let mut u = 0.0;
        for (threshold, weight) in &INVERSE_DEADZONES {
            if *threshold > 0.0 {
                if z > *threshold {
                    u += weight * (z - threshold);
                }
            } else if *threshold < 0.0 {
                if z < *threshold {
                    u += weight * (z - threshold);
                }
            } else {
                u += weight * z;
            }
        }
        u
    }
}
