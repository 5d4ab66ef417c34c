//! A model on all experiments of a record.

use super::Model;
use crate::arrays::from_matrix;
use crate::errors::{parameter, to_python};
use crate::progress::interruptible;
use crate::record::Record;
use gpi_core::Matrix;
use gpi_core::identify::residuals_from_fitted_start;
use pyo3::prelude::*;
use pyo3::types::PyList;

impl Model {
    /// Measured minus simulated outputs of all experiments, from the start that a model has or from a fitted one.
    pub(super) fn residuals(
        &self,
        py: Python<'_>,
        record: &Record,
        fit_start: bool,
    ) -> PyResult<Vec<Matrix>> {
        let (model, record) = (&self.model, &record.record);
        if fit_start {
            interruptible(py, None, |report| residuals_from_fitted_start(model, record, report))
        } else {
            model.residuals(record).map_err(to_python)
        }
    }

    /// The outputs of all experiments of a record, with its own measured columns.
    pub(super) fn simulate_record<'py>(
        &self,
        py: Python<'py>,
        record: &Record,
        has_covariates: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        if has_covariates {
            return Err(parameter("`covariates`: a record has its own; leave them out".to_owned()));
        }
        let simulated = self.model.simulate_record(&record.record).map_err(to_python)?;
        let outputs = simulated.iter().map(|output| from_matrix(py, output));
        Ok(PyList::new(py, outputs)?.into_any())
    }
}
