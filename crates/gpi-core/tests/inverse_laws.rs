//! Laws of the inverse, on random cascades, pasts and signals.
#![cfg(feature = "identify")]
#![allow(clippy::unwrap_used)]

use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
use proptest::prelude::*;

type Cascade = Gpi<Vec<f64>, Vec<f64>>;

/// Slopes between 0.2 and 3: their differences are weights of either sign.
fn slopes(most: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.2..3.0, 1..most)
}

/// Half-widths or thresholds from zero on, some of them equal, with the slopes beyond them.
fn stretches(slopes: &[f64], gaps: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut places, mut weights) = (vec![0.0], vec![slopes[0]]);
    for (pair, gap) in slopes.windows(2).zip(gaps.iter().cycle()) {
        places.push(places.last().unwrap() + gap);
        weights.push(pair[1] - pair[0]);
    }
    (places, weights)
}

fn cascade() -> impl Strategy<Value = Cascade> {
    let gaps = || prop::collection::vec(prop_oneof![Just(0.0), 0.05..1.0], 1..5);
    (slopes(12), gaps(), slopes(6), slopes(6), gaps(), any::<u64>()).prop_map(
        |(plays, widths, above, below, thresholds, order)| {
            let (mut r, mut p) = stretches(&plays, &widths);
            let places = r.len();
            for place in 1..places {
                let other = (order >> (place % 60)) as usize % places;
                r.swap(place, other);
                p.swap(place, other);
            }
            // what falls on zero would change the slope on both sides
            let mut thresholds = thresholds;
            thresholds[0] = f64::max(thresholds[0], 0.05);
            let (mut eta, mut g) = stretches(&above, &thresholds);
            let mut mirrored = below;
            mirrored[0] = above[0];
            let (negative, weights) = stretches(&mirrored, &thresholds);
            eta.extend(negative.iter().skip(1).map(|place| -place));
            g.extend(weights.iter().skip(1));
            let envelope = Deadzones::new(eta, g, Reading::OneSided).unwrap();
            Gpi::new(envelope, PlayBank::new(r, p).unwrap())
        },
    )
}

/// Values with many ties, between -10 and 10.
fn signal(most: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec((-40_i32..40).prop_map(|quarter| f64::from(quarter) / 4.0), 1..most)
}

/// The envelope's slopes may multiply rounding.
const TOLERANCE: f64 = 1e-12;

proptest! {
    /// `gpi(inverse(w)) = w`, whatever has been before.
    #[test]
    fn what_is_wanted_is_what_comes(gpi in cascade(), past in signal(60), wanted in signal(200)) {
        let inverse = gpi.inverse().unwrap();
        let mut forward = gpi.rest();
        gpi.in_place(&mut forward, &mut past.clone());
        let mut backward = gpi.inverse_state(&forward).unwrap();
        for w in wanted {
            let u = inverse.step(&mut backward, w);
            let v = gpi.step(&mut forward, u);
            prop_assert!((v - w).abs() <= TOLERANCE * 20.0, "{} for {}", v, w);
        }
        prop_assert_eq!(backward.out_of_reach, 0);
    }

    /// `inverse(gpi(u)) = u`.
    #[test]
    fn the_drive_is_found_again(gpi in cascade(), past in signal(60), drive in signal(200)) {
        let inverse = gpi.inverse().unwrap();
        let mut forward = gpi.rest();
        gpi.in_place(&mut forward, &mut past.clone());
        let mut backward = gpi.inverse_state(&forward).unwrap();
        for u in drive {
            let v = gpi.step(&mut forward, u);
            let found = inverse.step(&mut backward, v);
            prop_assert!((found - u).abs() <= 1e-11 * 20.0, "{} for {}", found, u);
        }
    }

    /// Within limits or beyond them, a block is its samples.
    #[test]
    fn a_block_is_its_samples(gpi in cascade(), wanted in signal(900), limit in 0.5_f64..30.0) {
        let inverse = gpi.inverse_within(-limit, limit).unwrap();
        let (mut one, mut all) = (inverse.rest(), inverse.rest());
        let mut block = wanted.clone();
        inverse.in_place(&mut all, &mut block);
        for (w, u) in wanted.iter().zip(block) {
            prop_assert!((inverse.step(&mut one, *w) - u).abs() <= 1e-11 * 20.0);
        }
        prop_assert_eq!(one.out_of_reach, all.out_of_reach);
    }

    /// Beyond the limits v comes as near as the drive lets it, and is exact again as soon as it can be.
    #[test]
    fn out_of_reach_it_waits_at_the_limit(gpi in cascade(), wanted in signal(300), limit in 0.5_f64..8.0) {
        let inverse = gpi.inverse_within(-limit, limit).unwrap();
        let [lowest, highest] = inverse.drive();
        let (mut backward, mut forward) = (inverse.rest(), gpi.rest());
        for w in wanted {
            let before = backward.out_of_reach;
            let u = inverse.step(&mut backward, w);
            let v = gpi.step(&mut forward, u);
            if backward.out_of_reach == before {
                prop_assert!((v - w).abs() <= TOLERANCE * 20.0, "{} for {}", v, w);
            } else {
                let near = |limit: f64| (u - limit).abs() <= 1e-12 * limit.abs();
                prop_assert!(near(highest) && v < w || near(lowest) && v > w);
            }
        }
    }

    /// Single precision follows double precision.
    #[test]
    fn in_single_precision(wanted in signal(200)) {
        let envelope = Deadzones::new([0.0_f32, 2.0], [1.0, -0.25], Reading::OneSided).unwrap();
        let gpi = Gpi::new(envelope, PlayBank::new([0.0_f32, 0.5, 1.0], [0.8, 0.3, 0.4]).unwrap());
        let inverse = gpi.inverse().unwrap();
        let (mut backward, mut forward) = (inverse.rest(), gpi.rest());
        for w in wanted {
            let v = gpi.step(&mut forward, inverse.step(&mut backward, w as f32));
            prop_assert!((v - w as f32).abs() < 1e-5);
        }
    }
}
