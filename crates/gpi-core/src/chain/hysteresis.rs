//! The parameters of one hysteresis.
//!
//! ```text
//! z(k) = sum_j g_j Z_eta_j(u(k-1), u(k))
//! v(k) = sum_i p_i q_i(F_i(k)),  F_i the play of half-width r_i of z; r_0 = 0, F_0 = z
//! ```
//!
//! The weights are those of plays, p_i >= 0, or of stops `z - F_i`, g_i >= 0 (see [`Elements`]):
//!
//! ```text
//! v = g_0 z + sum_i g_i (z - F_i) = p_0 z + sum_i p_i F_i,      p_0 = g_0 + sum_i g_i,   p_i = -g_i  (i > 0)
//! ```
//!
//! It is the generalised Prandtl-Ishlinskii operator in the parametrisation of the fit. Z_eta is the deadzone of
//! threshold eta, one-sided (`Z_0 = u`) or directional. The parametrisation keeps the linear terms `eta_0 = 0` and
//! `r_0 = 0` first even where their values are zero, so that places do not move. [`Parameters::to_operator`] drops what
//! has no weight and sorts the thresholds; [`Parameters::from_operator`] does the opposite. Both keep the map from u to
//! v.

use super::plays::Plays;
use crate::effects::{Effect, PlayCurves};
use crate::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
use crate::{Hysteresis, Matrix};

/// What a bank consists of, which is the sign of its weights: `v = p_0 z + sum_i p_i F_i(z)` with `p_0 >= 0`, and `p_i >= 0`
/// for plays or `p_i <= 0` for stops `-p_i (z - F_i(z))`. A bank of stops is the model of Maxwell slip.
///
/// ```
/// use gpi_core::identify::{Elements, IdentifyOptions};
/// let options = IdentifyOptions { elements: Some(Elements::Stops), ..IdentifyOptions::default() };
/// assert_eq!(options.elements, Some(Elements::Stops));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Elements {
    /// Plays: v lags behind z, as the displacement of a piezo lags behind its voltage.
    #[default]
    Plays,
    /// Stops: v leads z, as the force of friction leads the displacement.
    Stops,
}

impl Elements {
    /// The elements of weights at half-widths: stops where those above zero have a negative sum.
    fn of(half_widths: &[f64], weights: &[f64]) -> Self {
        let pairs = half_widths.iter().zip(weights);
        let all: f64 = pairs.filter(|(r, _)| **r > 0.0).map(|(_, weight)| weight).sum();
        if all < 0.0 { Self::Stops } else { Self::Plays }
    }

    /// The nearest weight that the element at a place of the bank can have; the first is the linear term.
    pub(crate) fn nearest(self, place: usize, weight: f64) -> f64 {
        match self {
            Self::Stops if place > 0 => weight.min(0.0),
            Self::Plays | Self::Stops => weight.max(0.0),
        }
    }
}

/// How much second differences of the weights and slopes of the deadzones cost, see [`super::prior`]; zero for no prior.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Prior {
    /// w.
    pub weights: f64,
    /// s.
    pub slopes: f64,
}

impl Prior {
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// Parameters of one hysteresis: `z = sum_j g_j Z_{eta_j}(u)`, then plays.
///
/// The first threshold is 0, whose one-sided deadzone is the identity; the first half-width is 0 too.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parameters {
    pub elements: Elements,
    pub reading: Reading,
    pub thresholds: Vec<f64>,
    pub slopes: Vec<f64>,
    pub half_widths: Vec<f64>,
    pub weights: Vec<f64>,
    /// What is known of the weights and slopes without the data. Half-widths and thresholds with such a prior are held.
    pub prior: Prior,
}

impl Parameters {
    /// The slope of v over u where all plays slide, and no deadzone but that of threshold 0 is passed.
    pub(crate) fn slope(&self) -> f64 {
        self.slopes[0] * self.weights.iter().sum::<f64>()
    }

    /// The slope of v over u where its direction has just been reversed: no play slides, so that all stops move.
    pub(crate) fn slope_after_reversal(&self) -> f64 {
        self.slopes[0] * self.weights[0]
    }

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
        let (elements, prior) = (Elements::default(), Prior::default());
        Self { elements, reading, thresholds, slopes, half_widths, weights, prior }
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
        let (half_widths, weights): (Vec<f64>, Vec<f64>) =
            with_zero(plays.half_widths(), plays.weights());
        let elements = Elements::of(&half_widths, &weights);
        let (reading, prior) = (envelope.reading(), Prior::default());
        Self { elements, reading, thresholds, slopes, half_widths, weights, prior }
    }

    /// z for one sample of u.
    pub(crate) fn envelope(&self, previous: f64, u: f64) -> f64 {
        let zones = self.thresholds.iter().zip(&self.slopes);
        zones.map(|(&eta, slope)| slope * self.reading.zone(eta, previous, u)).sum()
    }

    /// Smallest and largest z of samples of u, with u = 0 before the first.
    pub(crate) fn envelope_range(&self, u: impl Iterator<Item = f64>) -> (f64, f64) {
        let mut z: Vec<f64> = u.collect();
        if self.through_envelope(&mut z).is_none() {
            let mut previous = 0.0;
            z.iter_mut().for_each(|z| *z = self.envelope(std::mem::replace(&mut previous, *z), *z));
        }
        z.into_iter()
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

    /// The plays at rest, with the effects that act on an input.
    pub(crate) fn plays<'a>(&'a self, effects: &'a [Effect], input: usize, rate: f64) -> Plays<'a> {
        Plays::new((&self.half_widths, &self.weights), effects, input, rate)
    }

    /// Replaces samples of u by those of v; `start` as in [`Sensitivity`](super::sensitivity::Sensitivity).
    ///
    /// Plays that no effect acts on are computed by the operators, whose cost hardly grows with their number.
    pub(crate) fn apply(&self, start: Option<&[f64]>, plays: Plays, signal: &mut [f64]) {
        if plays.are_plain() && self.apply_operators(start, &plays.places, signal).is_some() {
            return;
        }
        let u = signal.to_vec();
        self.run(start, plays, &u, &mut |k, plays, z| signal[k] = plays.step(z, |_, _| {}));
    }

    /// Replaces samples of u by those of z, with u = 0 before the first; `None`, with the signal as it was, where the parameters are none of an operator.
    fn through_envelope(&self, signal: &mut [f64]) -> Option<()> {
        let zones = (self.thresholds.clone(), self.slopes.clone());
        let envelope = Deadzones::new(zones.0, zones.1, self.reading).ok()?;
        envelope.in_place(&mut envelope.rest(), signal);
        Some(())
    }

    /// The same by the operators, for plays that begin at these places; `None`, with the signal as it was, where the parameters are none of an operator.
    fn apply_operators(
        &self,
        start: Option<&[f64]>,
        places: &[f64],
        signal: &mut [f64],
    ) -> Option<()> {
        let bank = PlayBank::new(self.half_widths.clone(), self.weights.clone()).ok()?;
        let first = self.envelope(0.0, *signal.first()?);
        let sided = |sides: &[f64]| {
            sides.iter().zip(&self.half_widths).map(|(side, r)| first + side * r).collect()
        };
        let mut state = bank.state_from(start.map_or_else(|| places.to_vec(), sided)).ok()?;
        self.through_envelope(signal)?;
        bank.in_place(&mut state, signal);
        Some(())
    }

    /// Derivatives of v by the values of curves through which the plays are read, (values, samples):
    /// `dv/dc = sum_i p_i dq_i(F_i)/dc`. F_i does not depend on c, so that one run gives them all.
    pub(crate) fn reading_slopes(
        &self,
        start: Option<&[f64]>,
        plays: Plays,
        u: &[f64],
        curves: &dyn PlayCurves,
    ) -> Matrix {
        let mut slopes = Matrix::zeros(curves.values().len(), u.len());
        self.run(start, plays, u, &mut |k, plays, z| {
            let mut column = slopes.column_mut(k);
            plays.step(z, |i, moved| {
                let (r, weight) = (self.half_widths[i], self.weights[i]);
                curves.read_slopes(r, moved.place, weight, column.as_mut_slice());
            });
        });
        slopes
    }

    /// Takes samples of u through the envelope; `step` takes the plays on from there.
    fn run(
        &self,
        mut start: Option<&[f64]>,
        mut plays: Plays,
        u: &[f64],
        step: &mut dyn FnMut(usize, &mut Plays, f64),
    ) {
        for (k, &now) in u.iter().enumerate() {
            // at the first sample the input stands
            let previous = k.checked_sub(1).map(|before| u[before]);
            plays.drive_changes(previous.map_or(0.0, |previous| now - previous));
            let z = self.envelope(previous.unwrap_or(0.0), now);
            if let Some(sides) = start.take() {
                plays.stand(z, sides);
            }
            step(k, &mut plays, z);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operators_give_what_the_definition_gives() {
        let u: Vec<f64> = (0..3000)
            .map(|k| 2.0 * (0.013 * f64::from(k)).sin() + (0.4 * f64::from(k)).cos())
            .collect();
        for reading in [Reading::OneSided, Reading::Directional] {
            let parameters = Parameters {
                elements: Elements::Plays,
                reading,
                thresholds: vec![0.0, -0.7, 0.6],
                slopes: vec![1.1, 0.3, -0.4],
                // in the order in which a fit has moved them
                half_widths: vec![0.0, 0.8, 0.31],
                weights: vec![1.0, 0.5, 0.7],
                prior: Prior::default(),
            };
            for start in [None, Some(&[0.0, 0.9, -0.3][..])] {
                let plays = || parameters.plays(&[], 0, 1.0);
                let (mut found, mut expected) = (u.clone(), u.clone());
                parameters.apply_operators(start, &plays().places, &mut found).unwrap();
                let mut step =
                    |k: usize, plays: &mut Plays, z| expected[k] = plays.step(z, |_, _| {});
                parameters.run(start, plays(), &u, &mut step);
                let mut pairs = found.iter().zip(&expected);
                assert!(pairs.all(|(found, expected)| (found - expected).abs() < 1e-12));
            }
        }
    }
}
