//! The search for the effects that a record's declared model lacks.

mod explanation;
mod residual_tests;
mod rows;

use crate::calls;
use crate::errors::to_python;
use crate::identify::elements;
use crate::identify::grid;
use crate::model::Refinement;
use crate::operators::read_reading;
use crate::progress::interruptible_in_part;
use explanation::Explanation;
use gpi_core::effects::CATALOGUE;
use gpi_core::explain as core;
use gpi_core::identify::IdentifyOptions;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Finds the effects that a record's declared model lacks, and adds them to the model.
///
/// The declared model (deadzones, plays, G) is identified on the record without ten blocks of time, which are held out for
/// validation. Then effects are added one at a time. A score test, (T7) in the theory, ranks all candidates of the
/// catalogue, and the best few are fitted jointly with the model. The one that explains most is accepted if its gain
/// exceeds a significance threshold, (T8), and if the error on the held-out blocks confirms it. The search ends when no
/// further effect is accepted.
///
/// Parameters
/// ----------
/// record : Record or path
///     Measured input and output.
/// holdout : Record or path, optional
///     Another experiment with the same actuator for validation. Effects that the input does not drive are not simulated
///     on it.
/// effects : str or sequence of str, optional
///     Names of the effects that may be added (see ``effect_names``); all when left out, none if empty.
/// require : str or sequence of str, optional
///     Names of effects that are added in any case. The evidence of the step shows their gain.
/// order : int, optional
///     Order of G in the declared model. A missing mode and a missing delay are then reported as effects.
/// half_widths : int or array_like, shape (n,), optional
///     Number of plays, or their half-widths, in the unit of u; as in ``identify``.
/// thresholds : int or array_like, shape (m,), optional
///     Number of deadzones, or their thresholds, in the unit of u; as in ``identify``.
/// delay : int, optional
///     Restricts G to a gain with a delay of this many samples.
/// reading : {"one-sided", "directional"}
///     The deadzone convention, as in ``Deadzones``.
/// hysteresis : {"plays", "stops"}, optional
///     What the hysteresis consists of, as in ``identify``.
/// progress : callable, optional
///     Called with a ``Progress``: the stage, the trial, the fraction done and the best error so far. An exception ends the search, as Ctrl-C does: the
///     effects found so far are returned, with ``interrupted`` set. Before the declared model is identified, the
///     exception is raised.
///
/// Returns
/// -------
/// Explanation
///     The effects, the model, the errors before and after, and tests of the residual.
///
/// Raises
/// ------
/// DataError
///     As in ``identify``.
/// ParameterError
///     An effect is not in the catalogue, or the record has no data from which a required effect can be initialized.
///
/// Examples
/// --------
/// >>> found = gpi.explain(gpi.read_record("run.csv"))  # doctest: +SKIP
/// >>> found.effects, found.verdict  # doctest: +SKIP
/// (['creep'], 'explained')
#[pyfunction]
#[pyo3(signature = (record, holdout = None, *extra, effects = None, require = None, order = None, half_widths = None,
    thresholds = None, delay = None, reading = "one-sided", hysteresis = None, progress = None, **others),
    text_signature = "(record, holdout=None, *, effects=None, require=None, order=None, half_widths=None, \
thresholds=None, delay=None, reading='one-sided', hysteresis=None, progress=None)")]
fn explain(
    py: Python<'_>,
    record: &Bound<'_, PyAny>,
    holdout: Option<&Bound<'_, PyAny>>,
    extra: &Bound<'_, PyTuple>,
    effects: Option<&Bound<'_, PyAny>>,
    require: Option<&Bound<'_, PyAny>>,
    order: Option<usize>,
    half_widths: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    delay: Option<usize>,
    reading: &str,
    hysteresis: Option<&str>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Explanation> {
    calls::only_a_record("explain", record, extra, others)?;
    let identify = IdentifyOptions {
        order,
        delay,
        half_widths: grid("half_widths", half_widths)?,
        thresholds: grid("thresholds", thresholds)?,
        reading: read_reading(reading)?,
        elements: elements(hysteresis)?,
        ..IdentifyOptions::default()
    };
    let effects = calls::effect_names("effects", effects)?;
    let require = calls::effect_names("require", require)?.unwrap_or_default();
    let options = core::ExplainOptions { identify, effects, require };
    let record = calls::record("record", record, "gpi.explain(")?;
    let holdout = calls::optional_record("holdout", holdout, "gpi.explain(record, ")?;
    let measured = &record.get().record;
    let holdout = holdout.as_ref().map(|other| &other.get().record);
    let on_another_record = holdout.is_some();
    let (mut found, stopped) = interruptible_in_part(py, progress, |report| {
        core::explain(measured, holdout, &options, report)
    })?;
    // a stop that came with the last report has not changed the result, but the caller must know of it
    found.interrupted |= stopped;
    found.model = found.model.with_prediction(&found.refinement, measured).map_err(to_python)?;
    let refinement = Py::new(py, Refinement::new(&found.model, found.refinement.clone())?)?;
    Ok(Explanation { found, record, refinement, on_another_record })
}

/// Names and descriptions of all effects that ``explain`` knows, in the order of the signal chain.
///
/// Returns
/// -------
/// dict
///     The description of each name.
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
    module.add_function(wrap_pyfunction!(explain, module)?)?;
    module.add_function(wrap_pyfunction!(residual_tests::residual_tests, module)?)
}
