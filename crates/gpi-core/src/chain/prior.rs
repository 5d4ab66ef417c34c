//! What is known of a hysteresis without the data: the density of its plays is smooth, and its envelope bends little.
//!
//! A record seldom tells neighbouring plays of a fine grid apart, nor one deadzone from the next. With weights p_i on half-widths at equal
//! distances and slopes g_j of the deadzones but the first, the prior adds to the cost
//!
//! ```text
//! w sum_i (p_i - 2 p_(i+1) + p_(i+2))^2 + s sum_j g_j^2,      i > 0 (the linear term apart), j > 0
//! ```
//!
//! This is (T14) in the documentation's theory. A fit with it is the maximum of the posterior density for independent normal second
//! differences of p and slopes g. Both terms are quadratic in the unknowns, so that they add a constant matrix to the Gram matrix.
//!
//! Source: G. Pillonetto, F. Dinuzzo, T. Chen, G. De Nicolao, L. Ljung, *Kernel methods in system identification, machine learning and function
//! estimation: a survey*, Automatica 50, 2014.

use super::hysteresis::Prior;
use super::point::Point;
use super::table::{Group, Table};
use crate::Matrix;
use crate::linear::Arrow;
use nalgebra::DVector;

/// A part of the prior: the places of its unknowns, its matrix K and its factor, which add `factor x' K x`.
pub(crate) struct PriorPart {
    pub places: Vec<usize>,
    pub matrix: Matrix,
    pub factor: f64,
    /// The input whose hysteresis it is about.
    pub input: usize,
    /// Whether it is about the weights, or else about the slopes.
    pub is_of_weights: bool,
}

impl PriorPart {
    /// x' K x for the unknowns of a table.
    pub(crate) fn square(&self, values: &[f64]) -> f64 {
        let own = self.own(values);
        (&self.matrix * &own).dot(&own)
    }

    fn own(&self, values: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.places.len(), self.places.iter().map(|&place| values[place]))
    }
}

impl Point {
    /// The parts of the prior over the unknowns of a table; none without a prior, or where the hysteresis is held.
    pub(crate) fn prior(&self, table: &Table) -> Vec<PriorPart> {
        let mut parts = Vec::new();
        for (input, channel) in self.channels.iter().enumerate() {
            let Prior { weights, slopes } = channel.prior;
            let rows = [
                (Group::Weights { input }, weights, true),
                (Group::Slopes { input }, slopes, false),
            ];
            for (group, factor, is_of_weights) in rows {
                let places: Vec<usize> = table.range(group).skip(1).collect();
                if factor > 0.0 && !places.is_empty() {
                    let count = places.len();
                    let matrix = if is_of_weights {
                        second_differences(count)
                    } else {
                        Matrix::identity(count, count)
                    };
                    parts.push(PriorPart { places, matrix, factor, input, is_of_weights });
                }
            }
        }
        parts
    }

    /// Whether any hysteresis has a prior.
    pub(crate) fn has_prior(&self) -> bool {
        self.channels.iter().any(|channel| !channel.prior.is_none())
    }

    /// What the prior adds to the cost.
    pub(crate) fn penalty(&self, table: &Table) -> f64 {
        if !self.has_prior() {
            return 0.0;
        }
        let values = table.values(self);
        self.prior(table).iter().map(|part| part.factor * part.square(&values)).sum()
    }

    /// Adds the prior to the descent of the cost; returns what it adds to the cost.
    pub(crate) fn penalise(&self, table: &Table, descent: &mut DVector<f64>) -> f64 {
        if !self.has_prior() {
            return 0.0;
        }
        let values = table.values(self);
        let mut penalty = 0.0;
        for part in self.prior(table) {
            let product = &part.matrix * part.own(&values);
            for (&place, value) in part.places.iter().zip(product.iter()) {
                descent[place] -= part.factor * value;
            }
            penalty += part.factor * part.square(&values);
        }
        penalty
    }
}

/// Adds parts of a prior to a Gram matrix.
pub(crate) fn add_prior(parts: &[PriorPart], gram: &mut Arrow) {
    for part in parts {
        gram.add_part(&(part.factor * &part.matrix), &part.places);
    }
}

/// L'L with the rows 1, -2, 1 of L.
fn second_differences(count: usize) -> Matrix {
    let rows = count.saturating_sub(2);
    let mut differences = Matrix::zeros(rows, count);
    for i in 0..rows {
        differences.view_mut((i, i), (1, 3)).copy_from_slice(&[1.0, -2.0, 1.0]);
    }
    differences.tr_mul(&differences)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_weights_cost_nothing() {
        let matrix = second_differences(6);
        let square = |values: [f64; 6]| {
            let values = DVector::from_row_slice(&values);
            (&matrix * &values).dot(&values)
        };
        assert_eq!(square([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), 0.0);
        // differences 1, 1, 1, 1, 4: one second difference of 3
        assert_eq!(square([1.0, 2.0, 3.0, 4.0, 5.0, 9.0]), 9.0);
        assert_eq!(second_differences(2), Matrix::zeros(2, 2));
    }
}
