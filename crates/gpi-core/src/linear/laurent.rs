//! The noncausal FIR inverse of stable dynamics, with zeros inside or outside the unit circle.
//!
//! On the annulus that contains the unit circle, `G^-1(z) = sum_i h_i z^-i` (45) with matrices h_i (inputs, outputs), the
//! Fourier coefficients of `G^-1(e^{jw})`. They are computed by a discrete Fourier transform of N points, which gives the
//! periodic sum `sum_m h_{i + m N}`. The coefficients decay as `rho^|i|`, where rho is the largest modulus of a zero
//! inside the circle or of the inverse of a zero outside, so N follows from rho and the accepted error.

use super::StateSpace;
use super::decompose::solve;
use crate::{Error, Matrix};
use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::ops::Range;

/// Smallest accepted distance of a zero from the unit circle: nearer zeros would make the inverse longer than about 10^5
/// samples.
pub const ZERO_TOLERANCE: f64 = 1e-4;

/// Aliasing error, as a fraction of the truncation tolerance and absolute: it must not contribute to the truncation error.
const ALIASING: (f64, f64) = (1e-3, 1e-15);

/// Least decay rho of the Laurent coefficients that is assumed: a few more points than needed for zeros near the origin.
const SLOWEST: f64 = 0.5;

/// The truncation of the Laurent series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseOptions {
    /// r, the number of causal taps besides tap 0; chosen from `tolerance` if `None`.
    pub causal: Option<usize>,
    /// d, the number of noncausal taps (the preview in samples); chosen from `tolerance` if `None`.
    pub noncausal: Option<usize>,
    /// Largest truncation error ([`NoncausalFir::error`]) for the choice of r and d.
    pub tolerance: f64,
}

impl Default for InverseOptions {
    fn default() -> Self {
        Self { causal: None, noncausal: None, tolerance: 1e-6 }
    }
}

/// The truncated Laurent series of G^-1 on the annulus that contains the unit circle, equation (46) of the paper:
/// `v(k) = sum_{i=-d}^{r} h_i y(k-i)`.
#[derive(Clone, Debug, PartialEq)]
pub struct NoncausalFir {
    /// h_{-d} .. h_r, each (inputs, outputs) of G.
    pub taps: Vec<Matrix>,
    /// d, the number of future samples that the inverse needs.
    pub noncausal: usize,
    /// Truncation error: the sum of the norms of the omitted taps, as a fraction of the sum over all taps. It bounds the
    /// relative error of the frequency response, (T2) in the documentation's theory.
    pub error: f64,
}

/// An estimate of the intermediate signal v, with the range in which it is valid.
#[derive(Clone, Debug, PartialEq)]
pub struct IntermediateSignal {
    /// v-hat, (samples, inputs of G). Before its first and after its last sample, the output is taken as constant.
    pub values: Matrix,
    /// The samples that depend on measured outputs only.
    pub valid: Range<usize>,
}

impl StateSpace {
    /// The noncausal FIR approximation of G^-1, equations (45) and (46) of the paper.
    ///
    /// A strictly proper or nonminimum-phase G leads to noncausal taps.
    ///
    /// ```
    /// use gpi_core::linear::{InverseOptions, TransferFunction};
    /// // nonminimum phase: the zero at 2 makes the inverse noncausal
    /// let system = TransferFunction::new(&[1.0, -2.0], &[1.0, 0.0])?.to_state_space()?;
    /// let inverse = system.noncausal_inverse(&InverseOptions::default())?;
    /// assert!(inverse.noncausal >= 20 && inverse.error <= 1e-6);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The numbers of inputs and outputs differ, a zero is within [`ZERO_TOLERANCE`] of the unit circle, G is unstable, or
    /// the tolerance is outside (0, 1).
    pub fn noncausal_inverse(&self, options: &InverseOptions) -> Result<NoncausalFir, Error> {
        Error::require_equal("channels", ("inputs", self.inputs()), ("outputs", self.outputs()))?;
        let tolerance = options.tolerance;
        let is_valid = tolerance > 0.0 && tolerance < 1.0;
        Error::require(is_valid, "tolerance", tolerance, "must lie between 0 and 1")?;
        let modulus = self.spectral_radius()?;
        if modulus >= 1.0 {
            return Err(unstable(modulus));
        }
        let mut slowest = SLOWEST;
        for zero in self.zeros()? {
            let distance = (zero.norm() - 1.0).abs();
            if distance < ZERO_TOLERANCE {
                return Err(zero_on_circle(distance, zero.arg().abs()));
            }
            slowest = slowest.max(zero.norm().min(1.0 / zero.norm()));
        }
        // aliasing of N points is slowest^(N/2)
        let decay = (ALIASING.0 * tolerance).min(ALIASING.1).ln() / slowest.ln();
        let window = options.causal.unwrap_or(0) + options.noncausal.unwrap_or(0) + self.order();
        let size = (2.0 * decay) as usize + 2 * window + 16;
        let series = self.laurent_series(size.next_power_of_two())?;
        Ok(truncate(&series, options))
    }

    /// The Laurent coefficients of G^-1 for the lags 0, 1, .., followed by those for the negative lags, the last of which
    /// is -1; `size` is a power of two.
    fn laurent_series(&self, size: usize) -> Result<Vec<Matrix>, Error> {
        let complex = |tap: &Matrix| tap.map(Complex64::from);
        let mut series: Vec<_> = self.folded_response(size)?.iter().map(complex).collect();
        let mut planner = FftPlanner::new();
        transform(&mut series, &*planner.plan_fft_forward(size));
        for (line, matrix) in series.iter_mut().enumerate() {
            if !matrix.try_inverse_mut() {
                return Err(zero_on_circle(0.0, std::f64::consts::TAU * line as f64 / size as f64));
            }
        }
        transform(&mut series, &*planner.plan_fft_inverse(size));
        Ok(series.iter().map(|tap| tap.map(|value| value.re / size as f64)).collect())
    }

    /// The impulse response folded to one period, `sum_m H_{k + m size}`: its discrete Fourier transform is G on the grid
    /// exactly, even if the response decays slowly.
    fn folded_response(&self, size: usize) -> Result<Vec<Matrix>, Error> {
        let mut power = self.a().clone();
        for _ in 0..size.trailing_zeros() {
            power = &power * &power;
        }
        let identity = Matrix::identity(self.order(), self.order());
        let mut state = solve(identity - power, self.b()).ok_or_else(|| unstable(1.0))?;
        let mut folded = vec![Matrix::zeros(self.outputs(), self.inputs()); size];
        for k in 1..=size {
            folded[k % size] += self.c() * &state;
            state = self.a() * state;
        }
        folded[0] += self.d();
        Ok(folded)
    }
}

/// The discrete Fourier transform of every entry of a series of square matrices.
fn transform(series: &mut [nalgebra::DMatrix<Complex64>], fft: &dyn Fft<f64>) {
    for entry in 0..series.first().map_or(0, nalgebra::DMatrix::len) {
        let mut buffer: Vec<Complex64> = series.iter().map(|matrix| matrix[entry]).collect();
        fft.process(&mut buffer);
        series.iter_mut().zip(buffer).for_each(|(matrix, value)| matrix[entry] = value);
    }
}

fn unstable(modulus: f64) -> Error {
    Error::Unstable { modulus, remedy: "only stable dynamics have a stable inverse" }
}

fn zero_on_circle(distance: f64, frequency: f64) -> Error {
    Error::ZeroOnUnitCircle { distance, frequency, tolerance: ZERO_TOLERANCE }
}

/// Keeps the taps -d..=r of a periodic series.
fn truncate(series: &[Matrix], options: &InverseOptions) -> NoncausalFir {
    let size = series.len();
    let norms: Vec<f64> = series.iter().map(Matrix::norm).collect();
    let total: f64 = norms.iter().sum();
    // each side may omit half of the tolerance
    let allowed = 0.5 * options.tolerance * total;
    let shortest = |tail: &mut dyn Iterator<Item = f64>, longest: usize| {
        let mut sum = 0.0;
        let is_omitted = |norm: &f64| {
            sum += norm;
            sum <= allowed
        };
        longest - tail.take_while(is_omitted).count()
    };
    let half = size / 2;
    let causal = options
        .causal
        .unwrap_or_else(|| shortest(&mut norms[1..=half].iter().rev().copied(), half));
    let noncausal = options
        .noncausal
        .unwrap_or_else(|| shortest(&mut norms[half + 1..].iter().copied(), size - half - 1));
    let lags = (0..noncausal).map(|i| size - noncausal + i).chain(0..=causal);
    let kept: f64 = lags.clone().map(|lag| norms[lag]).sum();
    let taps = lags.map(|lag| series[lag].clone()).collect();
    NoncausalFir { taps, noncausal, error: ((total - kept) / total).max(0.0) }
}

impl NoncausalFir {
    /// r, the number of past samples that the inverse needs.
    pub fn causal(&self) -> usize {
        self.taps.len() - 1 - self.noncausal
    }

    /// The intermediate signal v-hat for a measured `output` (samples, outputs), equation (47) of the paper.
    ///
    /// # Errors
    /// The output has another number of channels than G, or is shorter than the inverse.
    pub fn apply(&self, output: &Matrix) -> Result<IntermediateSignal, Error> {
        let (inputs, outputs) = self.taps[0].shape();
        Error::require_equal("channels", ("output", output.ncols()), ("G", outputs))?;
        let samples = output.nrows();
        let taps = self.taps.len();
        Error::require_samples(samples, taps, format!("{taps} taps of the inverse"))?;
        let mut values = Matrix::zeros(samples, inputs);
        let last = samples as isize - 1;
        for (index, tap) in self.taps.iter().enumerate() {
            let lag = index as isize - self.noncausal as isize;
            for (row, column) in (0..inputs).flat_map(|i| (0..outputs).map(move |o| (i, o))) {
                let (weight, source) = (tap[(row, column)], output.column(column));
                let mut target = values.column_mut(row);
                for k in 0..samples {
                    target[k] += weight * source[(k as isize - lag).clamp(0, last) as usize];
                }
            }
        }
        Ok(IntermediateSignal { values, valid: self.causal()..samples - self.noncausal })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;

    fn siso(numerator: &[f64], denominator: &[f64]) -> StateSpace {
        TransferFunction::new(numerator, denominator).unwrap().to_state_space().unwrap()
    }

    #[test]
    fn inverts_strictly_proper_nonminimum_phase_dynamics() {
        let system = siso(&[1.0, -2.5, 1.0], &[1.0, -0.9, 0.5, 0.0]); // zeros 2 and 0.5
        let input =
            Matrix::from_fn(400, 1, |k, _| (k as f64 * 0.3).sin() + (k as f64 * 0.05).cos());
        let inverse = system.noncausal_inverse(&InverseOptions::default()).unwrap();
        let seen = inverse.apply(&system.simulate(&input).unwrap()).unwrap();
        for k in seen.valid {
            assert!((seen.values[k] - input[k]).abs() < 1e-5);
        }
    }

    #[test]
    fn inverts_two_channels() {
        let a = Matrix::from_row_slice(2, 2, &[0.3, 0.2, -0.1, 0.4]);
        let (b, c) = (Matrix::identity(2, 2), Matrix::from_row_slice(2, 2, &[1.0, 0.2, 0.1, 0.8]));
        let system = StateSpace::new(a, b, c, Matrix::zeros(2, 2)).unwrap();
        let input = Matrix::from_fn(200, 2, |k, i| ((k * (i + 2)) as f64 * 0.21).sin());
        let inverse = system.noncausal_inverse(&InverseOptions::default()).unwrap();
        assert_eq!(inverse.noncausal, 1, "strictly proper: one sample of preview");
        let seen = inverse.apply(&system.simulate(&input).unwrap()).unwrap();
        let valid = seen.valid.len();
        let error = seen.values.rows(seen.valid.start, valid) - input.rows(seen.valid.start, valid);
        assert!(error.amax() < 1e-5);
    }

    #[test]
    fn given_window_reports_what_it_cuts() {
        let system = siso(&[1.0, -0.9], &[1.0, 0.0]); // G = 1 - 0.9 q^-1, h_i = 0.9^i
        let options = InverseOptions { causal: Some(9), noncausal: Some(0), tolerance: 1e-6 };
        let inverse = system.noncausal_inverse(&options).unwrap();
        assert_eq!(inverse.taps.len(), 10);
        assert!((inverse.error - 0.9_f64.powi(10)).abs() < 1e-9);
    }

    #[test]
    fn zeros_on_the_circle_are_refused() {
        let system = siso(&[1.0, 1.0], &[1.0, 0.0]); // blind at the Nyquist frequency
        let error = system.noncausal_inverse(&InverseOptions::default()).unwrap_err();
        assert!(matches!(error, Error::ZeroOnUnitCircle { distance, .. } if distance < 1e-9));
    }
}
