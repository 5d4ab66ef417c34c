//! Plays of noise, one after the other, over several stretches of time side by side.

use crate::operators::play;
use pulp::Simd;

/// Stretches side by side: what the widest vectors of today's processors hold.
const LANES: usize = 8;
type Lanes = [f64; LANES];

/// The outputs of plays that stand at `places`, and where they stand at the end; `false`, and nothing done, where
/// some play does not forget within a stretch how it began.
#[inline(always)]
pub(super) fn run<S: Simd>(
    simd: S,
    half_widths: &[f64],
    weights: &[f64],
    places: &mut [f64],
    input: &[f64],
    output: &mut [f64],
) -> bool {
    let stretch = input.len() / LANES;
    let widest = half_widths.iter().copied().fold(0.0, f64::max);
    let mut stand = vec![[0.0; LANES]; places.len()];
    for lane in 0..LANES {
        let begin = lane * stretch;
        let known =
            if lane == 0 { Some(begin) } else { forgotten(&input[..begin], widest, stretch) };
        let Some(first) = known else { return false };
        for ((stand, &r), place) in stand.iter_mut().zip(half_widths).zip(&*places) {
            let before = input[first..begin].iter();
            stand[lane] = before.fold(*place, |place, &z| play(r, z, place));
        }
    }
    /// Samples of each lane that are brought side by side at once: a vector that is read back as soon as its lanes
    /// are written, or the other way, would wait for them.
    const AT_ONCE: usize = 64;
    let mut beside = [[0.0; LANES]; AT_ONCE];
    for first in (0..stretch).step_by(AT_ONCE) {
        let count = AT_ONCE.min(stretch - first);
        for lane in 0..LANES {
            let own = &input[lane * stretch + first..][..count];
            own.iter().zip(&mut beside).for_each(|(z, beside)| beside[lane] = *z);
        }
        for z in &mut beside[..count] {
            *z = follow(simd, z, half_widths, weights, &mut stand);
        }
        for lane in 0..LANES {
            let own = &mut output[lane * stretch + first..][..count];
            own.iter_mut().zip(&beside).for_each(|(v, beside)| *v = beside[lane]);
        }
    }
    for (place, stand) in places.iter_mut().zip(&stand) {
        *place = stand[LANES - 1];
    }
    let rest = LANES * stretch;
    for (z, v) in input[rest..].iter().zip(&mut output[rest..]) {
        *v = 0.0;
        for ((place, &r), weight) in places.iter_mut().zip(half_widths).zip(weights) {
            *place = play(r, *z, *place);
            *v += weight * *place;
        }
    }
    true
}

/// The place from which on plays of at most this half-width end where they do wherever they began: z sweeps
/// `2 r` there. At most so many samples back.
fn forgotten(input: &[f64], widest: f64, most: usize) -> Option<usize> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (k, &z) in input.iter().enumerate().rev().take(most) {
        (low, high) = (low.min(z), high.max(z));
        if high - low >= 2.0 * widest {
            return Some(k);
        }
    }
    None
}

/// One sample of each lane.
#[inline(always)]
fn follow<S: Simd>(
    simd: S,
    z: &Lanes,
    half_widths: &[f64],
    weights: &[f64],
    stand: &mut [Lanes],
) -> Lanes {
    /// Sums that do not wait for each other.
    const SUMS: usize = 4;
    let mut v = [0.0; LANES];
    let parts = S::as_simd_f64s(z).0.iter().zip(S::as_mut_simd_f64s(&mut v).0);
    for (part, (z, v)) in parts.enumerate() {
        let mut sums = [simd.splat_f64s(0.0); SUMS];
        let mut places = stand.chunks_exact_mut(SUMS);
        let (mut r, mut p) = (half_widths.chunks_exact(SUMS), weights.chunks_exact(SUMS));
        for ((places, r), p) in (&mut places).zip(&mut r).zip(&mut p) {
            for i in 0..SUMS {
                one(simd, part, *z, r[i], p[i], &mut places[i], &mut sums[i]);
            }
        }
        let rest = places.into_remainder().iter_mut().zip(r.remainder()).zip(p.remainder());
        for ((place, &r), &p) in rest {
            one(simd, part, *z, r, p, place, &mut sums[0]);
        }
        let [a, b, c, d] = sums;
        *v = simd.add_f64s(simd.add_f64s(a, b), simd.add_f64s(c, d));
    }
    v
}

/// One play of some lanes, and its part of the sum.
#[inline(always)]
fn one<S: Simd>(
    simd: S,
    part: usize,
    z: S::f64s,
    r: f64,
    weight: f64,
    place: &mut Lanes,
    sum: &mut S::f64s,
) {
    let (r, weight) = (simd.splat_f64s(r), simd.splat_f64s(weight));
    let (low, high) = (simd.sub_f64s(z, r), simd.add_f64s(z, r));
    let place = &mut S::as_mut_simd_f64s(place).0[part];
    *place = simd.max_f64s(low, simd.min_f64s(high, *place));
    *sum = simd.mul_add_e_f64s(weight, *place, *sum);
}
