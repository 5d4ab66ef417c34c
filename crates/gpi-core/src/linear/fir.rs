//! Finite impulse response by least squares: the first stage of the chain.

use super::fir_statistic::{FirStatistic, Sums};
use crate::{Error, Experiment, Matrix, Record};

/// A finite impulse response model, equation (17) of the paper:
/// `y(k) = sum_{j=0}^{taps-1} H_j u(k-j) + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Fir {
    /// Markov parameters H_0 .. H_{taps-1}, each (outputs, inputs).
    pub markov: Vec<Matrix>,
    /// The constant term of each experiment, (experiments, outputs).
    pub offsets: Matrix,
    /// Singular values of the regressor without its offsets, descending.
    pub singular_values: Vec<f64>,
    /// How many of them exceed [`Fir::EXCITATION_TOLERANCE`] times the largest; the estimate is the
    /// minimum-norm one over these directions.
    pub rank: usize,
    /// Root mean square of the residual of each output.
    pub residual_rms: Vec<f64>,
    /// Rows of the regression.
    pub samples: usize,
}

impl Fir {
    /// A direction counts as excited when its singular value exceeds this fraction of the largest: smaller ones
    /// are rounding.
    pub const EXCITATION_TOLERANCE: f64 = 1e-13;

    /// Ratio of the largest to the smallest singular value of the regressor: by so much errors of the output may
    /// grow in the taps.
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

    /// The model's output for an input at rest before its first sample; offsets are left out.
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

/// Estimates `taps` Markov parameters by least squares, equation (25) of the paper, with one offset
/// per experiment.
///
/// The rows are those samples that are scored and whose past reaches back `taps - 1` samples. The
/// regressor (rows x taps inputs) is never built: see [`FirStatistic`], which also takes records in parts.
///
/// `ridge` = 0 is plain least squares. A positive one leaves out what the input hardly excites (a
/// band without excitation, say), where plain estimates are noise that [`realize`](super::realize)
/// would take for dynamics: with w an eigenvalue of the Gram matrix over their mean, its direction is
/// scaled by `1 - (ridge / (ridge + w))^3`, as three passes of iterated ridge regression do.
///
/// ```
/// use gpi_core::{Channel, Experiment, Matrix, Record, linear};
/// let u = Matrix::from_fn(200, 1, |k, _| ((k * k) as f64 * 0.7).sin());
/// let y = Matrix::from_fn(200, 1, |k, _| 3.0 + 2.0 * u[k] - if k > 0 { u[k - 1] } else { 0.0 });
/// let run = Experiment { input: u, output: y, covariates: Matrix::zeros(200, 0), warmup: 0, held_out: vec![] };
/// let channel = |name: &str| vec![Channel::new(name, "")];
/// let record = Record::new(vec![run], 1.0, channel("u"), channel("y"), vec![])?;
/// let fir = linear::estimate(&record, 3, 0.0)?;
/// assert!((fir.markov[1][0] + 1.0).abs() < 1e-12 && (fir.offsets[0] - 3.0).abs() < 1e-12);
/// # Ok::<(), gpi_core::Error>(())
/// ```
///
/// # Errors
/// No taps, a negative ridge, fewer samples than unknowns. Weak excitation is not an error here: see [`Fir::rank`].
pub fn estimate(record: &Record, taps: usize, ridge: f64) -> Result<Fir, Error> {
    let inputs = record.inputs().len();
    let runs = record.experiments();
    let rows = |e: &Experiment| e.input.nrows().saturating_sub(e.warmup.max(taps.max(1) - 1));
    require_samples(runs.iter().map(rows).sum(), taps, inputs, runs.len())?;
    gathered(record, taps)?.solve(ridge)
}

fn gathered(record: &Record, taps: usize) -> Result<FirStatistic, Error> {
    let mut statistic = FirStatistic::new(taps, record.inputs().len(), record.outputs().len())?;
    for experiment in record.experiments() {
        statistic.begin(experiment.warmup);
        statistic.take(&experiment.input, &experiment.output);
    }
    Ok(statistic)
}

impl FirStatistic {
    /// The least squares estimate from all that came; `ridge` as for [`estimate`].
    ///
    /// # Errors
    /// A negative ridge, fewer samples than unknowns.
    pub fn solve(&self, ridge: f64) -> Result<Fir, Error> {
        if !(ridge >= 0.0 && ridge.is_finite()) {
            return Err(Error::parameter("ridge", ridge, "must be zero or positive"));
        }
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
    if samples < needed {
        let purpose = format!("{taps} taps x {inputs} inputs and an offset per experiment");
        return Err(Error::TooFewSamples { samples, needed, purpose });
    }
    Ok(())
}

/// The largest number of taps that the input of a record supports, `usize::MAX` when more taps always
/// find more excitation.
///
/// A sum of M sines excites 2M directions, however many taps are asked for; broadband input excites
/// ever more. The two are told apart by the rank at 64 and at 32 lags (fewer on short records).
pub(crate) fn excitation_limit(record: &Record) -> Result<usize, Error> {
    /// Power of a direction relative to the mean that counts as excitation.
    const FLOOR: f64 = 1e-4;
    let inputs = record.inputs().len();
    let longest = record.experiments().iter().map(|e| e.input.nrows()).max().unwrap_or(0);
    let lags = (longest / (4 * inputs)).clamp(2, 64);
    let rank = |lags: usize| -> Result<usize, Error> {
        let (factor, _) = gathered(record, lags)?.decompose();
        let values = factor.singular_values()?;
        let powers = values.iter().map(|value| value * value);
        let floor = FLOOR * powers.clone().sum::<f64>() / values.len() as f64;
        Ok(powers.filter(|&power| power > floor).count())
    };
    let (half, full) = (rank(lags / 2)?, rank(lags)?);
    let saturated = full < lags * inputs && full <= half + inputs;
    Ok(if saturated { full.div_ceil(inputs).max(1) } else { usize::MAX })
}
