//! One sample at a time through 17 deadzones and 8 plays, as firmware does: `one_sample gpi 1000`.
//!
//! `naive` instead of `gpi` runs the definitions as they are read. Prints nanoseconds a sample;
//! `tools/count_instructions.py` counts the instructions of either.

use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
use std::hint::black_box;
use std::time::Instant;

const ZONES: usize = 17;
const PLAYS: usize = 8;

struct Naive {
    zones: [(f64, f64); ZONES],
    plays: [(f64, f64, f64); PLAYS],
}

impl Naive {
    #[inline(never)]
    fn step(&mut self, u: f64) -> f64 {
        let mut z = 0.0;
        for (eta, g) in self.zones {
            z += g * if eta > 0.0 {
                (u - eta).max(0.0)
            } else if eta < 0.0 {
                (u - eta).min(0.0)
            } else {
                u
            };
        }
        let mut v = 0.0;
        for (r, p, place) in &mut self.plays {
            *place = (z - *r).max((z + *r).min(*place));
            v += *p * *place;
        }
        v
    }
}

#[inline(never)]
fn step<O: Operator<Sample = f64>>(operator: &O, state: &mut O::State, u: f64) -> f64 {
    operator.step(state, u)
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let [_, which, samples] = &words[..] else {
        eprintln!("usage: one_sample gpi|naive SAMPLES");
        std::process::exit(2);
    };
    let samples: u32 = samples.parse().unwrap_or(1000);
    let thresholds: [f64; ZONES] = std::array::from_fn(|j| (j as f64 - 8.0) / 9.0);
    let half_widths: [f64; PLAYS] = std::array::from_fn(|i| i as f64 / 8.0);
    let (g, p) = ([0.1; ZONES], [0.125; PLAYS]);
    let table: Vec<f64> = (0..1000).map(|k| (0.05 * f64::from(k)).sin()).collect();
    let input = (0..samples).zip(table.iter().cycle()).map(|(_, u)| *u);
    let mut sum = 0.0;
    let begin = Instant::now();
    if which == "naive" {
        let zones = std::array::from_fn(|j| (thresholds[j], g[j]));
        let plays = std::array::from_fn(|i| (half_widths[i], p[i], 0.0));
        let mut naive = black_box(Naive { zones, plays });
        input.for_each(|u| sum += naive.step(u));
    } else {
        let envelope = Deadzones::new(thresholds, g, Reading::OneSided);
        let plays = PlayBank::new(half_widths, p);
        let (Ok(envelope), Ok(plays)) = (envelope, plays) else { return };
        let gpi = black_box(Gpi::new(envelope, plays));
        let mut state = gpi.rest();
        input.for_each(|u| sum += step(&gpi, &mut state, u));
    }
    black_box(sum);
    println!("{}", begin.elapsed().as_nanos() as f64 / f64::from(samples));
}
