//! Closing the loop.

use crate::arrays::from_matrix;
use crate::identify::{grid, interruptible_in_part};
use crate::model::Model;
use crate::operators::read_reading;
use crate::plotting::{in_notebook, plot};
use crate::record::Record;
use crate::refine::Refinement;
use crate::residual::test_rows;
use gpi_core::SimulationError;
use gpi_core::effects::CATALOGUE;
use gpi_core::explain as core;
use gpi_core::identify::IdentifyOptions;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What a record's model lacked: effects, errors before and after, and what is left.
///
/// It comes from ``explain``.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> y = gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u) + np.random.default_rng(0).normal(0.0, 0.01, 2000)
/// >>> record = gpi.Record(u, y, 1000.0)
/// >>> found = gpi.explain(record, effects=[], delay=0, half_widths=[0.0, 2.0], thresholds=0)
/// >>> found.effects, found.verdict
/// ([], 'explained')
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Explanation {
    found: core::Explanation,
    record: Py<Record>,
    refinement: Py<Refinement>,
}

fn error_dict<'py>(py: Python<'py>, error: &SimulationError) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("rms", error.rms)?;
    result.set_item("nrmse", error.nrmse)?;
    result.set_item("fit_percent", error.fit_percent)?;
    result.set_item("max", error.max)?;
    Ok(result)
}

fn errors_dict<'py>(py: Python<'py>, errors: &core::Errors) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("train", error_dict(py, &errors.train)?)?;
    result.set_item("holdout", error_dict(py, &errors.holdout)?)?;
    Ok(result)
}

#[pymethods]
impl Explanation {
    /// Names of the accepted effects, in the order they were added.
    #[getter]
    fn effects(&self) -> Vec<&'static str> {
        self.found.effects.clone()
    }

    /// The model with all effects.
    #[getter]
    fn model(&self, py: Python<'_>) -> Model {
        let refinement = Some(self.refinement.clone_ref(py));
        Model { model: self.found.model.clone(), identification: None, refinement }
    }

    /// The declared model alone.
    #[getter]
    fn base(&self) -> Model {
        Model { model: self.found.base.clone(), identification: None, refinement: None }
    }

    /// The record that was explained.
    #[getter]
    fn record(&self, py: Python<'_>) -> Py<Record> {
        self.record.clone_ref(py)
    }

    /// Errors of the declared model.
    ///
    /// ``train`` and ``holdout``, each as ``Model.error`` returns it (``rms`` and ``max`` in the output's unit).
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        errors_dict(py, &self.found.before)
    }

    /// Errors with all effects, in the units of ``before``; wrong samples that were found are not scored.
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        errors_dict(py, &self.found.after)
    }

    /// ``explained`` (what is left is noise), ``partly-explained`` or ``unattributed``.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.found.verdict.name()
    }

    /// The declared model, then each effect.
    ///
    /// Rows of ``effect`` (None first), ``parameters`` (rows of ``name``, ``value`` and ``std`` in ``unit``, and ``unit``),
    /// ``evidence`` (``promised``, a fraction of the residual's squares, ``deviance`` and what ``chance`` alone would give
    /// of it, pure numbers, and ``dropped``, names), ``train_rms`` and ``holdout_rms`` (in the output's unit).
    #[getter]
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let step = |step: &core::Step| {
            let row = PyDict::new(py);
            row.set_item("effect", step.effect)?;
            let parameters = step.parameters.iter().zip(&step.units).map(|(parameter, unit)| {
                let row = PyDict::new(py);
                row.set_item("name", &parameter.name)?;
                row.set_item("value", parameter.value)?;
                row.set_item("std", Some(parameter.deviation).filter(|std| std.is_finite()))?;
                row.set_item("unit", unit)?;
                PyResult::Ok(row)
            });
            row.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
            let evidence = PyDict::new(py);
            evidence.set_item("promised", step.promised)?;
            evidence.set_item("deviance", step.deviance)?;
            evidence.set_item("chance", step.chance)?;
            evidence.set_item("dropped", step.dropped.clone())?;
            row.set_item("evidence", evidence)?;
            row.set_item("train_rms", step.train_rms)?;
            row.set_item("holdout_rms", step.holdout_rms)?;
            Ok(row)
        };
        self.found.steps.iter().map(step).collect()
    }

    /// The model as each step found it, in the order of ``steps``; all is refined together at last.
    #[getter]
    fn models(&self) -> Vec<Model> {
        let model = |model: &gpi_core::Model| Model {
            model: model.clone(),
            identification: None,
            refinement: None,
        };
        self.found.models.iter().map(model).collect()
    }

    /// A resonance that is elsewhere where the outputs swing more.
    ///
    /// Rows of ``swing`` (rms, in the outputs' unit), ``frequency`` and ``std`` (Hz) for the smallest and the largest swing;
    /// None where no loop was closed around G, or no resonance moves.
    #[getter]
    fn moved_resonance<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<Bound<'py, PyDict>>>> {
        let Some(pair) = &self.found.moved_resonance else { return Ok(None) };
        let row = |one: &core::Resonance| {
            let row = PyDict::new(py);
            row.set_item("swing", one.swing)?;
            row.set_item("frequency", one.frequency)?;
            row.set_item("std", one.deviation)?;
            Ok(row)
        };
        pair.iter().map(row).collect::<PyResult<_>>().map(Some)
    }

    /// Effects that were tried and not taken.
    ///
    /// Rows of ``effect``, ``holdout_rms`` (in the output's unit), ``why``, ``confounded_with``.
    #[getter]
    fn rejected<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |one: &core::Rejected| {
            let row = PyDict::new(py);
            row.set_item("effect", one.effect)?;
            row.set_item("holdout_rms", one.holdout_rms)?;
            row.set_item("why", &one.why)?;
            row.set_item("confounded_with", one.confounded_with.clone())?;
            Ok(row)
        };
        self.found.rejected.iter().map(one).collect()
    }

    /// Tests of what is left.
    ///
    /// Rows of ``name``, ``output``, ``statistic``, ``threshold`` and ``p_value`` (pure numbers), ``passed``, ``points_to``.
    #[getter]
    fn tests<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        test_rows(py, &self.found.tests, &self.found.model)
    }

    /// Isolated samples that stand apart from their neighbours and are not scored.
    ///
    /// Rows of ``experiment`` and ``row``, pure numbers counted from 0, and ``output``, its name.
    #[getter]
    fn wrong_samples<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let mut rows = Vec::new();
        for (experiment, outputs) in self.found.wrong_samples.iter().enumerate() {
            for (output, places) in self.found.model.outputs().iter().zip(outputs) {
                for place in places {
                    let row = PyDict::new(py);
                    row.set_item("experiment", experiment)?;
                    row.set_item("output", &output.name)?;
                    row.set_item("row", place)?;
                    rows.push(row);
                }
            }
        }
        Ok(rows)
    }

    /// The noise of each output, in its unit, as ``Refinement.noise_floor``.
    #[getter]
    fn noise_floor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.refinement.bind(py).getattr("noise_floor")
    }

    /// What to measure next, with ``why`` and ``command``; None when nothing more is to be learnt.
    #[getter]
    fn next_experiment<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(next) = &self.found.next_experiment else { return Ok(None) };
        let row = PyDict::new(py);
        row.set_item("why", &next.why)?;
        row.set_item("command", &next.command)?;
        Ok(Some(row))
    }

    /// Measured minus simulated output of the declared model, one (samples, outputs) an experiment, in the outputs' units.
    #[getter]
    fn residuals_before<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.found.residuals_before.iter().map(|residual| from_matrix(py, residual)).collect()
    }

    /// The same with all effects, one (samples, outputs) an experiment, in the outputs' units.
    #[getter]
    fn residuals_after<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.found.residuals_after.iter().map(|residual| from_matrix(py, residual)).collect()
    }

    /// Held-out samples of each experiment, as pairs of first and one past the last.
    #[getter]
    fn held_out(&self) -> Vec<Vec<(usize, usize)>> {
        let pairs = |blocks: &Vec<std::ops::Range<usize>>| {
            blocks.iter().map(|block| (block.start, block.end)).collect()
        };
        self.found.held_out.iter().map(pairs).collect()
    }

    /// Whether the search was stopped before it had finished.
    #[getter]
    fn interrupted(&self) -> bool {
        self.found.interrupted
    }

    /// All of it as a JSON object.
    ///
    /// Returns
    /// -------
    /// dict
    ///     The object ``gpi-explanation/1``: errors, parameters and residuals' tests in the units of the properties of
    ///     the same names.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let module = slf.py().import("gpi_hammerstein.explanation")?;
        module.call_method1("to_dict", (slf,))
    }

    /// Samples at the start of each experiment that the fit could not use.
    #[getter]
    fn warmups(&self) -> Vec<usize> {
        self.found.warmups.clone()
    }

    /// Writes one HTML page with all of it, which needs no network and nothing else.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file, such as ``report.html``.
    /// command : str, optional
    ///     The command that made it, for the foot of the page.
    /// notes : sequence of str
    ///     What was done to the samples on the way in.
    ///
    /// Raises
    /// ------
    /// ParameterError
    ///     The folder does not exist or cannot be written.
    #[pyo3(signature = (path, *, command = None, notes = vec![]))]
    fn report(
        slf: &Bound<'_, Self>,
        path: &Bound<'_, PyAny>,
        command: Option<String>,
        notes: Vec<String>,
    ) -> PyResult<()> {
        let options = PyDict::new(slf.py());
        options.set_item("command", command)?;
        options.set_item("notes", notes)?;
        let module = slf.py().import("gpi_hammerstein.report")?;
        module.call_method("write_report", (slf, path), Some(&options))?;
        Ok(())
    }

    /// Draws the residual before and after; see ``gpi_hammerstein.plot.residual_in_time``.
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
        plot("residual_in_time", slf.as_any(), ax)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook("explanation", slf.as_any())
    }

    fn __repr__(&self) -> String {
        let (before, after) = (self.found.before.holdout.rms, self.found.after.holdout.rms);
        let effects = self.found.effects.join(", ");
        format!("Explanation([{effects}], {}, {before:.4e} -> {after:.4e})", self.verdict())
    }
}

/// Finds out what a record's model lacks, adds it, and reports the error before and after.
///
/// The declared model (deadzones, plays, G) is identified without ten blocks of time that are kept for
/// the test. Every candidate of the catalogue is ranked by a score test, (T7) in the theory, the best few
/// are fitted jointly with the model, and the one that explains most stays if it gains more than chance,
/// (T8), and the held-out blocks confirm it; until nothing more is confirmed.
///
/// Parameters
/// ----------
/// record : Record
///     Measured input and output.
/// holdout : Record, optional
///     Another experiment of the same actuator to test on. Effects that the input does not drive are left
///     out there.
/// effects : sequence of str, optional
///     Names of the effects that may be added (see ``effect_names``); all when left out, none when empty.
/// require : sequence of str, optional
///     Names of effects that are added whatever they gain; the step's evidence tells what that is.
/// order : int, optional
///     States of the linear part; a mode that it lacks is then an effect, and a delay too.
/// half_widths : int or array_like, shape (n,), optional
///     How many plays, or their half-widths, in the unit of u; as in ``identify``.
/// thresholds : int or array_like, shape (m,), optional
///     How many deadzones, or their thresholds, in the unit of u; as in ``identify``.
/// delay : int, optional
///     Makes G a gain with this delay, in samples.
/// reading : {"one-sided", "directional"}
///     How the deadzones are read, as in ``Deadzones``.
/// progress : callable, optional
///     Called with a stage's name and the fraction done. An exception ends the search, as Ctrl-C does:
///     what was found so far is returned, with ``interrupted`` set; before the declared model is
///     identified the exception is raised.
///
/// Returns
/// -------
/// Explanation
///     Effects, model, errors before and after, tests of what is left.
///
/// Raises
/// ------
/// DataError
///     As ``identify``.
/// ParameterError
///     An effect that is not in the catalogue, a required one that the record has nothing to place by.
///
/// Examples
/// --------
/// >>> found = gpi.explain(gpi.read_record("run.csv"))  # doctest: +SKIP
/// >>> found.effects, found.verdict  # doctest: +SKIP
/// (['creep'], 'explained')
#[pyfunction]
#[pyo3(signature = (record, holdout = None, *, effects = None, require = None, order = None, half_widths = None,
    thresholds = None, delay = None, reading = "one-sided", progress = None))]
#[allow(clippy::too_many_arguments)]
fn explain(
    py: Python<'_>,
    record: Py<Record>,
    holdout: Option<&Record>,
    effects: Option<Vec<String>>,
    require: Option<Vec<String>>,
    order: Option<usize>,
    half_widths: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    delay: Option<usize>,
    reading: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Explanation> {
    let identify = IdentifyOptions {
        order,
        delay,
        half_widths: grid("half_widths", half_widths)?,
        thresholds: grid("thresholds", thresholds)?,
        reading: read_reading(reading)?,
        ..IdentifyOptions::default()
    };
    let options = core::ExplainOptions { identify, effects, require: require.unwrap_or_default() };
    let own = record.bind(py).borrow();
    let (measured, holdout) = (&own.record, holdout.map(|other| &other.record));
    let found = interruptible_in_part(py, progress, |report| {
        core::explain(measured, holdout, &options, report)
    })?;
    drop(own);
    let refinement = Py::new(py, Refinement { refinement: found.refinement.clone() })?;
    Ok(Explanation { found, record, refinement })
}

/// Names of all effects that ``explain`` knows, in the order of the chain, and what they are.
///
/// Returns
/// -------
/// dict
///     Name to description.
///
/// Examples
/// --------
/// >>> gpi.effect_names()["creep"]
/// "slow relaxation driven by the actuator's own motion"
#[pyfunction]
fn effect_names(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let names = PyDict::new(py);
    for entry in CATALOGUE {
        names.set_item(entry.name, entry.what)?;
    }
    Ok(names)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Explanation>()?;
    module.add_function(wrap_pyfunction!(effect_names, module)?)?;
    module.add_function(wrap_pyfunction!(explain, module)?)
}
