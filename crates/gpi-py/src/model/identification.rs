//! How a model was identified.

use crate::arrays::from_vector;
use crate::linear::Fir;
use crate::plotting::plot;
use gpi_core::identify as core;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// How a model was identified.
///
/// Examples
/// --------
/// >>> u = gpi.multisine(2000, 1000.0, (0.5, 400.0), (0.0, 10.0))
/// >>> record = gpi.Record(u, gpi.PlayBank([0.0, 2.0], [1.0, 0.5])(u), 1000.0)
/// >>> model = gpi.identify(record, delay=0, half_widths=[0.0, 2.0], thresholds=0)
/// >>> [(row["order"], row["plays"]) for row in model.identification.candidates]
/// [(0, 2)]
#[pyclass(module = "gpi_hammerstein", frozen)]
pub(crate) struct Identification {
    pub(crate) found: core::Identification,
}

#[pymethods]
impl Identification {
    /// The first estimate of the paper, a FIR model from u to y; None if the input excites only a gain and a delay.
    #[getter]
    fn fir(&self) -> Option<Fir> {
        self.found.fir.clone().map(|fir| Fir { fir })
    }

    /// Singular values of ERA's Hankel matrix in the best round, shape (n,), descending, in output units per unit of v;
    /// empty if the input excites only a gain and a delay.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        from_vector(py, &self.found.singular_values)
    }

    /// Number of unstable poles that were reflected into the unit circle.
    #[getter]
    fn reflected(&self) -> usize {
        self.found.reflected
    }

    /// Order of persistent excitation of the input, the number of taps that it supports; None if no limit was found.
    #[getter]
    fn supported_taps(&self) -> Option<usize> {
        Some(self.found.supported_taps).filter(|&taps| taps < usize::MAX)
    }

    /// Delay in samples if the linear part is a gain with a delay, else None.
    #[getter]
    fn delay(&self) -> Option<usize> {
        self.found.delay
    }

    /// The residual after each round: rows of ``rms`` (training data, in the output's unit), ``order``, ``taps``.
    #[getter]
    fn rounds<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let row = |round: &core::Round| {
            let row = PyDict::new(py);
            row.set_item("rms", round.rms)?;
            row.set_item("order", round.order)?;
            row.set_item("taps", round.taps)?;
            Ok(row)
        };
        self.found.rounds.iter().map(row).collect()
    }

    /// The structures that were compared, in the order in which they were fitted.
    ///
    /// Rows of ``delay``, ``order``, ``plays``, ``deadzones``, ``rms`` (in the output's unit), ``parameters`` (their number),
    /// ``used`` (their effective number, corrected for the residual's autocorrelation), ``criterion`` (BIC, ``N ln rms^2 +
    /// used ln N``; None for a structure that is ruled out because a mode follows a line of the mains), ``chosen``. Of the
    /// structures with the same hysteresis as the one with the smallest criterion, the model of the noise chooses the order.
    #[getter]
    fn candidates<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let row = |(place, candidate): (usize, &core::Candidate)| {
            let row = PyDict::new(py);
            row.set_item("delay", candidate.delay)?;
            row.set_item("order", candidate.order)?;
            row.set_item("plays", candidate.plays)?;
            row.set_item("deadzones", candidate.deadzones)?;
            row.set_item("rms", candidate.rms)?;
            row.set_item("parameters", candidate.parameters)?;
            row.set_item("used", candidate.used)?;
            let criterion = Some(candidate.criterion).filter(|value| value.is_finite());
            row.set_item("criterion", criterion)?;
            row.set_item("chosen", place == self.found.chosen)?;
            Ok(row)
        };
        self.found.candidates.iter().enumerate().map(row).collect()
    }

    /// Samples at the start of each experiment that were not scored.
    #[getter]
    fn warmups(&self) -> Vec<usize> {
        self.found.warmups.clone()
    }

    /// Remarks for the user, each a sentence.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.found.notes.clone()
    }

    /// Draws the structures that were compared; see ``gpi_hammerstein.plot.candidates``.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes for the criterion; those of a new figure when left out.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     The criterion's axes.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        plot("candidates", slf.as_any(), ax)
    }

    fn __repr__(&self) -> String {
        let rms: Vec<String> =
            self.found.rounds.iter().map(|round| format!("{:.4e}", round.rms)).collect();
        format!("Identification(rms by round: {})", rms.join(", "))
    }
}
