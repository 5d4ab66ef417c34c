//! Figures that others published.
#![allow(clippy::unwrap_used)]

use gpi_core::operators::{Operator, PlayBank};
use std::f64::consts::TAU;

/// A steady loop of 4 sin under a bank: its peak, and its area.
#[test]
fn steady_loop_of_a_published_bank() {
    let bank = PlayBank::new(
        [0.0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7],
        [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012],
    )
    .unwrap();
    let period = 200_000;
    let u: Vec<f64> =
        (0..=2 * period).map(|k| 4.0 * (TAU * k as f64 / period as f64).sin()).collect();
    let mut v = u.clone();
    bank.in_place(&mut bank.rest(), &mut v);
    let peak = v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!((peak - 8.2056).abs() < 1e-4, "peak {peak}");
    let area: f64 =
        (period..2 * period).map(|k| f64::midpoint(u[k], u[k + 1]) * (v[k + 1] - v[k])).sum();
    assert!((area.abs() - 20.202_48).abs() < 1e-5, "area {area}");
}
