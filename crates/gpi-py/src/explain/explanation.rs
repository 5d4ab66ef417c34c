//! What the search for effects found.

use super::rows;
use crate::arrays::from_matrix;
use crate::model::{Model, Refinement};
use crate::plotting::{in_notebook, plot};
use crate::record::Record;
use gpi_core::explain as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The effects that a record's declared model lacked, the errors before and after, and tests of the residual.
///
/// It is returned by ``explain``.
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
pub(super) struct Explanation {
    pub(super) found: core::Explanation,
    pub(super) record: Py<Record>,
    pub(super) refinement: Py<Refinement>,
    /// Whether a held-out record was given.
    pub(super) on_another_record: bool,
}

#[pymethods]
impl Explanation {
    /// Names of the accepted effects, in the order in which they were added.
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

    /// The declared model without effects.
    #[getter]
    fn base(&self) -> Model {
        Model { model: self.found.base.clone(), identification: None, refinement: None }
    }

    /// The record that was explained.
    #[getter]
    fn record(&self, py: Python<'_>) -> Py<Record> {
        self.record.clone_ref(py)
    }

    /// Whether the held-out errors are those on another record, by the rule of ``Model.on_another_record``; otherwise they
    /// are those on blocks of the record itself, which no fit has seen.
    #[getter]
    fn on_another_record(&self) -> bool {
        self.on_another_record
    }

    /// Errors of the declared model.
    ///
    /// ``train`` and ``holdout``, each with the figures of ``Model.error`` (``rms`` and ``max`` in the output's unit).
    #[getter]
    fn before<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        rows::errors(py, &self.found.before)
    }

    /// Errors of the model with all effects, in the units of ``before``. The wrong samples that were found are not scored.
    #[getter]
    fn after<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        rows::errors(py, &self.found.after)
    }

    /// ``explained`` (the residual is noise), ``partly-explained`` (effects were found, but the residual is structured),
    /// ``unattributed`` (the residual is structured, and no effect was found) or ``outside-class`` (the residual is structured,
    /// because the declared structure is wrong; see ``verdict_reason``).
    #[getter]
    fn verdict(&self) -> &'static str {
        self.found.verdict.name()
    }

    /// Why the declared structure is wrong, in words; None unless the verdict is ``outside-class``.
    #[getter]
    fn verdict_reason(&self) -> Option<String> {
        let reasons = &self.found.reasons;
        (!reasons.is_empty()).then(|| reasons.join("; "))
    }

    /// Sentences on the record that concern the estimate, such as an input that depends on the output.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.found.notes.clone()
    }

    /// Simple models that were fitted to the same training data, and scored on the same held-out data as ``after``.
    ///
    /// Rows as those of ``rivals``: ``name``, ``detail``, ``train_rms`` and ``holdout_rms`` (in the output's unit).
    #[getter]
    fn rivals<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        crate::rivals::rows(py, &self.found.rivals)
    }

    /// The steps of the search: the declared model, then each effect.
    ///
    /// Rows of ``effect`` (None first), ``parameters`` (rows of ``name``, ``value`` and ``std`` in ``unit``, and ``unit``),
    /// ``evidence``, ``train_rms`` and ``holdout_rms`` (in the output's unit). ``evidence`` holds ``promised``, the fraction of
    /// the residual's sum of squares that the score test predicts; ``deviance`` and its significance threshold ``chance``, pure
    /// numbers; ``dropped``, the names of the effects that this one made superfluous; ``probability``, how probable it is, by the
    /// held-out blocks, that it predicts better than the other effects of its round that would also be accepted (None without
    /// any); and ``alternatives``, the probabilities of these by their names.
    #[getter]
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.found.steps.iter().map(|step| rows::step(py, step)).collect()
    }

    /// The model after each step, in the order of ``steps``. All parts are refined jointly after the last step.
    #[getter]
    fn models(&self) -> Vec<Model> {
        let model = |model: &gpi_core::Model| Model {
            model: model.clone(),
            identification: None,
            refinement: None,
        };
        self.found.models.iter().map(model).collect()
    }

    /// A resonance that moves with the amplitude of the outputs.
    ///
    /// Rows of ``swing`` (the amplitude as rms, in the outputs' unit), ``frequency`` and ``std`` (Hz) for the smallest and the
    /// largest amplitude; None if the model has no feedback loop around G, or no resonance moves.
    #[getter]
    fn moved_resonance<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<Bound<'py, PyDict>>>> {
        let Some(pair) = &self.found.moved_resonance else { return Ok(None) };
        pair.iter().map(|one| rows::resonance(py, one)).collect::<PyResult<_>>().map(Some)
    }

    /// Effects that were tried and not accepted.
    ///
    /// Rows of ``effect``, ``holdout_rms`` (in the output's unit), ``why``, ``confounded_with``, and ``probability``: how
    /// probable it is, by the held-out blocks, that it predicts better than the other effects of its round that would
    /// also be accepted (None where it would not be accepted itself).
    #[getter]
    fn rejected<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.found.rejected.iter().map(|one| rows::rejected(py, one)).collect()
    }

    /// Tests of the residual.
    ///
    /// Rows of ``name``, ``output``, ``statistic``, ``threshold``, ``p_value`` and ``level`` (pure numbers), ``passed``,
    /// ``points_to``, as in ``residual_tests``.
    #[getter]
    fn tests<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        rows::tests(py, &self.found.tests, &self.found.model)
    }

    /// Isolated wrong samples, which differ from their neighbours by far more than the noise. They are not scored.
    ///
    /// Rows of ``experiment`` and ``row``, pure numbers that start at 0, and ``output``, its name.
    #[getter]
    fn wrong_samples<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        rows::wrong_samples(py, &self.found)
    }

    /// The noise floor of each output, in its unit, as ``Refinement.noise_floor``.
    #[getter]
    fn noise_floor<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.refinement.bind(py).getattr("noise_floor")
    }

    /// The experiment to measure next, with ``why`` and ``command``; None if no further experiment is needed.
    #[getter]
    fn next_experiment<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(next) = &self.found.next_experiment else { return Ok(None) };
        let row = PyDict::new(py);
        row.set_item("why", &next.why)?;
        row.set_item("command", &next.command)?;
        Ok(Some(row))
    }

    /// Measured minus simulated output of the declared model, for each experiment of shape (samples, outputs), in the outputs'
    /// units.
    #[getter]
    fn residuals_before<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.found.residuals_before.iter().map(|residual| from_matrix(py, residual)).collect()
    }

    /// Measured minus simulated output of the model with all effects, for each experiment of shape (samples, outputs), in the
    /// outputs' units.
    #[getter]
    fn residuals_after<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyAny>> {
        self.found.residuals_after.iter().map(|residual| from_matrix(py, residual)).collect()
    }

    /// Held-out blocks of each experiment, as pairs of the first sample and the one after the last.
    #[getter]
    fn held_out(&self) -> Vec<Vec<(usize, usize)>> {
        let pairs = |blocks: &Vec<std::ops::Range<usize>>| {
            blocks.iter().map(|block| (block.start, block.end)).collect()
        };
        self.found.held_out.iter().map(pairs).collect()
    }

    /// Whether the search was stopped before it was complete.
    #[getter]
    fn interrupted(&self) -> bool {
        self.found.interrupted
    }

    /// The explanation as a JSON object.
    ///
    /// Returns
    /// -------
    /// dict
    ///     An object of the schema ``gpi-explanation/1``. Errors, parameters and tests are in the units of the properties of
    ///     the same names.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let module = slf.py().import("gpi_hammerstein.explanation")?;
        module.call_method1("to_dict", (slf,))
    }

    /// Number of samples at the start of each experiment that the fit could not use.
    #[getter]
    fn warmups(&self) -> Vec<usize> {
        self.found.warmups.clone()
    }

    /// Writes the explanation as one self-contained HTML page.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file, such as ``report.html``.
    /// command : str, optional
    ///     The command that made the explanation, for the foot of the page.
    /// notes : sequence of str
    ///     Remarks on the preparation of the samples.
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

    /// Draws the residuals of both models over time; see ``gpi_hammerstein.plot.residual_in_time``.
    ///
    #[doc = include_str!("../docs/plot.txt")]
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
