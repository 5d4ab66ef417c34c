//! A hysteresis with plays wherever the record asks for them: non-negative least squares on a dense grid.
//!
//! A joint fit moves each half-width r_i and each initial place s_i downhill from where it stands. It cannot split one
//! play into two, so too few wide plays stay too few. The output is linear in the weights, so that on a grid that is
//! dense in r, with several initial places s for each r where the initial state is unknown, the weights alone decide
//! which plays there are:
//!
//! ```text
//! v(k) = sum_i sum_s p_is F_{r_i, s}(k),    p_is >= 0,    r_i = i/n of half the span of z,    s = -1, 0, 1
//! ```
//!
//! with `F_{r, s}(-1) = z(0) + s r`. They are fitted to y together with the envelope's slopes, the offsets, the state of G
//! and the zeros of G; the poles, the thresholds and the effects are held. Two thirds of the columns are needed only
//! until the plays have lost their initial state, where a mixture of starts resembles a start in between.
//!
//! Non-negative least squares leaves few weights above zero. A play of the stage between two grid points gets the weight of
//! both, so that neighbours on the grid become one play: their weights add up, and r and s are the weighted means. The
//! result is a start for the joint fit, which knows no grid.
//!
//! Source: C. Lawson and R. Hanson, Solving Least Squares Problems, 1974, chapter 23, for the active set that makes the
//! solution sparse.

use crate::Error;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::{DynamicsFreedom, Point};
use crate::fit::RefineOptions;
use crate::fit::joint::fit_options;
use crate::fit::minimize::fit;
use crate::fit::preparation::Prepared;
use crate::fit::settings::DenseSettings;
use crate::optimize::Loss;
use crate::progress::Progress;

/// A play: its half-width, its weight and, in each experiment of unknown initial state, its initial place.
#[derive(Clone, Debug, PartialEq)]
struct Play {
    half_width: f64,
    weight: f64,
    sides: Vec<f64>,
}

/// The point with the plays that a dense grid asks for, before a joint fit.
///
/// `loss` weighs the outputs. The plays of all inputs are placed anew.
pub(crate) fn dense(
    point: &Point,
    prepared: &Prepared,
    loss: &Loss,
    progress: Progress,
) -> Result<Point, Error> {
    let settings = &prepared.settings.dense;
    let mut rich = point.clone();
    let step = |span: f64| 0.5 * span / settings.half_widths as f64;
    let steps: Vec<f64> = prepared.spans(point).into_iter().map(step).collect();
    for (input, &step) in steps.iter().enumerate() {
        spread(&mut rich, input, step, settings);
    }
    let mut options = fit_options(prepared, &RefineOptions::default(), settings.steps);
    options.loss = loss.clone();
    options.gain = settings.gain;
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Numerator;
    options.freedom.derivatives.starts = false;
    let mut found = fit(rich, &prepared.record, &options, "dense grid", progress)?.point;
    for (input, &step) in steps.iter().enumerate() {
        gather(&mut found, input, step);
    }
    Ok(found)
}

/// Puts the dense grid in place of the plays of an input. Each play's weight goes to the nearest one.
fn spread(point: &mut Point, input: usize, step: f64, settings: &DenseSettings) {
    let known = plays(point, input);
    let is_unknown = point.pasts.iter().any(|past| past.plays.is_some());
    let starts = if is_unknown { &settings.starts[..] } else { &settings.starts[1..2] };
    let grid = (1..settings.half_widths).flat_map(|i| starts.iter().map(move |&s| (i, s)));
    let unknown = point.pasts.iter().filter(|past| past.plays.is_some()).count();
    let mut dense = vec![Play { half_width: 0.0, weight: 0.0, sides: vec![0.0; unknown] }];
    dense.extend(grid.map(|(place, side)| Play {
        half_width: step * place as f64,
        weight: 0.0,
        sides: vec![side; unknown],
    }));
    for play in known {
        let mean = play.sides.iter().sum::<f64>() / unknown.max(1) as f64;
        let distance = |other: &Play| {
            let apart = (other.half_width - play.half_width).abs() / step;
            let side = other.sides.first().map_or(0.0, |side| (side - mean).abs());
            // the half-width decides, the initial place only between equal ones
            apart + 1e-3 * side
        };
        let nearest =
            (0..dense.len()).min_by(|&a, &b| distance(&dense[a]).total_cmp(&distance(&dense[b])));
        if let Some(nearest) = nearest {
            dense[nearest].weight += play.weight;
        }
    }
    set_plays(point, input, &dense);
}

/// Joins the plays of one half-width, then those of two neighbours on the grid, and leaves out those without weight.
fn gather(point: &mut Point, input: usize, step: f64) {
    let mut used = plays(point, input).into_iter();
    let linear: Vec<Play> = used.by_ref().take(1).collect();
    let used: Vec<Play> = used.filter(|play| play.weight > 0.0).collect();
    let apart = |own: &Play, other: &Play| other.half_width - own.half_width;
    let one_each = joined(used, |run| apart(&run[0], &run[run.len() - 1]) < 0.5 * step);
    let pairs =
        joined(one_each, |run| run.len() < 3 && apart(&run[0], &run[run.len() - 1]) < 1.5 * step);
    set_plays(point, input, &[linear, pairs].concat());
}

/// Joins runs of plays, each as long as `is_one` accepts it.
fn joined(plays: Vec<Play>, is_one: impl Fn(&[Play]) -> bool) -> Vec<Play> {
    let mut runs: Vec<Vec<Play>> = Vec::new();
    for play in plays {
        if let Some(run) = runs.last_mut() {
            run.push(play);
            if is_one(run) {
                continue;
            }
            let Some(play) = run.pop() else { continue };
            runs.push(vec![play]);
        } else {
            runs.push(vec![play]);
        }
    }
    let one = |run: Vec<Play>| {
        run.into_iter().reduce(|mut own, other| {
            join(&mut own, &other);
            own
        })
    };
    runs.into_iter().filter_map(one).collect()
}

/// Adds a play to another one.
fn join(own: &mut Play, other: &Play) {
    let all = own.weight + other.weight;
    let part = if all > 0.0 { other.weight / all } else { 0.5 };
    own.half_width += part * (other.half_width - own.half_width);
    own.sides
        .iter_mut()
        .zip(&other.sides)
        .for_each(|(side, other)| *side += part * (other - *side));
    own.weight = all;
}

fn plays(point: &Point, input: usize) -> Vec<Play> {
    let Parameters { half_widths, weights, .. } = &point.channels[input];
    let sides = |place: usize| {
        let known = point.pasts.iter().filter_map(|past| past.plays.as_ref());
        known.map(|plays| plays[input][place]).collect()
    };
    let play = |(place, (&half_width, &weight)): (usize, (&f64, &f64))| Play {
        half_width,
        weight,
        sides: sides(place),
    };
    half_widths.iter().zip(weights).enumerate().map(play).collect()
}

fn set_plays(point: &mut Point, input: usize, plays: &[Play]) {
    point.channels[input].half_widths = plays.iter().map(|play| play.half_width).collect();
    point.channels[input].weights = plays.iter().map(|play| play.weight).collect();
    let unknown = point.pasts.iter_mut().filter_map(|past| past.plays.as_mut());
    for (index, sides) in unknown.enumerate() {
        sides[input] = plays.iter().map(|play| play.sides[index]).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Sections;
    use crate::operators::Reading;
    use crate::{Channel, Experiment, Matrix, Record};

    /// Triangles of growing and falling size around 5; the record begins in the middle of one.
    fn input(k: usize) -> f64 {
        let size = 5.0 * (0.4 + 0.6 * (k as f64 / 700.0).sin().abs());
        let phase = (k as f64 / 160.0 + 0.3).fract();
        5.0 + size * (4.0 * (phase - 0.5).abs() - 1.0)
    }

    #[test]
    fn splits_wide_plays_that_a_joint_fit_leaves_together() {
        let truth = Parameters {
            weights: vec![1.0, 0.2, 0.15, 0.2],
            ..Parameters::identity(Reading::OneSided, vec![], vec![0.0, 1.0, 3.0, 4.2])
        };
        let mut output: Vec<f64> = (0..4000).map(input).collect();
        let u = Matrix::from_column_slice(output.len(), 1, &output);
        truth.apply(Some(&[0.0, -1.0, -1.0, -0.4]), truth.plays(&[], 0, 1.0), &mut output);
        let run = Experiment {
            input: u,
            output: Matrix::from_column_slice(output.len(), 1, &output),
            covariates: Matrix::zeros(output.len(), 0),
            warmup: 0,
            held_out: vec![],
        };
        let channel = |name: &str| vec![Channel::new(name, "")];
        let record = Record::new(vec![run], 1.0, channel("u"), channel("y"), vec![]).unwrap();
        let poor = Parameters::identity(Reading::OneSided, vec![], vec![0.0, 1.5, 3.0]);
        let prepared = Prepared::scoring_all(&record, vec![poor]).unwrap();
        let unit = Matrix::from_element(1, 1, 1.0);
        let point = prepared.point(Sections::delayed_gain(&unit, 0));
        let free = RefineOptions { half_widths: true, ..RefineOptions::default() };
        let options = fit_options(&prepared, &free, 60);
        let mut quiet = |_: &str, _: f64| true;
        let mut fitted = |point: Point| {
            let found = fit(point, &prepared.record, &options, "test", &mut quiet).unwrap();
            ((found.linearization.cost / 4000.0).sqrt(), found.point)
        };
        let (alone, _) = fitted(point.clone());
        let rich = dense(&point, &prepared, &Loss::squares(1), &mut |_, _| true).unwrap();
        let (rms, found) = fitted(rich);
        assert!(rms < 0.2 * alone, "{rms} {alone}");
        // the weights of all plays around each true one
        let channel = &found.channels[0];
        for (half_width, weight) in [(1.0, 0.2), (3.0, 0.15), (4.2, 0.2)] {
            let near = channel.half_widths.iter().zip(&channel.weights);
            let near = near.filter(|(r, _)| **r > 0.0 && (**r - half_width).abs() < 0.3);
            let all: f64 = near.map(|(_, p)| p).sum();
            let scale = channel.weights[0];
            assert!((all / scale - weight).abs() < 0.03, "{half_width}: {all} {channel:?}");
        }
    }

    #[test]
    fn neighbours_on_the_grid_become_one_play_of_their_mean_half_width() {
        let play = |half_width: f64, weight: f64, side: f64| Play {
            half_width,
            weight,
            sides: vec![side],
        };
        let near = |run: &[Play]| run[run.len() - 1].half_width - run[0].half_width < 1.5;
        let found =
            joined(vec![play(1.0, 0.1, -1.0), play(2.0, 0.3, 1.0), play(5.0, 0.2, 0.0)], near);
        assert_eq!(found.len(), 2);
        assert!((found[0].half_width - 1.75).abs() < 1e-12);
        assert!((found[0].weight - 0.4).abs() < 1e-12);
        assert!((found[0].sides[0] - 0.5).abs() < 1e-12);
        assert_eq!(found[1], play(5.0, 0.2, 0.0));
    }
}
