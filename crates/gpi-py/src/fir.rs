//! The FIR estimate.

use crate::arrays::{experiments, from_matrices, from_matrix, from_signal, from_vector, signal};
use crate::errors::{parameter, to_python};
use crate::plotting::plot;
use gpi_core::linear;
use gpi_core::{Channel, Experiment, Matrix};
use pyo3::prelude::*;

/// A finite impulse response model: ``y(k) = sum_j H_j u(k-j) + offset``.
///
/// It comes from ``fir`` or ``FirStatistic.solve``.
///
/// Examples
/// --------
/// >>> u = np.random.default_rng(0).standard_normal(500)
/// >>> response = gpi.fir(u, 2.0 * u, taps=3)
/// >>> response.markov.shape, response.simulate([1.0, 0.0]).round(9).tolist()
/// ((1, 1, 3), [2.0, 0.0])
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

    /// Singular values of the regressor (means removed), shape (taps * inputs,), descending, in the inputs' units.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fir.singular_values)
    }

    /// Largest over smallest singular value, a ratio by which errors of the output may grow in the taps.
    #[getter]
    fn condition(&self) -> f64 {
        self.fir.condition()
    }

    /// Number of singular values above 1e-13 of the largest, what the input excites beyond rounding.
    #[getter]
    fn rank(&self) -> usize {
        self.fir.rank
    }

    /// Root mean square of the residual of each output, shape (outputs,), in its unit.
    #[getter]
    fn residual_rms<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.fir.residual_rms)
    }

    /// Rows of the regression.
    #[getter]
    fn samples(&self) -> usize {
        self.fir.samples
    }

    /// The output for u, from rest and without offset.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (samples,) or (samples, outputs)
    ///     y, in the outputs' units; a vector where u is one and there is one output.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     Another number of inputs.
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
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes to draw on; those of a new figure when left out.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     The axes.
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
///     Zero is plain least squares. A positive value, a ratio to the mean eigenvalue of the normal
///     equations, leaves out what the input hardly excites (three passes of iterated ridge
///     regression).
///
/// Returns
/// -------
/// Fir
///     The estimate with its excitation rank and condition number.
///
/// Raises
/// ------
/// DataError
///     Samples that are not finite, unequal lengths, fewer samples than unknowns.
/// ParameterError
///     No taps, a negative ridge.
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
fn fir(
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

/// What the least squares of a finite impulse response need to know of records, however long.
///
/// Samples go in by parts and are not kept: the size is that of the model, (taps * inputs)^2. The estimate is that of
/// `fir` on all samples at once, as good as by an orthogonal decomposition of the regressor.
///
/// Parameters
/// ----------
/// taps : int
///     Number of Markov parameters.
/// inputs, outputs : int
///     Number of channels.
///
/// Raises
/// ------
/// ParameterError
///     No taps or channels, more than 20000 taps times inputs.
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
struct FirStatistic {
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

    /// Rows of the regression so far, the samples whose past of ``taps - 1`` samples is known.
    #[getter]
    fn samples(&self) -> usize {
        self.statistic.samples()
    }

    /// Takes the next samples of the present experiment.
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
    ///     Another number of channels, unequal lengths.
    fn push(&mut self, py: Python<'_>, u: &Bound<'_, PyAny>, y: &Bound<'_, PyAny>) -> PyResult<()> {
        let ((input, _), (output, _)) = (signal("u", u)?, signal("y", y)?);
        py.detach(|| self.statistic.push(&input, &output)).map_err(to_python)
    }

    /// Ends the present experiment: what comes next has another past and another offset.
    fn end_experiment(&mut self) {
        self.statistic.end_experiment();
    }

    /// Adds what another one has gathered; the present experiments of both end.
    ///
    /// Parameters
    /// ----------
    /// other : FirStatistic
    ///     One of as many taps, inputs and outputs.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     Another number of taps, inputs or outputs.
    fn merge(&mut self, other: &Self) -> PyResult<()> {
        self.statistic.merge(other.statistic.clone()).map_err(to_python)
    }

    /// The least squares estimate from all samples so far.
    ///
    /// Parameters
    /// ----------
    /// ridge : float
    ///     As for ``fir``: zero, or a ratio to the mean eigenvalue of the normal equations.
    ///
    /// Returns
    /// -------
    /// Fir
    ///     The estimate.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     Fewer samples than unknowns.
    /// ParameterError
    ///     A negative ridge.
    #[pyo3(signature = (*, ridge = 0.0))]
    fn solve(&self, py: Python<'_>, ridge: f64) -> PyResult<Fir> {
        Ok(Fir { fir: py.detach(|| self.statistic.solve(ridge)).map_err(to_python)? })
    }

    fn __repr__(&self) -> String {
        format!("FirStatistic({} taps, {} samples)", self.taps(), self.samples())
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Fir>()?;
    module.add_class::<FirStatistic>()?;
    module.add_function(wrap_pyfunction!(fir, module)?)
}
