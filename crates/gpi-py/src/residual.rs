//! Tests of what a model leaves of a record.

use crate::identify::interruptible;
use crate::model::Model;
use crate::record::Record;
use gpi_core::explain as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// One dict a test, the output by its name.
pub(crate) fn test_rows<'py>(
    py: Python<'py>,
    tests: &[core::ResidualTest],
    model: &gpi_core::Model,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let row = |test: &core::ResidualTest| {
        let row = PyDict::new(py);
        row.set_item("name", test.name)?;
        row.set_item("output", &model.outputs()[test.output].name)?;
        row.set_item("statistic", test.statistic)?;
        row.set_item("threshold", test.threshold)?;
        row.set_item("p_value", test.p_value)?;
        row.set_item("passed", test.passed())?;
        row.set_item("points_to", &test.points_to)?;
        Ok(row)
    };
    tests.iter().map(row).collect()
}

/// Tests what a model leaves of a record: ``e(k) = y(k) - y_hat(k)``, y_hat simulated from u alone, with
/// the model's effects and the record's covariates.
///
/// Of every output: ``mean``; ``whiteness`` (Ljung and Box); ``lines`` of the spectrum; whether e follows
/// ``past-input``, ``past-intermediate`` (v), ``level``, ``speed``, ``direction``, ``amplitude``, time
/// (``trend``), or the input's past in another way where the input swings more (``level-to-level``); the
/// same for e squared (``higher-order``); ``outliers``. A test fails by chance once in 100 times the number
/// of tests, or less often. The statistic of a dependence is
/// ``t = sum_b g_b / sqrt(sum_b g_b^2)``, g_b the product of e and a regressor summed over block b of
/// time, which noise of any colour that is shorter than a block leaves small.
///
/// Parameters
/// ----------
/// model : Model
///     Any model; it need not have been identified here.
/// record : Record
///     Measured input u, shape (samples, inputs), and output y, shape (samples, outputs).
/// fit_start : bool
///     As in ``Model.error``: fit what was before the first sample of experiments that begin in motion.
/// remove_mean : bool
///     As in ``Model.error``: take the mean of each experiment's residual out first.
///
/// Returns
/// -------
/// dict
///     ``structured``: whether more is left than the model's noise (memory that the effect
///     ``coloured-noise`` declares and isolated outliers are noise). ``tests``: rows of ``name``, ``output``,
///     ``statistic``, ``threshold`` (pure numbers), ``p_value``, ``passed``, ``points_to``.
///
/// Raises
/// ------
/// DataError
///     Inputs or outputs that differ in number from the model's.
/// ParameterError
///     A record at another rate than the model's.
///
/// Examples
/// --------
/// >>> t = np.arange(2000) / 1000
/// >>> u = np.sin(2 * np.pi * 1.5 * t) + np.sin(2 * np.pi * 120.0 * t**2)
/// >>> model = gpi.identify(gpi.Record(u, 2.0 * u, rate=1000.0), delay=0, half_widths=[0.0])
/// >>> rest = np.random.default_rng(0).normal(0.0, 0.1, 2000)
/// >>> residual = gpi.residual_tests(model, gpi.Record(u, model.simulate(u) + rest, rate=1000.0))
/// >>> residual["structured"]
/// False
/// >>> mains = 0.1 * np.sin(2 * np.pi * 50.0 * t)
/// >>> residual = gpi.residual_tests(model, gpi.Record(u, model.simulate(u) + rest + mains, rate=1000.0))
/// >>> [test["points_to"] for test in residual["tests"] if test["name"] == "lines" and not test["passed"]]
/// ['periodic-disturbance']
#[pyfunction]
#[pyo3(signature = (model, record, *, fit_start = false, remove_mean = false))]
fn residual_tests<'py>(
    py: Python<'py>,
    model: &Model,
    record: &Record,
    fit_start: bool,
    remove_mean: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (model, record) = (&model.model, &record.record);
    let options = core::ResidualOptions { fit_start, remove_mean };
    let tests =
        interruptible(py, None, |report| core::residual_tests(model, record, &options, report))?;
    let effects: Vec<&str> = model.effects().iter().map(gpi_core::effects::Effect::name).collect();
    let result = PyDict::new(py);
    result.set_item("structured", core::structured(&effects, &tests))?;
    result.set_item("tests", test_rows(py, &tests, model)?)?;
    Ok(result)
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(residual_tests, module)?)
}
