//! The end of a refinement: superfluous parts are removed, and the uncertainty of the rest is computed.
//!
//! - Plays and deadzones of weight zero do not change the output. They are removed, and a few steps let the rest
//!   settle.
//! - Deadzones may replace each other: eigenvectors of the scaled Gram matrix whose eigenvalues are negligible are
//!   directions in which the output does not change. In each, the deadzone of largest share, if it is large enough, is
//!   set to zero, and the rest is fitted again. The removal stands if `J_after <= (1 + l / N) J_before`, J the cost of
//!   N values: for small l, the deviance `N ln(J_after / J_before)` is then at most l, in units in which a superfluous
//!   parameter gains 1 on average.
//! - The standard deviations are those of the estimated unknowns ([`certainty`]); an unknown at a bound has none.

use crate::fit::certainty;
use crate::fit::joint::Refined;
use crate::fit::minimize::{FitOptions, Fitted, fit};
use crate::fit::preparation::Prepared;
use crate::fit::problem::residual_rms;
use crate::fit::refinement::{Parameter, Refinement};
use crate::fit::sensitivities::names_and_values;
use crate::progress::{Progress, report};
use crate::uncertainty::Bands;
use crate::uncertainty::covariance::Uncertainty;
use crate::uncertainty::noise_floor::NoiseFloor;
use crate::{Error, Record};

impl Refined {
    /// The covariance of the estimates, and the number of parameters that the information criterion counts.
    pub(crate) fn uncertainty(
        &self,
        record: &Record,
        progress: Progress,
    ) -> Result<Uncertainty, Error> {
        let residuals = self.fitted.point.residuals(record)?;
        let mut check = || report(progress, "uncertainty", 0.0);
        certainty::uncertainty(&self.fitted, record, &self.options, residuals, &mut check)
    }

    /// Drops plays and deadzones without weight and fits once more.
    fn drop_unused(&mut self, prepared: &Prepared, progress: Progress) -> Result<(), Error> {
        if self.fitted.point.drop_unused() {
            let start = self.fitted.point.clone();
            let options = FitOptions {
                steps: prepared.settings.simplification.steps,
                ..self.options.clone()
            };
            let again = fit(start, &prepared.record, &options, "refinement", progress)?;
            self.fitted = again.after(&self.fitted.history);
        }
        Ok(())
    }

    /// Drops unidentifiable deadzones, which another one or the identity replaces, as long as the fit stays as good.
    pub(crate) fn drop_undetermined(
        &mut self,
        prepared: &Prepared,
        progress: Progress,
    ) -> Result<(), Error> {
        let settings = &prepared.settings.simplification;
        self.drop_unused(prepared, progress)?;
        for _ in 0..settings.passes {
            let open = self.uncertainty(&prepared.record, progress)?.open;
            let mut simpler = self.clone();
            let table = &self.fitted.table;
            if !simpler.fitted.point.silence_deadzones(table, &open) {
                break;
            }
            simpler.drop_unused(prepared, progress)?;
            let allowed = 1.0 + settings.loss / prepared.values();
            if simpler.fitted.linearization.cost > allowed * self.fitted.linearization.cost {
                break;
            }
            *self = simpler;
        }
        Ok(())
    }

    /// Drops plays and deadzones without weight, and computes the uncertainty of the rest.
    pub(crate) fn finish(
        mut self,
        prepared: &Prepared,
        progress: Progress,
    ) -> Result<Refinement, Error> {
        let record = &prepared.record;
        let values = prepared.values();
        let status = self.fitted.status;
        self.bridge(prepared, progress)?;
        self.drop_unused(prepared, progress)?;
        let uncertainty = self.uncertainty(record, progress)?;
        let Fitted { point, table, history, .. } = self.fitted;
        let residuals = point.residuals(record)?;
        let estimated = point.bounds(&table, record, self.options.freedom).estimated();
        let (names, values_of) = names_and_values(&point, &table, prepared);
        let described = table.described(&point, record);
        let deviations = uncertainty.deviations();
        let parameter = |&i: &usize| Parameter {
            name: names[i].clone(),
            value: values_of[i],
            deviation: deviations[i],
            unit: described[i].0.clone(),
            zero_is_absence: described[i].1,
        };
        Ok(Refinement {
            status,
            history: history.iter().map(|cost| (cost / values).sqrt()).collect(),
            parameters: estimated.iter().map(parameter).collect(),
            undetermined: uncertainty.undetermined(&names),
            residual_rms: residual_rms(&residuals, record),
            noise_floor: NoiseFloor::estimate(record, &residuals),
            residuals,
            outliers: self.outliers,
            robust: self.robust,
            bands: Bands { point, table, estimated, uncertainty },
        })
    }
}
