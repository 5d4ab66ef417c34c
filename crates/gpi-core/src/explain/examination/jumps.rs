//! Whether what a drift explains changes in jumps.
//!
//! A slow function of time through many knots also follows a signal that jumps between levels: burst noise, a sensor that slips on its
//! mount, a loose contact. A smooth curve needs several knots for each jump. A step needs only its place and its height.
//!
//! With d what the drift adds to the output and e the residual of the model with it, what the drift is to explain is `d + e`. It is cut
//! into pieces with a constant level each,
//!
//! ```text
//! J_levels = sum over pieces p of sum_k in p (d(k) + e(k) - mean_p)^2,
//! ```
//!
//! with half as many jumps as the drift has knots, so that both have as many parameters. Each next cut is the one by which J_levels
//! falls most (binary segmentation: A. J. Scott and M. Knott, 1974). White noise of variance s^2, which is known from the power of e near
//! half the sampling rate, leaves `N s^2` of N samples. The drift is not named if
//!
//! ```text
//! J_levels - N s^2 < p (|e|^2 - N s^2),
//! ```
//!
//! that is, if levels leave much less. A smooth curve needs far more levels than knots; a random walk leaves about the same with both.

use super::contribution::contribution;
use crate::chain::point::Point;
use crate::effects::Place;
use crate::identify::NoiseFloor;
use crate::{Error, Record};

/// Whether levels between jumps leave less than `part` of the squares above the noise that the drift at a place leaves; false of an
/// effect that is not added to the output.
pub(super) fn is_of_jumps(
    record: &Record,
    point: &Point,
    place: usize,
    part: f64,
) -> Result<bool, Error> {
    let Place::Added(own) = point.effects[place].place() else { return Ok(false) };
    let output = own.output();
    let without = point.without_effect(place);
    let residuals = point.residuals(record)?;
    let (mut pieces, mut smooth) = (Vec::new(), 0.0);
    for (index, experiment) in record.experiments().iter().enumerate() {
        let known = point.signals(experiment, index)?;
        let (added, _) = contribution(point, &without, &known, experiment, index)?;
        let scored = || experiment.scored_runs().flatten();
        let to_explain = |k: usize| added[(k, output)] + residuals[index][(k, output)];
        pieces.push(Piece::of(&scored().map(to_explain).collect::<Vec<f64>>()));
        smooth += scored().map(|k| residuals[index][(k, output)].powi(2)).sum::<f64>();
    }
    let jumps = point.effects[place].values().len() / PARAMETERS_OF_A_JUMP;
    let white = NoiseFloor::from_residuals(record, &residuals).rms[output];
    let noise = white.powi(2) * record.scored() as f64;
    Ok(squares_of_levels(pieces, jumps) - noise < part * (smooth - noise).max(0.0))
}

/// The place and the height.
const PARAMETERS_OF_A_JUMP: usize = 2;

/// The squares that are left when pieces are cut so many times more, each time where they fall most.
fn squares_of_levels(mut pieces: Vec<Piece>, jumps: usize) -> f64 {
    for _ in 0..jumps {
        let gain = |piece: &Piece| piece.cut.map_or(0.0, |(_, gain)| gain);
        let place =
            (0..pieces.len()).max_by(|&i, &j| gain(&pieces[i]).total_cmp(&gain(&pieces[j])));
        let cut = place.and_then(|place| Some((place, pieces[place].cut?.0)));
        let Some((place, at)) = cut else { break };
        let [left, right] = pieces.swap_remove(place).halves(at);
        pieces.extend([left, right]);
    }
    pieces.iter().map(|piece| piece.squares).sum()
}

/// Successive values with one level.
struct Piece {
    /// Sums of the values before each sample, less those before the first one.
    sums: Vec<f64>,
    /// The same of their squares.
    squared: Vec<f64>,
    /// Squares around the mean.
    squares: f64,
    /// The sample before which a cut lowers them most, and by how much; `None` of a piece of one sample.
    cut: Option<(usize, f64)>,
}

impl Piece {
    fn of(values: &[f64]) -> Self {
        let running = |of: fn(f64) -> f64| {
            let mut sum = 0.0;
            let next = values.iter().map(|&value| {
                sum += of(value);
                sum
            });
            std::iter::once(0.0).chain(next).collect()
        };
        Self::between(running(|value| value), running(|value| value * value))
    }

    fn between(sums: Vec<f64>, squared: Vec<f64>) -> Self {
        let n = sums.len() - 1;
        let total = sums[n];
        // the part of a piece's squares that its level takes
        let taken = |sum: f64, count: usize| sum * sum / count.max(1) as f64;
        let gain =
            |at: usize| taken(sums[at], at) + taken(total - sums[at], n - at) - taken(total, n);
        let cut = (1..n).map(|at| (at, gain(at))).max_by(|a, b| a.1.total_cmp(&b.1));
        let squares = (squared[n] - taken(total, n)).max(0.0);
        Self { sums, squared, squares, cut }
    }

    /// The piece before a sample and that from it on.
    fn halves(&self, at: usize) -> [Self; 2] {
        let part = |sums: &[f64]| sums.iter().map(|sum| sum - sums[0]).collect();
        let before = Self::between(part(&self.sums[..=at]), part(&self.squared[..=at]));
        [before, Self::between(part(&self.sums[at..]), part(&self.squared[at..]))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::plain::plain;
    use crate::effects::Drift;
    use crate::explain::outside::plants::noise;
    use crate::{Channel, Experiment, Matrix};

    /// Whether a drift of 16 knots, each at the value of `disturbance` there, is refused.
    fn is_refused(disturbance: impl Fn(usize) -> f64) -> bool {
        let (samples, rate) = (801, 1e3);
        let u = Matrix::from_fn(samples, 1, |k, _| (0.3 * k as f64).sin());
        let mut noise = noise(1);
        let y = Matrix::from_fn(samples, 1, |k, _| u[k] + disturbance(k) + 0.01 * noise());
        let knot = |j: usize| disturbance(50 * j) - disturbance(0);
        let drift = Drift {
            output: 0,
            moves_stage: false,
            changes: (1..=16).map(knot).collect(),
            duration: samples as f64 / rate,
            span: 2.0,
        };
        let mut point = plain(&[1.0], &[1.0], vec![drift.into()]);
        point.offsets[0].fill(disturbance(0));
        let channel = |name| vec![Channel::new(name, "")];
        let record =
            Record::new(vec![Experiment::new(u, y)], rate, channel("u"), channel("y"), vec![]);
        is_of_jumps(&record.unwrap(), &point, 0, 0.5).unwrap()
    }

    #[test]
    fn levels_are_no_drift_and_a_smooth_curve_is_one() {
        assert!(is_refused(|k| [0.0, 1.0, -0.5, 1.0, 0.0][k / 180]));
        assert!(!is_refused(|k| (0.01 * k as f64).sin()));
        assert!(!is_refused(|k| 1e-3 * k as f64));
    }

    fn left(values: &[f64], jumps: usize) -> f64 {
        squares_of_levels(vec![Piece::of(values)], jumps)
    }

    #[test]
    fn levels_between_jumps_need_as_many_cuts() {
        let values: Vec<f64> = (0..90).map(|k| [1.0, -2.0, 0.5][k / 30]).collect();
        let mean = -0.5 / 3.0;
        let all: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        assert!((left(&values, 0) - all).abs() < 1e-9);
        assert!(left(&values, 1) > 1.0);
        assert!(left(&values, 2) < 1e-9);
        // there is nothing more to cut in the end
        assert!(left(&values[..3], 100) < 1e-12);
    }

    #[test]
    fn a_ramp_keeps_a_part_that_falls_with_the_square_of_the_number_of_levels() {
        let ramp: Vec<f64> = (0..1024).map(f64::from).collect();
        let [two, four] = [1, 3].map(|jumps| left(&ramp, jumps));
        assert!((left(&ramp, 0) / two - 4.0).abs() < 1e-3);
        assert!((two / four - 4.0).abs() < 1e-3);
    }
}
