//! Models, and how they were identified and refined. The docstrings of a model's methods stand in `docs/model`.

mod effects;
mod identification;
mod on_record;
mod refinement;
mod state;

pub(crate) use identification::Identification;
pub(crate) use refinement::Refinement;
pub(crate) use state::read as read_state;

use crate::arrays::{from_matrix, from_signal, from_vector, signal, vector};
use crate::calls;
use crate::channels::{label, names, units};
use crate::compensate::{self, Compensation, Compensator};
use crate::errors::to_python;
use crate::figures::figures;
use crate::linear::StateSpace;
use crate::operators::Gpi;
use crate::plotting::in_notebook;
use crate::progress::interruptible;
use crate::record::Record;
use gpi_core::compensate::CompensateOptions;
use gpi_core::identify::{functions_of_time, on_another_record, over_horizons};
use gpi_core::{Matrix, SimulationError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A Hammerstein model: ``y = G(q) P[D[u]] + offset``, one hysteresis per input.
///
/// Models are returned by ``identify``, ``refine``, ``load`` and ``Model.from_json``.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
/// >>> model
/// Model(u -> y, 1 deadzones, 2 plays, linear order 0, 1000 Hz)
/// >>> model.error(record)["fit_percent"] > 99
/// True
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Model {
    pub(crate) model: gpi_core::Model,
    pub(crate) identification: Option<Py<Identification>>,
    pub(crate) refinement: Option<Py<Refinement>>,
}

#[pymethods]
impl Model {
    /// Sampling rate in Hz.
    #[getter]
    fn rate(&self) -> f64 {
        self.model.rate()
    }

    /// The hysteresis of each input.
    #[getter]
    fn hysteresis(&self) -> Vec<Gpi> {
        self.model.hysteresis().iter().map(|h| Gpi { hysteresis: h.clone() }).collect()
    }

    /// The linear dynamics G, of unit DC gain where one input drives one output.
    #[getter]
    fn linear(&self) -> StateSpace {
        self.model.linear().clone().into()
    }

    /// Constant term of each output, shape (outputs,), in its unit.
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, self.model.offsets())
    }

    /// Names of the inputs.
    #[getter]
    fn input_names(&self) -> Vec<String> {
        names(self.model.inputs())
    }

    /// Names of the outputs.
    #[getter]
    fn output_names(&self) -> Vec<String> {
        names(self.model.outputs())
    }

    /// Units of the inputs, empty where unknown.
    #[getter]
    fn input_units(&self) -> Vec<String> {
        units(self.model.inputs())
    }

    /// Units of the outputs, empty where unknown.
    #[getter]
    fn output_units(&self) -> Vec<String> {
        units(self.model.outputs())
    }

    /// How the model was identified; None for a model that was loaded.
    #[getter]
    fn identification(&self, py: Python<'_>) -> Option<Py<Identification>> {
        self.identification.as_ref().map(|identification| identification.clone_ref(py))
    }

    /// How the model was refined, and the uncertainty of its parameters; None for a model without refinement.
    ///
    /// A model that was loaded or unpickled has the parts that model files contain, see ``Refinement``.
    #[getter]
    fn refinement(&self, py: Python<'_>) -> Option<Py<Refinement>> {
        self.refinement.as_ref().map(|refinement| refinement.clone_ref(py))
    }

    /// The effects of the model, in the order of the signal chain.
    ///
    /// Rows of ``name`` and ``parameters``. These are rows of ``name``, ``value`` and ``std`` in ``unit`` (empty for a pure
    /// number), and ``determined``, as in ``Refinement.parameters``; ``std`` is None if it is unknown.
    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        effects::rows(py, &self.model)
    }

    /// Names of the effects that are functions of the time of the record that the model was fitted to.
    ///
    /// They say nothing of another record, see ``on_another_record``.
    #[getter]
    fn functions_of_time(&self) -> Vec<&'static str> {
        functions_of_time(&self.model)
    }

    #[doc = include_str!("../docs/model/on_another_record.txt")]
    #[pyo3(signature = (record, *, fit_start = true, remove_mean = false))]
    fn on_another_record<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
        fit_start: bool,
        remove_mean: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let record = calls::record("record", record, "model.on_another_record(")?;
        let (model, record) = (&self.model, &record.get().record);
        let found =
            interruptible(py, None, |report| on_another_record(model, record, fit_start, report))?;
        let result = PyDict::new(py);
        result.set_item("error", figures(py, &found.error(record, remove_mean))?)?;
        result.set_item("left_out", found.left_out)?;
        let model = Self { model: found.model, identification: None, refinement: None };
        result.set_item("model", Py::new(py, model)?)?;
        Ok(result)
    }

    #[doc = include_str!("../docs/model/over_horizons.txt")]
    fn over_horizons<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
        horizon: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let record = calls::record("record", record, "model.over_horizons(")?;
        let (model, record) = (&self.model, &record.get().record);
        let found =
            interruptible(py, None, |report| over_horizons(model, record, horizon, report))?;
        figures(py, &found)
    }

    #[doc = include_str!("../docs/model/simulate.txt")]
    #[pyo3(signature = (u, *, covariates = None))]
    fn simulate<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        covariates: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Ok(record) = u.cast::<Record>() {
            return self.simulate_record(u.py(), record.get(), covariates.is_some());
        }
        let (input, one_dimensional) = signal("u", u)?;
        let columns = match covariates {
            None => Matrix::zeros(input.nrows(), 0),
            Some(columns) => signal("covariates", columns)?.0,
        };
        // arrays have no column names
        self.model.require_covariates(&vec![""; columns.ncols()]).map_err(to_python)?;
        let output = self.model.simulate_beside(&input, &columns).map_err(to_python)?;
        Ok(from_signal(u.py(), output, one_dimensional))
    }

    #[doc = include_str!("../docs/model/intermediate.txt")]
    fn intermediate<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let v = self.model.intermediate(&input).map_err(to_python)?;
        Ok(from_signal(u.py(), v, one_dimensional))
    }

    #[doc = include_str!("../docs/model/start.txt")]
    fn start<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let state = self.model.start(&vector("u", u)?).map_err(to_python)?;
        Ok(from_vector(u.py(), &state::write(&state)))
    }

    #[doc = include_str!("../docs/model/run.txt")]
    fn run<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        state: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (input, one_dimensional) = signal("u", u)?;
        let mut state = state::read(&self.model, &vector("state", state)?)?;
        let output = self.model.simulate_from(&mut state, &input).map_err(to_python)?;
        let py = u.py();
        Ok((from_signal(py, output, one_dimensional), from_vector(py, &state::write(&state))))
    }

    #[doc = include_str!("../docs/model/error.txt")]
    #[pyo3(signature = (record, *, remove_mean = false, fit_start = false))]
    fn error<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
        remove_mean: bool,
        fit_start: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let record = calls::record("record", record, "model.error(")?;
        let residuals = self.residuals(py, record.get(), fit_start)?;
        figures(py, &SimulationError::of(&record.get().record, &residuals, remove_mean))
    }

    #[doc = include_str!("../docs/model/compensate.txt")]
    #[pyo3(signature = (reference, *, limits = None, slew = None, quasi_static = false, preview = None, passes = 20,
        start = None, start_output = None, start_state = None))]
    fn compensate(
        &self,
        py: Python<'_>,
        reference: &Bound<'_, PyAny>,
        limits: Option<&Bound<'_, PyAny>>,
        slew: Option<f64>,
        quasi_static: bool,
        preview: Option<usize>,
        passes: usize,
        start: Option<&Bound<'_, PyAny>>,
        start_output: Option<f64>,
        start_state: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Compensation> {
        let slew = slew.unwrap_or(f64::INFINITY);
        let limits = compensate::read_limits(limits)?;
        let start = compensate::read_start(&self.model, start, start_output, start_state)?;
        let options = CompensateOptions { limits, slew, quasi_static, preview, passes, start };
        compensate::compensate(py, &self.model, reference, &options)
    }

    #[doc = include_str!("../docs/model/compensator.txt")]
    #[pyo3(signature = (*, limits = None))]
    fn compensator(&self, limits: Option<(f64, f64)>) -> PyResult<Compensator> {
        let limits = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        self.model.compensator(limits).map(Compensator::new).map_err(to_python)
    }

    #[doc = include_str!("../docs/model/residual.txt")]
    #[pyo3(signature = (record, *, fit_start = false))]
    fn residual<'py>(
        &self,
        py: Python<'py>,
        record: &Bound<'py, PyAny>,
        fit_start: bool,
    ) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let record = calls::record("record", record, "model.residual(")?;
        let residuals = self.residuals(py, record.get(), fit_start)?;
        Ok(residuals.iter().map(|residual| from_matrix(py, residual)).collect())
    }

    #[doc = include_str!("../docs/model/compare.txt")]
    #[pyo3(signature = (record, *, fit_start = true, remove_mean = false))]
    fn compare<'py>(
        slf: &Bound<'py, Self>,
        record: &Bound<'py, PyAny>,
        fit_start: bool,
        remove_mean: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let record = calls::record("record", record, "model.compare(")?;
        let options = PyDict::new(py);
        options.set_item("fit_start", fit_start)?;
        options.set_item("remove_mean", remove_mean)?;
        let module = py.import("gpi_hammerstein.compared")?;
        module.call_method("compare", (slf, record), Some(&options))
    }

    /// The parameters of the model with their values and standard deviations, a list of ``Parameter``.
    ///
    /// First come the parameters of a refinement, as in ``Refinement.parameters``; for a model without one, the weights,
    /// half-widths, thresholds and offsets with unknown standard deviations. Then come those of the effects.
    #[getter]
    fn parameters<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("gpi_hammerstein.summary")?.call_method1("parameters", (slf,))
    }

    /// The model as a text table: structure, fit, parameters with their standard deviations, poles, effects.
    ///
    /// Returns
    /// -------
    /// Summary
    ///     A text, which ``print`` and a notebook show as a table.
    fn summary<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("gpi_hammerstein.summary")?.call_method1("summary", (slf,))
    }

    #[doc = include_str!("../docs/model/loop_steps.txt")]
    fn loop_steps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let steps = self.model.loop_steps().map_err(to_python)?;
        steps.iter().map(|step| state::write_loop_step(py, step)).collect()
    }

    #[doc = include_str!("../docs/model/to_json.txt")]
    fn to_json(&self) -> PyResult<String> {
        self.model.to_json().map_err(to_python)
    }

    #[doc = include_str!("../docs/model/from_json.txt")]
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        let model = gpi_core::Model::from_json(text).map_err(to_python)?;
        let refinement = Refinement::saved(&model).map(|saved| Py::new(py, saved)).transpose()?;
        Ok(Self { model, identification: None, refinement })
    }

    #[doc = include_str!("../docs/model/save.txt")]
    fn save(slf: &Bound<'_, Self>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let files = slf.py().import("gpi_hammerstein.files")?;
        files.call_method1("save_model", (slf, path))?;
        Ok(())
    }

    #[doc = include_str!("../docs/model/plot.txt")]
    #[pyo3(signature = (record, ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        record: &Bound<'py, PyAny>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let options = PyDict::new(slf.py());
        options.set_item("ax", ax)?;
        let module = slf.py().import("gpi_hammerstein.plot")?;
        module.call_method("fit", (slf, record), Some(&options))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook("model", slf.as_any())
    }

    fn __repr__(&self) -> String {
        let bank = |h: &gpi_core::Hysteresis| {
            let (zones, plays) = (h.envelope().weights().len(), h.plays().weights());
            let are_stops = plays.iter().any(|&weight| weight < 0.0);
            let elements = if are_stops { "stops" } else { "plays" };
            format!("{zones} deadzones, {} {elements}", plays.len())
        };
        let hysteresis: Vec<String> = self.model.hysteresis().iter().map(bank).collect();
        format!(
            "Model({} -> {}, {}, linear order {}, {} Hz)",
            label(self.model.inputs()),
            label(self.model.outputs()),
            hysteresis.join("; "),
            self.model.linear().order(),
            self.model.rate()
        )
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Model>()?;
    module.add_class::<Identification>()?;
    module.add_class::<Refinement>()
}
