//! Every tolerance of the uncertainty and of the noise, with its meaning and the reason for its value.
//!
//! "By hand" means that nobody derived the value; docs/scoreboard.md shows what all values together achieve.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

/// How uncertainty and noise are computed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct UncertaintySettings {
    /// The covariance and what follows from it.
    pub covariance: CovarianceSettings,
    /// The autoregression of the residual.
    pub noise_model: NoiseModelSettings,
    /// The noise of the sensor.
    pub noise_floor: NoiseFloorSettings,
    /// Isolated wrong samples.
    pub outliers: OutlierSettings,
}

impl UncertaintySettings {
    /// Refuses settings that mean nothing.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.covariance.validate()?;
        self.noise_model.validate()?;
        self.noise_floor.validate()?;
        self.outliers.validate()
    }
}

settings! {
    /// The covariance and what follows from it.
    struct CovarianceSettings {
        /// Part of the largest eigenvalue, in columns scaled to unit length, up to which a direction is unidentifiable:
        /// some thousand times the rounding of a Gram matrix.
        identifiable: f64 = 1e-12, PART;
        /// Share in an unidentifiable direction from which on a parameter is unidentifiable: rounding alone gives less.
        share: f64 = 1e-3, PART;
        /// Shares that are listed: smaller ones do not help to see which parameters replace each other. By hand.
        listed: f64 = 0.05, PART;
        /// Step of a central difference in standard deviations: small enough to be linear, far above rounding.
        step: f64 = 1e-2, POSITIVE;
        /// The step as a part of each value at most: the linearization holds along unidentifiable directions as well.
        part: f64 = 1e-5, POSITIVE;
        /// Values below this part of the largest one count as this part, so that zeros do not forbid a step. By hand.
        least: f64 = 1e-4, PART;
        /// Eigenvalues of the correlation matrix below this are rounding.
        axes: f64 = 1e-14, PART;
        /// Order up to which nalgebra decomposes a matrix: faer is faster beyond, but keeps a workspace of megabytes,
        /// more than a record may take.
        large: usize = 300, FROM_ONE;
    }

    /// The autoregression of the residual.
    struct NoiseModelSettings {
        /// The highest order. By hand.
        order: usize = 30, FROM_ONE;
        /// Samples for each coefficient, at least. By hand.
        samples: usize = 20, FROM_ONE;
        /// Part of the variance below which the rest is rounding, and the recursion ends.
        rounding: f64 = 1e-12, PART;
    }

    /// The noise of the sensor.
    struct NoiseFloorSettings {
        /// Differences between periods that make an estimate: their rms is then known to a tenth.
        differences: f64 = 100.0, FROM_ONE;
        /// Part of an input's range by which repeated samples may differ: rounding of a file.
        repeated: f64 = 1e-9, PART;
        /// Samples of the shortest rest that counts: its second half determines a line and a variance. By hand.
        rest: usize = 100, FROM_ONE;
        /// Samples of all rests that make an estimate: their rms is then known to a twentieth.
        samples: usize = 200, FROM_ONE;
        /// Standard errors by which a rest may be noisier than the quietest one: beyond, the output still moves.
        standard_errors: f64 = 4.0, 0.0..=100.0;
        /// Samples of a periodogram: resolution is not needed, and averages vary less.
        periodogram: usize = 4096, FROM_ONE;
        /// Part of half the sampling rate from which on the residual counts as noise: a stage hardly responds there.
        /// By hand.
        band: f64 = 0.75, PART;
    }

    /// Isolated wrong samples.
    struct OutlierSettings {
        /// Robust standard deviations of the differences from the neighbours' median: a Gaussian exceeds six of them
        /// once in 10^9 samples.
        apart: f64 = 6.0, POSITIVE;
        /// Times that such a difference must exceed those around it, which excludes jumps and edges. By hand.
        alone: f64 = 4.0, FROM_ONE;
        /// Samples on either side that are compared: by hand.
        around: usize = 12, FROM_ONE;
        /// Of them, samples that may be wrong as well where outliers are counted. By hand.
        near: usize = 2, 0.0..=24.0;
        /// Part of such a difference by which the measured output must differ from the cubic through its four neighbours: by hand, as
        /// the motion may hide a part of it.
        shown: f64 = 0.5, PART;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_settings_are_valid() {
        UncertaintySettings::default().validate().unwrap();
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |change: fn(&mut UncertaintySettings)| {
            let mut settings = UncertaintySettings::default();
            change(&mut settings);
            settings.validate().unwrap_err().to_string()
        };
        assert!(refused(|s| s.covariance.step = 0.0).contains("step"));
        assert!(refused(|s| s.noise_model.order = 0).contains("order"));
        assert!(refused(|s| s.noise_floor.band = 1.5).contains("band"));
        assert!(refused(|s| s.outliers.alone = f64::NAN).contains("alone"));
    }
}
