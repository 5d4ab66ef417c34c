//! Excitation signals.

use crate::arrays::from_vector;
use crate::errors::to_python;
use gpi_core::excitation::{self, Drive, Lines};
use pyo3::prelude::*;

/// A random-phase multisine, one period long, within `range`.
///
/// Parameters
/// ----------
/// samples : int
///     Number of samples, the length of one period.
/// rate : float
///     Sampling rate in Hz.
/// band : tuple of float
///     Lowest and highest excited frequency in Hz.
/// range : tuple of float
///     Smallest and largest value, in the drive's unit.
/// seed : int
///     Seed of the phases.
/// odd : bool
///     Whether to excite odd lines only, so that even nonlinearities are visible at the even lines.
/// detection : bool
///     Whether to omit one in four odd lines at random, so that odd nonlinearities are visible there.
/// slew : float, optional
///     Largest slope in units per second. Harmonics appear if it limits the signal.
///
/// Returns
/// -------
/// ndarray, shape (samples,)
///     The drive signal, in the drive's unit.
///
/// Raises
/// ------
/// ParameterError
///     A parameter is out of its range, or the band contains no line.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 100.0), (0.0, 10.0), odd=True)
/// >>> float(u.min()), float(u.max())
/// (0.0, 10.0)
#[pyfunction]
#[pyo3(signature = (samples, rate, band, range, *, seed = 0, odd = false, detection = false, slew = None))]
fn multisine(
    py: Python<'_>,
    samples: usize,
    rate: f64,
    band: (f64, f64),
    range: (f64, f64),
    seed: u64,
    odd: bool,
    detection: bool,
    slew: Option<f64>,
) -> PyResult<Bound<'_, PyAny>> {
    let lines = match (odd, detection) {
        (_, true) => Lines::OddWithDetection,
        (true, false) => Lines::Odd,
        (false, false) => Lines::All,
    };
    let drive = Drive { samples, rate, range, slew };
    let signal = excitation::multisine(&drive, band, lines, seed).map_err(to_python)?;
    Ok(from_vector(py, &signal))
}

/// A pseudo-random binary signal between the ends of `range`.
///
/// Parameters
/// ----------
/// samples : int
///     Number of samples.
/// rate : float
///     Sampling rate in Hz.
/// clock : float
///     Rate at which the signal may switch, in Hz.
/// range : tuple of float
///     The two levels, in the drive's unit.
/// seed : int
///     Seed of the shift register.
/// slew : float, optional
///     Largest slope in units per second.
///
/// Returns
/// -------
/// ndarray, shape (samples,)
///     The drive signal, in the drive's unit.
///
/// Raises
/// ------
/// ParameterError
///     A parameter is out of its range, or the clock is too slow for the signal to switch at all.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.prbs(1000, 1000.0, 100.0, (0.0, 5.0))
/// >>> sorted(set(u.tolist()))
/// [0.0, 5.0]
#[pyfunction]
#[pyo3(signature = (samples, rate, clock, range, *, seed = 0, slew = None))]
fn prbs(
    py: Python<'_>,
    samples: usize,
    rate: f64,
    clock: f64,
    range: (f64, f64),
    seed: u64,
    slew: Option<f64>,
) -> PyResult<Bound<'_, PyAny>> {
    let drive = Drive { samples, rate, range, slew };
    Ok(from_vector(py, &excitation::prbs(&drive, clock, seed).map_err(to_python)?))
}

/// A triangle wave that starts at the middle of the range, reaches both ends, then decays to the middle.
///
/// Parameters
/// ----------
/// samples : int
///     Number of samples.
/// rate : float
///     Sampling rate in Hz.
/// frequency : float
///     Frequency of the triangle, in Hz.
/// range : tuple of float
///     Smallest and largest value, in the drive's unit.
/// slew : float, optional
///     Largest slope in units per second.
///
/// Returns
/// -------
/// ndarray, shape (samples,)
///     The drive signal, in the drive's unit.
///
/// Raises
/// ------
/// ParameterError
///     A parameter is out of its range, or the signal is shorter than one period.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> u = gpi.decaying_triangle(1000, 1000.0, 4.0, (0.0, 10.0))
/// >>> float(u[0])
/// 5.0
#[pyfunction]
#[pyo3(signature = (samples, rate, frequency, range, *, slew = None))]
fn decaying_triangle(
    py: Python<'_>,
    samples: usize,
    rate: f64,
    frequency: f64,
    range: (f64, f64),
    slew: Option<f64>,
) -> PyResult<Bound<'_, PyAny>> {
    let drive = Drive { samples, rate, range, slew };
    let signal = excitation::decaying_triangle(&drive, frequency).map_err(to_python)?;
    Ok(from_vector(py, &signal))
}

/// Four constant levels of equal duration: the low end of the range, the high end, the middle and the low end.
///
/// While the input is constant, only slow effects change the output. They can be told apart: creep follows each step,
/// drift does not, and a drifting gain is visible only away from zero.
///
/// Parameters
/// ----------
/// samples : int
///     Number of samples.
/// rate : float
///     Sampling rate in Hz.
/// range : tuple of float
///     Smallest and largest value, in the drive's unit.
/// slew : float, optional
///     Largest slope in units per second.
///
/// Returns
/// -------
/// ndarray, shape (samples,)
///     The drive signal, in the drive's unit.
///
/// Raises
/// ------
/// ParameterError
///     A parameter is out of its range, or there are fewer than four samples.
///
/// Examples
/// --------
/// >>> import gpi_hammerstein as gpi
/// >>> gpi.held_steps(8, 1.0, (0.0, 10.0)).tolist()
/// [0.0, 0.0, 10.0, 10.0, 5.0, 5.0, 0.0, 0.0]
#[pyfunction]
#[pyo3(signature = (samples, rate, range, *, slew = None))]
fn held_steps(
    py: Python<'_>,
    samples: usize,
    rate: f64,
    range: (f64, f64),
    slew: Option<f64>,
) -> PyResult<Bound<'_, PyAny>> {
    let drive = Drive { samples, rate, range, slew };
    Ok(from_vector(py, &excitation::held_steps(&drive).map_err(to_python)?))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(multisine, module)?)?;
    module.add_function(wrap_pyfunction!(prbs, module)?)?;
    module.add_function(wrap_pyfunction!(decaying_triangle, module)?)?;
    module.add_function(wrap_pyfunction!(held_steps, module)?)
}
