//! An actuator, its compensator, and what both are driven with; no heap, no `std`, no panic.
//!
//! `actuator.rs`, `compensator.rs` and the folder `c` are written by `tools/make_firmware_example.py`, the latter two
//! with `gpi export`.
#![no_std]
#![forbid(unsafe_code)]

pub mod actuator;
pub mod as_read;
pub mod compensator;

/// Samples of the run.
pub const SAMPLES: u32 = 1000;

/// A triangle that decays: 5 periods of 200 samples between -40 and 40 um about 2 um.
pub fn reference(sample: u32) -> f32 {
    const PERIOD: u32 = 200;
    let (phase, left) = (sample % PERIOD, SAMPLES.saturating_sub(sample) as f32 / SAMPLES as f32);
    let height = match phase {
        0..50 => phase as f32,
        50..150 => 100.0 - phase as f32,
        _ => phase as f32 - 200.0,
    };
    2.0 + 0.8 * height * left
}
