//! Parts of a few experiments whose Gram matrix replaces that of a whole record, where the latter would take long.
//!
//! For n unknowns and N values a Gram matrix takes `N n^2` multiplications, but far fewer values than N determine it well
//! enough for the direction of a step; only the gradient must be exact, since it decides where the fit ends (R. Byrd,
//! G. Chin, W. Neveitt and J. Nocedal, On the use of stochastic Hessian information, 2011). Experiments are chosen at
//! evenly spread ranks of their output's mean square, and of each a part, so that 25 n values remain. With m of N samples
//! chosen and `J` (m rows, n) their sensitivities,
//!
//! ```text
//! gram = N / m J'J                        for what all experiments share
//! gram = N_i / m_i J_i'J_i                for the offsets of a chosen experiment i, N_i / N_l that of l for another i
//! ```
//!
//! Derivatives of a part begin `ln(0.01) / ln|p|` samples before it, p the slowest pole: earlier inputs act on it by less
//! than one percent.

use crate::chain::group::Group;
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::fit::settings::RepresentativeSettings;
use crate::linear::Section;
use crate::{Error, Experiment, Matrix, Record};

/// Chosen experiments, and how much of the record they are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Representatives {
    /// Their places in the record, and themselves with nothing but their part scored.
    pub experiments: Vec<(usize, Experiment)>,
    /// Scored samples of the record over theirs.
    pub ratio: f64,
    /// Samples before a part in which derivatives are taken along.
    pub memory: usize,
}

/// Chooses experiments of evenly spread amplitudes (rms), and of each a part, with enough samples for the curvature of the
/// cost by so many unknowns, where all of them would take long; `None` where they would not, or where each
/// experiment has unknowns of its own that the others say nothing about.
///
/// Each has another part, lest all of them show the same end of a sweep.
pub(crate) fn representatives(
    point: &Point,
    record: &Record,
    unknowns: usize,
) -> Option<Representatives> {
    let RepresentativeSettings { long, enough, fewest, most, decayed } = Default::default();
    let experiments = record.experiments();
    let all = experiments.len() as f64;
    let outputs = record.outputs().len() as f64;
    let (values, enough) = (record.scored() as f64 * outputs, enough * unknowns as f64);
    let has_own = point.pasts.iter().any(|past| past.has_unknown_state || past.plays.is_some());
    if values * (unknowns as f64).powi(2) < long
        || enough > most * values
        || all < fewest
        || has_own
    {
        return None;
    }
    let count = (all * enough / values).ceil().max(fewest);
    let power = |experiment: &Experiment| {
        let rows = experiment.scored_rows(&experiment.output).map(|rows| rows.norm_squared());
        rows.sum::<f64>() / experiment.scored() as f64
    };
    let powers: Vec<f64> = experiments.iter().map(power).collect();
    let chosen = spread(&powers, count as usize);
    let own: usize = chosen.iter().map(|&index| experiments[index].scored()).sum();
    let parts = (own as f64 * outputs / enough).floor().max(1.0) as usize;
    let part =
        |(number, index): (usize, usize)| (index, experiments[index].part(number % parts, parts));
    let chosen: Vec<(usize, Experiment)> = chosen.into_iter().enumerate().map(part).collect();
    let own: usize = chosen.iter().map(|(_, own)| own.scored()).sum();
    let slowest = point
        .sections()
        .iter()
        .flat_map(Section::poles)
        .map(num_complex::Complex::norm)
        .fold(0.0, f64::max);
    // no longer than what is scored
    let memory = (decayed.ln() / slowest.min(1.0 - 1e-9).ln()).ceil().max(0.0);
    Some(Representatives {
        ratio: record.scored() as f64 / own as f64,
        memory: (memory as usize).min(own / chosen.len()),
        experiments: chosen,
    })
}

/// The experiments whose derivatives are streamed, their places in the record, and how many samples before what
/// is scored derivatives are taken along.
pub(crate) fn streamed<'a>(
    few: Option<&'a Representatives>,
    record: &'a Record,
) -> Vec<(usize, &'a Experiment, usize)> {
    match few {
        Some(few) => few.experiments.iter().map(|(i, part)| (*i, part, few.memory)).collect(),
        None => record.experiments().iter().enumerate().map(|(i, e)| (i, e, usize::MAX)).collect(),
    }
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
    /// Extrapolates the Gram matrix of these parts to the record; every experiment has its own offsets.
    pub(crate) fn extend(&self, gram: &mut Matrix, table: &Table, record: &Record) {
        let scored = |index: usize| record.experiments()[index].scored() as f64;
        let mut factors = vec![self.ratio; table.len];
        let mut is_own = vec![false; table.len];
        let offsets = |experiment: usize| table.range(Group::Offsets { experiment });
        (0..record.experiments().len()).for_each(|index| is_own[offsets(index)].fill(true));
        for (index, part) in &self.experiments {
            let whole = scored(*index) / part.scored() as f64;
            factors[offsets(*index)].fill(whole);
        }
        for (j, mut column) in gram.column_iter_mut().enumerate() {
            for (i, value) in column.iter_mut().enumerate() {
                *value *= if is_own[j] { factors[j] } else { factors[i] };
            }
        }
        // offsets elsewhere are as well determined as here
        let like = self.experiments[0].0;
        let known = offsets(like);
        let known = gram.view((known.start, known.start), (known.len(), known.len())).into_owned();
        let is_chosen = |index: &usize| self.experiments.iter().any(|(own, _)| own == index);
        for index in (0..record.experiments().len()).filter(|index| !is_chosen(index)) {
            let own = offsets(index);
            let mut block = gram.view_mut((own.start, own.start), (own.len(), own.len()));
            block.copy_from(&(&known * (scored(index) / scored(like))));
        }
    }

    /// A point and a record with these experiments alone.
    pub(crate) fn alone(&self, point: &Point, record: &Record) -> Result<(Point, Record), Error> {
        let parts = self.experiments.iter().map(|(_, part)| part.clone());
        let record = record.with_experiments(parts.collect())?;
        let mut point = point.clone();
        let places = || self.experiments.iter().map(|(index, _)| *index);
        point.pasts = places().map(|index| point.pasts[index].clone()).collect();
        point.offsets = places().map(|index| point.offsets[index].clone()).collect();
        Ok((point, record))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{model, record, run};
    use crate::chain::point::{DynamicsFreedom, Freedom};
    use crate::chain::sensitivity::Derivatives;
    use crate::fit::preparation::Prepared;
    use crate::fit::problem::Estimation;
    use crate::optimize::{LeastSquares, Loss};

    const FREEDOM: Freedom = Freedom {
        weights: true,
        offsets: true,
        derivatives: Derivatives { thresholds: false, half_widths: true, starts: false },
        states: false,
        identity: true,
        dynamics: DynamicsFreedom::Everything,
    };

    fn gram(point: &Point, record: &Record) -> (Matrix, Table) {
        let loss = Loss::squares(2);
        let problem = Estimation::new(point, record, FREEDOM, &loss);
        let all = problem.linearize(point, &mut || Ok(())).unwrap();
        (all.gram.to_dense(), problem.table)
    }

    #[test]
    fn gram_of_equal_experiments_is_that_of_all() {
        let model = model();
        let record = record(&model, vec![run(1.5, 0.0, 100, vec![]); 5]);
        let channels: Vec<_> = model.hysteresis().iter().map(Parameters::from_operator).collect();
        let prepared = Prepared::new(&record, channels).unwrap();
        let point = prepared.point_of(&model).unwrap();
        let whole = |index: usize| (index, prepared.record.experiments()[index].clone());
        let few = Representatives { experiments: vec![whole(1), whole(3)], ratio: 2.5, memory: 0 };
        let (expected, table) = gram(&point, &prepared.record);
        let (alone, own) = few.alone(&point, &prepared.record).unwrap();
        let (two, within) = gram(&alone, &own);
        // the offsets of the two have other places among those of all
        let offsets = |experiment: usize| table.range(Group::Offsets { experiment });
        let shared = within.range(Group::Offsets { experiment: 0 }).start;
        let mut found = Matrix::zeros(table.len, table.len);
        let place = |i: usize| match i.checked_sub(shared) {
            None => i,
            Some(k) => offsets(few.experiments[k / 2].0).start + k % 2,
        };
        for i in 0..within.len {
            for j in 0..within.len {
                found[(place(i), place(j))] = two[(i, j)];
            }
        }
        few.extend(&mut found, &table, &prepared.record);
        let scale = expected.amax();
        let is_offset = |i: usize| (0..5).any(|index| offsets(index).contains(&i));
        let same = |i: usize, j: usize| (found[(i, j)] - expected[(i, j)]).abs() < 1e-12 * scale;
        for i in 0..table.len {
            for j in 0..table.len {
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
    fn parts_score_every_sample_once() {
        let model = model();
        let mut whole = record(&model, vec![run(1.5, 0.0, 100, vec![])]).experiments()[0].clone();
        whole.held_out = vec![150..170, 300..310];
        let parts: Vec<Experiment> = (0..3).map(|number| whole.part(number, 3)).collect();
        let scored = parts.iter().flat_map(Experiment::scored_runs).flatten();
        assert!(scored.eq(whole.scored_runs().flatten()));
        let third = whole.scored() / 3;
        assert!(parts.iter().all(|part| part.scored().abs_diff(third) <= 1));
    }

    #[test]
    fn chosen_experiments_spread_over_all_amplitudes() {
        let powers = [3.0, 1.0, 2.0, 3.1, 1.1, 2.1, 3.2, 1.2, 2.2];
        assert_eq!(spread(&powers, 3), [3, 4, 5]);
        assert_eq!(spread(&powers, 9), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    }
}
