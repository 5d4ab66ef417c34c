//! A hysteresis from its input and its output.

use super::grid::grid;
use crate::arrays::{from_vector, vector};
use crate::operators::Gpi;
use crate::progress::interruptible;
use gpi_core::identify::{self as core, Grid};
use pyo3::prelude::*;

/// A hysteresis fitted to an input and an intermediate signal.
///
/// It is returned by ``fit_hysteresis``.
///
/// Examples
/// --------
/// >>> u = 4 * np.sin(0.01 * np.arange(2000)) * np.linspace(1, 0.5, 2000)
/// >>> v = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u)
/// >>> fit = gpi.fit_hysteresis(u, v, half_widths=[0.0, 1.0], thresholds=0)
/// >>> fit.gpi.plays.weights.round(6).tolist()
/// [1.0, 0.5]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(super) struct HysteresisFit {
    fit: core::HysteresisFit,
}

#[pymethods]
impl HysteresisFit {
    /// Envelope and plays. The weight of the identity in the envelope is 1.
    #[getter]
    fn gpi(&self) -> Gpi {
        Gpi { hysteresis: self.fit.hysteresis.clone() }
    }

    /// Constant term of v, in the unit of v.
    #[getter]
    fn offset(&self) -> f64 {
        self.fit.offset
    }

    /// Initial outputs F(-1) of the plays, shape (n,), in the order of their half-widths, in the unit of u.
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fit.start)
    }

    /// Root mean square error, in the unit of v.
    #[getter]
    fn rms(&self) -> f64 {
        self.fit.rms
    }

    /// Root mean square error at the start and after every accepted step, shape (steps + 1,), in the unit of v.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fit.history)
    }

    /// How the fit ended, ``converged``, ``stalled`` or ``limit``.
    #[getter]
    fn status(&self) -> &'static str {
        self.fit.status.name()
    }

    fn __repr__(&self) -> String {
        format!(
            "HysteresisFit({} deadzones, {} plays, rms {:.4e}, {})",
            self.fit.hysteresis.envelope().weights().len(),
            self.fit.hysteresis.plays().weights().len(),
            self.fit.rms,
            self.fit.status.name()
        )
    }
}

/// Fits envelope and plays jointly to an input and an intermediate signal.
///
/// The model is ``v(k) = sum_i p_i F_{r_i}[D[u]](k) + offset`` with ``D[u] = u + sum_j g_j Z_{eta_j}[u]`` (one-sided
/// deadzones) and p_i >= 0.
///
/// Parameters
/// ----------
/// u, v : array_like, shape (samples,)
///     Input and intermediate signal, each in its own unit.
/// half_widths : int or array_like, shape (n,), optional
///     The number of half-widths, which are distributed over half the span of u, or their values, in the unit of u; 24
///     when left out. Zero is always added.
/// thresholds : int or array_like, shape (m,), optional
///     The number of thresholds, which are distributed over the range of u, or their values, in the unit of u; 10 when
///     left out.
/// progress : callable, optional
///     Called with a ``Progress``: the stage, the fraction done and the elapsed time; an exception stops the fit.
///
/// Returns
/// -------
/// HysteresisFit
///     The operator, its offset, its initial state and the error.
///
/// Raises
/// ------
/// DataError
///     The lengths differ, a sample is not finite, a signal is constant, or there are too few samples.
/// ParameterError
///     A half-width is negative, or there is none.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = 4 * np.sin(0.01 * np.arange(2000)) * np.linspace(1, 0.5, 2000)
/// >>> v = gpi.PlayBank([0.0, 1.0], [1.0, 0.5])(u)
/// >>> fit = gpi.fit_hysteresis(u, v, half_widths=[0, 0.5, 1, 1.5], thresholds=0)
/// >>> bool(fit.rms < 1e-6)
/// True
#[pyfunction]
#[pyo3(signature = (u, v, *, half_widths = None, thresholds = None, progress = None))]
pub(super) fn fit_hysteresis(
    py: Python<'_>,
    u: &Bound<'_, PyAny>,
    v: &Bound<'_, PyAny>,
    half_widths: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<HysteresisFit> {
    let (u, v) = (vector("u", u)?, vector("v", v)?);
    let half_widths = grid("half_widths", half_widths)?.unwrap_or(Grid::Count(24));
    let thresholds = grid("thresholds", thresholds)?.unwrap_or(Grid::Count(10));
    let fit = interruptible(py, progress, |report| {
        core::fit_hysteresis(&u, &v, &half_widths, &thresholds, report)
    })?;
    Ok(HysteresisFit { fit })
}
