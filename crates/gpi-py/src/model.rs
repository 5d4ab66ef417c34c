//! The identified model.

use crate::arrays::{from_matrix, from_signal, from_vector, signal, vector};
use crate::compensate::{self, Compensation};
use crate::compensator::Compensator;
use crate::errors::{parameter, to_python};
use crate::identification::Identification;
use crate::identify::interruptible;
use crate::operators::{Gpi, read_state, write_state};
use crate::plotting::in_notebook;
use crate::record::{Record, names, units};
use crate::refine::Refinement;
use crate::state_space::StateSpace;
use gpi_core::compensate::CompensateOptions;
use gpi_core::identify::residuals_from_fitted_start;
use gpi_core::{Matrix, ModelState, SimulationError};
use nalgebra::DVector;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A Hammerstein model: ``y = G(q) P[D[u]] + offset``, one hysteresis per input.
///
/// It comes from ``identify``, ``load`` or ``Model.from_json``.
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

impl Model {
    fn residuals(&self, py: Python<'_>, record: &Record, fit_start: bool) -> PyResult<Vec<Matrix>> {
        let (model, record) = (&self.model, &record.record);
        if fit_start {
            interruptible(py, None, |report| residuals_from_fitted_start(model, record, report))
        } else {
            model.residuals(record).map_err(to_python)
        }
    }

    /// A state as one vector: previous input and plays of every input, x, what the effects remember, and
    /// how many samples have gone.
    fn write(state: &ModelState) -> Vec<f64> {
        let plays = state.hysteresis.iter().flat_map(write_state);
        let values = plays.chain(state.linear.iter().copied());
        if state.effects.is_empty() {
            return values.collect();
        }
        // what an effect remembers, after how much it is
        let sized = |memory: &Vec<f64>| [&[memory.len() as f64], &memory[..]].concat();
        let effects = state.effects.iter().flat_map(sized);
        values.chain(effects).chain(std::iter::once(state.sample as f64)).collect()
    }

    fn read(&self, values: &[f64]) -> PyResult<ModelState> {
        let sizes: Vec<usize> =
            self.model.hysteresis().iter().map(|h| 1 + h.plays().weights().len()).collect();
        let expected = sizes.iter().sum::<usize>() + self.model.linear().order();
        let (values, mut others) = values.split_at(expected.min(values.len()));
        let found = values.len() + others.len();
        let wrong =
            || parameter(format!("`state` has {found} elements, but {expected} are needed"));
        let mut effects = Vec::new();
        for _ in self.model.effects() {
            let (&size, rest) = others.split_first().ok_or_else(wrong)?;
            let (own, rest) = rest.split_at_checked(size as usize).ok_or_else(wrong)?;
            effects.push(own.to_vec());
            others = rest;
        }
        let mut sample = 0;
        if !effects.is_empty()
            && let Some((&last, rest)) = others.split_first()
        {
            (sample, others) = (last as usize, rest);
        }
        if values.len() != expected || !others.is_empty() {
            return Err(wrong());
        }
        let mut rest = values;
        let mut hysteresis = Vec::new();
        for (operator, size) in self.model.hysteresis().iter().zip(sizes) {
            let (own, others) = rest.split_at(size);
            hysteresis.push(read_state(operator, own)?);
            rest = others;
        }
        let linear = DVector::from_column_slice(rest);
        Ok(ModelState { hysteresis, linear, effects, sample })
    }
}

/// Error figures as a dictionary.
pub(crate) fn figures<'py>(
    py: Python<'py>,
    error: &SimulationError,
) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("rms", error.rms)?;
    result.set_item("nrmse", error.nrmse)?;
    result.set_item("fit_percent", error.fit_percent)?;
    result.set_item("max", error.max)?;
    Ok(result)
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

    /// How the model was refined, and how sure its parameters are; None for a model that was loaded.
    #[getter]
    fn refinement(&self, py: Python<'_>) -> Option<Py<Refinement>> {
        self.refinement.as_ref().map(|refinement| refinement.clone_ref(py))
    }

    /// The effects of the catalogue that the model has, in the order of the chain.
    ///
    /// Rows of ``name`` and ``parameters`` (rows of ``name``, ``value`` in ``unit``, and ``unit``, empty for a pure number).
    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let describe = |effect: &gpi_core::effects::Effect| {
            let row = PyDict::new(py);
            row.set_item("name", effect.name())?;
            let parameters = self.model.quantities(effect).into_iter().map(|quantity| {
                let row = PyDict::new(py);
                row.set_item("name", quantity.name)?;
                row.set_item("value", quantity.value)?;
                row.set_item("unit", quantity.unit)?;
                PyResult::Ok(row)
            });
            row.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
            Ok(row)
        };
        self.model.effects().iter().map(describe).collect()
    }

    /// The output for u.
    ///
    /// The actuator is taken to have been raised from zero to the first sample once, and to have stood
    /// there before. Use ``start`` and ``run`` for another past.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    /// covariates : array_like, shape (samples,) or (samples, columns), optional
    ///     Other measured columns, each in its own unit, that an effect of the model may let leak in; zero when
    ///     left out.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (samples,) or (samples, outputs)
    ///     y, in the outputs' units; a vector where u is one and there is one output.
    #[pyo3(signature = (u, *, covariates = None))]
    fn simulate<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        covariates: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let output = match covariates {
            None => self.model.simulate(&input),
            Some(columns) => self.model.simulate_beside(&input, &signal("covariates", columns)?.0),
        };
        Ok(from_signal(u.py(), output.map_err(to_python)?, one_dimensional))
    }

    /// The intermediate signal v that belongs to ``simulate``.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shaped like u
    ///     v, in the output's unit; that of the output to which G has the largest DC gain, where there are several.
    fn intermediate<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (input, one_dimensional) = signal("u", u)?;
        let v = self.model.intermediate(&input).map_err(to_python)?;
        Ok(from_signal(u.py(), v, one_dimensional))
    }

    /// The state of an actuator that was raised from zero to u, and stands there.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (inputs,)
    ///     What each input stands at, in its unit.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (states,)
    ///     For ``run``: the previous input and the play outputs of every input, then the states of G, then what
    ///     effects remember; each in its own unit.
    fn start<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let state = self.model.start(&vector("u", u)?).map_err(to_python)?;
        Ok(from_vector(u.py(), &Self::write(&state)))
    }

    /// The output from a given state, and the state after the last sample.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (samples,) or (samples, inputs)
    ///     Input, in its unit.
    /// state : array_like, shape (states,)
    ///     What ``start`` or an earlier ``run`` returned, each in its own unit.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     y, shape (samples,) or (samples, outputs), in the outputs' units, and the state, shape (states,), in the
    ///     units that ``state`` has.
    fn run<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        state: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (input, one_dimensional) = signal("u", u)?;
        let mut state = self.read(&vector("state", state)?)?;
        let output = self.model.simulate_from(&mut state, &input).map_err(to_python)?;
        let py = u.py();
        Ok((from_signal(py, output, one_dimensional), from_vector(py, &Self::write(&state))))
    }

    /// The simulation error over the scored samples of a record.
    ///
    /// Parameters
    /// ----------
    /// record : Record
    ///     Measured input and output.
    /// remove_mean : bool
    ///     Take the mean of each experiment's residual out first, for a sensor whose offset moved.
    /// fit_start : bool
    ///     Fit what was before the first sample of experiments that begin in motion (plays and state of
    ///     G, nothing else) to the record first, as MATLAB's ``compare`` does.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``rms`` and ``max`` in the output's unit, ``nrmse`` (rms over span, a ratio), ``fit_percent``
    ///     (``100 (1 - |e| / |y - mean y|)``, in percent).
    #[pyo3(signature = (record, *, remove_mean = false, fit_start = false))]
    fn error<'py>(
        &self,
        py: Python<'py>,
        record: &Record,
        remove_mean: bool,
        fit_start: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let residuals = self.residuals(py, record, fit_start)?;
        figures(py, &SimulationError::of(&record.record, &residuals, remove_mean))
    }

    /// The drive that makes the outputs follow a reference.
    ///
    /// Backwards through the chain: output stage, G by its noncausal inverse (46), the hysteresis by its exact inverse, a
    /// delay by driving earlier. What creep and loops around G add is found by simulation: what a pass misses is added to
    /// what the next one is asked for. The actuator is taken to stand at the reference's first value, the reference to
    /// stay at its last one.
    ///
    /// Parameters
    /// ----------
    /// reference : array_like, shape (samples,) or (samples, outputs)
    ///     What the outputs shall do, in their units, at the model's rate.
    /// limits : tuple of float or list of them, optional
    ///     Lowest and highest drive, in the inputs' units: one pair for all inputs, or one each.
    /// slew : float, optional
    ///     The fastest drive, in units of the input per second.
    /// quasi_static : bool
    ///     Leave G alone: only its DC gain is inverted, and nothing looks ahead.
    /// preview : int, optional
    ///     Samples by which the drive may begin before the reference; as many as G needs when left out.
    /// passes : int
    ///     Most passes after the first one; they end as soon as they no longer help.
    ///
    /// Returns
    /// -------
    /// Compensation
    ///     The drive, and what the model says that it does.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     Limits that leave nothing, a hysteresis or a DC gain without an inverse.
    /// DataError
    ///     Another number of channels, unequal numbers of inputs and outputs, samples that are not finite.
    /// NumericalError
    ///     A zero of G on the unit circle.
    #[pyo3(signature = (reference, *, limits = None, slew = None, quasi_static = false, preview = None, passes = 20))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn compensate(
        &self,
        py: Python<'_>,
        reference: &Bound<'_, PyAny>,
        limits: Option<&Bound<'_, PyAny>>,
        slew: Option<f64>,
        quasi_static: bool,
        preview: Option<usize>,
        passes: usize,
    ) -> PyResult<Compensation> {
        let slew = slew.unwrap_or(f64::INFINITY);
        let limits = compensate::read_limits(limits)?;
        let options = CompensateOptions { limits, slew, quasi_static, preview, passes };
        compensate::compensate(py, &self.model, reference, &options)
    }

    /// The compensator that runs one sample at a time and knows the past only.
    ///
    /// Hysteresis and creep are undone exactly, of the dynamics their DC gain: for references that are slow next to G, and
    /// for microcontrollers (``gpi export``).
    ///
    /// Parameters
    /// ----------
    /// limits : tuple of float, optional
    ///     Lowest and highest drive, in the input's unit.
    ///
    /// Returns
    /// -------
    /// Compensator
    ///     The compensator, with the parts of the model that it leaves alone.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     Limits that leave nothing, a hysteresis or a DC gain without an inverse.
    /// DataError
    ///     Several inputs or outputs.
    #[pyo3(signature = (*, limits = None))]
    fn compensator(&self, limits: Option<(f64, f64)>) -> PyResult<Compensator> {
        let limits = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        self.model.compensator(limits).map(Compensator::new).map_err(to_python)
    }

    /// Measured minus simulated output of each experiment.
    ///
    /// Parameters
    /// ----------
    /// record : Record
    ///     Measured input and output.
    /// fit_start : bool
    ///     As in ``error``: fit what was before the first sample of experiments that begin in motion.
    ///
    /// Returns
    /// -------
    /// list of ndarray, each of shape (samples, outputs)
    ///     The residual of each experiment, its warm-up included, in the outputs' units.
    #[pyo3(signature = (record, *, fit_start = false))]
    fn residual<'py>(
        &self,
        py: Python<'py>,
        record: &Record,
        fit_start: bool,
    ) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let residuals = self.residuals(py, record, fit_start)?;
        Ok(residuals.iter().map(|residual| from_matrix(py, residual)).collect())
    }

    /// The model as JSON.
    ///
    /// Returns
    /// -------
    /// str
    ///     A text of the schema ``gpi-model/1``.
    fn to_json(&self) -> PyResult<String> {
        self.model.to_json().map_err(to_python)
    }

    /// Reads what ``to_json`` wrote.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     JSON of the schema ``gpi-model/1``.
    ///
    /// Returns
    /// -------
    /// Model
    ///     The model; its ``identification`` and ``refinement`` are not stored and hence None.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     Another schema, a text that is no model.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        let model = gpi_core::Model::from_json(text).map_err(to_python)?;
        Ok(Self { model, identification: None, refinement: None })
    }

    /// Writes the model to a JSON file; a file of that name is replaced as a whole.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file, such as ``model.json``.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     The folder does not exist or cannot be written.
    fn save(slf: &Bound<'_, Self>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        let files = slf.py().import("gpi_hammerstein.files")?;
        files.call_method1("save_model", (slf, path))?;
        Ok(())
    }

    /// Draws measured and simulated output; see ``gpi_hammerstein.plot.fit``.
    ///
    /// Parameters
    /// ----------
    /// record : Record
    ///     A record at the model's rate.
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes to draw on; those of a new figure when left out.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     The axes.
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
        let plays = |h: &gpi_core::Hysteresis| {
            format!(
                "{} deadzones, {} plays",
                h.envelope().weights().len(),
                h.plays().weights().len()
            )
        };
        let hysteresis: Vec<String> = self.model.hysteresis().iter().map(plays).collect();
        let label = |channels: &[gpi_core::Channel]| {
            channels.iter().map(gpi_core::Channel::label).collect::<Vec<_>>().join(", ")
        };
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
    module.add_class::<Model>()
}
