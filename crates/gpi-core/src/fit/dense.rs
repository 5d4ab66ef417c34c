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
//! with `F_{r, s}(-1) = z(0) + s r`. The weights are fitted to y together with the envelope's slopes, the offsets, the
//! unknown states of G and of sections in parallel, the values of the effects and the zeros of G. The poles and the
//! thresholds are held. The plays of one r differ only until they have lost their initial state; until then, a weighted
//! sum of them approximates a play with an initial place in between.
//!
//! Non-negative least squares leaves few weights above zero. A play of the stage between two grid points gets the weight of
//! both, so that neighbours on the grid become one play: their weights add up, and r and s are the weighted means. The
//! result is a start for the joint fit, which moves half-widths and initial places freely.
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
use crate::progress::Progress;

/// A play: its half-width, its weight and, in each experiment of unknown initial state, its initial place.
#[derive(Clone, Debug, PartialEq)]
struct Play {
    half_width: f64,
    weight: f64,
    sides: Vec<f64>,
}

/// The point with the plays of all inputs chosen anew on a dense grid, before a joint fit.
pub(crate) fn dense(
    point: &Point,
    prepared: &Prepared,
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
    options.gain = settings.gain;
    options.freedom.identity = false;
    options.freedom.dynamics = DynamicsFreedom::Numerator;
    options.freedom.derivatives.starts = false;
    let mut found = fit(rich, &prepared.record, &options, "dense grid", progress)?.point;
    for (input, &step) in steps.iter().enumerate() {
        join_neighbours(&mut found, input, step);
    }
    Ok(found)
}

/// Puts the dense grid in place of the plays of an input. Each play's weight goes to the nearest one.
fn spread(point: &mut Point, input: usize, step: f64, settings: &DenseSettings) {
    let known = plays(point, input);
    let unknown = known[0].sides.len();
    // where every initial state is known, one play of each half-width is enough
    let starts = if unknown > 0 { &settings.starts[..] } else { &settings.starts[..1] };
    let play =
        |half_width: f64, side: f64| Play { half_width, weight: 0.0, sides: vec![side; unknown] };
    let grid = (1..settings.half_widths).map(|place| step * place as f64);
    let plays_of = |half_width: f64| starts.iter().map(move |&side| play(half_width, side));
    let mut dense = vec![play(0.0, 0.0)];
    dense.extend(grid.flat_map(plays_of));
    for own in known {
        let apart = |other: &Play| (other.half_width - own.half_width).abs();
        let turned = |other: &Play| {
            let sides = other.sides.iter().zip(&own.sides);
            sides.map(|(other, own)| (other - own).abs()).sum::<f64>()
        };
        // of equal half-widths, the one of the nearest initial place
        let nearest = dense.iter_mut().min_by(|a, b| {
            apart(a).total_cmp(&apart(b)).then_with(|| turned(a).total_cmp(&turned(b)))
        });
        if let Some(nearest) = nearest {
            nearest.weight += own.weight;
        }
    }
    set_plays(point, input, &dense);
}

/// Joins the plays of one half-width, then those of two neighbours on the grid, and leaves out those without weight.
fn join_neighbours(point: &mut Point, input: usize, step: f64) {
    let mut used = plays(point, input).into_iter();
    let linear: Vec<Play> = used.by_ref().take(1).collect();
    let used: Vec<Play> = used.filter(|play| play.weight != 0.0).collect();
    let is_within =
        |run: &[Play], play: &Play, reach: f64| play.half_width - run[0].half_width < reach * step;
    // half-widths of the grid are whole steps apart
    let one_each = joined(used, |run, play| is_within(run, play, 0.5));
    let pairs = joined(one_each, |run, play| run.len() < 2 && is_within(run, play, 1.5));
    set_plays(point, input, &[linear, pairs].concat());
}

/// Joins runs of plays; `belongs` tells whether a play continues the run before it.
fn joined(plays: Vec<Play>, belongs: impl Fn(&[Play], &Play) -> bool) -> Vec<Play> {
    let mut runs: Vec<Vec<Play>> = Vec::new();
    for play in plays {
        match runs.last_mut() {
            Some(run) if belongs(run, &play) => run.push(play),
            _ => runs.push(vec![play]),
        }
    }
    runs.into_iter().filter_map(|run| run.into_iter().reduce(sum)).collect()
}

/// One play in place of two: the sum of the weights, and the weighted means of half-width and initial places.
fn sum(mut own: Play, other: Play) -> Play {
    let all = own.weight + other.weight;
    let part = other.weight / all;
    own.half_width += part * (other.half_width - own.half_width);
    for (side, other) in own.sides.iter_mut().zip(other.sides) {
        *side += part * (other - *side);
    }
    Play { weight: all, ..own }
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
        let mut quiet = |_: &crate::Report| true;
        let mut fitted = |point: Point| {
            let found = fit(point, &prepared.record, &options, "test", &mut quiet).unwrap();
            ((found.linearization.cost / 4000.0).sqrt(), found.point)
        };
        let (alone, _) = fitted(point.clone());
        let rich = dense(&point, &prepared, &mut |_| true).unwrap();
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
        let near = |run: &[Play], play: &Play| play.half_width - run[0].half_width < 1.5;
        let found =
            joined(vec![play(1.0, 0.1, -1.0), play(2.0, 0.3, 1.0), play(5.0, 0.2, 0.0)], near);
        assert_eq!(found.len(), 2);
        assert!((found[0].half_width - 1.75).abs() < 1e-12);
        assert!((found[0].weight - 0.4).abs() < 1e-12);
        assert!((found[0].sides[0] - 0.5).abs() < 1e-12);
        assert_eq!(found[1], play(5.0, 0.2, 0.0));
    }
}
