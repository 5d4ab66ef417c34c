//! How a model was refined, and the uncertainty of its parameters.

use crate::arrays::{
    from_complex, from_matrices, from_matrix, from_signal, from_vector, signal, vector,
};
use crate::errors::{parameter, to_python};
use crate::plotting::plot;
use gpi_core::identify as core;
use gpi_core::{Estimate, Estimates, Matrix};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// How a model was refined, and the uncertainty of its parameters.
///
/// A model file contains ``status``, ``parameters``, ``undetermined``, ``residual_rms``, ``noise_floor``, ``outliers`` and
/// ``robust``. For a model that was loaded or unpickled, ``history``, ``covariance``, ``residuals``, ``poles``,
/// ``markov_std``, ``response_std`` and ``loop_std`` raise a ``ParameterError``; ``gpi.refine`` computes them again from the
/// record.
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
    /// What model files contain.
    estimates: Estimates,
    /// All of it, for a model that was not loaded.
    refinement: Option<core::Refinement>,
}

impl Refinement {
    /// The refinement of a model.
    pub(crate) fn new(model: &gpi_core::Model, refinement: core::Refinement) -> PyResult<Self> {
        let estimates = match model.estimates() {
            Some(estimates) => estimates.clone(),
            None => refinement.estimates(model).map_err(to_python)?,
        };
        Ok(Self { estimates, refinement: Some(refinement) })
    }

    /// What the file of a model contains of its refinement.
    pub(super) fn saved(model: &gpi_core::Model) -> Option<Self> {
        model.estimates().map(|estimates| Self { estimates: estimates.clone(), refinement: None })
    }

    /// What only a refinement that was not loaded has; `name` is what is asked for.
    fn whole(&self, name: &str) -> PyResult<&core::Refinement> {
        self.refinement.as_ref().ok_or_else(|| {
            parameter(format!(
                "`{name}` is not saved in model files; refine the model on its record (gpi.refine) to compute it again"
            ))
        })
    }

    /// (outputs, inputs).
    fn shape(whole: &core::Refinement) -> (usize, usize) {
        whole.bands.shape()
    }
}

/// An estimate as a dictionary.
pub(super) fn estimate<'py>(py: Python<'py>, one: &Estimate) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("name", &one.name)?;
    row.set_item("value", one.value)?;
    row.set_item("std", one.std)?;
    row.set_item("unit", &one.unit)?;
    row.set_item("determined", one.determined)?;
    Ok(row)
}

#[pymethods]
impl Refinement {
    /// How the optimization ended: ``converged``, ``stalled`` (no step reduces the cost) or ``limit`` (of the number of steps).
    #[getter]
    fn status(&self) -> &str {
        &self.estimates.status
    }

    /// Whether history, covariance, residuals and uncertainty bands are there. Model files do not contain them.
    #[getter]
    fn complete(&self) -> bool {
        self.refinement.is_some()
    }

    /// Root mean square residual at the start and after every accepted step, shape (steps + 1,), in the output's unit. Several
    /// outputs are weighted by their residuals.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_vector(py, &self.whole("history")?.history))
    }

    /// The estimated parameters: rows of ``name``, ``value`` and ``std``, both in ``unit``, and ``determined``.
    ///
    /// ``std`` is None if the parameter is unidentifiable, and 0 for a weight at its bound. ``unit`` is empty for a pure number
    /// or if it is unknown. ``determined`` is False if the parameter is unidentifiable, and for weights and coefficients of
    /// numerators, whose zero means absence, if the 95 % interval ``value ± 1.96 std`` holds zero. Weights and half-widths are
    /// numbered as in ``model.hysteresis[i].plays``, deadzones as in its ``envelope``. ``section[i].a1`` and so on are the
    /// coefficients of G, written as a sum of parallel sections ``(b1 z + b2 + ..) / (z^2 + a1 z + a2)``; ``poles`` is easier
    /// to interpret.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.estimates.parameters.iter().map(|one| estimate(py, one)).collect()
    }

    /// Covariance of ``parameters``, (T5) in the theory, shape (parameters, parameters), each in the product of two units.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(from_matrix(py, &self.whole("covariance")?.covariance()))
    }

    /// Unidentifiable parameters: the linear combinations of parameters that the data do not determine.
    ///
    /// Each combination is a list of pairs of name and coefficient (a pure number of either sign), the largest coefficient first.
    #[getter]
    fn undetermined(&self) -> Vec<Vec<(String, f64)>> {
        self.estimates.undetermined.clone()
    }

    /// Root mean square residual of each output on the training data, shape (outputs,), in its unit.
    #[getter]
    fn residual_rms<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.estimates.residual_rms)
    }

    /// Measured minus simulated output of each experiment, each (samples, outputs), in the outputs' units. The simulation
    /// starts from the estimated initial states.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let residuals = &self.whole("residuals")?.residuals;
        Ok(residuals.iter().map(|residual| from_matrix(py, residual)).collect())
    }

    /// The noise floor of each output; (T6) in the theory if the input is periodic.
    ///
    /// ``rms`` (list, in the outputs' units), ``how`` (``repeated-periods``, ``rests`` or ``high-frequency-residual``), and the
    /// ``period`` (in samples) or the number of ``samples`` from which it was estimated.
    #[getter]
    fn noise_floor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let floor = &self.estimates.noise_floor;
        let result = PyDict::new(py);
        result.set_item("rms", floor.rms.clone())?;
        result.set_item("how", &floor.how)?;
        for (name, count) in [("period", floor.period), ("samples", floor.samples)] {
            if let Some(count) = count {
                result.set_item(name, count)?;
            }
        }
        Ok(result)
    }

    /// Number of isolated outliers in the residual.
    #[getter]
    fn outliers(&self) -> usize {
        self.estimates.outliers
    }

    /// Whether Huber's loss was used.
    #[getter]
    fn robust(&self) -> bool {
        self.estimates.robust
    }

    /// Poles of G without those of its dead time, and their standard deviations.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray of complex, each of shape (n,)
    ///     The poles, and the standard deviations of their real parts (in the real part) and imaginary parts (in the
    ///     imaginary part); no unit.
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let poles = self.whole("poles")?.bands.poles().map_err(to_python)?;
        Ok((from_complex(py, poles.poles), from_complex(py, poles.deviations)))
    }

    /// Standard deviations of the first Markov parameters of G.
    ///
    /// Parameters
    /// ----------
    /// count : int
    ///     Number of Markov parameters.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (outputs, inputs, count)
    ///     The standard deviations, in output units per unit of v.
    fn markov_std<'py>(&self, py: Python<'py>, count: usize) -> PyResult<Bound<'py, PyAny>> {
        let whole = self.whole("markov_std")?;
        let deviations = whole.bands.markov_deviations(count).map_err(to_python)?;
        Ok(from_matrices(py, Self::shape(whole), &deviations))
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
    ///     The standard deviations of ``ln |G|`` (no unit; times 8.686 in dB) and of the phase in radians.
    fn response_std<'py>(
        &self,
        angles: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = angles.py();
        let angles = vector("angles", angles)?;
        let whole = self.whole("response_std")?;
        let found = py.detach(|| whole.bands.response_deviations(&angles)).map_err(to_python)?;
        let stack = |part: fn(&core::ResponseDeviation) -> &Matrix| {
            let values: Vec<Matrix> = found.iter().map(|at| part(at).clone()).collect();
            from_matrices(py, Self::shape(whole), &values).call_method1("transpose", (2, 0, 1))
        };
        Ok((stack(|at| &at.log_magnitude)?, stack(|at| &at.phase)?))
    }

    /// Standard deviations of the intermediate signal v for the input u, from rest.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shaped like u
    ///     The standard deviations, in the unit of v.
    fn loop_std<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let found = self.whole("loop_std")?.bands.loop_deviations(&input).map_err(to_python)?;
        Ok(from_signal(u.py(), found, one_dimensional))
    }

    /// Draws the residual over the steps; see ``gpi_hammerstein.plot.history``.
    ///
    #[doc = include_str!("../docs/plot.txt")]
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("history", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        let count = self.estimates.parameters.len();
        let rms = self.refinement.as_ref().map_or_else(String::new, |whole| {
            let at = |place: Option<&f64>| place.copied().unwrap_or(f64::NAN);
            let (first, last) = (at(whole.history.first()), at(whole.history.last()));
            format!(", rms {first:.4e} -> {last:.4e}")
        });
        format!("Refinement({}, {count} parameters{rms})", self.estimates.status)
    }
}
