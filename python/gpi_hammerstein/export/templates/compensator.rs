//! $title.
//!
$facts

#![forbid(unsafe_code)]
// a program need not use every function
#![allow(dead_code)]

/// The number type.
pub type Real = $real;

const PLAYS: usize = $plays;
const KNOTS: usize = $knot_count;
@creep
const LAGS: usize = $lags;
@end

// v = (reference - offset - creep) / gain
const OFFSET: Real = $offset;
const GAIN: Real = $gain;
const STANDING_GAIN: Real = $standing_gain;
@creep

// Creep: in each sample, each lag changes by rate (v - lag). Its contribution to creep is gain times its value.
const LAG_RATES: [Real; LAGS] = [$lag_rates];
const LAG_GAINS: [Real; LAGS] = [$lag_gains];
@end

// The inverse plays, by increasing half-width.
const HALF_WIDTHS: [Real; PLAYS] = [$half_widths];
const WEIGHTS: [Real; PLAYS] = [$weights];

// The inverse deadzones as a piecewise linear curve: knots, the drive at each knot, the slope before the first knot and after
// each knot.
const KNOT_PLACES: [Real; KNOTS] = [$knots];
const HEIGHTS: [Real; KNOTS] = [$heights];
const SLOPES: [Real; KNOTS + 1] = [$slopes];

// The limits of the drive, the corresponding inputs of the inverse deadzones, and the range of v in which no limit is reached.
const LOWEST_DRIVE: Real = $lowest_drive;
const HIGHEST_DRIVE: Real = $highest_drive;
const LOWEST: Real = $lowest;
const HIGHEST: Real = $highest;
const SAFE_BELOW: Real = $safe_below;
const SAFE_ABOVE: Real = $safe_above;

// The range of v, and the part of it in which neither this range nor a limit of the drive is reached.
const LOWEST_V: Real = $lowest_v;
const HIGHEST_V: Real = $highest_v;
const USUAL_BELOW: Real = $usual_below;
const USUAL_ABOVE: Real = $usual_above;

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
/// - A reference that is NaN or infinite changes neither the drive nor the state. [`Compensator::standing_at`] takes it as $rest,
///   where v = 0.
/// - v is limited to $v_range. In the steady state, these are the references
///   $lowest_reference .. $highest_reference. A drive at its limit within this range is no fault.
/// - [`Compensator::faults`] tells that one of the two has happened, until [`Compensator::clear_faults`].
/// - After m bad and n good samples, v differs from the v without the bad samples by at most m * $recovery * $decay^n,
///   apart from rounding errors, if all gains of creep have the sign of the gain.
///   The plays return to the same state when v has moved up and down by twice the largest half-width, $widest. Until
///   then, the drive is the right one for the actuator, which has followed the drive too.
#[derive(Clone, Debug)]
pub struct Compensator {
    plays: [Real; PLAYS],
@creep
    lags: [Real; LAGS],
    /// Rounding errors of the lags.
    carried: [Real; LAGS],
@end
    drive: Real,
    out_of_reach: u32,
    faults: Faults,
}

impl Compensator {
    /// Returns the steady state after the actuator has moved from zero to this reference$output_unit.
    pub fn standing_at(reference: Real) -> Self {
        let faults = Faults { not_finite: !reference.is_finite(), saturated: false };
        let reference = if faults.not_finite { OFFSET } else { reference };
@creep
        let (lags, carried) = ([0.0; LAGS], [0.0; LAGS]);
        let mut own = Self { plays: [0.0; PLAYS], lags, carried, drive: 0.0, out_of_reach: 0, faults };
        let v = own.go_to((reference - OFFSET) / STANDING_GAIN);
        own.lags = [v; LAGS];
@else
        let mut own = Self { plays: [0.0; PLAYS], drive: 0.0, out_of_reach: 0, faults };
        own.go_to((reference - OFFSET) / STANDING_GAIN);
@end
        own.out_of_reach = 0;
        own
    }

    /// Returns the drive$input_unit for the next sample of the reference$output_unit. See [`Compensator`] for
    /// bad samples.
    #[inline]
    pub fn step(&mut self, reference: Real) -> Real {
        if !reference.is_finite() {
            self.faults.not_finite = true;
            return self.drive;
        }
@creep
        let mut creep = 0.0;
        for (gain, lag) in LAG_GAINS.iter().zip(&self.lags) {
            creep += gain * lag;
        }
        let v = self.go_to((reference - OFFSET - creep) / GAIN);
        self.creep_on(v);
@else
        self.go_to((reference - OFFSET) / GAIN);
@end
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
@creep

    #[inline]
    fn creep_on(&mut self, v: Real) {
        for (rate, (lag, carried)) in LAG_RATES.iter().zip(self.lags.iter_mut().zip(&mut self.carried)) {
            let wanted = rate * (v - *lag) + *carried;
            let there = *lag + wanted;
            *carried = wanted - (there - *lag);
            *lag = there;
        }
    }
@end

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
    clamp(HEIGHTS[j] + SLOPES[j + usize::from(passed > 0)] * (z - KNOT_PLACES[j]), LOWEST_DRIVE, HIGHEST_DRIVE)
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
