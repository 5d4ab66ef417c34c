//! Arguments whose meaning is clear, and messages for those whose meaning is not.

use crate::errors::parameter;
use crate::record::Record;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};

/// Names of effects: a list, or a text for a list of one.
pub(crate) fn effect_names(
    name: &str,
    value: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<Vec<String>>> {
    let Some(value) = value else { return Ok(None) };
    if let Ok(one) = value.cast::<PyString>() {
        return Ok(Some(vec![one.to_str()?.to_owned()]));
    }
    let names = value.try_iter().and_then(|all| all.map(|one| one?.extract::<String>()).collect());
    names.map(Some).map_err(|_| {
        let kind = kind(value);
        parameter(format!(
            "`{name}` is {kind}, but a name or a list of names is needed; gpi.effect_names() lists them"
        ))
    })
}

/// A record, or the one in the file that a path names. `call` is the call that is shown if it is neither.
pub(crate) fn record(name: &str, value: &Bound<'_, PyAny>, call: &str) -> PyResult<Py<Record>> {
    if let Ok(record) = value.cast::<Record>() {
        return Ok(record.clone().unbind());
    }
    let py = value.py();
    if value.cast::<PyString>().is_ok() || value.hasattr("__fspath__")? || is_table(value)? {
        let read = py.import("gpi_hammerstein.io")?.call_method1("read_record", (value,))?;
        return Ok(read.cast_into::<Record>()?.unbind());
    }
    Err(parameter(format!(
        "`{name}` is {}, but a record or the path of its file is needed; make a record of input and output arrays with \
         their rate in Hz: {call}gpi.Record(u, y, rate=1000.0))",
        kind(value)
    )))
}

/// The same for an optional record.
pub(crate) fn optional_record(
    name: &str,
    value: Option<&Bound<'_, PyAny>>,
    call: &str,
) -> PyResult<Option<Py<Record>>> {
    value.map(|value| record(name, value, call)).transpose()
}

/// Whether `read_record` reads a value as a table.
fn is_table(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    let frames = value.py().import("gpi_hammerstein.io.frames")?;
    frames.call_method1("is_frame", (value,))?.extract()
}

/// The arguments of `read_record`.
const OF_READING: [&str; 8] =
    ["rate", "input", "output", "time", "covariate", "warmup", "resample", "experiment"];

/// What a value is, for messages.
fn kind(value: &Bound<'_, PyAny>) -> String {
    let name =
        value.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
    if name == "ndarray" { "an array".to_owned() } else { format!("of type {name}") }
}

/// Refuses arguments that a function of a record does not have, and says what was probably meant.
///
/// # Errors
/// A `ParameterError` for arrays and a rate in place of a record, a `TypeError` for other arguments.
pub(crate) fn only_a_record(
    function: &str,
    first: &Bound<'_, PyAny>,
    extra: &Bound<'_, PyTuple>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    let is_record = first.cast::<Record>().is_ok();
    let is_path = first.cast::<PyString>().is_ok() || first.hasattr("__fspath__")?;
    let is_file = is_path || is_table(first)?;
    let mut names = Vec::new();
    if let Some(others) = others {
        for name in others.keys() {
            names.push(name.extract::<String>()?);
        }
    }
    let reads = names.iter().find(|name| OF_READING.contains(&name.as_str()));
    if let (true, Some(name)) = (is_file, reads) {
        let file = if is_path { first.repr()?.to_string() } else { "frame".to_owned() };
        return Err(parameter(format!(
            "`{name}` says how a file is read: gpi.{function}(gpi.read_record({file}, {name}=...))"
        )));
    }
    if !is_record && !is_file && (!extra.is_empty() || names.iter().any(|name| name == "rate")) {
        return Err(parameter(format!(
            "`record` is {}, but {function} takes a record, which has input, output and rate: \
             gpi.{function}(gpi.Record(u, y, rate=1000.0))",
            kind(first)
        )));
    }
    if !extra.is_empty() {
        return Err(PyTypeError::new_err(format!(
            "the arguments of {function}() after the record are given by their names, such as order=3"
        )));
    }
    let Some(name) = names.first() else { return Ok(()) };
    let py = first.py();
    let own = py.import("gpi_hammerstein._native")?.getattr(function)?;
    let signature = py.import("inspect")?.call_method1("signature", (own,))?;
    let known: Vec<String> = signature
        .getattr("parameters")?
        .try_iter()?
        .map(|one| one?.extract())
        .collect::<PyResult<_>>()?;
    let near: Vec<String> =
        py.import("difflib")?.call_method1("get_close_matches", (name, &known))?.extract()?;
    let meant = near.first().map_or_else(
        || format!("it has {}", known.join(", ")),
        |near| format!("did you mean `{near}`?"),
    );
    Err(PyTypeError::new_err(format!("{function}() has no argument `{name}`; {meant}")))
}
