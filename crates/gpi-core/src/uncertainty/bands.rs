//! Standard deviations of what engineers look at: poles, Markov parameters, frequency response, loop.

use super::covariance::Uncertainty;
use crate::chain::point::{Past, Point};
use crate::chain::table::Table;
use crate::effects::{Effect, InnerLoop, Units};
use crate::linear::Sections;
use crate::{Error, Matrix};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// Poles with the standard deviations of their real and imaginary parts.
#[derive(Clone, Debug, PartialEq)]
pub struct PoleDeviations {
    /// The poles of G without those of its dead time.
    pub poles: Vec<Complex64>,
    /// The deviation of the real part in the real part, that of the imaginary part in the imaginary
    /// one.
    pub deviations: Vec<Complex64>,
}

/// The frequency response at one frequency with its standard deviations, each (outputs, inputs).
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseDeviation {
    /// G(e^jw).
    pub response: DMatrix<Complex64>,
    /// Standard deviation of ln |G|: multiply by 8.686 for dB.
    pub log_magnitude: Matrix,
    /// Standard deviation of the phase in radians.
    pub phase: Matrix,
}

/// An estimate and its covariance, from which the standard deviation of every function of the estimate follows.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    pub(crate) point: Point,
    pub(crate) table: Table,
    /// The unknowns that are not held.
    pub(crate) estimated: Vec<usize>,
    pub(crate) uncertainty: Uncertainty,
}

impl Bands {
    /// Numbers of outputs and inputs.
    pub fn shape(&self) -> (usize, usize) {
        self.point.dynamics.d.shape()
    }

    /// The change of any function of the point over one standard deviation along each axis of the covariance.
    pub(crate) fn axes(
        &self,
        function: impl Fn(&Point) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let values = self.table.values(&self.point);
        let moved = |step: &DVector<f64>| function(&self.point.moved(step, &self.table));
        self.uncertainty.axes(&values, &self.point.spacings(&self.table), moved)
    }

    /// Standard deviations of any function of the point.
    fn spread(
        &self,
        function: impl Fn(&Point) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<f64>, Error> {
        let values = self.table.values(&self.point);
        let moved = |step: &DVector<f64>| function(&self.point.moved(step, &self.table));
        self.uncertainty.spread(&values, &self.point.spacings(&self.table), moved)
    }

    /// Standard deviations of the quantities of every effect.
    pub(crate) fn effect_deviations(&self) -> Result<Vec<Vec<f64>>, Error> {
        let quantities = |point: &Point| -> Vec<Vec<f64>> {
            let force = |inner: &InnerLoop| point.steady_force(inner);
            let of = |effect: &Effect| {
                let output = effect.place().output().unwrap_or(0);
                let stiffness = point.stiffness(output);
                let units = Units { input: "", output: "", stiffness };
                effect.quantities(units, &force).iter().map(|q| q.value).collect()
            };
            point.blocks().iter().map(of).collect()
        };
        let sizes: Vec<usize> = quantities(&self.point).iter().map(Vec::len).collect();
        if sizes.iter().sum::<usize>() == 0 {
            return Ok(vec![Vec::new(); sizes.len()]);
        }
        let deviations = self.spread(|point| Ok(quantities(point).concat()))?;
        let mut rest = deviations.into_iter();
        Ok(sizes.iter().map(|&size| rest.by_ref().take(size).collect()).collect())
    }

    /// The poles of G and how far they may be off.
    ///
    /// Near a double pole, where a conjugate pair becomes two real ones, the deviations are those of
    /// the linearization and too small.
    ///
    /// # Errors
    /// The covariance's decomposition does not converge.
    pub fn poles(&self) -> Result<PoleDeviations, Error> {
        let parts = |poles: Vec<Complex64>| poles.iter().flat_map(|p| [p.re, p.im]).collect();
        let deviations = self.spread(|point| Ok(parts(point.dynamics.poles())))?;
        let pairs = deviations.chunks_exact(2).map(|pair| Complex64::new(pair[0], pair[1]));
        let poles = self.point.dynamics.poles();
        let mut deviations: Vec<Complex64> = pairs.collect();
        deviations.resize(poles.len(), Complex64::new(0.0, 0.0));
        Ok(PoleDeviations { poles, deviations })
    }

    /// Standard deviations of the first `count` Markov parameters of G, each (outputs, inputs).
    ///
    /// # Errors
    /// The covariance's decomposition does not converge.
    pub fn markov_deviations(&self, count: usize) -> Result<Vec<Matrix>, Error> {
        let (outputs, inputs) = self.point.dynamics.d.shape();
        let deviations = self.spread(|point| {
            let markov = point.dynamics.to_state_space()?.markov(count);
            Ok(markov.iter().flat_map(|tap| tap.iter().copied().collect::<Vec<_>>()).collect())
        })?;
        if deviations.is_empty() {
            return Ok(vec![Matrix::zeros(outputs, inputs); count]);
        }
        let taps = deviations.chunks_exact(outputs * inputs);
        Ok(taps.map(|tap| Matrix::from_column_slice(outputs, inputs, tap)).collect())
    }

    /// The frequency response at `frequencies` in radians per sample, with its standard deviations.
    ///
    /// # Errors
    /// The covariance's decomposition does not converge.
    pub fn response_deviations(
        &self,
        frequencies: &[f64],
    ) -> Result<Vec<ResponseDeviation>, Error> {
        let (outputs, inputs) = self.point.dynamics.d.shape();
        let responses = |dynamics: &Sections| -> Vec<DMatrix<Complex64>> {
            frequencies.iter().map(|&frequency| dynamics.response(frequency)).collect()
        };
        let here = responses(&self.point.dynamics);
        // relative to the response itself: the logarithm's real part is the magnitude, the imaginary
        // one the phase, without a branch to cross
        let deviations = self.spread(|point| {
            let moved = responses(&point.dynamics);
            let pairs = moved.iter().zip(&here).flat_map(|(moved, here)| {
                let ratios = moved.iter().zip(here.iter()).map(|(a, b)| (a / b).ln());
                ratios.flat_map(|ratio| [ratio.re, ratio.im]).collect::<Vec<_>>()
            });
            Ok(pairs.collect())
        })?;
        let size = 2 * outputs * inputs;
        Ok(here
            .into_iter()
            .enumerate()
            .map(|(place, response)| {
                let own = |part: usize| {
                    Matrix::from_fn(outputs, inputs, |row, column| {
                        let element = size * place + 2 * (column * outputs + row) + part;
                        deviations.get(element).copied().unwrap_or(0.0)
                    })
                };
                ResponseDeviation { response, log_magnitude: own(0), phase: own(1) }
            })
            .collect())
    }

    /// Standard deviations of the intermediate signals v (samples, inputs) that an input leads to when
    /// the actuator starts from rest: the band around a loop.
    ///
    /// # Errors
    /// An input with another number of channels, the covariance's decomposition does not converge.
    pub fn loop_deviations(&self, input: &Matrix) -> Result<Matrix, Error> {
        let inputs = self.point.channels.len();
        Error::require_equal("channels", ("input", input.ncols()), ("model", inputs))?;
        let rest = Past::rest(0, 0);
        let deviations =
            self.spread(|point| Ok(point.intermediate(input, &rest).as_slice().to_vec()))?;
        Ok(Matrix::from_column_slice(input.nrows(), inputs, &deviations))
    }
}
