//! The covariance of a least squares fit under autocorrelated noise.
//!
//! With H the Gram matrix of the sensitivities and M the score's covariance (both (unknowns, unknowns), see
//! `fit/certainty.rs`) the covariance of the estimate is `C = H^-1 M H^-1`. Units must not decide what is identifiable, so
//! rows and columns are scaled by `sqrt(H_ii)` first. The own unknowns of each experiment are eliminated ([`super::elimination`]):
//! there are as many of them as experiments, and the shared unknowns are what everybody asks for. With `d` the error of
//! the shared unknowns and `d_e` that of the own unknowns of experiment e,
//!
//! ```text
//! cov(d, d)     = F F'                                     F (shared, directions)
//! d_e           = G_e d + n_e                              G_e (own, shared), n_e the error if d were zero
//! cov(n_e, d)   = P_e,   cov(n_e, n_e) = W_e,   cov(n_e, n_f) = 0 for two experiments
//! ```
//!
//! so that the memory is proportional to the number of experiments; the dense matrix C is made when it is asked for. Unknowns
//! at a bound are held and have variance zero. Unidentifiable directions are kept apart, and the deviation of every
//! parameter that takes part in one is NaN.
//!
//! The number of samples of white noise that the fit uses up is `tr(H^-1 M) / sigma^2`, sigma^2 the residual's variance:
//! the number of unknowns for white noise, since M is then `sigma^2 H`, and more for slow noise (K. Takeuchi, 1976).
//!
//! A function f of the unknowns has the variance `g' C g`, g its gradient (delta method). With the axes
//! `d_k = F U_k` of `C = F F'`, U the principal axes of F with rows of unit length, it is the sum of squares of the derivatives
//! along them: `sum_k ((f(theta + h d_k) - f(theta - h d_k)) / (2 h))^2`. For functions of the shared unknowns and of means
//! over the experiments F has, for the own unknowns, the rows `G_e F` and one more column for each of their places, with the
//! entries `sqrt(W_e,kk / E)` for E experiments: what each experiment adds to a mean over all of them.

use super::eigen::descending_eigen;
use super::elimination::{Direction, Eliminated, Elimination};
use super::prior::with_prior;
use super::settings::CovarianceSettings;
use crate::linear::{Arrow, ArrowGroup};
use crate::{Error, Matrix};
use nalgebra::DVector;

/// Covariance of the unknowns of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Uncertainty {
    /// How many unknowns there are.
    unknowns: usize,
    /// The shared ones that are free, and F, (shared, directions).
    shared: Vec<usize>,
    factor: Matrix,
    groups: Vec<Own>,
    /// Unidentifiable directions.
    pub open: Vec<Direction>,
    /// Parameters that the fit has used up, counted in samples of white noise: `tr(H^-1 M) / variance`.
    pub used: f64,
    /// Parameters that are free: neither held nor at a bound.
    pub estimated: usize,
    settings: CovarianceSettings,
}

/// The errors of the own unknowns of an experiment.
#[derive(Clone, Debug, PartialEq)]
struct Own {
    /// Those that are free.
    unknowns: Vec<usize>,
    /// G_e and P_e, (own, shared).
    gain: Matrix,
    with_shared: Matrix,
    /// W_e, (own, own).
    covariance: Matrix,
}

impl Uncertainty {
    /// `H^-1 M H^-1`, H the Gram matrix `gram` of the sensitivities and M that of the score under the residual's
    /// autocorrelation, `scores`, for the unknowns `free`; all others are held. `cost` is the sum of the losses of
    /// so many `samples`.
    pub(crate) fn new(
        settings: CovarianceSettings,
        gram: &Arrow,
        scores: &Arrow,
        free: &[usize],
        samples: f64,
        cost: f64,
    ) -> Self {
        let unknowns = gram.len();
        let (gram, scores) = (gram.restricted(free), scores.restricted(free));
        let scale = gram.diagonal().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
        let (gram, scores) = (gram.scaled(&scale), scores.scaled(&scale));
        let Elimination { factor, groups, open, used } =
            Elimination::new(&gram, &scores, settings.identifiable);
        let names = |places: &[usize]| -> Vec<usize> { places.iter().map(|&i| free[i]).collect() };
        let (shared, _) = gram.shared();
        let scaled = |matrix: Matrix, rows: &[usize], columns: Option<&[usize]>, power: i32| {
            let by = |i: usize, j: usize| {
                scale[rows[i]] * columns.map_or(1.0, |columns| scale[columns[j]].powi(power))
            };
            Matrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / by(i, j))
        };
        let own = |(group, found): (&ArrowGroup, Eliminated)| {
            let own = &group.unknowns[..];
            Own {
                unknowns: names(own),
                gain: scaled(found.gain, own, Some(shared), -1),
                with_shared: scaled(found.with_shared, own, Some(shared), 1),
                covariance: scaled(found.covariance, own, Some(own), 1),
            }
        };
        let groups = gram.groups().iter().zip(groups).map(own).collect();
        let named = |direction: Direction| direction.iter().map(|&(i, x)| (free[i], x)).collect();
        Self {
            unknowns,
            shared: names(shared),
            factor: scaled(factor, shared, None, 1),
            groups,
            open: open.into_iter().map(named).collect(),
            used: used * samples / cost.max(f64::MIN_POSITIVE),
            estimated: free.len(),
            settings,
        }
    }

    /// The covariance of some unknowns, in their order; zero for those that are held.
    pub(crate) fn covariance(&self, unknowns: &[usize]) -> Matrix {
        let mut wanted = vec![None; self.unknowns];
        unknowns.iter().enumerate().for_each(|(at, &i)| wanted[i] = Some(at));
        let shared = &self.factor * self.factor.transpose();
        let mut covariance = Matrix::zeros(unknowns.len(), unknowns.len());
        let mut put = |rows: &[usize], columns: &[usize], values: &Matrix| {
            for (j, &column) in columns.iter().enumerate() {
                for (i, &row) in rows.iter().enumerate() {
                    if let (Some(row), Some(column)) = (wanted[row], wanted[column]) {
                        covariance[(row, column)] = values[(i, j)];
                        covariance[(column, row)] = values[(i, j)];
                    }
                }
            }
        };
        put(&self.shared, &self.shared, &shared);
        for (place, one) in self.groups.iter().enumerate() {
            let with_shared = &one.gain * &shared + &one.with_shared;
            put(&one.unknowns, &self.shared, &with_shared);
            put(&one.unknowns, &one.unknowns, &one.whole(&shared));
            for other in &self.groups[..place] {
                let between = &with_shared * other.gain.transpose()
                    + &one.gain * other.with_shared.transpose();
                put(&one.unknowns, &other.unknowns, &between);
            }
        }
        covariance
    }

    /// Standard deviations of the unknowns; NaN where an unidentifiable direction takes part.
    pub(crate) fn deviations(&self) -> DVector<f64> {
        let shared = &self.factor * self.factor.transpose();
        let mut variances = DVector::zeros(self.unknowns);
        let mut put = |unknowns: &[usize], values: DVector<f64>| {
            unknowns.iter().zip(values.iter()).for_each(|(&i, value)| variances[i] = *value);
        };
        put(&self.shared, shared.diagonal());
        self.groups.iter().for_each(|own| put(&own.unknowns, own.whole(&shared).diagonal()));
        let mut deviations = variances.map(|square: f64| square.max(0.0).sqrt());
        for &(unknown, share) in self.open.iter().flatten() {
            if share.abs() > self.settings.share {
                deviations[unknown] = f64::NAN;
            }
        }
        deviations
    }

    /// Unidentifiable parameters: names and shares of the unknowns in every such direction, the largest first.
    pub(crate) fn undetermined(&self, names: &[String]) -> Vec<Vec<(String, f64)>> {
        let direction = |direction: &Direction| {
            let listed = direction.iter().filter(|(_, share)| share.abs() > self.settings.listed);
            let mut shares: Vec<_> = listed.map(|&(i, share)| (names[i].clone(), share)).collect();
            shares.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            shares
        };
        self.open.iter().map(direction).collect()
    }

    /// F of all unknowns, (unknowns, directions): see the module's last paragraph.
    fn whole_factor(&self) -> Matrix {
        let means = self.groups.iter().map(|own| own.unknowns.len()).max().unwrap_or(0);
        let directions = self.factor.ncols();
        let mut whole = Matrix::zeros(self.unknowns, directions + means);
        for (i, &row) in self.shared.iter().enumerate() {
            whole.view_mut((row, 0), (1, directions)).copy_from(&self.factor.row(i));
        }
        for own in &self.groups {
            let rows = &own.gain * &self.factor;
            for (i, &row) in own.unknowns.iter().enumerate() {
                whole.view_mut((row, 0), (1, directions)).copy_from(&rows.row(i));
                let variance = own.covariance[(i, i)] / self.groups.len() as f64;
                whole[(row, directions + i)] = variance.max(0.0).sqrt();
            }
        }
        whole
    }

    /// Standard deviations of functions of the point: root of the sum of squares of [`Uncertainty::axes`].
    pub(crate) fn spread(
        &self,
        values_of: &[f64],
        known: &[f64],
        moved: impl Fn(&DVector<f64>) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<f64>, Error> {
        let mut variances: Vec<f64> = Vec::new();
        for axis in self.axes(values_of, known, moved)? {
            variances.resize(axis.len(), 0.0);
            variances.iter_mut().zip(&axis).for_each(|(sum, change)| *sum += change.powi(2));
        }
        Ok(variances.into_iter().map(f64::sqrt).collect())
    }

    /// The change of functions of the point along each principal axis of the covariance, over one standard deviation: their
    /// covariance is the sum of the outer products. From central differences, or from one side where the other one is no
    /// valid point: a half-width near zero, of which a step would make a negative one.
    ///
    /// `values` are those of the unknowns: a step stays far below them, also along an axis that is
    /// unidentifiable. `known` are standard deviations to which they are known without the data, infinite for most.
    pub(crate) fn axes(
        &self,
        values_of: &[f64],
        known: &[f64],
        moved: impl Fn(&DVector<f64>) -> Result<Vec<f64>, Error>,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let CovarianceSettings { step: longest, part: most, least, axes, .. } = self.settings;
        let largest = values_of.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let reach = |value: f64| most * value.abs().max(least * largest);
        // Zero for an unknown that is held: rounding must not move it off its place, such as the
        // threshold zero, on whose two sides the deadzone is another one.
        let factor = with_prior(self.whole_factor(), known);
        let lengths = factor.row_iter().map(|row| row.norm());
        let divisor = DVector::from_iterator(
            self.unknowns,
            lengths.map(|value| if value > 0.0 { value } else { 1.0 }),
        );
        let mut scaled = factor.clone();
        scaled.column_iter_mut().for_each(|mut column| column.component_div_assign(&divisor));
        // any rotation leaves F F' as it is: rounding of the eigenvectors does no harm
        let (values, vectors) = descending_eigen(scaled.tr_mul(&scaled));
        let along = |(axis, _): (usize, &f64)| {
            let deviation = &factor * vectors.column(axis);
            let parts = deviation.iter().zip(values_of);
            let fraction = parts
                .filter(|(part, _)| **part != 0.0)
                .map(|(part, value)| reach(*value) / part.abs())
                .fold(longest, f64::min);
            let step = deviation * fraction;
            let here = || moved(&DVector::zeros(self.unknowns));
            let (above, below, length) = match (moved(&step), moved(&-step)) {
                (Ok(above), Ok(below)) => (above, below, 2.0 * fraction),
                (Ok(above), Err(_)) => (above, here()?, fraction),
                (Err(_), Ok(below)) => (here()?, below, fraction),
                (Err(error), Err(_)) => return Err(error),
            };
            let change = |(above, below): (&f64, &f64)| (above - below) / length;
            Ok(above.iter().zip(&below).map(change).collect())
        };
        values.iter().enumerate().take_while(|(_, value)| **value > axes).map(along).collect()
    }
}

impl Own {
    /// The covariance of the own unknowns, from that of the shared ones.
    fn whole(&self, shared: &Matrix) -> Matrix {
        let cross = &self.with_shared * self.gain.transpose();
        &self.gain * shared * self.gain.transpose() + &cross + cross.transpose() + &self.covariance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three shared unknowns, two of each of three experiments, with a gram and a score of unequal noise.
    fn arrows() -> (Arrow, Arrow) {
        let own = vec![vec![3, 4], vec![5, 6], vec![7, 8]];
        let (mut gram, mut scores) = (Arrow::zeros(9, own.clone()), Arrow::zeros(9, own.clone()));
        for (number, own) in own.iter().enumerate() {
            let places = [&[0, 1, 2], &own[..]].concat();
            let rows = Matrix::from_fn(12, 5, |i, j| {
                ((i * (j + 2) + 5 * number) as f64 * 0.61).sin() + 0.2
            });
            gram.add_part(&rows.tr_mul(&rows), &places);
            let louder = Matrix::from_fn(12, 5, |i, j| rows[(i, j)] * (0.5 + 0.1 * i as f64));
            scores.add_part(&louder.tr_mul(&louder), &places);
        }
        (gram, scores)
    }

    #[test]
    fn covariance_and_trace_are_those_of_the_dense_matrices() {
        let (gram, scores) = arrows();
        let all: Vec<usize> = (0..9).collect();
        let settings = CovarianceSettings::default();
        let found = Uncertainty::new(settings, &gram, &scores, &all, 1.0, 1.0);
        let inverse = gram.to_dense().try_inverse().unwrap();
        let expected = &inverse * scores.to_dense() * &inverse;
        assert!((found.covariance(&all) - &expected).amax() < 1e-11 * expected.amax());
        let deviations = expected.diagonal().map(f64::sqrt);
        assert!((found.deviations() - deviations).amax() < 1e-11);
        assert!((found.used - (inverse * scores.to_dense()).trace()).abs() < 1e-11);
        assert_eq!((found.open.len(), found.estimated), (0, 9));
    }

    #[test]
    fn held_unknowns_have_no_variance() {
        let (gram, scores) = arrows();
        let free = [0, 2, 3, 5, 6, 8];
        let settings = CovarianceSettings::default();
        let found = Uncertainty::new(settings, &gram, &scores, &free, 1.0, 1.0);
        let inverse = gram.select(&free).try_inverse().unwrap();
        let expected = &inverse * scores.select(&free) * &inverse;
        assert!((found.covariance(&free) - expected).amax() < 1e-11);
        assert_eq!(found.covariance(&[1, 4, 7]), Matrix::zeros(3, 3));
    }

    #[test]
    fn changes_are_known_from_the_side_that_is_valid() {
        let (gram, scores) = arrows();
        let free: Vec<usize> = (0..9).collect();
        let settings = CovarianceSettings::default();
        let found = Uncertainty::new(settings, &gram, &scores, &free, 1.0, 1.0);
        let sum = |step: &DVector<f64>| Ok(vec![step.sum()]);
        // on one side of every axis the first unknown would be negative
        let positive = |step: &DVector<f64>| {
            Error::require(step[0] >= 0.0, "first", step[0], "must be positive")?;
            sum(step)
        };
        let (values, known) = ([1.0; 9], [f64::INFINITY; 9]);
        let expected = found.spread(&values, &known, sum).unwrap()[0];
        let one_sided = found.spread(&values, &known, positive).unwrap()[0];
        assert!((one_sided / expected - 1.0).abs() < 1e-9, "{one_sided} {expected}");
        let never = |_: &DVector<f64>| {
            Error::require(false, "first", 1.0, "must not exist")?;
            Ok(vec![])
        };
        assert!(found.spread(&values, &known, never).is_err());
    }

    #[test]
    fn directions_without_data_are_open() {
        let (mut gram, scores) = arrows();
        // shared 0 repeats shared 1, and the own unknowns of the second experiment each other
        let copy = |mut matrix: Matrix, of: usize, to: usize| {
            let column = matrix.column(of).into_owned();
            matrix.set_column(to, &column);
            let row = matrix.row(of).into_owned();
            matrix.set_row(to, &row);
            matrix
        };
        let dense = copy(copy(gram.to_dense(), 1, 0), 5, 6);
        gram = Arrow::zeros(9, vec![vec![3, 4], vec![5, 6], vec![7, 8]]);
        for own in [[3, 4], [5, 6], [7, 8]] {
            // the shared part once
            let places = [&[0, 1, 2], &own[..]].concat();
            let part = Matrix::from_fn(5, 5, |i, j| {
                let value = dense[(places[i], places[j])];
                if i < 3 && j < 3 && own[0] > 3 { 0.0 } else { value }
            });
            gram.add_part(&part, &places);
        }
        let all: Vec<usize> = (0..9).collect();
        let settings = CovarianceSettings::default();
        let found = Uncertainty::new(settings, &gram, &scores, &all, 1.0, 1.0);
        assert_eq!(found.open.len(), 2);
        let open = found.deviations().map(f64::is_nan);
        assert_eq!(open.as_slice(), [true, true, false, false, false, true, true, false, false]);
    }
}
