//! The noncausal FIR inverse: running stable dynamics backwards, whatever their zeros.

use super::StateSpace;
use super::decompose::solve;
use crate::{Error, Matrix};
use num_complex::Complex64;
use std::ops::Range;

/// Zeros nearer than this to the unit circle are refused: the inverse would ring for more than about
/// 10^5 samples.
pub const ZERO_TOLERANCE: f64 = 1e-4;

/// How much of the Laurent series is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseOptions {
    /// r, the number of causal taps besides tap 0; chosen from `tolerance` when `None`.
    pub causal: Option<usize>,
    /// d, the number of noncausal taps (preview); chosen from `tolerance` when `None`.
    pub noncausal: Option<usize>,
    /// Largest truncation error accepted when r or d is chosen.
    pub tolerance: f64,
}

impl Default for InverseOptions {
    fn default() -> Self {
        Self { causal: None, noncausal: None, tolerance: 1e-6 }
    }
}

/// The truncated Laurent series of G^-1 on the annulus of the unit circle, equation (46):
/// `v(k) = sum_{i=-d}^{r} h_i y(k-i)`.
#[derive(Clone, Debug, PartialEq)]
pub struct NoncausalFir {
    /// h_{-d} .. h_r, each (inputs, outputs) of G.
    pub taps: Vec<Matrix>,
    /// d: how many samples of the future the inverse looks at.
    pub noncausal: usize,
    /// What was cut off: the sum of the norms of the taps left out, as a fraction of the sum over
    /// all taps. It bounds the relative error of the frequency response, (T2) in the documentation's theory.
    pub error: f64,
}

/// An intermediate signal seen through the inverse, with the samples where it can be trusted.
#[derive(Clone, Debug, PartialEq)]
pub struct IntermediateSignal {
    /// v-hat, (samples, inputs of G); near the ends the output is continued by its end values.
    pub values: Matrix,
    /// The samples whose inverse saw measured outputs only.
    pub valid: Range<usize>,
}

impl StateSpace {
    /// The noncausal FIR approximation of G^-1, equations (45) and (46) of the paper.
    ///
    /// The coefficients of the Laurent series on the unit circle are the Fourier coefficients of
    /// 1 / G(e^{jw}); strictly proper and nonminimum-phase G lead to noncausal taps.
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
    /// Unequal numbers of inputs and outputs, a zero within [`ZERO_TOLERANCE`] of the unit circle, an
    /// unstable G, a tolerance outside (0, 1).
    pub fn noncausal_inverse(&self, options: &InverseOptions) -> Result<NoncausalFir, Error> {
        Error::require_equal("channels", ("inputs", self.inputs()), ("outputs", self.outputs()))?;
        if !(options.tolerance > 0.0 && options.tolerance < 1.0) {
            let requirement = "must lie between 0 and 1";
            return Err(Error::parameter("tolerance", options.tolerance, requirement));
        }
        let modulus = self.spectral_radius()?;
        if modulus >= 1.0 {
            let remedy = "only stable dynamics are run backwards";
            return Err(Error::Unstable { modulus, remedy });
        }
        let mut slowest = 0.5_f64;
        for zero in self.zeros()? {
            let distance = (zero.norm() - 1.0).abs();
            if distance < ZERO_TOLERANCE {
                let frequency = zero.arg().abs();
                let tolerance = ZERO_TOLERANCE;
                return Err(Error::ZeroOnUnitCircle { distance, frequency, tolerance });
            }
            slowest = slowest.max(zero.norm().min(1.0 / zero.norm()));
        }
        // The series decays as slowest^|i|; aliasing on a grid of N points is slowest^(N/2).
        let decay = (1e-3 * options.tolerance).min(1e-15).ln() / slowest.ln();
        let window = options.causal.unwrap_or(0) + options.noncausal.unwrap_or(0) + self.order();
        let size = (2.0 * decay) as usize + 2 * window + 16;
        let series = self.laurent_series(size.next_power_of_two())?;
        Ok(truncate(&series, options))
    }

    /// Laurent coefficients of G^-1 for lags 0, 1, .., then negative ones from the end; `size` is a
    /// power of two.
    fn laurent_series(&self, size: usize) -> Result<Vec<Matrix>, Error> {
        let channels = self.inputs();
        let mut planner = rustfft::FftPlanner::new();
        let forward = planner.plan_fft_forward(size);
        let mut response = vec![nalgebra::DMatrix::<Complex64>::zeros(channels, channels); size];
        let folded = self.folded_response(size)?;
        for (row, column) in (0..channels).flat_map(|i| (0..channels).map(move |j| (i, j))) {
            let mut buffer: Vec<Complex64> =
                folded.iter().map(|tap| Complex64::new(tap[(row, column)], 0.0)).collect();
            forward.process(&mut buffer);
            for (matrix, value) in response.iter_mut().zip(buffer) {
                matrix[(row, column)] = value;
            }
        }
        for (line, matrix) in response.iter_mut().enumerate() {
            if !matrix.try_inverse_mut() {
                let frequency = std::f64::consts::TAU * line as f64 / size as f64;
                let tolerance = ZERO_TOLERANCE;
                return Err(Error::ZeroOnUnitCircle { distance: 0.0, frequency, tolerance });
            }
        }
        let backward = planner.plan_fft_inverse(size);
        let mut series = vec![Matrix::zeros(channels, channels); size];
        for (row, column) in (0..channels).flat_map(|i| (0..channels).map(move |j| (i, j))) {
            let mut buffer: Vec<Complex64> = response.iter().map(|m| m[(row, column)]).collect();
            backward.process(&mut buffer);
            for (tap, value) in series.iter_mut().zip(&buffer) {
                tap[(row, column)] = value.re / size as f64;
            }
        }
        Ok(series)
    }

    /// The impulse response folded to one period, `sum_m H_{k + m size}`: its discrete Fourier
    /// transform is G on the grid exactly, however slowly the response decays.
    fn folded_response(&self, size: usize) -> Result<Vec<Matrix>, Error> {
        let mut power = self.a().clone();
        for _ in 0..size.trailing_zeros() {
            power = &power * &power;
        }
        let identity = Matrix::identity(self.order(), self.order());
        let remedy = "only stable dynamics are run backwards";
        let singular = Error::Unstable { modulus: 1.0, remedy };
        let mut state = solve(identity - power, self.b()).ok_or(singular)?;
        let mut folded = vec![Matrix::zeros(self.outputs(), self.inputs()); size];
        for k in 1..=size {
            folded[k % size] += self.c() * &state;
            state = self.a() * state;
        }
        folded[0] += self.d();
        Ok(folded)
    }
}

/// Keeps the taps -d..=r of a periodic series.
fn truncate(series: &[Matrix], options: &InverseOptions) -> NoncausalFir {
    let size = series.len();
    let norms: Vec<f64> = series.iter().map(Matrix::norm).collect();
    let total: f64 = norms.iter().sum();
    // Each side may cut half of the tolerance.
    let allowed = 0.5 * options.tolerance * total;
    let shortest = |tail: &mut dyn Iterator<Item = f64>, longest: usize| {
        let mut sum = 0.0;
        longest
            - tail
                .take_while(|norm| {
                    sum += norm;
                    sum <= allowed
                })
                .count()
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
    /// r: how many samples of the past the inverse looks at.
    pub fn causal(&self) -> usize {
        self.taps.len() - 1 - self.noncausal
    }

    /// The intermediate signal of a measured output (samples, outputs), equation (47).
    ///
    /// # Errors
    /// An output with another number of channels, or shorter than the inverse.
    pub fn apply(&self, output: &Matrix) -> Result<IntermediateSignal, Error> {
        let (inputs, outputs) = self.taps[0].shape();
        Error::require_equal("channels", ("output", output.ncols()), ("G", outputs))?;
        let samples = output.nrows();
        if samples < self.taps.len() {
            let purpose = format!("{} taps of the inverse", self.taps.len());
            return Err(Error::TooFewSamples { samples, needed: self.taps.len(), purpose });
        }
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
