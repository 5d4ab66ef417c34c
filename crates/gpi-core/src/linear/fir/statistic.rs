//! The sufficient statistic of the FIR least squares problem, for records of any length.

use super::gram::Gram;
use super::lagged_sums::{LaggedSums, Sums};
use super::triangular_factor::TriangularFactor;
use crate::{Error, Matrix};

/// The Gram matrix of the lagged inputs and the outputs, from which [`FirStatistic::solve`] gives the least squares
/// estimate (25) of the paper.
///
/// Its size, `(taps inputs)^2`, does not depend on the number of samples: a record larger than memory can be added in
/// parts, and the statistics of several records can be merged. The mean of each experiment is removed.
///
/// The matrix has twice the working precision. The estimate is therefore as accurate as one by an orthogonal
/// decomposition of the regressor, although the Gram matrix squares its condition number.
///
/// ```
/// use gpi_core::{Matrix, linear::FirStatistic};
/// let u = Matrix::from_fn(300, 1, |k, _| ((k * k) as f64 * 0.7).sin());
/// let y = Matrix::from_fn(300, 1, |k, _| 3.0 + 2.0 * u[k] - if k > 0 { u[k - 1] } else { 0.0 });
/// let mut statistic = FirStatistic::new(3, 1, 1)?;
/// for start in [0, 100, 200] {
///     statistic.push(&u.rows(start, 100).into(), &y.rows(start, 100).into())?;
/// }
/// let fir = statistic.solve(0.0)?;
/// assert!((fir.markov[1][0] + 1.0).abs() < 1e-12 && (fir.offsets[0] - 3.0).abs() < 1e-12);
/// # Ok::<(), gpi_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FirStatistic {
    taps: usize,
    inputs: usize,
    outputs: usize,
    gram: Gram,
    /// One for each experiment that has ended.
    sums: Vec<Sums>,
    present: LaggedSums,
}

impl FirStatistic {
    /// Largest product of taps and inputs: its Gram matrix takes 6.4 GB.
    pub const LARGEST: usize = 20_000;

    /// An empty statistic for `taps` Markov parameters, each (outputs, inputs).
    ///
    /// # Errors
    /// `taps`, `inputs` or `outputs` is zero, or there are more unknowns than [`FirStatistic::LARGEST`].
    pub fn new(taps: usize, inputs: usize, outputs: usize) -> Result<Self, Error> {
        for (name, value) in [("taps", taps), ("inputs", inputs), ("outputs", outputs)] {
            Error::require(value > 0, name, value, "at least one is needed")?;
        }
        let fits = taps.saturating_mul(inputs) <= Self::LARGEST;
        let requirement = format!("with {inputs} inputs at most {} fit", Self::LARGEST / inputs);
        Error::require(fits, "taps", taps, requirement)?;
        Ok(Self {
            taps,
            inputs,
            outputs,
            gram: Gram::zeros(taps * inputs, outputs),
            sums: Vec::new(),
            present: LaggedSums::new(taps, inputs, outputs, 0),
        })
    }

    /// Number of taps.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// Number of rows of the regression so far: samples for which the `taps - 1` earlier samples are known.
    pub fn samples(&self) -> usize {
        self.sums.iter().map(|sums| sums.count).sum::<usize>() + self.present.count()
    }

    /// Adds the next samples of the present experiment: `input` is (samples, inputs), `output` (samples, outputs).
    ///
    /// # Errors
    /// Input and output differ in length, the number of channels differs from the statistic's, or a sample is not
    /// finite; the statistic is then unchanged.
    pub fn push(&mut self, input: &Matrix, output: &Matrix) -> Result<(), Error> {
        Error::require_equal("samples", ("input", input.nrows()), ("output", output.nrows()))?;
        self.require_shape("here", (self.taps, input.ncols(), output.ncols()))?;
        Error::require_finite("input", input)?;
        Error::require_finite("output", output)?;
        self.take(input, output);
        Ok(())
    }

    /// [`FirStatistic::push`] without checks.
    pub(super) fn take(&mut self, input: &Matrix, output: &Matrix) {
        self.present.push(input, output);
    }

    /// Ends the present experiment: the next samples have an unknown past and an offset of their own.
    pub fn end_experiment(&mut self) {
        self.begin(0);
    }

    /// Ends the present experiment. In the next one, samples before `first` serve as the past of later ones only.
    pub(super) fn begin(&mut self, first: usize) {
        let next = LaggedSums::new(self.taps, self.inputs, self.outputs, first);
        let ended = std::mem::replace(&mut self.present, next);
        if ended.seen > 0 {
            self.sums.push(ended.add_to(&mut self.gram, self.taps));
        }
    }

    /// Adds the data of another statistic; the present experiments of both end.
    ///
    /// # Errors
    /// The statistics differ in the number of taps, inputs or outputs.
    pub fn merge(&mut self, mut other: Self) -> Result<(), Error> {
        self.require_shape("the other", other.shape())?;
        self.end_experiment();
        other.end_experiment();
        self.gram.add(&other.gram);
        self.sums.extend(other.sums);
        Ok(())
    }

    /// The triangular factor of the regressor of all data, and the sums of each experiment.
    pub(super) fn decompose(&self) -> (TriangularFactor, Vec<Sums>) {
        let mut all = self.clone();
        all.end_experiment();
        (all.gram.factor(), all.sums)
    }

    /// The normal equations in working precision: `A^T A` and `A^T y` of the centred regressor A and targets y.
    pub(super) fn equations(&self) -> (Matrix, Matrix) {
        let mut all = self.clone();
        all.end_experiment();
        all.gram.rounded()
    }

    /// Number of experiments, including the present one.
    pub fn experiments(&self) -> usize {
        self.sums.len() + usize::from(self.present.seen > 0)
    }

    /// Number of taps, inputs and outputs.
    pub(super) fn shape(&self) -> (usize, usize, usize) {
        (self.taps, self.inputs, self.outputs)
    }

    fn require_shape(&self, name: &str, other: (usize, usize, usize)) -> Result<(), Error> {
        let own = "the statistic";
        Error::require_equal("taps", (own, self.taps), (name, other.0))?;
        Error::require_equal("inputs", (own, self.inputs), (name, other.1))?;
        Error::require_equal("outputs", (own, self.outputs), (name, other.2))
    }
}
