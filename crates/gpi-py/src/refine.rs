//! Joint refinement and how sure its parameters are.

use crate::arrays::{
    from_complex, from_matrices, from_matrix, from_signal, from_vector, signal, vector,
};
use crate::errors::to_python;
use crate::identify::interruptible;
use crate::model::Model;
use crate::plotting::plot;
use crate::record::Record;
use gpi_core::Matrix;
use gpi_core::identify::{self as core, NoiseMethod, RefineOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// How a model was refined, and how sure its parameters are.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
/// >>> [row["name"] for row in model.refinement.parameters[:2]]
/// ['u.weights[0]', 'u.weights[1]']
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Refinement {
    pub(crate) refinement: core::Refinement,
}

impl Refinement {
    /// (outputs, inputs).
    fn shape(&self) -> (usize, usize) {
        self.refinement.bands.shape()
    }
}

#[pymethods]
impl Refinement {
    /// How it ended, ``converged``, ``stalled`` (no shorter step helps) or ``limit`` (of steps).
    #[getter]
    fn status(&self) -> &'static str {
        self.refinement.status.name()
    }

    /// Root mean square residual at the start and after every accepted step, shape (steps + 1,), in the output's unit
    /// (outputs are balanced by their residuals where there are several).
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.refinement.history)
    }

    /// Every estimated parameter, rows of ``name``, ``value`` and ``std``, both in the parameter's own unit.
    ///
    /// ``std`` is None where the data do not determine the parameter, and 0 for a weight at its bound.
    /// Weights and half-widths are numbered as in ``model.hysteresis[i].plays``, deadzones as in its
    /// ``envelope``. ``section[i].a1`` and so on belong to G in parallel sections
    /// ``(b1 z + b2 + ..) / (z^2 + a1 z + a2)``; see ``poles`` for what they mean.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let row = |parameter: &core::Parameter| {
            let row = PyDict::new(py);
            row.set_item("name", &parameter.name)?;
            row.set_item("value", parameter.value)?;
            row.set_item("std", Some(parameter.deviation).filter(|std| std.is_finite()))?;
            Ok(row)
        };
        self.refinement.parameters.iter().map(row).collect()
    }

    /// Covariance of ``parameters``, (T5) in the theory, shape (parameters, parameters), each in the product of two units.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_matrix(py, &self.refinement.covariance)
    }

    /// Combinations of parameters that the data do not determine, largest share first.
    ///
    /// Lists of name and share, a pure number of either sign.
    #[getter]
    fn undetermined(&self) -> Vec<Vec<(String, f64)>> {
        self.refinement.undetermined.clone()
    }

    /// Root mean square residual of each output on the training data, shape (outputs,), in its unit.
    #[getter]
    fn residual_rms<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.refinement.residual_rms)
    }

    /// Measured minus simulated output of each experiment, each (samples, outputs), in the outputs' units, with the
    /// starts that were fitted.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.refinement.residuals.iter().map(|residual| from_matrix(py, residual)).collect()
    }

    /// The noise of each output, (T6) in the theory where the input repeats.
    ///
    /// ``rms`` (list, in the outputs' units), ``how`` (``repeated-periods``, ``rests`` or ``high-frequency-residual``), and
    /// ``period`` (in samples) or ``samples`` that it rests on.
    #[getter]
    fn noise_floor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let floor = &self.refinement.noise_floor;
        let result = PyDict::new(py);
        result.set_item("rms", floor.rms.clone())?;
        result.set_item("how", floor.method.name())?;
        match floor.method {
            NoiseMethod::RepeatedPeriods { period } => result.set_item("period", period)?,
            NoiseMethod::Rests { samples } => result.set_item("samples", samples)?,
            NoiseMethod::HighFrequencyResidual => {}
        }
        Ok(result)
    }

    /// Isolated outliers in the residual.
    #[getter]
    fn outliers(&self) -> usize {
        self.refinement.outliers
    }

    /// Whether Huber's loss was used.
    #[getter]
    fn robust(&self) -> bool {
        self.refinement.robust
    }

    /// Poles of G without its dead time's, and how far they may be off.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray of complex, each of shape (n,)
    ///     The poles, and the standard deviations of their real parts (in the real part) and imaginary parts (in the
    ///     imaginary part); no unit.
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let poles = self.refinement.bands.poles().map_err(to_python)?;
        Ok((from_complex(py, poles.poles), from_complex(py, poles.deviations)))
    }

    /// Standard deviations of the first Markov parameters of G.
    ///
    /// Parameters
    /// ----------
    /// count : int
    ///     How many Markov parameters.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (outputs, inputs, count)
    ///     In output units per unit of v.
    fn markov_std<'py>(&self, py: Python<'py>, count: usize) -> PyResult<Bound<'py, PyAny>> {
        let deviations = self.refinement.bands.markov_deviations(count).map_err(to_python)?;
        Ok(from_matrices(py, self.shape(), &deviations))
    }

    /// Standard deviations of the frequency response of G.
    ///
    /// Parameters
    /// ----------
    /// angles : array_like, shape (angles,)
    ///     w in radians per sample: 2 pi f / rate.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray, each of shape (angles, outputs, inputs)
    ///     Of ``ln |G|`` (no unit; times 8.686 in dB), and of the phase in radians.
    fn response_std<'py>(
        &self,
        angles: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = angles.py();
        let angles = vector("angles", angles)?;
        let found =
            py.detach(|| self.refinement.bands.response_deviations(&angles)).map_err(to_python)?;
        let stack = |part: fn(&core::ResponseDeviation) -> &Matrix| {
            let values: Vec<Matrix> = found.iter().map(|at| part(at).clone()).collect();
            from_matrices(py, self.shape(), &values).call_method1("transpose", (2, 0, 1))
        };
        Ok((stack(|at| &at.log_magnitude)?, stack(|at| &at.phase)?))
    }

    /// Standard deviations of the intermediate signal v that u leads to from rest.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shaped like u
    ///     In the unit of v.
    fn loop_std<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let found = self.refinement.bands.loop_deviations(&input).map_err(to_python)?;
        Ok(from_signal(u.py(), found, one_dimensional))
    }

    /// Draws the residual over the steps; see ``gpi_hammerstein.plot.history``.
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
        plot("history", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        format!(
            "Refinement({}, {} parameters, rms {:.4e} -> {:.4e})",
            self.refinement.status.name(),
            self.refinement.parameters.len(),
            self.refinement.history.first().copied().unwrap_or(f64::NAN),
            self.refinement.history.last().copied().unwrap_or(f64::NAN)
        )
    }
}

/// Refines all parts of a model at once on a record.
///
/// Levenberg-Marquardt on the simulation error, free run from the input alone, (T3) in the theory, with respect to play and
/// deadzone weights, poles and zeros of G, the offset, and the start of experiments whose past is
/// unknown. G keeps its DC gain and the half-widths the scale of the envelope. ``identify`` ends with it.
///
/// Parameters
/// ----------
/// model : Model
///     Where to start.
/// record : Record
///     Training data.
/// thresholds : bool
///     Let the thresholds of the deadzones move; they stay on their side of zero.
/// half_widths : bool
///     Let the half-widths of the plays move; the widest stays and sets the scale.
/// robust : bool, optional
///     Huber's loss instead of squares; when left out, it is used if the residual has isolated outliers.
/// offset_knots : int
///     Knots of a slowly varying offset of each experiment; the model keeps its mean.
/// progress : callable, optional
///     Called with a stage's name and the fraction done; an exception stops the work.
///
/// Returns
/// -------
/// Model
///     With ``model.refinement``.
///
/// Raises
/// ------
/// DataError
///     Channels that differ, constant signals, fewer samples than parameters.
/// ParameterError
///     A record at another rate, an unstable model.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.multisine(4000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> y = np.convolve(gpi.PlayBank([0, 2.0], [1.0, 0.5])(u), [0.0, 0.7, 0.3])[:4000]
/// >>> record = gpi.Record(u, y, rate=1000.0, warmup=100)
/// >>> model = gpi.identify(record, half_widths=[0, 2], thresholds=0)
/// >>> refined = gpi.refine(model, record)
/// >>> refined.refinement.status in ("converged", "stalled")
/// True
#[pyfunction]
#[pyo3(signature = (model, record, *, thresholds = false, half_widths = false, robust = None,
    offset_knots = 1, progress = None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of the Python function")]
fn refine(
    py: Python<'_>,
    model: &Model,
    record: &Record,
    thresholds: bool,
    half_widths: bool,
    robust: Option<bool>,
    offset_knots: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Model> {
    let options = RefineOptions { thresholds, half_widths, robust, offset_knots };
    let (start, record) = (&model.model, &record.record);
    let (refined, refinement) =
        interruptible(py, progress, |report| core::refine(start, record, &options, report))?;
    let refinement = Some(Py::new(py, Refinement { refinement })?);
    Ok(Model { model: refined, identification: None, refinement })
}

/// Derivatives of a model's simulated output by everything that ``refine`` moves.
///
/// G is held to its DC gain: the element of D that belongs to an input's largest DC gain makes up for
/// changes of ``section[i]`` and ``feedthrough``. All derivatives are held in memory.
///
/// Parameters
/// ----------
/// model : Model
///     Where to take them.
/// record : Record
///     Input, and output for the gradient.
/// thresholds, half_widths : bool
///     Whether these are among the parameters.
/// offset_knots : int
///     As in ``refine``.
///
/// Returns
/// -------
/// dict
///     ``names``; ``values``, shape (parameters,), each in its own unit; ``jacobians``, one an experiment, each
///     (outputs, scored samples, parameters), in output units per unit of the parameter; ``gradient``, shape
///     (parameters,), half that of ``cost``; ``hessian``, shape (parameters, parameters), J^T J; ``cost``, the
///     sum of the squares of the residuals.
///
/// Raises
/// ------
/// DataError, ParameterError
///     As in ``refine``.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> y = np.convolve(gpi.PlayBank([0, 2.0], [1.0, 0.5])(u), [0.0, 0.7, 0.3])[:2000]
/// >>> record = gpi.Record(u, y, rate=1000.0, warmup=100)
/// >>> model = gpi.identify(record, half_widths=[0, 2], thresholds=0)
/// >>> found = gpi.sensitivities(model, record)
/// >>> found["jacobians"][0].shape == (1, 1900, len(found["names"]))
/// True
#[pyfunction]
#[pyo3(signature = (model, record, *, thresholds = false, half_widths = false, offset_knots = 1))]
fn sensitivities<'py>(
    py: Python<'py>,
    model: &Model,
    record: &Record,
    thresholds: bool,
    half_widths: bool,
    offset_knots: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let options = RefineOptions { thresholds, half_widths, robust: None, offset_knots };
    let (model, record) = (&model.model, &record.record);
    let found =
        interruptible(py, None, |report| core::sensitivities(model, record, &options, report))?;
    let result = PyDict::new(py);
    result.set_item("names", &found.names)?;
    result.set_item("values", from_vector(py, &found.values))?;
    let jacobians = found.jacobians.iter().map(|outputs| {
        let shape = outputs[0].shape();
        from_matrices(py, shape, outputs).call_method1("transpose", (2, 0, 1))
    });
    result.set_item("jacobians", jacobians.collect::<PyResult<Vec<_>>>()?)?;
    result.set_item("gradient", from_vector(py, found.gradient.as_slice()))?;
    result.set_item("hessian", from_matrix(py, &found.hessian))?;
    result.set_item("cost", found.cost)?;
    Ok(result)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Refinement>()?;
    module.add_function(wrap_pyfunction!(refine, module)?)?;
    module.add_function(wrap_pyfunction!(sensitivities, module)?)
}
