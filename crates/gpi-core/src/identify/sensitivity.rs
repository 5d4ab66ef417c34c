//! The output of one hysteresis and its derivatives, streamed sample by sample.

use crate::Hysteresis;
use crate::operators::{Deadzones, Gpi, PlayBank, Reading, play};

/// Parameters of one hysteresis with one-sided deadzones: `z = u + sum_j g_j Z_{eta_j}(u)`, then plays.
///
/// The weight of the identity is 1, which fixes the scale between envelope and plays.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parameters {
    pub thresholds: Vec<f64>,
    pub slopes: Vec<f64>,
    pub half_widths: Vec<f64>,
    pub weights: Vec<f64>,
}

impl Parameters {
    /// The identity v = u on the given grid; `half_widths[0]` is 0.
    pub(super) fn identity(thresholds: Vec<f64>, half_widths: Vec<f64>) -> Self {
        let slopes = vec![0.0; thresholds.len()];
        let mut weights = vec![0.0; half_widths.len()];
        weights[0] = 1.0;
        Self { thresholds, slopes, half_widths, weights }
    }

    /// z for one sample of u.
    pub(super) fn envelope(&self, u: f64) -> f64 {
        let zones = self.thresholds.iter().zip(&self.slopes);
        u + zones.map(|(&threshold, slope)| slope * zone(threshold, u)).sum::<f64>()
    }

    /// Smallest and largest z of samples of u.
    pub(super) fn envelope_range(&self, u: impl Iterator<Item = f64>) -> (f64, f64) {
        u.map(|value| self.envelope(value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)))
    }

    /// The operator, without plays and deadzones of weight zero.
    pub(super) fn to_operator(&self) -> Result<Hysteresis, crate::Error> {
        let zones = self.thresholds.iter().zip(&self.slopes).filter(|(_, slope)| **slope != 0.0);
        let (mut thresholds, mut slopes): (Vec<f64>, Vec<f64>) = zones.unzip();
        let place = thresholds.partition_point(|&threshold| threshold < 0.0);
        thresholds.insert(place, 0.0);
        slopes.insert(place, 1.0);
        let plays = self.half_widths.iter().zip(&self.weights);
        let (half_widths, weights) = plays.filter(|(r, p)| **r == 0.0 || **p != 0.0).unzip();
        let envelope = Deadzones::new(thresholds, slopes, Reading::OneSided)?;
        Ok(Gpi::new(envelope, PlayBank::new(half_widths, weights)?))
    }
}

impl Parameters {
    /// Replaces samples of u by those of v, from F_i(-1) = start_i.
    pub(super) fn apply(&self, start: &[f64], signal: &mut [f64]) {
        let wanted = Derivatives::default();
        let mut sensitivity = Sensitivity::new(self, start, wanted);
        let mut row = vec![0.0; Sensitivity::columns(self, wanted)];
        for value in signal {
            sensitivity.step(*value, &mut row);
            *value = row[0];
        }
    }
}

/// A one-sided deadzone whose threshold is not zero.
fn zone(threshold: f64, u: f64) -> f64 {
    if threshold > 0.0 { (u - threshold).max(0.0) } else { (u - threshold).min(0.0) }
}

/// Which derivatives are wanted besides those by the weights and slopes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Derivatives {
    pub thresholds: bool,
    pub starts: bool,
}

/// Streams v and its derivatives with respect to weights, slopes, thresholds and start values.
///
/// A play's derivative by z is 1 while it slides and 0 while it sticks, so what reaches v from a
/// parameter of the envelope is its effect on z at the time each play last slid.
pub(super) struct Sensitivity<'a> {
    parameters: &'a Parameters,
    wanted: Derivatives,
    plays: Vec<f64>,
    /// Whether play i still remembers its start value.
    remembers: Vec<bool>,
    /// Z_j, then dz/d eta_j if wanted, when play i last slid: one after the other for each play.
    held: Vec<f64>,
    /// The same for the present sample.
    present: Vec<f64>,
    /// Sums over the plays of weight times `held`.
    sums: Vec<f64>,
}

impl<'a> Sensitivity<'a> {
    /// Starts with F_i(-1) = start_i.
    pub(super) fn new(parameters: &'a Parameters, start: &[f64], wanted: Derivatives) -> Self {
        let n = parameters.half_widths.len();
        let zones = parameters.thresholds.len() * if wanted.thresholds { 2 } else { 1 };
        Self {
            parameters,
            wanted,
            plays: start.to_vec(),
            remembers: vec![true; n],
            held: vec![0.0; n * zones],
            present: vec![0.0; zones],
            sums: vec![0.0; zones],
        }
    }

    /// How many values [`Sensitivity::step`] writes: v, plays, slopes, thresholds, starts.
    pub(super) fn columns(parameters: &Parameters, wanted: Derivatives) -> usize {
        let times = |wanted: bool| if wanted { 2 } else { 1 };
        let (n, zones) = (parameters.half_widths.len(), parameters.thresholds.len());
        1 + n * times(wanted.starts) + zones * times(wanted.thresholds)
    }

    /// One sample: `v`, then dv/d of the play weights, slopes, thresholds and start values.
    pub(super) fn step(&mut self, u: f64, output: &mut [f64]) {
        let Parameters { thresholds, slopes, half_widths, weights } = self.parameters;
        let (n, zones) = (half_widths.len(), thresholds.len());
        let mut z = u;
        for j in 0..zones {
            let value = zone(thresholds[j], u);
            self.present[j] = value;
            if self.wanted.thresholds {
                self.present[zones + j] = if value == 0.0 { 0.0 } else { -slopes[j] };
            }
            z += slopes[j] * value;
        }
        let held_size = self.present.len();
        let mut v = 0.0;
        for i in 0..n {
            let previous = self.plays[i];
            let value = play(half_widths[i], z, previous);
            if value != previous || half_widths[i] == 0.0 {
                self.remembers[i] = false;
                if weights[i] != 0.0 {
                    let held = &mut self.held[held_size * i..held_size * (i + 1)];
                    for (sum, (&present, &held)) in
                        self.sums.iter_mut().zip(self.present.iter().zip(held.iter()))
                    {
                        *sum += weights[i] * (present - held);
                    }
                    held.copy_from_slice(&self.present);
                }
            }
            self.plays[i] = value;
            v += weights[i] * value;
            output[1 + i] = value;
            if self.wanted.starts {
                output[1 + n + held_size + i] = if self.remembers[i] { weights[i] } else { 0.0 };
            }
        }
        output[0] = v;
        output[1 + n..1 + n + held_size].copy_from_slice(&self.sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operators::Operator;

    fn run(parameters: &Parameters, start: &[f64], u: &[f64]) -> Vec<Vec<f64>> {
        let wanted = Derivatives { thresholds: true, starts: true };
        let mut sensitivity = Sensitivity::new(parameters, start, wanted);
        let mut row = vec![0.0; Sensitivity::columns(parameters, wanted)];
        u.iter()
            .map(|&value| {
                sensitivity.step(value, &mut row);
                row.clone()
            })
            .collect()
    }

    #[test]
    fn derivatives_agree_with_differences_of_the_operator() {
        let parameters = Parameters {
            thresholds: vec![-0.7, 0.6],
            slopes: vec![0.3, -0.4],
            half_widths: vec![0.0, 0.31, 0.8],
            weights: vec![1.0, 0.5, 0.7],
        };
        let start = [0.1, 0.2, -0.3];
        let u: Vec<f64> = (0..300)
            .map(|k| (f64::from(k) * 0.137).sin() * 1.5 + 0.4 * (f64::from(k) * 0.731).cos())
            .collect();
        let rows = run(&parameters, &start, &u);
        let operator = parameters.to_operator().unwrap();
        let mut state = operator.rest();
        state.plays = operator.plays().state_from(start.to_vec()).unwrap();
        for (row, &value) in rows.iter().zip(&u) {
            assert!((row[0] - operator.step(&mut state, value)).abs() < 1e-12);
        }
        let step = 1e-7;
        let compare = |column: usize, moved: &Parameters, start: &[f64]| {
            let differences = run(moved, start, &u);
            let wrong = rows
                .iter()
                .zip(&differences)
                .filter(|(row, moved)| ((moved[0] - row[0]) / step - row[column]).abs() > 1e-5);
            // a sample at which a play turns within the step may differ
            let wrong = wrong.count();
            assert!(wrong <= 2, "column {column}: {wrong} samples differ");
        };
        for i in 0..3 {
            let mut moved = parameters.clone();
            moved.weights[i] += step;
            compare(1 + i, &moved, &start);
            let mut moved = start;
            moved[i] += step;
            compare(1 + 3 + 4 + i, &parameters, &moved);
        }
        for j in 0..2 {
            let mut moved = parameters.clone();
            moved.slopes[j] += step;
            compare(1 + 3 + j, &moved, &start);
            let mut moved = parameters.clone();
            moved.thresholds[j] += step;
            compare(1 + 3 + 2 + j, &moved, &start);
        }
    }
}
