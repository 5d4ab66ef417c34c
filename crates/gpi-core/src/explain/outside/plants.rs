//! Signals for the tests of the search.

use crate::rivals::Units;
use crate::{Channel, Experiment, Matrix, Record};

/// Numbers between -1 and 1 that look random.
pub(in crate::explain) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Filtered noise between about -1 and 1.
pub(super) fn slow_input(samples: usize) -> Vec<f64> {
    let mut next = noise(7);
    let (mut fast, mut slow) = (0.0, 0.0);
    (0..samples)
        .map(|_| {
            fast = 0.9 * fast + next();
            slow = 0.95 * slow + 0.05 * fast;
            slow
        })
        .collect()
}

/// A record in the units of the questions, some of whose time is held out.
pub(super) fn stage(u: &[f64], y: &[f64]) -> Record {
    let samples = u.len();
    let input = Matrix::from_column_slice(samples, 1, u);
    let output = Matrix::from_column_slice(samples, 1, y);
    let block = |i: usize| (5 + 10 * i) * samples / 100..(7 + 10 * i) * samples / 100;
    let held_out = (0..10).map(block).collect();
    let run = Experiment { held_out, ..Experiment::new(input, output) };
    let (u, y) = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
    let record = Record::new(vec![run], 1000.0, u, y, vec![]).unwrap();
    Units::of(&record).scaled(&record).unwrap()
}
