//! Realization of Markov parameters.

use super::state_space::StateSpace;
use crate::arrays;
use crate::errors::to_python;
use gpi_core::linear::{self, EraOptions};
use pyo3::prelude::*;

/// Realizes Markov parameters as a stable state space (Ho-Kalman / ERA), (T1) in the theory.
///
/// Parameters
/// ----------
/// markov : array_like, shape (taps,) or (outputs, inputs, taps)
///     H_0, H_1, ..., in output units per input unit.
/// order : int, optional
///     Number of states. When left out, it is chosen from the singular values: at the first drop by a factor of 20, or
///     else where the remaining ones hold less than 1e-4 of the sum of the squares.
/// blocks : int, optional
///     Number of block rows and columns of the Hankel matrix; (taps - 1) // 2 - 1 when left out, but at most 300 rows or
///     columns.
///
/// Returns
/// -------
/// StateSpace
///     The balanced realization. Its ``singular_values`` are all of them, or only the leading ones where an order of at
///     most 12 is given and the Hankel matrix has 100 rows or more. ``reflected`` is the number of unstable poles that
///     were reflected into the unit circle.
///
/// Raises
/// ------
/// ParameterError
///     The order exceeds the rank, there are too few taps for the blocks, or a tap is not finite.
/// NumericalError
///     The realization cannot be made stable.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> truth = gpi.StateSpace.from_transfer_function([1.0, 0.3], [1.0, -1.2, 0.6])
/// >>> gpi.era(truth.markov(41)).order
/// 2
#[pyfunction]
#[pyo3(signature = (markov, order = None, blocks = None))]
pub(super) fn era(
    py: Python<'_>,
    markov: &Bound<'_, PyAny>,
    order: Option<usize>,
    blocks: Option<usize>,
) -> PyResult<StateSpace> {
    let taps = arrays::markov("markov", markov)?;
    let options = EraOptions { order, blocks };
    let era = py.detach(|| linear::realize(&taps, &options)).map_err(to_python)?;
    Ok(StateSpace {
        system: era.system,
        singular_values: Some(era.singular_values),
        reflected: era.reflected,
    })
}
