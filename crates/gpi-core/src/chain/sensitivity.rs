//! The output of one hysteresis and its derivatives, streamed sample by sample.
//!
//! ```text
//! z(k) = sum_j g_j Z_j(k),      F_i(k) = max(z - w_i, min(z + w_i, F_i(k-1))),      v(k) = sum_i p_i q_i(F_i(k))
//! ```
//!
//! A play has three branches. With the width w_i(r_i) and the derivative by any parameter of the envelope or by r_i,
//!
//! ```text
//! F_i slides up:     F_i = z - w_i     dF_i = dz - dw_i
//! F_i slides down:   F_i = z + w_i     dF_i = dz + dw_i
//! F_i sticks:        F_i = F_i(k-1)    dF_i as at the sample before
//! ```
//!
//! Let k_i <= k be the sample at which play i last slid. Then dF_i by a parameter of the envelope is dz at k_i. With
//! `c_i = p_i q_i'(F_i)`, the derivatives of v(k) are
//!
//! | by | derivative |
//! |---|---|
//! | weight p_i | `q_i(F_i(k))` |
//! | slope g_j | `sum_i c_i Z_j(k_i)` |
//! | threshold eta_j | `sum_i c_i dz/deta_j(k_i)`, where dz/deta_j is `-g_j` if `Z_j != 0` and 0 otherwise; `+g_j` on the falling branch of directional deadzones |
//! | half-width r_i | `c_i s_i dw_i/dr_i + p_i dq_i/dr_i`, s_i = -1 after sliding up, 1 after sliding down |
//! | start s_i | `c_i r_i` until the play first slides, then 0 |
//!
//! A start is `F_i(-1) = z(0) + s_i r_i`: it moves with z(0), so that `k_i = 0` for dz, and dF_i/dr_i = s_i, until the
//! play first slides. A play that starts from rest at F = 0 has no derivative before it slides.
//!
//! The sums over i of slopes and thresholds are not formed at every sample: only a play that slides changes its term,
//! by `p_i (dz(k) - dz(k_i))`. With curves, c_i changes at other times too, and the sums are formed anew. A sample
//! costs the number of plays plus, for each play that slides, the number of deadzones (twice with thresholds).
//!
//! The derivatives are exact where no play turns at the sample itself. Turning times shift with the parameters, but F_i
//! is continuous across a turn, so that the shift adds nothing of first order. A width that depends on the speed of the
//! drive adds no term, because the speed is a function of the drive alone.

use super::hysteresis::Parameters;
use super::plays::Plays;
use crate::operators::Reading;
use std::ops::Range;

/// Which derivatives are wanted in addition to those by the weights and slopes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Derivatives {
    pub thresholds: bool,
    pub half_widths: bool,
    pub starts: bool,
}

/// Where [`Sensitivity::step`] writes what: v first, then its derivatives by each group.
#[derive(Clone, Debug)]
pub(crate) struct Columns {
    pub weights: Range<usize>,
    pub slopes: Range<usize>,
    pub thresholds: Range<usize>,
    pub half_widths: Range<usize>,
    pub starts: Range<usize>,
    pub len: usize,
}

impl Columns {
    pub(crate) fn new(parameters: &Parameters, wanted: Derivatives) -> Self {
        let (n, zones) = (parameters.half_widths.len(), parameters.thresholds.len());
        let mut len = 1;
        let mut take = |count: usize, wanted: bool| {
            let first = len;
            len += if wanted { count } else { 0 };
            first..len
        };
        let (weights, slopes) = (take(n, true), take(zones, true));
        let thresholds = take(zones, wanted.thresholds);
        let half_widths = take(n, wanted.half_widths);
        let starts = take(n, wanted.starts);
        Self { weights, slopes, thresholds, half_widths, starts, len }
    }
}

/// Streams v and its derivatives with respect to weights, slopes, thresholds, half-widths and start
/// values.
///
/// A play's derivative by z is 1 while it slides and 0 while it sticks, so what reaches v from a
/// parameter of the envelope is its effect on z at the time each play last slid. By its half-width the
/// derivative is -1 after sliding up and +1 after sliding down.
pub(crate) struct Sensitivity<'a> {
    parameters: &'a Parameters,
    wanted: Derivatives,
    columns: Columns,
    plays: Plays<'a>,
    /// Taken at the first sample.
    start: Option<&'a [f64]>,
    /// u(k-1), which directional deadzones compare with.
    previous: Option<f64>,
    /// `dq_i/dF_i` of each play.
    slopes: Vec<f64>,
    /// Whether play i still remembers its start value.
    remembers: Vec<bool>,
    /// dF_i/dr_i.
    directions: Vec<f64>,
    /// Z_j, then dz/d eta_j if wanted, when play i last slid: one after the other for each play.
    held: Vec<f64>,
    /// The same for the present sample.
    present: Vec<f64>,
    /// Sums over the plays of weight times `held`.
    sums: Vec<f64>,
}

impl<'a> Sensitivity<'a> {
    /// Starts from rest, or with F_i(-1) = z(0) + s_i r_i for `start` s_i in [-1, 1]: the place of a
    /// play follows z, wherever the envelope takes z.
    pub(crate) fn new(
        parameters: &'a Parameters,
        start: Option<&'a [f64]>,
        wanted: Derivatives,
        plays: Plays<'a>,
    ) -> Self {
        let n = parameters.half_widths.len();
        let zones = parameters.thresholds.len() * if wanted.thresholds { 2 } else { 1 };
        Self {
            parameters,
            wanted,
            columns: Columns::new(parameters, wanted),
            plays,
            previous: None,
            start,
            slopes: vec![1.0; n],
            remembers: vec![start.is_some(); n],
            directions: vec![0.0; n],
            held: vec![0.0; n * zones],
            present: vec![0.0; zones],
            sums: vec![0.0; zones],
        }
    }

    /// One sample: `v`, then dv/d of the weights, slopes, thresholds, half-widths and start values.
    pub(crate) fn step(&mut self, u: f64, output: &mut [f64]) {
        let z = self.envelope(u);
        if let Some(start) = self.start.take() {
            self.stand(z, start);
        }
        let Parameters { half_widths, weights, .. } = self.parameters;
        let Self { plays, slopes, remembers, directions, held, present, sums, .. } = self;
        let Columns { weights: reads, half_widths: widths, starts, .. } = &self.columns;
        let size = present.len();
        let v = plays.step(z, |i, moved| {
            if moved.place != moved.before || half_widths[i] == 0.0 {
                remembers[i] = false;
                let is_rising = moved.place > moved.before;
                directions[i] = if is_rising { -moved.growth } else { moved.growth };
                if weights[i] != 0.0 {
                    let held = &mut held[size * i..size * (i + 1)];
                    for (sum, (present, held)) in
                        sums.iter_mut().zip(present.iter().zip(held.iter()))
                    {
                        *sum += weights[i] * (present - held);
                    }
                    held.copy_from_slice(present);
                }
            }
            slopes[i] = moved.read.by_place;
            output[reads.start + i] = moved.read.value;
            if self.wanted.half_widths {
                let by_width = moved.read.by_place * directions[i] + moved.read.by_half_width;
                output[widths.start + i] = weights[i] * by_width;
            }
            if self.wanted.starts {
                let reach = if remembers[i] { half_widths[i] } else { 0.0 };
                output[starts.start + i] = weights[i] * moved.read.by_place * reach;
            }
        });
        output[0] = v;
        if self.plays.are_curved() {
            self.sum_through_curves();
        }
        output[self.columns.slopes.start..][..size].copy_from_slice(&self.sums);
    }

    /// z, and what its parameters add to it at the present sample.
    fn envelope(&mut self, u: f64) -> f64 {
        let Parameters { reading, thresholds, slopes, .. } = self.parameters;
        self.plays.drive_changes(self.previous.map_or(0.0, |previous| u - previous));
        let previous = self.previous.replace(u).unwrap_or(0.0);
        let zones = thresholds.len();
        let mut z = 0.0;
        for j in 0..zones {
            let value = reading.zone(thresholds[j], previous, u);
            self.present[j] = value;
            if self.wanted.thresholds {
                let falling = *reading == Reading::Directional && u < previous;
                let side = if falling { 1.0 } else { -1.0 };
                self.present[zones + j] = if value == 0.0 { 0.0 } else { side * slopes[j] };
            }
            z += slopes[j] * value;
        }
        z
    }

    /// The sums anew, with the slopes of the curves at the plays' present places, which change the sums while plays
    /// stick.
    fn sum_through_curves(&mut self) {
        let weights = &self.parameters.weights;
        self.sums.fill(0.0);
        let held = self.held.chunks_exact(self.present.len());
        for (i, held) in held.enumerate().filter(|(i, _)| weights[*i] != 0.0) {
            let slope = weights[i] * self.slopes[i];
            self.sums.iter_mut().zip(held).for_each(|(sum, value)| *sum += slope * value);
        }
    }

    /// Puts the plays at the first z plus a fraction of their half-widths; they move with z.
    fn stand(&mut self, z: f64, start: &[f64]) {
        let weights = &self.parameters.weights;
        self.plays.stand(z, start);
        for (i, &side) in start.iter().enumerate() {
            self.directions[i] = side;
            let held = &mut self.held[self.present.len() * i..self.present.len() * (i + 1)];
            held.copy_from_slice(&self.present);
            for (sum, present) in self.sums.iter_mut().zip(&self.present) {
                *sum += weights[i] * present;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::Elements;
    use crate::chain::hysteresis::Prior;
    use crate::effects::{Effect, HysteresisShape};
    use crate::operators::Operator;

    fn run(parameters: &Parameters, start: &[f64], u: &[f64]) -> Vec<Vec<f64>> {
        run_with(parameters, &[], start, u)
    }

    fn run_with(
        parameters: &Parameters,
        effects: &[Effect],
        start: &[f64],
        u: &[f64],
    ) -> Vec<Vec<f64>> {
        let wanted = Derivatives { thresholds: true, half_widths: true, starts: true };
        let plays = parameters.plays(effects, 0, 1.0);
        let mut sensitivity = Sensitivity::new(parameters, Some(start), wanted, plays);
        let mut row = vec![0.0; Columns::new(parameters, wanted).len];
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
            elements: Elements::Plays,
            reading: Reading::OneSided,
            thresholds: vec![0.0, -0.7, 0.6],
            slopes: vec![1.1, 0.3, -0.4],
            half_widths: vec![0.0, 0.31, 0.8],
            weights: vec![1.0, 0.5, 0.7],
            prior: Prior::default(),
        };
        let start = [0.0, 0.4, -0.3];
        let u: Vec<f64> = (0..300)
            .map(|k| (f64::from(k) * 0.137).sin() * 1.5 + 0.4 * (f64::from(k) * 0.731).cos())
            .collect();
        let rows = run(&parameters, &start, &u);
        let operator = parameters.to_operator().unwrap();
        let mut state = operator.rest();
        let z = parameters.envelope(0.0, u[0]);
        let plays = start.iter().zip(&parameters.half_widths).map(|(s, r)| z + s * r);
        state.plays = operator.plays().state_from(plays.collect()).unwrap();
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
            compare(1 + 3 + 6 + 3 + i, &parameters, &moved);
        }
        for i in 1..3 {
            let mut moved = parameters.clone();
            moved.half_widths[i] += step;
            compare(1 + 3 + 6 + i, &moved, &start);
        }
        for j in 0..3 {
            let mut moved = parameters.clone();
            moved.slopes[j] += step;
            compare(1 + 3 + j, &moved, &start);
            if j == 0 {
                continue;
            }
            let mut moved = parameters.clone();
            moved.thresholds[j] += step;
            compare(1 + 3 + 3 + j, &moved, &start);
        }
    }

    #[test]
    fn curves_that_depend_on_the_half_width_are_in_its_derivative() {
        let parameters = Parameters {
            elements: Elements::Plays,
            reading: Reading::OneSided,
            thresholds: vec![0.0],
            slopes: vec![1.0],
            half_widths: vec![0.31, 0.8],
            weights: vec![0.5, 0.7],
            prior: Prior::default(),
        };
        let coefficients = vec![0.2, -0.3, 0.1, -0.1, 0.25, 0.4];
        let shape = HysteresisShape {
            input: 0,
            coefficients,
            widths: 3,
            middle: 0.1,
            scale: 2.0,
            widest: 1.0,
        };
        let effects = [Effect::from(shape)];
        let u: Vec<f64> = (0..300).map(|k| 1.5 * (f64::from(k) * 0.137).sin()).collect();
        let start = [0.4, -0.3];
        let rows = run_with(&parameters, &effects, &start, &u);
        let step = 1e-6;
        for i in 0..2 {
            let mut moved = parameters.clone();
            moved.half_widths[i] += step;
            let differences = run_with(&moved, &effects, &start, &u);
            let column = 1 + 2 + 1 + 1 + i;
            let wrong = rows
                .iter()
                .zip(&differences)
                .filter(|(row, moved)| ((moved[0] - row[0]) / step - row[column]).abs() > 1e-5);
            let wrong = wrong.count();
            assert!(wrong <= 2, "half-width {i}: {wrong} samples differ");
        }
    }
}
