//! The plays of one hysteresis, with the effects that act on them.
//!
//! ```text
//! F_i(k) = max(z(k) - w_i(k), min(z(k) + w_i(k), F_i(k-1))),      v(k) = sum_i p_i q_i(F_i(k))
//! ```
//!
//! The widths w_i are the half-widths r_i unless [`PlayWidths`] let them grow with the speed of the drive, and q_i is
//! the identity unless [`PlayCurves`] read the plays. This is the one forward definition: models, estimated points and
//! their derivatives step through it.
//!
//! Several effects of one kind are composed in the order of the chain: `w_i = W_2(W_1(r_i, s_1), s_2)` with the speeds
//! `s_m(k)` that effect m makes of `|u(k) - u(k-1)| rate`, and `q_i = Q_2(r_i, Q_1(r_i, F_i))`. Their derivatives
//! follow by the chain rule, such as `dw_i/dr_i = W_2' W_1'` and `dq_i/dF_i = Q_2' Q_1'`, and are what [`Plays::step`] shows of
//! each play.
//!
//! Most plays stick at a sample. Their F_i is that of the sample before, whatever their width is now, and so is
//! `q_i(F_i)`: curves are evaluated for the plays that move only.

use crate::effects::{Effect, PlayCurves, PlayRead, PlayWidths};
use crate::operators::play;

/// The plays of one input in motion.
pub(crate) struct Plays<'a> {
    half_widths: &'a [f64],
    weights: &'a [f64],
    widenings: Vec<Widening<'a>>,
    curves: Vec<&'a dyn PlayCurves>,
    /// Sampling rate in Hz.
    rate: f64,
    /// F_i.
    pub places: Vec<f64>,
    /// `q_i(F_i)` and its derivatives; not a number before the first sample.
    reads: Vec<PlayRead>,
}

/// An effect on half-widths: its place among the effects, its state, and what widths grow with at this sample.
struct Widening<'a> {
    place: usize,
    effect: &'a dyn PlayWidths,
    memory: Vec<f64>,
    speed_seen: f64,
}

/// What one sample made of a play.
pub(crate) struct Moved {
    /// `F_i(k-1)` and `F_i(k)`.
    pub before: f64,
    pub place: f64,
    /// `dw_i/dr_i`.
    pub growth: f64,
    /// `q_i(F_i)` and its derivatives.
    pub read: PlayRead,
}

impl<'a> Plays<'a> {
    /// Plays at rest at zero, with those of the effects that act on an input.
    pub(crate) fn new(
        (half_widths, weights): (&'a [f64], &'a [f64]),
        effects: &'a [Effect],
        input: usize,
        rate: f64,
    ) -> Self {
        let widths = effects.iter().enumerate().filter_map(|(place, effect)| {
            let effect = effect.place().play_widths().filter(|own| own.input() == input)?;
            Some(Widening { place, effect, memory: effect.rest(), speed_seen: 0.0 })
        });
        let curves = effects.iter().filter_map(|effect| effect.place().play_curves());
        Self {
            half_widths,
            weights,
            widenings: widths.collect(),
            curves: curves.filter(|own| own.input() == input).collect(),
            rate,
            places: vec![0.0; half_widths.len()],
            reads: vec![PlayRead::plain(f64::NAN); half_widths.len()],
        }
    }

    /// Whether no effect acts on the plays.
    pub(crate) fn are_plain(&self) -> bool {
        self.widenings.is_empty() && self.curves.is_empty()
    }

    /// Whether plays are read through curves.
    pub(crate) fn are_curved(&self) -> bool {
        !self.curves.is_empty()
    }

    /// Exchanges the states of the effects with `memories`, one an effect of the chain.
    pub(crate) fn exchange(&mut self, memories: &mut [Vec<f64>]) {
        for own in &mut self.widenings {
            std::mem::swap(&mut own.memory, &mut memories[own.place]);
        }
    }

    /// Takes the change of the drive since the sample before.
    pub(crate) fn drive_changes(&mut self, change: f64) {
        let speed = change.abs() * self.rate;
        for Widening { effect, memory, speed_seen, .. } in &mut self.widenings {
            *speed_seen = effect.speed_seen(memory, speed, self.rate);
        }
    }

    /// Puts every play at z plus a fraction of its half-width.
    pub(crate) fn stand(&mut self, z: f64, sides: &[f64]) {
        let places = sides.iter().zip(self.half_widths).map(|(side, r)| z + side * r);
        self.places.iter_mut().zip(places).for_each(|(own, place)| *own = place);
    }

    /// `q_i` and its derivatives, by the chain rule through all curves.
    fn read(&self, half_width: f64, place: f64) -> PlayRead {
        self.curves.iter().fold(PlayRead::plain(place), |inner, curves| {
            let own = curves.read(half_width, inner.value);
            PlayRead {
                value: own.value,
                by_place: own.by_place * inner.by_place,
                by_half_width: own.by_half_width + own.by_place * inner.by_half_width,
            }
        })
    }

    /// v of plays that do not move.
    pub(crate) fn held(&self) -> f64 {
        let plays = self.half_widths.iter().zip(self.weights).zip(&self.places);
        plays.map(|((&r, weight), &place)| weight * self.read(r, place).value).sum()
    }

    /// One sample: returns v, and shows `each` play in turn.
    #[inline]
    pub(crate) fn step(&mut self, z: f64, mut each: impl FnMut(usize, Moved)) -> f64 {
        let mut v = 0.0;
        for i in 0..self.half_widths.len() {
            let (width, growth) =
                self.widenings.iter().fold((self.half_widths[i], 1.0), |(width, growth), own| {
                    let (width, slope) = own.effect.width(width, own.speed_seen);
                    (width, growth * slope)
                });
            let before = self.places[i];
            let place = play(width, z, before);
            // most plays stick, and are read the same then
            if place != before || self.reads[i].value.is_nan() {
                self.places[i] = place;
                self.reads[i] = self.read(self.half_widths[i], place);
            }
            let read = self.reads[i];
            v += self.weights[i] * read.value;
            each(i, Moved { before, place, growth, read });
        }
        v
    }
}
