//! Plays of a signal that reverses often: one play after the other, over several segments of time in parallel.

use super::ranked::Ranked;
use crate::operators::play;
use pulp::Simd;

/// Number of parallel segments: the `f64` lanes of the widest vectors of today's processors.
const LANES: usize = 8;
type Lanes = [f64; LANES];
/// Samples of each lane that are interleaved at once. A vector load directly after scalar stores to the same address, or
/// the reverse, would stall.
const AT_ONCE: usize = 64;

/// Replaces inputs by the outputs of the plays and updates `places`, the outputs of each play.
///
/// Does nothing and returns `false` if the state of some play at the start of a segment cannot be determined from the
/// segment before.
#[inline(always)]
pub(super) fn run<S: Simd>(
    simd: S,
    bank: &Ranked,
    (half_widths, weights): (&[f64], &[f64]),
    places: &mut [f64],
    signal: &mut [f64],
) -> bool {
    let stretch = signal.len() / LANES;
    let mut stand: Vec<Lanes> = places.iter().map(|&place| [place; LANES]).collect();
    for lane in 1..LANES {
        let Some(places) = settled(bank, &signal[..lane * stretch], stretch) else {
            return false;
        };
        stand.iter_mut().zip(&places).for_each(|(stand, place)| stand[lane] = *place);
    }
    let mut beside = [[0.0; LANES]; AT_ONCE];
    for first in (0..stretch).step_by(AT_ONCE) {
        let count = AT_ONCE.min(stretch - first);
        for lane in 0..LANES {
            let own = &signal[lane * stretch + first..][..count];
            own.iter().zip(&mut beside).for_each(|(z, beside)| beside[lane] = *z);
        }
        follow(simd, half_widths, weights, &mut stand, &mut beside[..count]);
        for lane in 0..LANES {
            let own = &mut signal[lane * stretch + first..][..count];
            own.iter_mut().zip(&beside).for_each(|(v, beside)| *v = beside[lane]);
        }
    }
    for (place, stand) in places.iter_mut().zip(&stand) {
        *place = stand[LANES - 1];
    }
    one_by_one(half_widths, weights, places, &mut signal[LANES * stretch..]);
    true
}

/// The outputs of the plays after these samples, whatever their initial state: once z has varied by the width 2 r of a
/// play's gap, its output depends on the last extremum of z only.
///
/// `None` if z varies by less than the width of the widest gap within the latest `most` samples.
pub(super) fn settled(bank: &Ranked, samples: &[f64], most: usize) -> Option<Vec<f64>> {
    let mut places = vec![0.0; bank.len()];
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut rank = 0;
    for &z in samples.iter().rev().take(most) {
        while let Some(&r) = bank.half_widths.get(rank) {
            let place = if high - z >= 2.0 * r {
                high - r
            } else if z - low >= 2.0 * r {
                low + r
            } else {
                break;
            };
            places[bank.order[rank]] = place;
            rank += 1;
        }
        if rank == bank.len() {
            return Some(places);
        }
        (low, high) = (low.min(z), high.max(z));
    }
    None
}

/// Replaces a few samples of each lane by the outputs of all plays.
#[inline(always)]
fn follow<S: Simd>(
    simd: S,
    half_widths: &[f64],
    weights: &[f64],
    stand: &mut [Lanes],
    beside: &mut [Lanes],
) {
    let mut sums = [[0.0; LANES]; AT_ONCE];
    let sums = &mut sums[..beside.len()];
    let mut plays = (half_widths, weights, stand);
    while !plays.2.is_empty() {
        plays = match plays.2.len() {
            8.. => some::<S, 8>(simd, plays, beside, sums),
            4.. => some::<S, 4>(simd, plays, beside, sums),
            2.. => some::<S, 2>(simd, plays, beside, sums),
            _ => some::<S, 1>(simd, plays, beside, sums),
        };
    }
    beside.copy_from_slice(sums);
}

/// Half-widths, weights, and the outputs of the plays in each lane.
type Plays<'a> = (&'a [f64], &'a [f64], &'a mut [Lanes]);

/// Adds the outputs of the first plays, whose state stays in registers; returns the other plays.
#[inline(always)]
fn some<'a, S: Simd, const COUNT: usize>(
    simd: S,
    (half_widths, weights, stand): Plays<'a>,
    beside: &[Lanes],
    sums: &mut [Lanes],
) -> Plays<'a> {
    let (own, stand) = stand.split_at_mut(COUNT);
    let (r, half_widths) = half_widths.split_at(COUNT);
    let (p, weights) = weights.split_at(COUNT);
    let (r, p): ([S::f64s; COUNT], [S::f64s; COUNT]) = (
        std::array::from_fn(|i| simd.splat_f64s(r[i])),
        std::array::from_fn(|i| simd.splat_f64s(p[i])),
    );
    for part in 0..LANES / S::F64_LANES {
        let mut places: [S::f64s; COUNT] =
            std::array::from_fn(|i| S::as_simd_f64s(&own[i]).0[part]);
        for (z, sum) in beside.iter().zip(&mut *sums) {
            let (z, sum) = (S::as_simd_f64s(z).0[part], &mut S::as_mut_simd_f64s(sum).0[part]);
            // two independent sums hide the latency of the additions
            let mut second = simd.splat_f64s(0.0);
            for i in 0..COUNT {
                let (low, high) = (simd.sub_f64s(z, r[i]), simd.add_f64s(z, r[i]));
                places[i] = simd.max_f64s(low, simd.min_f64s(high, places[i]));
                let sum = if i % 2 == 0 { &mut *sum } else { &mut second };
                *sum = simd.mul_add_e_f64s(p[i], places[i], *sum);
            }
            *sum = simd.add_f64s(*sum, second);
        }
        for (own, place) in own.iter_mut().zip(places) {
            S::as_mut_simd_f64s(own).0[part] = place;
        }
    }
    (half_widths, weights, stand)
}

/// The outputs by the definition, sample by sample.
pub(super) fn one_by_one(
    half_widths: &[f64],
    weights: &[f64],
    places: &mut [f64],
    signal: &mut [f64],
) {
    for value in signal {
        let z = std::mem::take(value);
        for ((place, &r), weight) in places.iter_mut().zip(half_widths).zip(weights) {
            *place = play(r, z, *place);
            *value += weight * *place;
        }
    }
}
