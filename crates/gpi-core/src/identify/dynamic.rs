//! Hysteresis and linear dynamics in turn, until nothing is gained.

use super::dynamics::{self, Dynamics};
use super::hysteresis::fit;
use super::identification::{Identification, Round};
use super::linearization::Freedom;
use super::sensitivity::Derivatives;
use super::start::{Start, rescale};
use super::{Progress, report};
use crate::linear;
use crate::{Error, Record};

/// Regularization of the FIR estimates, see [`linear::estimate`].
const RIDGE: f64 = 3e-2;

impl Start<'_> {
    /// Hysteresis and dynamics in turn.
    pub(super) fn dynamic(
        mut self,
        taps: usize,
        largest: usize,
        order: Option<usize>,
        supported: usize,
        progress: Progress,
    ) -> Result<Identification, Error> {
        const ROUNDS: usize = 5;
        /// Further rounds in which the thresholds move too.
        const POLISH: usize = 3;
        /// Levenberg-Marquardt steps a round.
        const STEPS: usize = 6;
        /// A round that lowers the rms by less than this fraction is the last one.
        const GAIN: f64 = 5e-3;
        let mut taps = taps;
        let mut current = dynamics_of(&self.record, &mut taps, largest, order, progress)?;
        let fir = linear::estimate(&self.record, taps, 0.0)?;
        let mut rounds = Vec::new();
        let mut point = self.point.clone();
        let linear_alone = self.free_run(&point, &current.refit.system)?.0;
        let mut best = (linear_alone, point.clone(), current.clone());
        let mut polish = false;
        for round in 0..ROUNDS + POLISH {
            report(progress, "rounds", round as f64 / (ROUNDS + POLISH) as f64)?;
            polish |= round == ROUNDS;
            // While placing anew, a round may be worse before the next is better; the polish goes on
            // from the best.
            if polish {
                (point, current) = (best.1.clone(), best.2.clone());
            }
            rescale(&mut point, &mut current.refit.system)?;
            if !polish {
                self.place(&mut point)?;
            }
            let numerator = current.refit.system.order() * self.record.outputs().len() <= 24;
            let derivatives = Derivatives { thresholds: polish, starts: self.unknown_past };
            let freedom = Freedom { derivatives, numerator };
            let linear = &current.refit.system;
            point = fit(point, linear, &self.record, freedom, STEPS, progress)?.point;
            if point.channels.iter().any(|c| c.weights.iter().all(|&weight| weight == 0.0)) {
                // y does not follow this input: there is no v to go on from.
                break;
            }
            current = dynamics_of(&self.driven(&point)?, &mut taps, largest, order, progress)?;
            let rms = self.free_run(&point, &current.refit.system)?.0;
            rounds.push(Round { rms, order: current.refit.system.order(), taps });
            let least = best.0;
            if rms < least {
                best = (rms, point.clone(), current.clone());
            }
            let stalled = rms > (1.0 - GAIN) * least;
            if stalled && round == 0 {
                self.notes.push(format!(
                    "hysteresis at the input hardly helps: training error {rms:.4e} with it, \
                     {least:.4e} without"
                ));
            }
            if stalled && (polish || round == 0) {
                break;
            }
            polish |= stalled;
        }
        let (_, mut point, dynamics) = best;
        let mut linear = dynamics.refit.system;
        rescale(&mut point, &mut linear)?;
        if dynamics.reflected > 0 {
            self.notes.push(format!(
                "{} poles of the realization were unstable and reflected into the unit circle",
                dynamics.reflected
            ));
        }
        let stages = (Some(fir), dynamics.singular_values, dynamics.reflected);
        let offsets = self.free_run(&point, &linear)?.1;
        self.finish(point, linear, &offsets, stages, supported, None, rounds)
    }
}

/// G of a record whose input is v, with as many taps as its slowest pole needs.
fn dynamics_of(
    record: &Record,
    taps: &mut usize,
    largest: usize,
    order: Option<usize>,
    progress: Progress,
) -> Result<Dynamics, Error> {
    let mut check = || report(progress, "dynamics", 0.0);
    let found = dynamics::estimate(record, *taps, RIDGE, order, &mut check)?;
    // taps until the slowest pole has decayed to one percent
    let radius = found.refit.system.spectral_radius()?;
    let needed = (0.01_f64.ln() / radius.ln()) as usize;
    if needed > *taps + *taps / 5 && *taps < largest {
        *taps = needed.min(largest);
        return dynamics::estimate(record, *taps, RIDGE, order, &mut check);
    }
    Ok(found)
}
