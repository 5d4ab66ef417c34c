//! The FIR estimate from samples that come in parts.

use super::fir::Fir;
use crate::arrays::signal;
use crate::errors::to_python;
use gpi_core::linear;
use pyo3::prelude::*;

/// Sufficient statistic for the least squares estimate of a finite impulse response.
///
/// Samples are passed in parts and are not stored, so records may be arbitrarily long: the memory depends on the model alone,
/// (taps * inputs)^2 numbers. The estimate is that of ``fir`` on all samples at once, with the accuracy of an orthogonal
/// decomposition of the regressor.
///
/// Parameters
/// ----------
/// taps : int
///     Number of Markov parameters.
/// inputs, outputs : int
///     Numbers of channels.
///
/// Raises
/// ------
/// ParameterError
///     A number of taps or channels is zero, or taps times inputs exceed 20000.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = np.random.default_rng(0).standard_normal(500)
/// >>> y = 3.0 + np.convolve(u, [2.0, -1.0])[:500]
/// >>> statistic = gpi.FirStatistic(3)
/// >>> for part in (slice(0, 200), slice(200, 500)):
/// ...     statistic.push(u[part], y[part])
/// >>> (np.round(statistic.solve().markov[0, 0], 9) + 0.0).tolist()
/// [2.0, -1.0, 0.0]
#[pyclass(module = "gpi_hammerstein")]
pub(super) struct FirStatistic {
    statistic: linear::FirStatistic,
}

#[pymethods]
impl FirStatistic {
    #[new]
    #[pyo3(signature = (taps, inputs = 1, outputs = 1))]
    fn new(taps: usize, inputs: usize, outputs: usize) -> PyResult<Self> {
        let statistic = linear::FirStatistic::new(taps, inputs, outputs).map_err(to_python)?;
        Ok(Self { statistic })
    }

    /// Number of taps.
    #[getter]
    fn taps(&self) -> usize {
        self.statistic.taps()
    }

    /// Number of rows of the regression so far: the samples whose ``taps - 1`` predecessors are known.
    #[getter]
    fn samples(&self) -> usize {
        self.statistic.samples()
    }

    /// Adds the next samples of the current experiment.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    /// y : array_like, shape (samples,) or (samples, outputs)
    ///     Output, in its unit.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     The number of channels differs from the statistic's, or the lengths differ.
    fn push(&mut self, py: Python<'_>, u: &Bound<'_, PyAny>, y: &Bound<'_, PyAny>) -> PyResult<()> {
        let ((input, _), (output, _)) = (signal("u", u)?, signal("y", y)?);
        py.detach(|| self.statistic.push(&input, &output)).map_err(to_python)
    }

    /// Ends the current experiment. The next samples belong to a new one, with its own past and its own offset.
    fn end_experiment(&mut self) {
        self.statistic.end_experiment();
    }

    /// Adds the samples of another statistic; the current experiments of both end.
    ///
    /// Parameters
    /// ----------
    /// other : FirStatistic
    ///     A statistic with the same numbers of taps, inputs and outputs.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     The number of taps, inputs or outputs differs.
    fn merge(&mut self, other: &Self) -> PyResult<()> {
        self.statistic.merge(other.statistic.clone()).map_err(to_python)
    }

    /// The least squares estimate from all samples so far.
    ///
    /// Parameters
    /// ----------
    /// ridge : float
    ///     Regularization as for ``fir``, a ratio to the mean eigenvalue of the normal equations.
    ///
    /// Returns
    /// -------
    /// Fir
    ///     The estimate.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     There are fewer samples than unknowns.
    /// ParameterError
    ///     ``ridge`` is negative.
    #[pyo3(signature = (*, ridge = 0.0))]
    fn solve(&self, py: Python<'_>, ridge: f64) -> PyResult<Fir> {
        Ok(Fir { fir: py.detach(|| self.statistic.solve(ridge)).map_err(to_python)? })
    }

    fn __repr__(&self) -> String {
        format!("FirStatistic({} taps, {} samples)", self.taps(), self.samples())
    }
}
