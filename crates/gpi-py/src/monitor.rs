//! The monitor of a machine.

use crate::arrays::signal;
use crate::errors::to_python;
use crate::model::Model;
use gpi_core::Matrix;
use gpi_core::monitor::{self, Change, Watched};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Tells whether a machine has changed since its model was made, from its input and output.
///
/// The model is simulated along with the machine. With the residual ``r(k) = y(k) - y_hat(k)``, and with
/// ``phi_i = dy_hat / dd_i`` for each possible change ``d_i`` (offset, gain, first resonance, width of the hysteresis), the
/// regression ``r(k) = sum_i d_i phi_i(k) + m(k) + w(k)`` is computed over windows of all lengths. ``w`` is the noise of
/// the training record, and ``m`` an error that is known to be possible: the misfit of the training record, the uncertainty of the
/// parameters, effects of time, and the unknown start. A change is noticed if two successive windows agree upon it, each by
/// more than chance and more than ``m``. The noise itself and sines in the residual are tested too.
///
/// The rate of false alarms is bounded by the sum over all tests, for Gaussian noise that is white.
///
/// Parameters
/// ----------
/// model : Model
///     The model of the machine.
/// noise : array_like of float, optional
///     Standard deviation of the noise of each output, in its unit. Default: that of the training record.
/// false_alarms_per_hour : float
///     The rate of false alarms: the count per hour of data.
///
/// Raises
/// ------
/// ParameterError
///     The model file does not contain the noise, and ``noise`` is not given; the noise is not positive; the rate is not
///     between 0 and 1000.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import gpi_hammerstein as gpi
/// >>> k = np.arange(6000)
/// >>> u = np.sin(0.031 * k) + np.cos(0.0071 * k)
/// >>> noise = 0.01 * np.random.default_rng(1).normal(size=(2, 6000))
/// >>> bank = gpi.PlayBank([0.0, 0.5], [1.0, 0.4])
/// >>> record = gpi.Record(u, bank(u) + noise[0], rate=100.0)
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 0.5], thresholds=0)
/// >>> monitor = gpi.Monitor(model)
/// >>> monitor.push(u, bank(u) + noise[1])
/// >>> monitor.changed
/// False
/// >>> monitor.push(u, 1.03 * bank(u) + noise[0])
/// >>> [(change["what"], round(change["size"]), change["unit"]) for change in monitor.changes]
/// [('gain', 3, '%')]
#[pyclass(module = "gpi_hammerstein")]
pub(super) struct Monitor {
    monitor: monitor::Monitor,
}

#[pymethods]
impl Monitor {
    #[new]
    #[pyo3(signature = (model, *, noise = None, false_alarms_per_hour = 1e-4))]
    fn new(model: &Model, noise: Option<Vec<f64>>, false_alarms_per_hour: f64) -> PyResult<Self> {
        let monitor = monitor::Monitor::new(&model.model, noise.as_deref(), false_alarms_per_hour);
        Ok(Self { monitor: monitor.map_err(to_python)? })
    }

    /// Counts the next samples.
    ///
    /// The first samples after the start or after ``end_experiment`` should be a second of data or more: the range of their
    /// input is taken for the range in which the machine has moved before.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    /// y : array_like, shape (samples,) or (samples, outputs)
    ///     Output, in its unit. A sample that is NaN is left out.
    /// covariates : array_like, shape (samples,) or (samples, covariates), optional
    ///     Other measured columns, if the model needs them, in their units.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     The number of channels differs from the model's, or the lengths differ.
    /// ParameterError
    ///     An input is not finite.
    #[pyo3(signature = (u, y, covariates = None))]
    fn push(
        &mut self,
        py: Python<'_>,
        u: &Bound<'_, PyAny>,
        y: &Bound<'_, PyAny>,
        covariates: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let ((input, _), (output, _)) = (signal("u", u)?, signal("y", y)?);
        let none = || Matrix::zeros(input.nrows(), 0);
        let covariates = match covariates {
            Some(columns) => signal("covariates", columns)?.0,
            None => none(),
        };
        py.detach(|| self.monitor.push(&input, &output, &covariates)).map_err(to_python)
    }

    /// Ends the current record. The next samples belong to another record of the same machine, whose start is unknown.
    fn end_experiment(&mut self) {
        self.monitor.end_experiment();
    }

    /// Whether a change was noticed.
    #[getter]
    fn changed(&self) -> bool {
        self.monitor.has_changed()
    }

    /// Names of what is tested.
    #[getter]
    fn watched(&self) -> Vec<&'static str> {
        self.monitor.watched()
    }

    /// Length of the data so far, in s.
    #[getter]
    fn seconds(&self) -> f64 {
        self.monitor.samples() as f64 / self.monitor.simulated().rate()
    }

    /// Time between two tests, in s.
    #[getter]
    fn period(&self) -> f64 {
        self.monitor.block() as f64 / self.monitor.simulated().rate()
    }

    /// The model that is simulated: without effects that are functions of the time of the training record.
    #[getter]
    fn model(&self) -> Model {
        let model = self.monitor.simulated().clone();
        Model { model, identification: None, refinement: None }
    }

    /// The limits of the tests: ``noise``, the standard deviation of each output's noise, in the output's unit; ``deviations``,
    /// the standard errors (a pure number) that a change must exceed in each of two windows; ``least_noise``, the smallest
    /// change of the noise that counts, a fraction of it; ``misfit``, the root mean square of the error of each output that may have
    /// any shape, in the output's unit; ``hidden``, that of a slow error that the training record may hide, in the output's
    /// unit; ``block``, a count: the samples between two tests.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let own = &self.monitor;
        let outputs = 0..own.noise().len();
        let misfit: Vec<f64> = outputs.clone().map(|output| own.misfit(output)).collect();
        let hidden: Vec<f64> = outputs.map(|output| own.hidden(output)).collect();
        let dict = PyDict::new(py);
        dict.set_item("noise", own.noise().to_vec())?;
        dict.set_item("deviations", own.deviations())?;
        dict.set_item("least_noise", own.least_noise())?;
        dict.set_item("misfit", misfit)?;
        dict.set_item("hidden", hidden)?;
        dict.set_item("block", own.block())?;
        Ok(dict)
    }

    /// What has changed, as the strongest evidence so far shows it: one dict for each quantity.
    ///
    /// ``what`` is ``offset``, ``gain``, ``resonance``, ``hysteresis-width``, ``noise`` or ``line``; ``channel`` the name of
    /// the channel. ``size`` is in ``unit``: that of the output for the offset and for the amplitude of a line (whose frequency
    /// is ``frequency_hz``), Hz for the resonance, % of the former value for the others. ``std`` is its standard deviation
    /// by the noise, None where it is not known. ``since_s`` is the time of the change in seconds of data. ``confidence`` is
    /// the probability that this quantity has changed and not another one in its place; ``instead`` lists those others whose
    /// probability is at least 0.05.
    #[getter]
    fn changes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let changes = self.monitor.changes();
        let dicts: PyResult<Vec<_>> = changes.iter().map(|own| self.dict_of(py, own)).collect();
        PyList::new(py, dicts?)
    }

    fn __repr__(&self) -> String {
        let state = if self.changed() { "changed" } else { "no change noticed" };
        format!("Monitor({} s of data: {state})", self.seconds())
    }
}

impl Monitor {
    fn dict_of<'py>(&self, py: Python<'py>, change: &Change) -> PyResult<Bound<'py, PyDict>> {
        let output = &self.monitor.simulated().outputs()[change.output];
        let (scale, unit) = match change.watched {
            Watched::Offset | Watched::Line { .. } => (1.0, output.unit.as_str()),
            Watched::Resonance { .. } => (1.0, "Hz"),
            _ => (100.0, "%"),
        };
        let channel = match change.watched {
            Watched::HysteresisWidth { input } => &self.monitor.simulated().inputs()[input],
            _ => output,
        };
        let frequency = match change.watched {
            Watched::Resonance { frequency } | Watched::Line { frequency } => Some(frequency),
            _ => None,
        };
        let dict = PyDict::new(py);
        dict.set_item("what", change.watched.name())?;
        dict.set_item("channel", &channel.name)?;
        dict.set_item("size", scale * change.size)?;
        dict.set_item("unit", unit)?;
        dict.set_item("std", change.std.map(|std| scale * std))?;
        dict.set_item("since_s", change.since)?;
        dict.set_item("confidence", change.confidence)?;
        let instead: Vec<_> = change.instead.iter().map(Watched::name).collect();
        dict.set_item("instead", instead)?;
        dict.set_item("frequency_hz", frequency)?;
        Ok(dict)
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Monitor>()
}
