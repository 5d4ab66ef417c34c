//! The output of one hysteresis and its derivatives, streamed sample by sample.

use crate::effects::{PlayCurves, PlayWidths};
use crate::operators::{Deadzones, Gpi, PlayBank, Reading, play};
use crate::{Hysteresis, Matrix};
use std::ops::Range;

/// Parameters of one hysteresis: `z = sum_j g_j Z_{eta_j}(u)`, then plays.
///
/// The first threshold is 0, whose one-sided deadzone is the identity; the first half-width is 0 too.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parameters {
    pub reading: Reading,
    pub thresholds: Vec<f64>,
    pub slopes: Vec<f64>,
    pub half_widths: Vec<f64>,
    pub weights: Vec<f64>,
}

impl Parameters {
    /// v = Z_0(u) on the given grid: the identity for one-sided deadzones.
    pub(crate) fn identity(
        reading: Reading,
        mut thresholds: Vec<f64>,
        half_widths: Vec<f64>,
    ) -> Self {
        thresholds.insert(0, 0.0);
        let first = |count: usize| {
            let mut values = vec![0.0; count];
            values[0] = 1.0;
            values
        };
        let (slopes, weights) = (first(thresholds.len()), first(half_widths.len()));
        Self { reading, thresholds, slopes, half_widths, weights }
    }

    /// The parameters of an operator; the identity and the play of half-width zero are added where
    /// they are missing.
    pub(crate) fn from_operator(hysteresis: &Hysteresis) -> Self {
        let with_zero = |places: &[f64], values: &[f64]| {
            let mut pairs: Vec<_> =
                places.iter().copied().zip(values.iter().copied()).filter(|p| p.0 != 0.0).collect();
            let at_zero = places.iter().zip(values).filter(|p| *p.0 == 0.0).map(|p| p.1).sum();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            pairs.insert(0, (0.0, at_zero));
            pairs.into_iter().unzip()
        };
        let (envelope, plays) = (hysteresis.envelope(), hysteresis.plays());
        let (thresholds, slopes) = with_zero(envelope.thresholds(), envelope.weights());
        let (half_widths, weights) = with_zero(plays.half_widths(), plays.weights());
        Self { reading: envelope.reading(), thresholds, slopes, half_widths, weights }
    }

    /// z for one sample of u.
    pub(crate) fn envelope(&self, previous: f64, u: f64) -> f64 {
        let zones = self.thresholds.iter().zip(&self.slopes);
        zones.map(|(&eta, slope)| slope * self.reading.zone(eta, previous, u)).sum()
    }

    /// Smallest and largest z of samples of u.
    pub(crate) fn envelope_range(&self, u: impl Iterator<Item = f64>) -> (f64, f64) {
        let mut previous = 0.0;
        u.map(|value| self.envelope(std::mem::replace(&mut previous, value), value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)))
    }

    /// The operator, without plays and deadzones of weight zero.
    pub(crate) fn to_operator(&self) -> Result<Hysteresis, crate::Error> {
        let zones = self.thresholds.iter().copied().zip(self.slopes.iter().copied());
        let mut zones: Vec<_> = zones.filter(|&(eta, slope)| eta == 0.0 || slope != 0.0).collect();
        zones.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (thresholds, slopes) = zones.into_iter().unzip();
        let plays = self.half_widths.iter().zip(&self.weights);
        let (half_widths, weights) = plays.filter(|(r, p)| **r == 0.0 || **p != 0.0).unzip();
        let envelope = Deadzones::new(thresholds, slopes, self.reading)?;
        Ok(Gpi::new(envelope, PlayBank::new(half_widths, weights)?))
    }

    /// Replaces samples of u by those of v; `start` as in [`Sensitivity::new`].
    pub(crate) fn apply(&self, start: Option<&[f64]>, beside: Beside, signal: &mut [f64]) {
        let mut k = 0;
        let u = signal.to_vec();
        // most plays stick, and read the same then
        let mut known = vec![(f64::NAN, 0.0); self.half_widths.len()];
        self.run(start, beside, &u, &mut |plays, beside| {
            let mut v = 0.0;
            for (i, (&place, known)) in plays.iter().zip(&mut known).enumerate() {
                if place != known.0 {
                    *known = (place, beside.read(self.half_widths[i], place).0);
                }
                v += self.weights[i] * known.1;
            }
            signal[k] = v;
            k += 1;
        });
    }

    /// Derivatives of v by the values of curves through which the plays are read, (values, samples).
    pub(crate) fn reading_slopes(
        &self,
        start: Option<&[f64]>,
        beside: Beside,
        u: &[f64],
        curves: &dyn PlayCurves,
    ) -> Matrix {
        let mut slopes = Matrix::zeros(curves.values().len(), u.len());
        let mut k = 0;
        self.run(start, beside, u, &mut |plays, _| {
            let mut column = slopes.column_mut(k);
            for ((&place, &r), &weight) in plays.iter().zip(&self.half_widths).zip(&self.weights) {
                curves.read_slopes(r, place, weight, column.as_mut_slice());
            }
            k += 1;
        });
        slopes
    }

    /// Shows the places of all plays sample by sample.
    fn run(
        &self,
        start: Option<&[f64]>,
        mut beside: Beside,
        u: &[f64],
        show: &mut dyn FnMut(&[f64], &Beside),
    ) {
        let (mut plays, mut start) = (vec![0.0; self.half_widths.len()], start);
        let mut previous = None;
        for &u in u {
            beside.speed_seen(previous, u);
            let z = self.envelope(previous.unwrap_or(0.0), u);
            previous = Some(u);
            if let Some(sides) = start.take() {
                let places = sides.iter().zip(&self.half_widths).map(|(side, r)| z + side * r);
                plays.iter_mut().zip(places).for_each(|(play, place)| *play = place);
            }
            for (place, &r) in plays.iter_mut().zip(&self.half_widths) {
                *place = play(beside.width(r).0, z, *place);
            }
            show(&plays, &beside);
        }
    }
}

/// Effects that act on the plays of one input.
#[derive(Clone, Default)]
pub(crate) struct Beside<'a> {
    widths: Vec<Widening<'a>>,
    curves: Vec<&'a dyn PlayCurves>,
    /// Sampling rate in Hz.
    rate: f64,
}

/// An effect on half-widths, its state, and the quantity that they grow with at the present sample.
#[derive(Clone)]
struct Widening<'a> {
    effect: &'a dyn PlayWidths,
    memory: Vec<f64>,
    speed_seen: f64,
}

impl<'a> Beside<'a> {
    pub(crate) fn new(
        widths: impl Iterator<Item = &'a dyn PlayWidths>,
        curves: impl Iterator<Item = &'a dyn PlayCurves>,
        rate: f64,
    ) -> Self {
        let resting = |effect: &'a dyn PlayWidths| Widening {
            effect,
            memory: effect.rest(),
            speed_seen: 0.0,
        };
        Self { widths: widths.map(resting).collect(), curves: curves.collect(), rate }
    }

    /// Takes |du/dt| in; at the first sample the input stands.
    fn speed_seen(&mut self, previous: Option<f64>, u: f64) {
        let speed = previous.map_or(0.0, |previous| (u - previous).abs() * self.rate);
        for Widening { effect, memory, speed_seen } in &mut self.widths {
            *speed_seen = effect.speed_seen(memory, speed, self.rate);
        }
    }

    /// A play's half-width, and its derivative by the half-width at rest.
    fn width(&self, half_width: f64) -> (f64, f64) {
        self.widths.iter().fold((half_width, 1.0), |(width, slope), widening| {
            let (width, own) = widening.effect.width(width, widening.speed_seen);
            (width, slope * own)
        })
    }

    /// What a play's place is read as, and the derivative.
    fn read(&self, half_width: f64, place: f64) -> (f64, f64) {
        self.curves.iter().fold((place, 1.0), |(place, slope), curves| {
            let (place, own) = curves.read(half_width, place);
            (place, slope * own)
        })
    }
}

/// Which derivatives are wanted besides those by the weights and slopes.
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
    beside: Beside<'a>,
    /// Whether plays are read through curves, so that the sums change while they stick.
    curved: bool,
    /// Taken at the first sample.
    start: Option<&'a [f64]>,
    /// u(k-1), which directional deadzones compare with.
    previous: Option<f64>,
    plays: Vec<f64>,
    /// What each place is read as, and the derivative; not a number before the first sample.
    reads: Vec<(f64, f64)>,
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
    /// Starts from rest, or with F_i(-1) = z(0) + s_i r_i for `start` s_i in [-1, 1]: a play stands
    /// beside z, wherever the envelope takes z.
    pub(crate) fn new(
        parameters: &'a Parameters,
        start: Option<&'a [f64]>,
        wanted: Derivatives,
        beside: Beside<'a>,
    ) -> Self {
        let n = parameters.half_widths.len();
        let zones = parameters.thresholds.len() * if wanted.thresholds { 2 } else { 1 };
        Self {
            parameters,
            wanted,
            columns: Columns::new(parameters, wanted),
            curved: !beside.curves.is_empty(),
            beside,
            previous: None,
            start,
            plays: vec![0.0; n],
            reads: vec![(f64::NAN, 0.0); n],
            remembers: vec![start.is_some(); n],
            directions: vec![0.0; n],
            held: vec![0.0; n * zones],
            present: vec![0.0; zones],
            sums: vec![0.0; zones],
        }
    }

    /// One sample: `v`, then dv/d of the weights, slopes, thresholds, half-widths and start values.
    pub(crate) fn step(&mut self, u: f64, output: &mut [f64]) {
        let Parameters { reading, thresholds, slopes, half_widths, weights } = self.parameters;
        let (n, zones) = (half_widths.len(), thresholds.len());
        let mut z = 0.0;
        self.beside.speed_seen(self.previous, u);
        let previous = self.previous.unwrap_or(0.0);
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
        self.previous = Some(u);
        if let Some(start) = self.start.take() {
            self.stand(z, start);
        }
        let held_size = self.present.len();
        let (widths, starts) = (self.columns.half_widths.start, self.columns.starts.start);
        let mut v = 0.0;
        for i in 0..n {
            let previous = self.plays[i];
            let (width, growth) = self.beside.width(half_widths[i]);
            let value = play(width, z, previous);
            if value != previous || half_widths[i] == 0.0 {
                self.remembers[i] = false;
                self.directions[i] = if value > previous { -growth } else { growth };
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
            if value != previous || self.reads[i].0.is_nan() {
                self.reads[i] = self.beside.read(half_widths[i], value);
            }
            let (read, slope) = self.reads[i];
            v += weights[i] * read;
            output[1 + i] = read;
            if self.wanted.half_widths {
                output[widths + i] = weights[i] * slope * self.directions[i];
            }
            if self.wanted.starts {
                let moved = if self.remembers[i] { half_widths[i] } else { 0.0 };
                output[starts + i] = weights[i] * slope * moved;
            }
        }
        if self.curved {
            self.sum_through_curves();
        }
        output[0] = v;
        output[self.columns.slopes.start..widths].copy_from_slice(&self.sums);
    }

    /// The sums anew, with the slopes of the curves at the plays' present places.
    fn sum_through_curves(&mut self) {
        let weights = &self.parameters.weights;
        self.sums.fill(0.0);
        let held = self.held.chunks_exact(self.present.len());
        for (i, held) in held.enumerate().filter(|(i, _)| weights[*i] != 0.0) {
            let slope = weights[i] * self.reads[i].1;
            self.sums.iter_mut().zip(held).for_each(|(sum, value)| *sum += slope * value);
        }
    }

    /// Puts the plays beside the first z, with which they move.
    fn stand(&mut self, z: f64, start: &[f64]) {
        let Parameters { half_widths, weights, .. } = self.parameters;
        for (i, &side) in start.iter().enumerate() {
            self.plays[i] = z + side * half_widths[i];
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
    use crate::operators::Operator;

    fn run(parameters: &Parameters, start: &[f64], u: &[f64]) -> Vec<Vec<f64>> {
        let wanted = Derivatives { thresholds: true, half_widths: true, starts: true };
        let mut sensitivity = Sensitivity::new(parameters, Some(start), wanted, Beside::default());
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
            reading: Reading::OneSided,
            thresholds: vec![0.0, -0.7, 0.6],
            slopes: vec![1.1, 0.3, -0.4],
            half_widths: vec![0.0, 0.31, 0.8],
            weights: vec![1.0, 0.5, 0.7],
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
}
