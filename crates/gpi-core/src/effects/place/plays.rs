//! The plays: their half-widths, and the curves through which they are read.

use crate::effects::block::Block;

/// An effect by which the half-widths of the plays depend on the speed of the drive.
pub trait PlayWidths: Block + Sync {
    /// The input channel whose hysteresis it changes.
    fn input(&self) -> usize;

    /// The state after a constant input.
    fn rest(&self) -> Vec<f64>;

    /// The quantity that half-widths grow with, at a speed `|du/dt|`; `rate` is the sampling rate in Hz.
    fn speed_seen(&self, state: &mut [f64], speed: f64, rate: f64) -> f64;

    /// The half-width of a play at that [`PlayWidths::speed_seen`], and its derivative by `half_width`.
    fn width(&self, half_width: f64, speed_seen: f64) -> (f64, f64);
}

/// What a curve makes of a play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayRead {
    /// The curve at the value F of the play.
    pub value: f64,
    /// Its derivative by F.
    pub by_place: f64,
    /// Its derivative by the half-width of the play, at the same F.
    pub by_half_width: f64,
}

impl PlayRead {
    /// A play that is read as it is.
    pub fn plain(place: f64) -> Self {
        Self { value: place, by_place: 1.0, by_half_width: 0.0 }
    }
}

/// An effect that reads the plays through curves: a play F contributes `curve(F)` instead of F.
pub trait PlayCurves: Block + Sync {
    /// The input channel whose hysteresis it changes.
    fn input(&self) -> usize;

    /// The curve of a play at the value `place` of F, and its derivatives.
    fn read(&self, half_width: f64, place: f64) -> PlayRead;

    /// Adds `weight` times the derivatives of [`PlayCurves::read`] by the values to `slopes`.
    fn read_slopes(&self, half_width: f64, place: f64, weight: f64, slopes: &mut [f64]);
}
