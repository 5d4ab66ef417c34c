//! A drive that makes the outputs follow a reference.

use crate::arrays::{from_signal, from_vector, signal, vector};
use crate::channels::{names, units};
use crate::errors::{parameter, to_python};
use crate::figures::figures;
use crate::model::read_state;
use crate::plotting::plot;
use gpi_core::Channel;
use gpi_core::compensate::{CompensateOptions, Compensation as Found, Start};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A drive that makes a model's outputs follow a reference, see ``Model.compensate``.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
/// >>> found = model.compensate(5.0 + np.sin(0.1 * np.arange(200)))
/// >>> found.error["rms"] < 1e-9, found.drive.shape, found.lead
/// (True, (200,), 0)
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Compensation {
    found: Found,
    rate: f64,
    outputs: Vec<Channel>,
    one_dimensional: bool,
}

#[pymethods]
impl Compensation {
    /// Time of each sample of the drive in s, shape (lead + samples,). The reference begins at 0.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        let lead = self.found.lead as f64;
        let rows = self.found.drive.nrows();
        let time: Vec<f64> = (0..rows).map(|k| (k as f64 - lead) / self.rate).collect();
        from_vector(py, &time)
    }

    /// Names of the outputs.
    #[getter]
    fn output_names(&self) -> Vec<String> {
        names(&self.outputs)
    }

    /// Units of the outputs.
    #[getter]
    fn output_units(&self) -> Vec<String> {
        units(&self.outputs)
    }

    /// The drive u, shape (lead + samples,) or (lead + samples, inputs), in the inputs' units.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_signal(py, self.found.drive.clone(), self.one_dimensional)
    }

    /// The reference, preceded by its first value during the lead; the shape of the drive, in the outputs' units.
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_signal(py, self.found.reference.clone(), self.one_dimensional)
    }

    /// The outputs that the model predicts, without the effects that no input drives; the shape of the drive, in the
    /// outputs' units.
    #[getter]
    fn predicted<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_signal(py, self.found.predicted.clone(), self.one_dimensional)
    }

    /// Number of samples by which the drive begins before the reference.
    #[getter]
    fn lead(&self) -> usize {
        self.found.lead
    }

    /// Error of the inversion, the reference minus ``predicted``, without the lead: what the model itself leaves. See
    /// ``expected_error`` for the error of the stage.
    ///
    /// The figures are those of ``Model.error``: ``rms`` and ``max`` in the output's unit, ``nrmse``, ``fit_percent``.
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figures(py, &self.found.error)
    }

    /// The error of the true output that is to be expected after the lead, without the noise of the sensor, (T11) in the theory.
    ///
    /// ``rms`` over all outputs; ``bound``, which 95 % of the errors at the worst sample do not exceed; ``parts``: ``inversion``,
    /// ``parameters``, ``model`` and ``past``, whose squares add up to that of ``rms``; ``missing``, the names of the parts that
    /// are None because the model does not know its own uncertainty: ``rms`` is too small then. All in the output's unit.
    #[getter]
    fn expected_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let expected = &self.found.expected_error;
        let parts = PyDict::new(py);
        parts.set_item("inversion", expected.inversion)?;
        parts.set_item("parameters", expected.parameters)?;
        parts.set_item("model", expected.model)?;
        parts.set_item("past", expected.past)?;
        let result = PyDict::new(py);
        result.set_item("rms", expected.rms)?;
        result.set_item("bound", expected.bound)?;
        result.set_item("parts", parts)?;
        result.set_item("missing", expected.missing())?;
        Ok(result)
    }

    /// The outputs that the model predicts without compensation: for the drive that is a static curve of the reference, the
    /// polynomial of degree 5 that comes nearest to ``drive``; in the outputs' units, the shape of the drive.
    #[getter]
    fn static_curve<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_signal(py, self.found.static_curve.clone(), self.one_dimensional)
    }

    /// Error without compensation, the reference minus ``static_curve``, with the figures of ``error`` (``rms`` and ``max`` in the
    /// output's unit).
    #[getter]
    fn error_static_curve<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figures(py, &self.found.error_static_curve)
    }

    /// Root mean square error after each pass, in the output's unit, shape (passes,).
    #[getter]
    fn passes<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.found.passes)
    }

    /// Number of samples at which a drive is clamped to a limit because the reference is out of reach.
    #[getter]
    fn out_of_reach(&self) -> usize {
        self.found.out_of_reach
    }

    /// Number of samples at which the slew limit holds a drive back.
    #[getter]
    fn too_fast(&self) -> usize {
        self.found.too_fast
    }

    /// Names of the model's effects that the drive compensates.
    #[getter]
    fn compensated(&self) -> Vec<&'static str> {
        self.found.compensated.clone()
    }

    /// Names of the model's effects that no drive compensates, with the reason.
    #[getter]
    fn left(&self) -> Vec<(&'static str, &'static str)> {
        self.found.left.clone()
    }

    /// Draws the predicted output over the reference; see ``gpi_hammerstein.plot.compensation``.
    ///
    #[doc = include_str!("../docs/plot.txt")]
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("compensation", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        let (error, before) = (self.found.expected_error.rms, self.found.error_static_curve.rms);
        let mut held = String::new();
        for (count, what) in
            [(self.found.out_of_reach, "at a limit"), (self.found.too_fast, "held back")]
        {
            if count > 0 {
                held += &format!(", {count} {what}");
            }
        }
        format!(
            "Compensation({} samples{held}, expected rms error {error:.3e}, static curve {before:.3e})",
            self.found.drive.nrows()
        )
    }
}

/// The drive of `Model.compensate`.
pub(crate) fn compensate(
    py: Python<'_>,
    model: &gpi_core::Model,
    reference: &Bound<'_, PyAny>,
    options: &CompensateOptions,
) -> PyResult<Compensation> {
    let (reference, one_dimensional) = signal("reference", reference)?;
    let found = py.detach(|| model.compensate(&reference, options)).map_err(to_python)?;
    let outputs = model.outputs().to_vec();
    Ok(Compensation { found, rate: model.rate(), outputs, one_dimensional })
}

/// A pair of limits for all inputs, or a list of pairs.
pub(crate) fn read_limits(limits: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<(f64, f64)>> {
    let Some(limits) = limits else { return Ok(Vec::new()) };
    if let Ok(pair) = limits.extract::<(f64, f64)>() {
        return Ok(vec![pair]);
    }
    let message = "`limits` must be a pair of numbers, or a list of such pairs";
    limits.extract().map_err(|_| parameter(message.to_owned()))
}

/// Where the stage stands before the drive begins: the input at rest, with a measured output or with a state.
pub(crate) fn read_start(
    model: &gpi_core::Model,
    start: Option<&Bound<'_, PyAny>>,
    output: Option<f64>,
    state: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<Start>> {
    let Some(start) = start else {
        let alone = [("start_output", output.is_some()), ("start_state", state.is_some())];
        return match alone.into_iter().find(|(_, given)| *given) {
            Some((name, _)) => {
                let message = format!("`{name}` needs `start`, the input at which the stage rests");
                Err(parameter(message))
            }
            None => Ok(None),
        };
    };
    let input = match start.extract::<f64>() {
        Ok(input) => vec![input],
        Err(_) => vector("start", start)?,
    };
    match (output, state) {
        (Some(_), Some(_)) => {
            let message = "`start_output` and `start_state` exclude each other; give one of them";
            Err(parameter(message.to_owned()))
        }
        (Some(output), None) => match input[..] {
            [input] => Ok(Some(Start::Output { input, output })),
            _ => {
                let message = "`start_output` needs a model of one input; give `start_state`";
                Err(parameter(message.to_owned()))
            }
        },
        (None, Some(state)) => {
            let state = read_state(model, &vector("start_state", state)?)?;
            Ok(Some(Start::State { input, state }))
        }
        (None, None) => Ok(Some(Start::Input(input))),
    }
}
