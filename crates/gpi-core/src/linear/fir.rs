//! Finite impulse response by least squares: the first stage of the chain.

use super::{NormalEquations, dot};
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
    /// A direction counts as excited when its singular value exceeds this fraction of the largest.
    pub const EXCITATION_TOLERANCE: f64 = 1e-6;

    /// Ratio of the largest to the smallest singular value of the regressor.
    ///
    /// It is computed from squares, so values above 1e8 say no more than "at least that".
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
/// regressor (rows x taps inputs) is never built: its Gram matrix is Toeplitz up to the edges, so the
/// first block row and a two-term recurrence give all of it in `O(rows taps inputs^2)`.
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
    let outputs = record.outputs().len();
    if taps == 0 {
        return Err(Error::parameter("taps", taps, "at least one tap is needed"));
    }
    if !(ridge >= 0.0 && ridge.is_finite()) {
        return Err(Error::parameter("ridge", ridge, "must be zero or positive"));
    }
    let unknowns = taps * inputs;
    let windows: Vec<_> = record.experiments().iter().map(|e| rows(e, taps)).collect();
    let samples = windows.iter().map(ExactSizeIterator::len).sum();
    if samples < unknowns + windows.len() {
        let purpose = format!("{taps} taps x {inputs} inputs and an offset per experiment");
        return Err(Error::TooFewSamples { samples, needed: unknowns + windows.len(), purpose });
    }
    let mut equations = NormalEquations::zeros(unknowns, outputs);
    let mut means = Vec::new();
    for (experiment, window) in record.experiments().iter().zip(windows) {
        means.push(accumulate(&mut equations, experiment, window, taps));
    }
    let solution = equations.solve(Fir::EXCITATION_TOLERANCE, ridge)?;
    let squares = equations.residual_squares(&solution.x);
    let markov: Vec<Matrix> = (0..taps)
        .map(|lag| Matrix::from_fn(outputs, inputs, |o, i| solution.x[(i * taps + lag, o)]))
        .collect();
    let dc: Matrix = markov.iter().sum();
    let offsets = Matrix::from_fn(means.len(), outputs, |e, o| {
        let (input, output, drift) = &means[e];
        // the mean of each regressor column differs from the input's mean by its edges
        let driven = dc.row(o).transpose().dot(input) + drift.dot(&solution.x.column(o));
        output[o] - driven
    });
    Ok(Fir {
        markov,
        offsets,
        singular_values: solution.singular_values,
        rank: solution.rank,
        residual_rms: squares.iter().map(|sum| (sum / samples as f64).sqrt()).collect(),
        samples,
    })
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
        let mut equations = NormalEquations::zeros(lags * inputs, record.outputs().len());
        for experiment in record.experiments() {
            accumulate(&mut equations, experiment, rows(experiment, lags), lags);
        }
        let eigenvalues = super::decompose::symmetric_eigen(&equations.gram)?.0;
        let floor = FLOOR * eigenvalues.mean();
        Ok(eigenvalues.iter().filter(|&&value| value > floor).count())
    };
    let (half, full) = (rank(lags / 2)?, rank(lags)?);
    let saturated = full < lags * inputs && full <= half + inputs;
    Ok(if saturated { full.div_ceil(inputs).max(1) } else { usize::MAX })
}

/// The rows of an experiment that have a full past and are scored.
fn rows(experiment: &Experiment, taps: usize) -> std::ops::Range<usize> {
    let end = experiment.input.nrows();
    experiment.warmup.max(taps - 1).min(end)..end
}

type Vector = nalgebra::DVector<f64>;

/// Adds one experiment's centred equations; returns the means of input and output, and how much the
/// mean of each regressor column exceeds that of its input.
fn accumulate(
    equations: &mut NormalEquations,
    experiment: &Experiment,
    window: std::ops::Range<usize>,
    taps: usize,
) -> (Vector, Vector, Vector) {
    let (start, end) = (window.start, window.end);
    let count = window.len();
    let mean = |matrix: &Matrix| -> Vector {
        let rows = matrix.rows(start, count);
        Vector::from_iterator(rows.ncols(), rows.column_iter().map(|column| column.mean()))
    };
    if count == 0 {
        let (input, output) = (mean_of_none(&experiment.input), mean_of_none(&experiment.output));
        return (input, output, Vector::zeros(equations.rhs.nrows()));
    }
    let (input_mean, output_mean) = (mean(&experiment.input), mean(&experiment.output));
    let centred = |matrix: &Matrix, mean: &Vector| -> Vec<Vec<f64>> {
        let columns = matrix.column_iter().zip(mean.iter());
        columns.map(|(column, mean)| column.iter().map(|value| value - mean).collect()).collect()
    };
    let u = centred(&experiment.input, &input_mean);
    let y = centred(&experiment.output, &output_mean);

    // Sums of the lagged columns over the window; what the centring left over at the edges.
    let mut sums = Vector::zeros(taps * u.len());
    for (channel, column) in u.iter().enumerate() {
        let mut sum: f64 = column[start..end].iter().sum();
        for lag in 0..taps {
            sums[channel * taps + lag] = sum;
            if lag + 1 < taps {
                sum += column[start - 1 - lag] - column[end - 1 - lag];
            }
        }
    }
    let mut gram = Matrix::zeros(sums.len(), sums.len());
    for (a, left) in u.iter().enumerate() {
        for (b, right) in u.iter().enumerate().skip(a) {
            let (row, column) = (a * taps, b * taps);
            for lag in 0..taps {
                gram[(row, column + lag)] = dot(&left[start..end], &right[start - lag..end - lag]);
                gram[(row + lag, column)] = dot(&left[start - lag..end - lag], &right[start..end]);
            }
            for j in 1..taps {
                for i in 1..taps {
                    gram[(row + i, column + j)] = gram[(row + i - 1, column + j - 1)]
                        + left[start - i] * right[start - j]
                        - left[end - i] * right[end - j];
                }
            }
            if a != b {
                let block = gram.view((row, column), (taps, taps)).transpose();
                gram.view_mut((column, row), (taps, taps)).copy_from(&block);
            }
        }
    }
    gram.ger(-1.0 / count as f64, &sums, &sums, 1.0);
    equations.gram += gram;
    for (output, target) in y.iter().enumerate() {
        let target = &target[start..end];
        for (channel, column) in u.iter().enumerate() {
            for lag in 0..taps {
                equations.rhs[(channel * taps + lag, output)] +=
                    dot(&column[start - lag..end - lag], target);
            }
        }
        equations.squares[output] += dot(target, target);
    }
    (input_mean, output_mean, sums / count as f64)
}

fn mean_of_none(matrix: &Matrix) -> Vector {
    Vector::zeros(matrix.ncols())
}
