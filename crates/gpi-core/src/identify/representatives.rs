//! A few experiments that stand for all where the derivatives of a whole record would take long.

use super::point::{Layout, Point};
use crate::{Error, Experiment, Matrix, Record};

/// Chosen experiments, and how much of the record they are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Representatives {
    /// In the record's order.
    pub experiments: Vec<usize>,
    /// Scored samples of the record over those of theirs that are used.
    pub ratio: f64,
    /// Samples that a state of G remembers to one percent.
    pub memory: usize,
    /// Every so many scored samples one is enough.
    pub stride: usize,
}

/// Chooses experiments of evenly spread swings with enough samples for the curvature of the cost by so many
/// unknowns, where all of them would take long; `None` where they would not, or where each experiment has
/// unknowns of its own that the others say nothing about.
pub(crate) fn representatives(
    point: &Point,
    record: &Record,
    unknowns: usize,
) -> Option<Representatives> {
    /// Products of a Gram matrix that take long.
    const LONG: f64 = 1e10;
    /// Values for each unknown that are enough.
    const ENOUGH: f64 = 40.0;
    /// Small, middle and large swings.
    const FEWEST: f64 = 3.0;
    let experiments = record.experiments();
    let values = (record.scored() * record.outputs().len()) as f64;
    let unknowns = unknowns as f64;
    let has_own = point.pasts.iter().any(|past| past.moving || past.plays.is_some());
    if values * unknowns * unknowns < LONG || has_own {
        return None;
    }
    let all = experiments.len() as f64;
    let count = (all * ENOUGH * unknowns / values).ceil().max(FEWEST);
    if count > 0.5 * all {
        return None;
    }
    let swing = |experiment: &Experiment| {
        let rows = experiment.scored_rows(&experiment.output).map(|rows| rows.norm_squared());
        rows.sum::<f64>() / experiment.scored() as f64
    };
    let swings: Vec<f64> = experiments.iter().map(swing).collect();
    let chosen = spread(&swings, count as usize);
    let own: usize = chosen.iter().map(|&index| experiments[index].scored()).sum();
    let own = own as f64;
    let stride = (own * record.outputs().len() as f64 / (ENOUGH * unknowns)).floor().max(1.0);
    let slowest = point.dynamics.poles().iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let memory = (0.01_f64.ln() / slowest.min(1.0 - 1e-9).ln()).ceil().max(0.0);
    Some(Representatives {
        experiments: chosen,
        ratio: record.scored() as f64 * stride / own,
        memory: memory as usize,
        stride: stride as usize,
    })
}

/// So many places among the ordered values, evenly spread.
fn spread(values: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let place = |i: usize| (2 * i + 1) * values.len() / (2 * count);
    let mut chosen: Vec<usize> = (0..count).map(|i| order[place(i)]).collect();
    chosen.sort_unstable();
    chosen
}

impl Representatives {
    /// Makes a Gram matrix of these experiments that of the record: all unknowns but the offsets, which every
    /// experiment has for itself, have so much more to say.
    pub(crate) fn extend(&self, gram: &mut Matrix, layout: &Layout, record: &Record) {
        let mut is_own = vec![false; layout.len];
        layout.offsets.iter().for_each(|own| is_own[own.clone()].fill(true));
        for (j, mut column) in gram.column_iter_mut().enumerate() {
            for (i, value) in column.iter_mut().enumerate() {
                let is_shared = !is_own[i] && !is_own[j];
                *value *= if is_shared { self.ratio } else { self.stride as f64 };
            }
        }
        // offsets elsewhere are as well determined as here
        let like = self.experiments[0];
        let known = layout.offsets[like].clone();
        let known = gram.view((known.start, known.start), (known.len(), known.len())).into_owned();
        let scored = |index: usize| record.experiments()[index].scored() as f64;
        let others = (0..record.experiments().len()).filter(|i| !self.experiments.contains(i));
        for index in others {
            let own = layout.offsets[index].clone();
            let mut block = gram.view_mut((own.start, own.start), (own.len(), own.len()));
            block.copy_from(&(&known * (scored(index) / scored(like))));
        }
    }

    /// A point and a record with these experiments alone.
    pub(crate) fn alone(&self, point: &Point, record: &Record) -> Result<(Point, Record), Error> {
        let of = |index: &usize| record.experiments()[*index].clone();
        let record = record.with_experiments(self.experiments.iter().map(of).collect())?;
        let mut point = point.clone();
        point.pasts = self.experiments.iter().map(|&index| point.pasts[index].clone()).collect();
        point.offsets =
            self.experiments.iter().map(|&index| point.offsets[index].clone()).collect();
        Ok((point, record))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::linearization::{Linearization, Weighting};
    use crate::identify::looped::{model, record, run};
    use crate::identify::point::{DynamicsFreedom, Freedom};
    use crate::identify::preparation::Prepared;
    use crate::identify::sensitivity::{Derivatives, Parameters};

    const FREEDOM: Freedom = Freedom {
        weights: true,
        derivatives: Derivatives { thresholds: false, half_widths: true, starts: false },
        identity: true,
        dynamics: DynamicsFreedom::Everything,
    };

    fn gram(point: &Point, record: &Record) -> (Matrix, Layout) {
        let weighting = Weighting::equal(2);
        let all = Linearization::new(point, record, FREEDOM, &weighting, &mut || Ok(())).unwrap();
        (all.equations.gram, all.layout)
    }

    #[test]
    fn gram_of_equal_experiments_is_that_of_all() {
        let model = model();
        let record = record(&model, vec![run(1.5, 0.0, 100, vec![]); 5]);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::new(&record, channels).unwrap();
        let point = prepared.point_of(&model).unwrap();
        let few = Representatives { experiments: vec![1, 3], ratio: 2.5, memory: 0, stride: 1 };
        let (expected, layout) = gram(&point, &prepared.record);
        let (alone, own) = few.alone(&point, &prepared.record).unwrap();
        let (two, within) = gram(&alone, &own);
        // offsets of the two stand elsewhere among those of all
        let shared = within.offsets[0].start;
        let mut found = Matrix::zeros(layout.len, layout.len);
        let place = |i: usize| match i.checked_sub(shared) {
            None => i,
            Some(k) => layout.offsets[few.experiments[k / 2]].start + k % 2,
        };
        for i in 0..within.len {
            for j in 0..within.len {
                found[(place(i), place(j))] = two[(i, j)];
            }
        }
        few.extend(&mut found, &layout, &prepared.record);
        let scale = expected.amax();
        let is_offset = |i: usize| layout.offsets.iter().any(|own| own.contains(&i));
        let same = |i: usize, j: usize| (found[(i, j)] - expected[(i, j)]).abs() < 1e-12 * scale;
        for i in 0..layout.len {
            for j in 0..layout.len {
                let other = is_offset(i) != is_offset(j);
                assert!(other || same(i, j), "{i} {j}: {} {}", found[(i, j)], expected[(i, j)]);
            }
        }
    }

    #[test]
    fn short_work_needs_no_representatives() {
        let model = model();
        let record = record(&model, vec![run(1.5, 0.0, 100, vec![]); 5]);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::new(&record, channels).unwrap();
        let point = prepared.point_of(&model).unwrap();
        assert_eq!(representatives(&point, &prepared.record, 50), None);
    }

    #[test]
    fn chosen_experiments_spread_over_all_swings() {
        let swings = [3.0, 1.0, 2.0, 3.1, 1.1, 2.1, 3.2, 1.2, 2.2];
        assert_eq!(spread(&swings, 3), [3, 4, 5]);
        assert_eq!(spread(&swings, 9), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    }
}
