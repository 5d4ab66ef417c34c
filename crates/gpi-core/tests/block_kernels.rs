//! Long records take other ways than sample by sample: the same outputs and states, on random and adversarial input.
#![cfg(feature = "identify")]
#![allow(clippy::unwrap_used)]

use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
use proptest::prelude::*;

/// Relative to the span: the sums of the two ways are rounded differently.
const EXACT: f64 = 1e-13;

/// How z moves: from smooth to all noise, with plateaus and ties, growing, decaying.
fn signal() -> impl Strategy<Value = Vec<f64>> {
    let parts = (0.0..1.0, 0.0..0.3, -1.5..1.5, 1_u32..4, any::<u64>(), 300_usize..12_000);
    parts.prop_map(
        |(noise, speed, growth, kind, seed, samples): (f64, f64, f64, u32, u64, usize)| {
            let mut state = seed | 1;
            let mut random = move || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            };
            let value = |k: usize| {
                let swing = (growth * k as f64 / samples as f64).exp();
                let smooth = (speed * k as f64).sin() + 0.4 * (0.37 * speed * k as f64).cos();
                let value = swing * ((1.0 - noise) * smooth + 2.0 * noise * random());
                match kind {
                    1 => value,
                    // plateaus and ties
                    2 => (8.0 * value).round() / 8.0,
                    // alternations
                    _ => {
                        if k.is_multiple_of(2) {
                            value
                        } else {
                            -value
                        }
                    }
                }
            };
            (0..samples).map(value).collect()
        },
    )
}

/// Half-widths, some of them equal, and weights of either sign.
fn bank() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    let play = (prop_oneof![Just(0.0), Just(0.25), 0.0..2.5_f64], -0.4..1.0_f64);
    prop::collection::vec(play, 2..80).prop_map(|plays| plays.into_iter().unzip())
}

/// How far two ways are apart, relative to the span; both must be finite or not.
fn apart(one: &[f64], other: &[f64], span: f64) -> f64 {
    let pairs = one.iter().zip(other);
    pairs
        .map(|(a, b)| if a.to_bits() == b.to_bits() || a == b { 0.0 } else { (a - b).abs() / span })
        .fold(0.0, |most, gap| if gap.is_nan() { f64::INFINITY } else { gap.max(most) })
}

fn check(bank: &PlayBank<Vec<f64>>, start: Vec<f64>, input: &[f64], cut: usize) {
    let mut slow = bank.state_from(start.clone()).unwrap();
    let expected: Vec<f64> = input.iter().map(|&z| bank.step(&mut slow, z)).collect();
    let mut fast = bank.state_from(start.clone()).unwrap();
    let mut found = input.to_vec();
    let (first, second) = found.split_at_mut(cut.min(input.len()));
    bank.in_place(&mut fast, first);
    bank.block(&mut fast, &input[first.len()..], second);
    let finite = input.iter().chain(&start).filter(|z| z.is_finite());
    let size = finite.fold(1e-300_f64, |size, z| size.max(z.abs()));
    let widest = bank.half_widths().iter().copied().fold(size, f64::max);
    let sum = bank.weights().iter().map(|p| p.abs()).sum::<f64>();
    assert!(apart(&found, &expected, widest * sum) < EXACT, "outputs");
    assert!(apart(fast.plays(), slow.plays(), widest) < EXACT, "states");
    let mut shared = bank.state_from(start).unwrap();
    let mut found = vec![0.0; input.len()];
    bank.block_on(3, &mut shared, input, &mut found);
    assert!(apart(&found, &expected, widest * sum) < EXACT, "outputs of three threads");
    assert!(apart(shared.plays(), slow.plays(), widest) < EXACT, "states of three threads");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn from_rest((r, p) in bank(), input in signal(), cut in 0_usize..12_000) {
        let start = vec![0.0; r.len()];
        check(&PlayBank::new(r, p).unwrap(), start, &input, cut);
    }

    /// Also from states that no past leads to.
    #[test]
    fn from_any_state(
        (r, p) in bank(), input in signal(), seed in prop::collection::vec(-2.0..2.0_f64, 80)
    ) {
        let start = seed[..r.len()].to_vec();
        check(&PlayBank::new(r, p).unwrap(), start, &input, 5000);
    }

    #[test]
    fn what_is_not_a_number_holds_the_plays(
        (r, p) in bank(), input in signal(), places in prop::collection::vec(0_usize..12_000, 1..4)
    ) {
        let mut input = input;
        for place in places {
            let place = place % input.len();
            input[place] = f64::NAN;
        }
        let start = vec![0.1; r.len()];
        check(&PlayBank::new(r, p).unwrap(), start, &input, 4096);
    }

    #[test]
    fn the_cascade_is_that_of_its_samples(
        (r, p) in bank(), input in signal(), eta in prop::collection::vec((-1.5..1.5_f64, -0.3..0.5_f64), 1..40)
    ) {
        for reading in [Reading::OneSided, Reading::Directional] {
            let (thresholds, weights): (Vec<f64>, Vec<f64>) =
                std::iter::once((0.0, 1.0)).chain(eta.iter().copied()).unzip();
            let size = 6.0 * weights.iter().map(|g| g.abs()).sum::<f64>();
            let envelope = Deadzones::new(thresholds, weights, reading).unwrap();
            let gpi = Gpi::new(envelope, PlayBank::new(r.clone(), p.clone()).unwrap());
            let mut state = gpi.rest();
            let expected: Vec<f64> = input.iter().map(|&u| gpi.step(&mut state, u)).collect();
            let mut found = vec![0.0; input.len()];
            gpi.block(&mut gpi.rest(), &input, &mut found);
            let sum = p.iter().map(|p| p.abs()).sum::<f64>();
            prop_assert!(apart(&found, &expected, (size + 2.5) * sum) < EXACT);
        }
    }
}

/// A decay of many reversals, each inside the one before, then back through all of them.
#[test]
fn a_long_decay_and_back() {
    let turns = 100_000;
    let alternating = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    let decay = (0..turns).map(|k| alternating(k) * (1.0 - k as f64 / turns as f64));
    let input: Vec<f64> = decay.clone().chain(decay.rev()).collect();
    for plays in [2, 8, 32, 100, 1024] {
        let r: Vec<f64> = (0..plays).map(|i| i as f64 / plays as f64).collect();
        let p: Vec<f64> = (0..plays).map(|i| if i % 5 < 2 { -0.3 } else { 1.0 }).collect();
        check(&PlayBank::new(r, p).unwrap(), vec![0.0; plays], &input, 70_001);
    }
}

#[test]
fn infinite_samples_are_what_the_definition_makes_of_them() {
    let bank = PlayBank::new(vec![0.0, 0.5, 1.0], vec![1.0, 0.5, 0.25]).unwrap();
    let mut input: Vec<f64> = (0..5000).map(|k| (0.01 * f64::from(k)).sin()).collect();
    input[2000] = f64::INFINITY;
    check(&bank, vec![0.0; 3], &input, 300);
}

/// Minor loops in minor loops, each slow enough for runs of samples, which many plays begin to move within.
#[test]
fn smooth_loops_within_loops() {
    for speed in [1e-3, 1e-2, 5e-2, 0.2] {
        let value = |k: u32| {
            let k = f64::from(k);
            (speed * k).sin() + 0.5 * (3.3 * speed * k).sin() + 0.2 * (0.11 * speed * k).cos()
        };
        let input: Vec<f64> = (0..20_000).map(value).collect();
        for plays in [2, 9, 40, 300, 1024] {
            let r: Vec<f64> =
                (0..plays).map(|i| 1.2 * f64::from(i / 2) / f64::from(plays)).collect();
            let p = (0..plays).map(|i| if i % 5 < 2 { -0.3 } else { 1.0 }).collect();
            let start = r.iter().map(|r| 0.9 * r).collect();
            check(&PlayBank::new(r, p).unwrap(), start, &input, 9_000);
        }
    }
}
