//! What a residual still contains: named tests, each with what it points to.

use crate::identify::colour::Colour;
use crate::identify::outliers;
use crate::{Error, Matrix, Record};
use num_complex::Complex64;
use rustfft::FftPlanner;

/// One test of a residual.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualTest {
    /// Such as `whiteness`.
    pub name: &'static str,
    /// The output it looks at.
    pub output: usize,
    /// What is compared with the threshold.
    pub statistic: f64,
    /// What the statistic must not exceed: for whiteness the value of chance a hundredth over the number of
    /// tests, or a hundredth of the variance if that is more; four standard errors for a dependence.
    pub threshold: f64,
    /// The chance that a residual without structure gives a statistic this large or larger.
    pub p_value: f64,
    /// What it points to when it fails.
    pub points_to: &'static str,
}

impl ResidualTest {
    /// Whether the residual shows nothing here.
    pub fn passed(&self) -> bool {
        self.statistic <= self.threshold
    }
}

/// Names of the tests that show a dependence on the input or on time: more than noise with memory.
pub(crate) const STRUCTURE: [&str; 8] =
    ["past-input", "level", "speed", "direction", "amplitude", "higher-order", "trend", "lines"];

/// Signals that the residual is compared with, each (samples, channels), one an experiment.
#[derive(Clone, Copy)]
pub(crate) struct Beside<'a> {
    pub record: &'a Record,
    pub residuals: &'a [Matrix],
    /// The simulated output.
    pub simulated: &'a [Matrix],
}

/// All tests of every output.
pub(crate) fn analyse(beside: &Beside) -> Result<Vec<ResidualTest>, Error> {
    let mut tests = Vec::new();
    // A line stands out of a steep spectrum only once that is flat.
    let flat = Colour::of(beside.residuals, beside.record).whiten(beside.residuals);
    let whitened = Beside { residuals: &flat, ..*beside };
    let squares: Vec<Matrix> = beside
        .residuals
        .iter()
        .map(|residual| {
            let mean = residual.map(|value| value * value).row_mean();
            Matrix::from_fn(residual.nrows(), residual.ncols(), |k, o| {
                residual[(k, o)] * residual[(k, o)] - mean[o]
            })
        })
        .collect();
    for output in 0..beside.record.outputs().len() {
        tests.push(whiteness(beside, output));
        tests.push(lines(&whitened, output));
        for (name, points_to, regressors) in families(beside, output) {
            tests.push(independence(beside, output, name, points_to, &regressors));
        }
        let loudness = Beside { residuals: &squares, ..*beside };
        let all = families(beside, output).into_iter().filter(|family| family.0 != "past-input");
        let regressors: Regressors = all.flat_map(|family| family.2).collect();
        let points_to = "noise that depends on the input or on time, many small effects";
        tests.push(independence(&loudness, output, "higher-order", points_to, &regressors));
        tests.push(wrong_samples(beside, output));
    }
    // Bonferroni: a hundredth for all tests together
    let each = 0.01 / tests.len() as f64;
    /// Less of a residual's variance in its correlations is of no practical size, however sure.
    const SMALL: f64 = 0.01;
    let small = SMALL * beside.record.scored() as f64;
    for test in tests.iter_mut().filter(|test| test.name == "whiteness") {
        test.threshold = chi_square_above(each, LAGS as f64).max(small);
    }
    Ok(tests)
}

const LAGS: usize = 25;

/// Ljung and Box: `Q = n (n + 2) sum_k r_k^2 / (n - k)` over the first lags of the autocorrelation.
fn whiteness(beside: &Beside, output: usize) -> ResidualTest {
    let mut covariances = [0.0; LAGS + 1];
    let mut n = 0.0;
    for (residual, experiment) in beside.residuals.iter().zip(beside.record.experiments()) {
        for run in experiment.scored_rows(residual) {
            let values = run.column(output);
            n += values.len() as f64;
            for (lag, sum) in covariances.iter_mut().enumerate().take(values.len()) {
                *sum += (lag..values.len()).map(|k| values[k] * values[k - lag]).sum::<f64>();
            }
        }
    }
    let variance = covariances[0].max(f64::MIN_POSITIVE);
    let sum: f64 = (1..=LAGS)
        .map(|lag| (covariances[lag] / variance).powi(2) / (n - lag as f64).max(1.0))
        .sum();
    let statistic = n * (n + 2.0) * sum;
    ResidualTest {
        name: "whiteness",
        output,
        statistic,
        threshold: 0.0,
        p_value: chi_square_tail(statistic, LAGS as f64),
        points_to: "memory that the model lacks, or coloured noise",
    }
}

/// The largest line of the periodogram over the median of those around it (Fisher's test, against the
/// local background): exponential for noise of any smooth spectrum.
fn lines(beside: &Beside, output: usize) -> ResidualTest {
    const AROUND: usize = 64;
    let (mut most, mut count) = (0.0_f64, 0.0);
    for (residual, experiment) in beside.residuals.iter().zip(beside.record.experiments()) {
        for run in experiment.scored_rows(residual) {
            let n = run.nrows();
            if n < 4 * AROUND {
                continue;
            }
            let column = run.column(output);
            let mean = column.mean();
            let window =
                |k: usize| (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).sin().powi(2);
            let mut spectrum: Vec<Complex64> = column
                .iter()
                .enumerate()
                .map(|(k, value)| Complex64::new((value - mean) * window(k), 0.0))
                .collect();
            FftPlanner::new().plan_fft_forward(n).process(&mut spectrum);
            let power: Vec<f64> = spectrum[4..n / 2].iter().map(Complex64::norm_sqr).collect();
            for chunk in power.chunks(AROUND).filter(|chunk| chunk.len() == AROUND) {
                let mut sorted = chunk.to_vec();
                sorted.sort_by(f64::total_cmp);
                let median = sorted[AROUND / 2].max(f64::MIN_POSITIVE);
                most = most.max(sorted[AROUND - 1] / median);
                count += AROUND as f64;
            }
        }
    }
    // power over median is exponential with mean 1 / ln 2
    let single = (-(2.0_f64.ln()) * most).exp();
    ResidualTest {
        name: "lines",
        output,
        statistic: most,
        threshold: (count.max(1.0) / 1e-4).ln() / 2.0_f64.ln() * 1.35,
        p_value: (single * count).min(1.0),
        points_to: "periodic-disturbance",
    }
}

type Regressors = Vec<Vec<Vec<f64>>>;

/// Functions of input, output and time that a residual must not follow: name, what it points to,
/// `[regressor][experiment][sample]`.
fn families(beside: &Beside, output: usize) -> Vec<(&'static str, &'static str, Regressors)> {
    let rate = beside.record.rate();
    let runs = || beside.record.experiments().iter().zip(beside.simulated);
    let level = || -> Vec<Vec<f64>> {
        let all: Vec<f64> = beside
            .simulated
            .iter()
            .flat_map(|m| m.column(output).iter().copied().collect::<Vec<_>>())
            .collect();
        let low = all.iter().copied().fold(f64::INFINITY, f64::min);
        let high = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(f64::MIN_POSITIVE));
        let scaled = |m: &Matrix| m.column(output).iter().map(|x| (x - middle) / half).collect();
        beside.simulated.iter().map(scaled).collect()
    };
    let x = level();
    let speeds: Vec<Vec<f64>> = runs()
        .map(|(e, _)| {
            let u = e.input.column(0);
            (0..u.len()).map(|k| if k == 0 { 0.0 } else { (u[k] - u[k - 1]) * rate }).collect()
        })
        .collect();
    let squares: f64 = speeds.iter().flatten().map(|s: &f64| s * s).sum();
    let count = speeds.iter().map(Vec::len).sum::<usize>() as f64;
    let scale = (squares / count).sqrt().max(f64::MIN_POSITIVE);
    let map = |f: &dyn Fn(f64, f64) -> f64| -> Vec<Vec<f64>> {
        let pairs = x.iter().zip(&speeds);
        pairs
            .map(|(x, s)| {
                x.iter().zip(s).map(|(&x, &s)| f(x, (s / scale).clamp(-5.0, 5.0))).collect()
            })
            .collect()
    };
    let sign = |s: f64| if s == 0.0 { 0.0 } else { s.signum() };
    let lagged = |lag: usize| -> Vec<Vec<f64>> {
        let shift = |s: &Vec<f64>| {
            (0..s.len()).map(|k| if k < lag { 0.0 } else { s[k - lag] / scale }).collect()
        };
        speeds.iter().map(shift).collect()
    };
    let time = |f: &dyn Fn(f64) -> f64| -> Vec<Vec<f64>> {
        x.iter()
            .map(|x| (0..x.len()).map(|k| f(2.0 * k as f64 / x.len() as f64 - 1.0)).collect())
            .collect()
    };
    let scaled: Vec<Vec<f64>> =
        speeds.iter().map(|s| s.iter().map(|s| s / scale).collect()).collect();
    let swell = |x: &[Vec<f64>], signal: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let pairs = x.iter().zip(signal);
        let product = |(x, signal): (&Vec<f64>, &Vec<f64>)| {
            swelling(x, 0.05 * rate).iter().zip(signal).map(|(a, b)| a * b).collect()
        };
        pairs.map(product).collect()
    };
    vec![
        (
            "past-input",
            "linear-dynamics, delay, creep",
            [0, 1, 2, 4, 8, 16, 32, 64, 128, 256].map(lagged).to_vec(),
        ),
        (
            "level",
            "output-nonlinearity, envelope",
            vec![
                map(&|x, _| x),
                map(&|x, _| x * x),
                map(&|x, _| x.powi(3)),
                map(&|x, _| x.powi(4)),
                map(&|x, _| x.powi(5)),
            ],
        ),
        (
            "speed",
            "rate-dependence, amplifier-slew",
            vec![
                map(&|_, s| s.abs()),
                map(&|_, s| s * s.abs()),
                map(&|_, s| s * s),
                map(&|x, s| x * s.abs()),
            ],
        ),
        (
            "direction",
            "backlash, hysteresis-shape",
            vec![
                map(&|_, s| sign(s)),
                map(&|x, s| sign(s) * x),
                map(&|x, s| sign(s) * x * x),
                map(&|x, s| sign(s) * x.powi(3)),
            ],
        ),
        ("amplitude", "stiffness", vec![swell(&x, &x), swell(&x, &scaled)]),
        (
            "trend",
            "drift, gain-drift, creep",
            vec![
                time(&|t| t),
                time(&|t| t * t),
                time(&|t| t.powi(3)),
                time(&|t| (6.0 * t).sin()),
                time(&|t| (6.0 * t).cos()),
            ],
        ),
    ]
}

/// How large the swings of a signal are at each sample: the square of what is fast in it, smoothed over
/// so many samples.
fn swelling(signal: &[f64], samples: f64) -> Vec<f64> {
    let keep = (-1.0 / samples.max(1.0)).exp();
    let (mut slow, mut square) = (signal.first().copied().unwrap_or(0.0), 0.0);
    signal
        .iter()
        .map(|&value| {
            slow = keep * slow + (1.0 - keep) * value;
            square = keep * square + (1.0 - keep) * (value - slow).powi(2);
            square
        })
        .collect()
}

/// The largest of the regressors' `t = sum_b g_b / sqrt(sum_b g_b^2)`, with g_b the product of residual and
/// regressor summed over block b: valid for noise of any colour that is shorter than a block, and for
/// noise that is louder in places.
fn independence(
    beside: &Beside,
    output: usize,
    name: &'static str,
    points_to: &'static str,
    regressors: &Regressors,
) -> ResidualTest {
    const BLOCKS: usize = 40;
    let mut largest = 0.0_f64;
    for regressor in regressors {
        let (mut sum, mut squares, mut parts) = (0.0, 0.0, 0);
        let total: usize = beside.record.scored();
        let length = (total / BLOCKS).max(1);
        let (mut mean, mut count) = (0.0, 0.0);
        for (values, experiment) in regressor.iter().zip(beside.record.experiments()) {
            for k in experiment.scored_runs().flatten() {
                mean += values[k];
                count += 1.0;
            }
        }
        mean /= count;
        let (mut own, mut filled) = (0.0, 0);
        for ((values, residual), experiment) in
            regressor.iter().zip(beside.residuals).zip(beside.record.experiments())
        {
            for k in experiment.scored_runs().flatten() {
                own += (values[k] - mean) * residual[(k, output)];
                filled += 1;
                if filled == length {
                    sum += own;
                    squares += own * own;
                    parts += 1;
                    (own, filled) = (0.0, 0);
                }
            }
        }
        if parts > 4 && squares > 0.0 {
            largest = largest.max((sum / squares.sqrt()).abs());
        }
    }
    let tests = regressors.len() as f64;
    ResidualTest {
        name,
        output,
        statistic: largest,
        threshold: 4.0,
        p_value: (tests * normal_tails(largest)).min(1.0),
        points_to,
    }
}

fn wrong_samples(beside: &Beside, output: usize) -> ResidualTest {
    let places = outliers::places(beside.residuals, beside.record, 0);
    let count: usize = places.iter().map(|experiment| experiment[output].len()).sum();
    let expected = 2e-9 * beside.record.scored() as f64;
    ResidualTest {
        name: "outliers",
        output,
        statistic: count as f64,
        threshold: 2.0,
        p_value: if count == 0 { 1.0 } else { expected.min(1.0).powi(count.min(9) as i32) },
        points_to: "outliers",
    }
}

/// The chance of a standard normal number beyond plus or minus z.
fn normal_tails(z: f64) -> f64 {
    statrs::function::erf::erfc(z / std::f64::consts::SQRT_2)
}

/// The chance of a chi-square number above `value`.
fn chi_square_tail(value: f64, freedom: f64) -> f64 {
    statrs::function::gamma::gamma_ur(0.5 * freedom, 0.5 * value.max(1e-300))
}

/// The value that a chi-square number exceeds with this chance.
fn chi_square_above(chance: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 10.0 * freedom + 1e3);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if chi_square_tail(middle, freedom) > chance { low = middle } else { high = middle }
    }
    high
}
