//! Tests of a model's residual on a record.

use super::rows;
use crate::calls;
use crate::model::Model;
use crate::progress::interruptible;
use gpi_core::explain as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Tests the residual of a model on a record.
///
/// The residual is ``e(k) = y(k) - y_hat(k)``. y_hat is simulated from u alone, with the model's effects and the record's
/// covariates. The tests of each output are ``mean``; ``whiteness`` (Ljung and Box); ``lines`` of the spectrum; dependence
/// of e on ``past-input``, ``past-intermediate`` (v), ``level``, ``speed``, ``direction``, ``amplitude`` and time
/// (``trend``); the part of e, whitened by its own past, that a regression on lags, speeds and plays of u and y_hat
/// predicts on blocks of time that it was not fitted to (``prediction``); dependence on the past input that changes with the input's amplitude (``level-to-level``); the same
/// dependences of the square of e (``higher-order``); and ``outliers``. The significance level of each test is at most
/// 0.01 divided by the number of tests. The statistic of a dependence is ``t = sum_b g_b / sqrt(sum_b g_b^2)``, where g_b is
/// the product of e and a regressor, summed over block b of time. It is robust to autocorrelated noise whose correlation
/// time is shorter than a block.
///
/// Parameters
/// ----------
/// model : Model
///     The model. It need not have been identified from this record.
/// record : Record or path
///     Measured input u, shape (samples, inputs), and output y, shape (samples, outputs).
/// fit_start : bool
///     Whether to estimate unknown initial states first, as in ``Model.error``.
/// remove_mean : bool
///     Whether to subtract the mean of each experiment's residual first, as in ``Model.error``.
///
/// Returns
/// -------
/// dict
///     ``structured``: whether the residual contains more than noise. Isolated outliers count as noise, and so does
///     autocorrelation if the model has the effect ``coloured-noise``. ``tests``: rows of ``name``, ``output``,
///     ``statistic``, ``threshold`` (pure numbers), ``p_value``, ``level``, ``passed``, ``points_to``. A test passes if
///     ``statistic <= threshold``, which is the same as ``p_value >= level``. ``p_value`` and ``level`` are None where the
///     threshold is one of practical size: what the input predicts (``prediction``), the number of ``outliers``, and
///     ``whiteness`` in long records, where correlations far below any practical size are significant.
///
/// Raises
/// ------
/// DataError
///     The number of inputs or outputs differs from the model's.
/// ParameterError
///     The record has another rate than the model.
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
pub(super) fn residual_tests<'py>(
    py: Python<'py>,
    model: &Model,
    record: &Bound<'_, PyAny>,
    fit_start: bool,
    remove_mean: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let record = calls::record("record", record, "gpi.residual_tests(model, ")?;
    let (model, record) = (&model.model, &record.get().record);
    let options = core::ResidualOptions { fit_start, remove_mean };
    let tests =
        interruptible(py, None, |report| core::residual_tests(model, record, &options, report))?;
    let effects: Vec<&str> = model.effects().iter().map(gpi_core::effects::Effect::name).collect();
    let result = PyDict::new(py);
    result.set_item("structured", core::structured(&effects, &tests))?;
    result.set_item("tests", rows::tests(py, &tests, model)?)?;
    Ok(result)
}
