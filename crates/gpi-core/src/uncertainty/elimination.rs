//! The own unknowns of each experiment, eliminated from the covariance of a fit.
//!
//! The Gram matrix H of the sensitivities and the covariance M of the score have the shape of an arrow
//! ([`crate::linear::Arrow`]): H_s and M_s of the shared unknowns, D_e and M_e of the own unknowns of experiment e, C_e and
//! N_e between the two. An estimate near the truth differs from it by the solution of `H d = z`, z the score of
//! covariance M. With `+` for the inverse without unidentifiable directions, elimination of the own unknowns gives
//!
//! ```text
//! d_e = G_e d + D_e^+ z_e              G_e = -D_e^+ C_e
//! S d = z_s + sum_e G_e' z_e           S   = H_s + sum_e C_e' G_e
//! cov(S d)             = M_s + sum_e (N_e' G_e + G_e' N_e + G_e' M_e G_e)
//! cov(D_e^+ z_e, S d)  = D_e^+ (N_e + M_e G_e)
//! tr(H^+ M)            = sum_e tr(D_e^+ M_e) + tr(S^+ cov(S d))
//! ```
//!
//! A symmetric matrix is inverted by its eigenvalues; those of S up to the part `identifiable` of the largest of H_s, and
//! those of D_e up to this part of its own largest, are unidentifiable directions. Those of S move the own unknowns too,
//! by G_e. The covariance of d is computed as `F F'`, `F = V L^(-1/2) Q K^(1/2)` with `S = V L V'` and
//! `L^(-1/2) V' cov(S d) V L^(-1/2) = Q K Q'`: products of inverses would lose the small variances of combinations of
//! parameters of which each alone is hardly determined. Source: elimination as in A. Björck, Numerical Methods for Least
//! Squares Problems, 1996, section 6.3; the covariance is that of L. Ljung, System Identification, 1999, section 9.2.

use super::covariance::{Direction, descending_eigen};
use crate::Matrix;
use crate::linear::{Arrow, ArrowGroup};

/// What is left after the elimination.
pub(super) struct Elimination {
    /// F, (shared, directions).
    pub factor: Matrix,
    /// One for each group.
    pub groups: Vec<Eliminated>,
    /// Unidentifiable directions, of unit length.
    pub open: Vec<Direction>,
    /// `tr(H^+ M)`.
    pub used: f64,
}

/// The own unknowns of an experiment.
pub(super) struct Eliminated {
    /// G_e, (own, shared).
    pub gain: Matrix,
    /// The covariance of `D_e^+ z_e` with d, (own, shared).
    pub with_shared: Matrix,
    /// The covariance of `D_e^+ z_e`, (own, own).
    pub covariance: Matrix,
}

impl Elimination {
    /// From H, scaled to a unit diagonal, and M in the same units.
    pub(super) fn new(gram: &Arrow, scores: &Arrow, identifiable: f64) -> Self {
        let (shared, head) = gram.shared();
        let largest = descending_eigen(head.clone()).0.iter().copied().fold(0.0, f64::max);
        let (mut complement, mut score) = (head.clone(), scores.shared().1.clone());
        let mut groups = Vec::with_capacity(gram.groups().len());
        let (mut open, mut used) = (Vec::new(), 0.0);
        for (own, noise) in gram.groups().iter().zip(scores.groups()) {
            let (root, null) = inverse_root(own.own.clone(), identifiable, None);
            open.extend(null.column_iter().map(|column| {
                own.unknowns.iter().copied().zip(column.iter().copied()).collect::<Direction>()
            }));
            let inverse = &root * root.transpose();
            let gain = -(&inverse * &own.coupling);
            let with_score = &noise.coupling + &noise.own * &gain;
            complement += own.coupling.tr_mul(&gain);
            let half = noise.coupling.tr_mul(&gain);
            score += &half + half.transpose() + gain.tr_mul(&(&noise.own * &gain));
            used += (root.tr_mul(&noise.own) * &root).trace();
            let covariance = &inverse * &noise.own * &inverse;
            groups.push(Eliminated { gain, with_shared: inverse * with_score, covariance });
        }
        let (root, null) = inverse_root(complement, identifiable, Some(largest));
        open.extend(
            null.column_iter().map(|column| {
                whole_direction(&column.into_owned(), shared, gram.groups(), &groups)
            }),
        );
        let (spread, turned) = descending_eigen(root.tr_mul(&score) * &root);
        used += spread.sum();
        let inverse = &root * root.transpose();
        groups.iter_mut().for_each(|group| group.with_shared *= &inverse);
        let mut factor = root * turned;
        for (mut column, spread) in factor.column_iter_mut().zip(spread.iter()) {
            column *= spread.max(0.0).sqrt();
        }
        Self { factor, groups, open, used }
    }
}

/// `V L^(-1/2)` (unknowns, directions) of a symmetric matrix `V L V'`, and its unidentifiable directions: those of eigenvalues
/// up to the part `identifiable` of the largest one, or of what is given for it.
fn inverse_root(matrix: Matrix, identifiable: f64, largest: Option<f64>) -> (Matrix, Matrix) {
    let (values, vectors) = descending_eigen(matrix);
    let largest = largest.unwrap_or_else(|| values.iter().copied().fold(0.0, f64::max));
    let rank = values.iter().take_while(|&&value| value > identifiable * largest).count();
    let mut root = vectors.columns(0, rank).into_owned();
    for (mut column, value) in root.column_iter_mut().zip(values.iter()) {
        column /= value.sqrt();
    }
    (root, vectors.columns(rank, vectors.ncols() - rank).into_owned())
}

/// A direction of the shared unknowns with what the own ones of every experiment do, of unit length.
fn whole_direction(
    direction: &nalgebra::DVector<f64>,
    shared: &[usize],
    groups: &[ArrowGroup],
    eliminated: &[Eliminated],
) -> Direction {
    let mut whole: Direction = shared.iter().copied().zip(direction.iter().copied()).collect();
    for (group, found) in groups.iter().zip(eliminated) {
        let own = &found.gain * direction;
        whole.extend(group.unknowns.iter().copied().zip(own.iter().copied()));
    }
    let length = whole.iter().map(|(_, share)| share * share).sum::<f64>().sqrt();
    whole.iter_mut().for_each(|(_, share)| *share /= length);
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uncertainty::covariance::Uncertainty;
    use crate::uncertainty::settings::CovarianceSettings;

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
