//! Compensator: drive of u for a reference of y.
//!
//! Model: SHA-256 089f1aad1a22257d95d63013d78cd3c506e9470bd22007b8429d520f697149f1 of its file.
//! Rate: 10000 samples a second.
//! Reference: y in um.
//! Drive: u in V, from -120 to 120 V.
//! Compensated: hysteresis, creep.
//! Not compensated: dynamics: only the DC gain of G is inverted.
//! Made by gpi-hammerstein 0.1.0, `gpi export`.

#![forbid(unsafe_code)]
// a program need not use every function
#![allow(dead_code)]

/// The number type.
pub type Real = f32;

const PLAYS: usize = 8;
const KNOTS: usize = 17;
const LAGS: usize = 2;

// v = (reference - offset - creep) / gain
const OFFSET: Real = 2.0;
const GAIN: Real = 1.0;
const STANDING_GAIN: Real = 1.08;

// Creep: in each sample, each lag changes by rate (v - lag). Its contribution to creep is gain times its value.
const LAG_RATES: [Real; LAGS] = [0.0049875206, 0.00019998];
const LAG_GAINS: [Real; LAGS] = [0.03, 0.05];

// The inverse plays, by increasing half-width.
const HALF_WIDTHS: [Real; PLAYS] = [0.0, 0.6, 1.62, 3.1, 5.075, 7.565, 11.005, 16.309];
const WEIGHTS: [Real; PLAYS] = [
    3.3333333,
    -0.39215687,
    -0.23847377,
    -0.17105713,
    -0.12200701,
    -0.08405716,
    -0.063137956,
    -0.05005406,
];

// The inverse deadzones as a piecewise linear curve: knots, the drive at each knot, the slope before the first knot and after
// each knot.
const KNOT_PLACES: [Real; KNOTS] = [
    -120.9, -106.05, -90.75, -75.6, -60.75, -45.3, -30.3, -15.0, 0.0, 15.0, 30.15, 45.75, 61.05,
    76.65, 92.4, 107.7, 123.3,
];
const HEIGHTS: [Real; KNOTS] = [
    -120.0, -105.0, -90.0, -75.0, -60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0, 75.0,
    90.0, 105.0, 120.0,
];
const SLOPES: [Real; KNOTS + 1] = [
    0.990099, 1.010101, 0.98039216, 0.990099, 1.010101, 0.9708738, 1.0, 0.98039216, 1.0, 1.0,
    0.990099, 0.96153843, 0.98039216, 0.96153843, 0.95238096, 0.98039216, 0.96153843, 0.95238096,
];

// The limits of the drive, the corresponding inputs of the inverse deadzones, and the range of v in which no limit is reached.
const LOWEST_DRIVE: Real = -120.0;
const HIGHEST_DRIVE: Real = 120.0;
const LOWEST: Real = -120.9;
const HIGHEST: Real = 123.3;
const SAFE_BELOW: Real = -52.8758;
const SAFE_ABOVE: Real = 53.9606;

// The range of v, and the part of it in which neither this range nor a limit of the drive is reached.
const LOWEST_V: Real = -170.3382;
const HIGHEST_V: Real = 171.423;
const USUAL_BELOW: Real = -52.8758;
const USUAL_ABOVE: Real = 53.9606;

/// What was wrong with the references since the flags were last cleared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// A reference was NaN or infinite: the drive was held.
    pub not_finite: bool,
    /// A reference needed a v outside of the range: v was set to the nearest end.
    pub saturated: bool,
}

/// Computes the drive from a reference; contains the state between two samples.
///
/// What happens at bad samples:
///
/// - The drive and the state are finite after every sequence of references, and the drive is within its limits.
/// - A reference that is NaN or infinite changes neither the drive nor the state. [`Compensator::standing_at`] takes it as 2,
///   where v = 0.
/// - v is limited to -170.338 .. 171.423. In the steady state, these are the references
///   -181.965 .. 187.137. A drive at its limit within this range is no fault.
/// - [`Compensator::faults`] tells that one of the two has happened, until [`Compensator::clear_faults`].
/// - After m bad and n good samples, v differs from the v without the bad samples by at most m * 0.0546 * 0.99980002^n,
///   apart from rounding errors, if all gains of creep have the sign of the gain.
///   The plays return to the same state when v has moved up and down by twice the largest half-width, 32.618. Until
///   then, the drive is the right one for the actuator, which has followed the drive too.
#[derive(Clone, Debug)]
pub struct Compensator {
    plays: [Real; PLAYS],
    lags: [Real; LAGS],
    /// Rounding errors of the lags.
    carried: [Real; LAGS],
    drive: Real,
    out_of_reach: u32,
    faults: Faults,
}

impl Compensator {
    /// Returns the steady state after the actuator has moved from zero to this reference in um.
    pub fn standing_at(reference: Real) -> Self {
        let faults = Faults { not_finite: !reference.is_finite(), saturated: false };
        let reference = if faults.not_finite { OFFSET } else { reference };
        let (lags, carried) = ([0.0; LAGS], [0.0; LAGS]);
        let mut own =
            Self { plays: [0.0; PLAYS], lags, carried, drive: 0.0, out_of_reach: 0, faults };
        let v = own.go_to((reference - OFFSET) / STANDING_GAIN);
        own.lags = [v; LAGS];
        own.out_of_reach = 0;
        own
    }

    /// Returns the drive in V for the next sample of the reference in um. See [`Compensator`] for
    /// bad samples.
    #[inline]
    pub fn step(&mut self, reference: Real) -> Real {
        if !reference.is_finite() {
            self.faults.not_finite = true;
            return self.drive;
        }
        let mut creep = 0.0;
        for (gain, lag) in LAG_GAINS.iter().zip(&self.lags) {
            creep += gain * lag;
        }
        let v = self.go_to((reference - OFFSET - creep) / GAIN);
        self.creep_on(v);
        self.drive
    }

    /// Returns the number of samples with the drive at a limit.
    pub fn out_of_reach(&self) -> u32 {
        self.out_of_reach
    }

    /// Returns what was wrong with the references.
    pub fn faults(&self) -> Faults {
        self.faults
    }

    /// Clears the faults.
    pub fn clear_faults(&mut self) {
        self.faults = Faults::default();
    }

    #[inline]
    fn creep_on(&mut self, v: Real) {
        for (rate, (lag, carried)) in
            LAG_RATES.iter().zip(self.lags.iter_mut().zip(&mut self.carried))
        {
            let wanted = rate * (v - *lag) + *carried;
            let there = *lag + wanted;
            *carried = wanted - (there - *lag);
            *lag = there;
        }
    }

    /// Moves the plays to v, or to the nearest v that can be reached, and sets the drive.
    #[inline]
    fn go_to(&mut self, v: Real) -> Real {
        if !(USUAL_BELOW..=USUAL_ABOVE).contains(&v) {
            return self.go_far(v);
        }
        self.drive = drive_for(step_plays(&mut self.plays, v));
        v
    }

    #[cold]
    fn go_far(&mut self, wanted: Real) -> Real {
        let v = clamp(wanted, LOWEST_V, HIGHEST_V);
        self.faults.saturated |= v != wanted;
        if (SAFE_BELOW..=SAFE_ABOVE).contains(&v) {
            self.drive = drive_for(step_plays(&mut self.plays, v));
            return v;
        }
        let mut z = 0.0;
        for i in 0..PLAYS {
            z += WEIGHTS[i] * clamp(self.plays[i], v - HALF_WIDTHS[i], v + HALF_WIDTHS[i]);
        }
        let within = clamp(z, LOWEST, HIGHEST);
        let mut reached = v;
        if within != z {
            reached = input_for(&self.plays, within);
            self.out_of_reach = self.out_of_reach.saturating_add(1);
        }
        step_plays(&mut self.plays, reached);
        self.drive = drive_for(within);
        reached
    }
}

#[inline]
fn clamp(value: Real, low: Real, high: Real) -> Real {
    let value = if high < value { high } else { value };
    if low > value { low } else { value }
}

/// The first play has no width and stores the last v. If v rises, no play moves down.
#[inline]
fn step_plays(places: &mut [Real; PLAYS], v: Real) -> Real {
    if v > places[0] {
        sum(PLAYS, |i| {
            let pushed = v - HALF_WIDTHS[i];
            places[i] = if pushed > places[i] { pushed } else { places[i] };
            WEIGHTS[i] * places[i]
        })
    } else {
        sum(PLAYS, |i| {
            let pushed = v + HALF_WIDTHS[i];
            places[i] = if pushed < places[i] { pushed } else { places[i] };
            WEIGHTS[i] * places[i]
        })
    }
}

#[inline]
fn drive_for(z: Real) -> Real {
    let passed = KNOT_PLACES.partition_point(|&knot| knot <= z);
    let j = if passed > 0 && passed <= KNOTS { passed - 1 } else { 0 };
    clamp(
        HEIGHTS[j] + SLOPES[j + usize::from(passed > 0)] * (z - KNOT_PLACES[j]),
        LOWEST_DRIVE,
        HIGHEST_DRIVE,
    )
}

/// Adds the terms in four independent sums, which the processor can compute in parallel.
#[inline]
fn sum(count: usize, mut term: impl FnMut(usize) -> Real) -> Real {
    let mut sums = [0.0; 4];
    let whole = count - count % 4;
    for first in (0..whole).step_by(4) {
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum += term(first + i);
        }
    }
    for i in whole..count {
        sums[0] += term(i);
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Returns the v that moves the plays from their present state to an output.
fn input_for(places: &[Real; PLAYS], output: Real) -> Real {
    let (mut v, mut reached, mut slope) = (places[0], 0.0, 0.0);
    for i in 0..PLAYS {
        reached += WEIGHTS[i] * places[i];
    }
    let rises = output > reached;
    for i in 0..PLAYS {
        let turn = if rises { places[i] + HALF_WIDTHS[i] } else { places[i] - HALF_WIDTHS[i] };
        let there = reached + slope * (turn - v);
        if (rises && there > output) || (!rises && there < output) {
            break;
        }
        (v, reached, slope) = (turn, there, slope + WEIGHTS[i]);
    }
    if slope > 0.0 { v + (output - reached) / slope } else { v }
}
