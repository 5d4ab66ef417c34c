//! Laws of the play operator and its banks, on random and adversarial input.
#![cfg(feature = "identify")]
#![allow(clippy::unwrap_used)]

use gpi_core::operators::{Operator, PlayBank, play};
use proptest::prelude::*;

/// Values with many ties and plateaus: multiples of a quarter.
fn signal() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec((-40_i32..40).prop_map(|quarter| f64::from(quarter) / 4.0), 1..200)
}

fn run(half_width: f64, start: f64, input: &[f64]) -> Vec<f64> {
    let mut state = start;
    input
        .iter()
        .map(|&value| {
            state = play(half_width, value, state);
            state
        })
        .collect()
}

proptest! {
    #[test]
    fn stays_within_its_half_width(input in signal(), quarters in 0_u32..30) {
        let half_width = f64::from(quarters) / 4.0;
        for (value, output) in input.iter().zip(run(half_width, 0.0, &input)) {
            prop_assert!((value - output).abs() <= half_width);
        }
    }

    #[test]
    fn is_rate_independent(input in signal(), repeats in 1_usize..4) {
        let slow: Vec<f64> = input.iter().flat_map(|&value| vec![value; repeats]).collect();
        let fast = run(1.25, 0.0, &input);
        let slow = run(1.25, 0.0, &slow);
        prop_assert!(fast.iter().zip(slow.chunks(repeats)).all(|(a, b)| b.iter().all(|b| a == b)));
    }

    #[test]
    fn preserves_order_and_never_expands(
        (low, gaps) in signal().prop_flat_map(|input| {
            let length = input.len();
            (Just(input), prop::collection::vec(0_u32..8, length))
        })
    ) {
        let high: Vec<f64> =
            low.iter().zip(&gaps).map(|(value, &gap)| value + f64::from(gap) / 4.0).collect();
        let widest = f64::from(*gaps.iter().max().unwrap_or(&0)) / 4.0;
        for (below, above) in run(1.5, 0.0, &low).iter().zip(run(1.5, 0.0, &high)) {
            prop_assert!(*below <= above && above - below <= widest);
        }
    }

    /// Two plays in series are one of the summed half-width.
    #[test]
    fn half_widths_add_in_series(input in signal()) {
        let (first, second) = (0.75, 1.5);
        let series = run(second, 0.0, &run(first, 0.0, &input));
        prop_assert_eq!(series, run(first + second, 0.0, &input));
    }

    /// Small and large loops repeat: after its largest excursion a bank forgets what was before.
    #[test]
    fn a_large_excursion_wipes_out_the_past(past in signal(), future in signal()) {
        let bank = PlayBank::new(vec![0.0, 0.5, 3.0], vec![1.0, -0.4, 2.0]).unwrap();
        let outputs = |past: &[f64]| {
            let mut state = bank.rest();
            for &value in past.iter().chain(&[-20.0, 20.0]) {
                bank.step(&mut state, value);
            }
            future.iter().map(|&value| bank.step(&mut state, value)).collect::<Vec<_>>()
        };
        prop_assert_eq!(outputs(&past), outputs(&[]));
    }

    #[test]
    fn block_in_place_and_parts_equal_single_steps(input in signal(), cut in 0_usize..200) {
        let bank = PlayBank::new(vec![0.0, 0.25, 0.25, 4.0], vec![1.0, -2.0, 0.5, 0.1]).unwrap();
        let mut state = bank.rest();
        let steps: Vec<f64> = input.iter().map(|&value| bank.step(&mut state, value)).collect();
        let cut = cut.min(input.len());
        let (mut parts, mut state) = (vec![0.0; input.len()], bank.rest());
        let (head, tail) = parts.split_at_mut(cut);
        bank.block(&mut state, &input[..cut], head);
        bank.block(&mut state, &input[cut..], tail);
        prop_assert_eq!(&steps, &parts);
        let mut signal = input.clone();
        bank.in_place(&mut bank.rest(), &mut signal);
        prop_assert_eq!(steps, signal);
    }
}
