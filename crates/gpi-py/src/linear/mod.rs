//! Linear models: their estimate, realization and inverse.

mod era;
mod fir;
mod fir_statistic;
mod noncausal_fir;
mod state_space;
mod transfer_function;

pub(crate) use fir::Fir;
pub(crate) use state_space::StateSpace;

use pyo3::prelude::*;

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Fir>()?;
    module.add_class::<fir_statistic::FirStatistic>()?;
    module.add_function(wrap_pyfunction!(fir::fir, module)?)?;
    module.add_class::<StateSpace>()?;
    module.add_function(wrap_pyfunction!(era::era, module)?)?;
    module.add_class::<noncausal_fir::NoncausalFir>()?;
    module.add_class::<noncausal_fir::IntermediateSignal>()
}
