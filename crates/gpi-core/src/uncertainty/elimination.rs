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

use super::eigen::descending_eigen;
use crate::Matrix;
use crate::linear::{Arrow, ArrowGroup};

/// Shares of unknowns in a direction, of unit length after scaling every unknown by its column's norm.
pub(crate) type Direction = Vec<(usize, f64)>;

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
