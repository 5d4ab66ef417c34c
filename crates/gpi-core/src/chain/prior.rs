//! What is known without the data: the density of the plays is smooth, the envelope bends little, and initial states are not far larger
//! than the output.
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
//! Behind an output stage, the samples at the begin of an experiment may say next to nothing of its initial state x: the gap of a backlash is
//! open, or a sensor is at the end of its range. The rest of the experiment then asks for an arbitrary x. With an output stage,
//!
//! ```text
//! f |x|^2,      f = 1e-6
//! ```
//!
//! is added to the cost. The sections are in observer form, so that a state is about as large as what it adds to the output: x counts as if
//! one sample had shown a thousandth of it, and a state that any sample shows hardly changes.
//!
//! Source: G. Pillonetto, F. Dinuzzo, T. Chen, G. De Nicolao, L. Ljung, *Kernel methods in system identification, machine learning and function
//! estimation: a survey*, Automatica 50, 2014.

use super::group::Group;
use super::hysteresis::Prior;
use super::point::Point;
use super::table::Table;
use crate::Matrix;
use crate::linear::Arrow;
use nalgebra::DVector;

/// f of the initial states behind an output stage.
const STATES: f64 = 1e-6;

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
        square(&self.matrix, &own(&self.places, values))
    }
}

fn own(places: &[usize], values: &[f64]) -> DVector<f64> {
    DVector::from_iterator(places.len(), places.iter().map(|&place| values[place]))
}

fn square(matrix: &Matrix, values: &DVector<f64>) -> f64 {
    (matrix * values).dot(values)
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

    /// The unknown initial states of each experiment, where an output stage may hide them, and the matrix of `f |x|^2`.
    fn hidden_states(&self, table: &Table) -> Vec<(Vec<usize>, Matrix)> {
        let experiments = if self.senses() { self.pasts.len() } else { 0 };
        let of = |experiment| {
            let range = table.range(Group::State { experiment });
            let states = table.coefficients(&range);
            (range.collect(), STATES * states.tr_mul(&states))
        };
        (0..experiments).map(of).collect()
    }

    /// What the prior adds to the cost.
    pub(crate) fn penalty(&self, table: &Table) -> f64 {
        if !self.has_prior() && !self.senses() {
            return 0.0;
        }
        let values = table.values(self);
        let hidden = self.hidden_states(table).into_iter();
        let states: f64 =
            hidden.map(|(places, matrix)| square(&matrix, &own(&places, &values))).sum();
        let parts = self.prior(table);
        states + parts.iter().map(|part| part.factor * part.square(&values)).sum::<f64>()
    }

    /// Adds the prior to the descent of the cost; returns what it adds to the cost.
    pub(crate) fn penalise(&self, table: &Table, descent: &mut DVector<f64>) -> f64 {
        if !self.has_prior() && !self.senses() {
            return 0.0;
        }
        let values = table.values(self);
        let mut penalty = 0.0;
        for (places, matrix) in self.hidden_states(table) {
            let states = own(&places, &values);
            let product = &matrix * &states;
            places.iter().zip(product.iter()).for_each(|(&place, value)| descent[place] -= value);
            penalty += product.dot(&states);
        }
        for part in self.prior(table) {
            let product = &part.matrix * own(&part.places, &values);
            for (&place, value) in part.places.iter().zip(product.iter()) {
                descent[place] -= part.factor * value;
            }
            penalty += part.factor * part.square(&values);
        }
        penalty
    }

    /// Adds the prior to a Gram matrix.
    pub(crate) fn curve(&self, table: &Table, gram: &mut Arrow) {
        add_prior(&self.prior(table), gram);
        for (places, matrix) in self.hidden_states(table) {
            gram.add_part(&matrix, &places);
        }
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
    use crate::chain::plain::{FREE, plain};
    use crate::effects::Backlash;

    #[test]
    fn initial_states_behind_a_gap_are_damped_and_cost_a_little() {
        let gap = Backlash { output: 0, half_width: 0.3, missing: None };
        for (effects, own) in [(vec![gap.into()], STATES), (vec![], 0.0)] {
            let is_hidden = own > 0.0;
            let mut point = plain(&[0.0, 0.3], &[1.0, -0.7], effects);
            point.pasts[0].has_unknown_state = true;
            point.pasts[0].state[0] = 2.0;
            let table = Table::new(&point, FREE);
            let state = table.range(Group::State { experiment: 0 }).start;
            assert_eq!(table.is_linear(state), !is_hidden);
            let mut gram = Arrow::zeros(table.len, table.own());
            point.curve(&table, &mut gram);
            let mut descent = DVector::zeros(table.len);
            assert_eq!(point.penalise(&table, &mut descent), 4.0 * own);
            assert_eq!(point.penalty(&table), 4.0 * own);
            assert_eq!((gram.get(state, state), descent[state]), (own, -2.0 * own));
            assert_eq!(
                descent.iter().filter(|value| **value != 0.0).count(),
                usize::from(is_hidden)
            );
        }
    }

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
