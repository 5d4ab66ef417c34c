//! The finite impulse response (FIR) model by least squares.

mod double_double;
mod gram;
mod iterated_ridge;
mod lagged_sums;
mod numbers;
mod persistent_excitation;
mod statistic;
mod triangular_factor;

pub use statistic::FirStatistic;

pub(crate) use iterated_ridge::impulse_response;
pub(crate) use persistent_excitation::excitation_limit;

use crate::{Error, Experiment, Matrix, Record};
use lagged_sums::Sums;

/// A finite impulse response model, equation (17) of the paper: `y(k) = sum_{j=0}^{taps-1} H_j u(k-j) + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Fir {
    /// Markov parameters H_0 .. H_{taps-1}, each (outputs, inputs).
    pub markov: Vec<Matrix>,
    /// The offset of each experiment, (experiments, outputs), in the unit of the output.
    pub offsets: Matrix,
    /// Singular values of the regressor with the mean of each experiment removed, descending.
    pub singular_values: Vec<f64>,
    /// Numerical rank, the order of persistent excitation: the number of singular values above
    /// [`Fir::EXCITATION_TOLERANCE`] times the largest. The estimate is the minimum-norm one over these directions.
    pub rank: usize,
    /// Root mean square of the residual of each output, in its unit.
    pub residual_rms: Vec<f64>,
    /// Number of rows of the regression.
    pub samples: usize,
}

impl Fir {
    /// A direction counts as excited if its singular value exceeds this fraction of the largest: smaller singular values
    /// are rounding errors of `f64`.
    pub const EXCITATION_TOLERANCE: f64 = 1e-13;

    /// The condition number of the regressor, its largest over its smallest singular value: the largest factor by which
    /// relative errors of the output may grow in the taps.
    pub fn condition(&self) -> f64 {
        match (self.singular_values.first(), self.singular_values.last()) {
            (Some(largest), Some(smallest)) => largest / smallest,
            _ => f64::INFINITY,
        }
    }

    /// Number of taps, mu + 1 in the paper.
    pub fn taps(&self) -> usize {
        self.markov.len()
    }

    /// The model's output (samples, outputs) for `input` (samples, inputs), which is zero before its first sample; the
    /// offsets are not added.
    pub fn simulate(&self, input: &Matrix) -> Matrix {
        let mut output = Matrix::zeros(input.nrows(), self.markov[0].nrows());
        for (lag, tap) in self.markov.iter().enumerate().take(input.nrows()) {
            let rows = input.nrows() - lag;
            let past = input.rows(0, rows);
            output.rows_mut(lag, rows).gemm(1.0, &past, &tap.transpose(), 1.0);
        }
        output
    }
}

/// Estimates `taps` Markov parameters by least squares, equation (25) of the paper, with one offset per experiment.
///
/// The rows of the regression are the samples behind the warm-up for which the `taps - 1` earlier samples are known. The
/// regressor (rows, taps inputs) is never built: see [`FirStatistic`], which also accepts records in parts.
///
/// `ridge` = 0 is ordinary least squares. A positive ridge suppresses directions that the input hardly excites, such as
/// a frequency band without power: ordinary estimates along them are noise, which [`realize`](super::realize) would
/// model as dynamics. A direction whose eigenvalue of the Gram matrix is w times their mean is scaled by
/// `1 - (ridge / (ridge + w))^3`, as by three passes of iterated ridge regression.
///
/// ```
/// use gpi_core::{Channel, Experiment, Matrix, Record, linear};
/// let u = Matrix::from_fn(200, 1, |k, _| ((k * k) as f64 * 0.7).sin());
/// let y = Matrix::from_fn(200, 1, |k, _| 3.0 + 2.0 * u[k] - if k > 0 { u[k - 1] } else { 0.0 });
/// let channel = |name| vec![Channel::new(name, "")];
/// let runs = vec![Experiment::new(u, y)];
/// let record = Record::new(runs, 1.0, channel("u"), channel("y"), vec![])?;
/// let fir = linear::estimate(&record, 3, 0.0)?;
/// assert!((fir.markov[1][0] + 1.0).abs() < 1e-12 && (fir.offsets[0] - 3.0).abs() < 1e-12);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// `taps` is zero, the ridge is negative, or there are fewer samples than unknowns. Weak excitation is not an error here:
/// see [`Fir::rank`].
pub fn estimate(record: &Record, taps: usize, ridge: f64) -> Result<Fir, Error> {
    require_samples_of(record, taps)?;
    gathered(record, taps)?.solve(ridge)
}

fn require_samples_of(record: &Record, taps: usize) -> Result<(), Error> {
    let runs = record.experiments();
    let rows = |e: &Experiment| e.input.nrows().saturating_sub(e.warmup.max(taps.max(1) - 1));
    require_samples(runs.iter().map(rows).sum(), taps, record.inputs().len(), runs.len())
}

/// The statistic of all experiments of a record.
fn gathered(record: &Record, taps: usize) -> Result<FirStatistic, Error> {
    let mut statistic = FirStatistic::new(taps, record.inputs().len(), record.outputs().len())?;
    for experiment in record.experiments() {
        statistic.begin(experiment.warmup);
        statistic.take(&experiment.input, &experiment.output);
    }
    Ok(statistic)
}

impl FirStatistic {
    /// The least squares estimate from all data so far; `ridge` as for [`estimate`].
    ///
    /// # Errors
    /// The ridge is negative, or there are fewer samples than unknowns.
    pub fn solve(&self, ridge: f64) -> Result<Fir, Error> {
        let is_valid = ridge >= 0.0 && ridge.is_finite();
        Error::require(is_valid, "ridge", ridge, "must be zero or positive")?;
        let (taps, inputs, outputs) = self.shape();
        let (samples, unknowns) = (self.samples(), taps * inputs);
        require_samples(samples, taps, inputs, self.experiments())?;
        let (factor, sums) = self.decompose();
        let solution = factor.solve(Fir::EXCITATION_TOLERANCE, ridge)?;
        let squares = &solution.residual_squares;
        let tap = |lag| Matrix::from_fn(outputs, inputs, |o, i| solution.x[(i * taps + lag, o)]);
        let offsets = Matrix::from_fn(sums.len(), outputs, |e, o| {
            let Sums { count, columns } = &sums[e];
            let driven = columns.rows(0, unknowns).dot(&solution.x.column(o));
            (columns[unknowns + o] - driven) / (*count).max(1) as f64
        });
        Ok(Fir {
            markov: (0..taps).map(tap).collect(),
            offsets,
            singular_values: solution.singular_values,
            rank: solution.rank,
            residual_rms: squares.iter().map(|sum| (sum / samples as f64).sqrt()).collect(),
            samples,
        })
    }
}

fn require_samples(
    samples: usize,
    taps: usize,
    inputs: usize,
    experiments: usize,
) -> Result<(), Error> {
    let needed = taps.saturating_mul(inputs).saturating_add(experiments);
    let purpose = format!("{taps} taps x {inputs} inputs and an offset per experiment");
    Error::require_samples(samples, needed, purpose)
}
