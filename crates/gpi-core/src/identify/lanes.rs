//! Arithmetic on the changes of several unknowns side by side.

use crate::effects::Law;

/// Unknowns that run side by side: what the widest vectors of today's processors hold.
pub(super) const LANES: usize = 8;
pub(super) type Lanes = [f64; LANES];
pub(super) const NONE: Lanes = [0.0; LANES];

/// How a change of z and of the logarithms of half-widths shows in w.
#[inline(always)]
pub(super) fn pass(
    law: &Law,
    z: Lanes,
    widths: &[Lanes],
    marks: &[f64],
    places: &mut [Lanes],
) -> Lanes {
    let mut w = NONE;
    match law {
        Law::Power { .. } => add(&mut w, marks[0], z),
        Law::Stops { weights, .. } => {
            let stops = weights.iter().zip(widths).zip(marks).zip(places);
            for (((weight, width), &mark), place) in stops {
                // a play that slides up stands at z - r, one that slides down at z + r
                if mark != 0.0 {
                    *place = z;
                    add(place, -mark, *width);
                }
                add(&mut w, *weight, z);
                add(&mut w, -weight, *place);
            }
        }
    }
    w
}

#[inline(always)]
pub(super) fn add(sum: &mut Lanes, factor: f64, values: Lanes) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Adds the sum of what both have, one by one weighted.
#[inline(always)]
pub(super) fn weigh(sum: &mut Lanes, weights: &[f64], values: &[Lanes]) {
    let mut own = *sum;
    for (&weight, value) in weights.iter().zip(values) {
        add(&mut own, weight, *value);
    }
    *sum = own;
}

/// One sample of a section in observer form, driven.
#[inline(always)]
pub(super) fn relax(a: &[f64], x: &mut [Lanes], driven: &[Lanes]) {
    match (a, x) {
        ([a1, a2], [x1, x2]) => {
            let before = *x1;
            *x1 = driven[0];
            add(x1, 1.0, *x2);
            add(x1, -a1, before);
            *x2 = driven[1];
            add(x2, -a2, before);
        }
        (a, x) => {
            let before = x[0];
            x[0] = driven[0];
            add(&mut x[0], -a[0], before);
        }
    }
}
