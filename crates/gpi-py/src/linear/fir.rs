//! The FIR estimate.

use crate::arrays::{experiments, from_matrices, from_matrix, from_signal, from_vector, signal};
use crate::errors::{parameter, to_python};
use crate::plotting::plot;
use gpi_core::linear;
use gpi_core::{Channel, Experiment, Matrix};
use pyo3::prelude::*;

/// A finite impulse response model: ``y(k) = sum_j H_j u(k-j) + offset``.
///
/// FIR models are returned by ``fir`` and ``FirStatistic.solve``.
///
/// Examples
/// --------
/// >>> u = np.random.default_rng(0).standard_normal(500)
/// >>> response = gpi.fir(u, 2.0 * u, taps=3)
/// >>> response.markov.shape, response.simulate([1.0, 2.0]).round(9).tolist()
/// ((1, 1, 3), [2.0, 4.0])
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Fir {
    pub(crate) fir: linear::Fir,
}

#[pymethods]
impl Fir {
    /// Markov parameters H_j, shape (outputs, inputs, taps), in output units per input unit.
    #[getter]
    fn markov<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrices(py, self.fir.markov[0].shape(), &self.fir.markov)
    }

    /// Constant term of each experiment, shape (experiments, outputs), in the outputs' units.
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, &self.fir.offsets)
    }

    /// Singular values of the regressor without its means, shape (taps * inputs,), descending, in the inputs' units.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fir.singular_values)
    }

    /// Largest over smallest singular value, the ratio by which the taps may amplify errors of the output.
    #[getter]
    fn condition(&self) -> f64 {
        self.fir.condition()
    }

    /// Order of persistent excitation: the number of singular values above 1e-13 of the largest, the rounding error.
    #[getter]
    fn rank(&self) -> usize {
        self.fir.rank
    }

    /// Root mean square of the residual of each output, shape (outputs,), in its unit.
    #[getter]
    fn residual_rms<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fir.residual_rms)
    }

    /// Number of rows of the regression.
    #[getter]
    fn samples(&self) -> usize {
        self.fir.samples
    }

    /// The output for u, from rest and without offset.
    ///
    #[doc = include_str!("../docs/simulate.txt")]
    /// Raises
    /// ------
    /// ParameterError
    ///     The number of inputs differs from the model's.
    fn simulate<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let expected = self.fir.markov[0].ncols();
        if input.ncols() != expected {
            let message = format!("`u` has {} channels, but {expected} are needed", input.ncols());
            return Err(parameter(message));
        }
        Ok(from_signal(u.py(), self.fir.simulate(&input), one_dimensional))
    }

    /// Draws the Markov parameters; see ``gpi_hammerstein.plot.markov``.
    ///
    #[doc = include_str!("../docs/plot.txt")]
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("markov", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        let (outputs, inputs) = self.fir.markov[0].shape();
        format!(
            "Fir({} taps, {inputs} inputs, {outputs} outputs, rank {} of {}, condition {:.3e}, \
             residual rms {:.4?})",
            self.fir.taps(),
            self.fir.rank,
            self.fir.singular_values.len(),
            self.fir.condition(),
            self.fir.residual_rms
        )
    }
}

/// Estimates Markov parameters by least squares (equation 25 of the paper).
///
/// Parameters
/// ----------
/// u, y : array_like, shape (samples,) or (samples, channels), or lists of arrays
///     Input and output, each channel in its own unit; lists hold one array an experiment, and each experiment has its
///     own offset.
/// taps : int
///     Number of Markov parameters, mu + 1 in the paper.
/// ridge : float
///     Regularization, a ratio to the mean eigenvalue of the normal equations. Zero is plain least squares. A positive
///     value suppresses the directions that the input hardly excites (three passes of iterated ridge regression).
///
/// Returns
/// -------
/// Fir
///     The estimate with its order of persistent excitation and its condition number.
///
/// Raises
/// ------
/// DataError
///     A sample is not finite, the lengths differ, or there are fewer samples than unknowns.
/// ParameterError
///     ``taps`` is zero, or ``ridge`` is negative.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = np.random.default_rng(0).standard_normal(500)
/// >>> fir = gpi.fir(u, 3.0 + np.convolve(u, [2.0, -1.0])[:500], taps=3)
/// >>> (np.round(fir.markov[0, 0], 9) + 0.0).tolist(), fir.rank
/// ([2.0, -1.0, 0.0], 3)
#[pyfunction]
#[pyo3(signature = (u, y, taps, *, ridge = 0.0))]
pub(super) fn fir(
    py: Python<'_>,
    u: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    taps: usize,
    ridge: f64,
) -> PyResult<Fir> {
    let (inputs, outputs) = (experiments("u", u)?, experiments("y", y)?);
    if inputs.len() != outputs.len() {
        let message = format!("`u` has {} experiments, but `y` {}", inputs.len(), outputs.len());
        return Err(parameter(message));
    }
    let channels = |letter: &str, signals: &[Matrix]| -> Vec<Channel> {
        let count = signals.first().map_or(0, Matrix::ncols);
        (1..=count).map(|index| Channel::new(format!("{letter}{index}"), "")).collect()
    };
    let (u_channels, y_channels) = (channels("u", &inputs), channels("y", &outputs));
    let runs = inputs.into_iter().zip(outputs).map(|(input, output)| Experiment {
        covariates: Matrix::zeros(input.nrows(), 0),
        input,
        output,
        warmup: 0,
        held_out: vec![],
    });
    let record = gpi_core::Record::new(runs.collect(), 1.0, u_channels, y_channels, vec![]);
    let record = record.map_err(to_python)?;
    let fir = py.detach(|| linear::estimate(&record, taps, ridge)).map_err(to_python)?;
    Ok(Fir { fir })
}
