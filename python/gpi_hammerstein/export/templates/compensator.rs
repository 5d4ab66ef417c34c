//! $title.
//!
$facts

#![forbid(unsafe_code)]

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

/// Computes the drive from a reference; contains the state between two samples.
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
}

impl Compensator {
    /// Returns the steady state after the actuator has moved from zero to this reference$output_unit.
    pub fn standing_at(reference: Real) -> Self {
@creep
        let (lags, carried) = ([0.0; LAGS], [0.0; LAGS]);
        let mut own = Self { plays: [0.0; PLAYS], lags, carried, drive: 0.0, out_of_reach: 0 };
        let v = own.go_to((reference - OFFSET) / STANDING_GAIN);
        own.lags = [v; LAGS];
@else
        let mut own = Self { plays: [0.0; PLAYS], drive: 0.0, out_of_reach: 0 };
        own.go_to((reference - OFFSET) / STANDING_GAIN);
@end
        own.out_of_reach = 0;
        own
    }

    /// Returns the drive$input_unit for the next sample of the reference$output_unit. If the reference is not finite, the drive
    /// does not change.
    #[inline]
    pub fn step(&mut self, reference: Real) -> Real {
        if !reference.is_finite() {
            return self.drive;
        }
@creep
        let mut creep = 0.0;
        for (gain, lag) in LAG_GAINS.iter().zip(&self.lags) {
            creep += gain * lag;
        }
        let v = self.go_to((reference - OFFSET - creep) / GAIN);
        for (rate, (lag, carried)) in LAG_RATES.iter().zip(self.lags.iter_mut().zip(&mut self.carried)) {
            let wanted = rate * (v - *lag) + *carried;
            let there = *lag + wanted;
            *carried = wanted - (there - *lag);
            *lag = there;
        }
@else
        self.go_to((reference - OFFSET) / GAIN);
@end
        self.drive
    }

    /// Returns the number of samples with the drive at a limit.
    pub fn out_of_reach(&self) -> u32 {
        self.out_of_reach
    }

    /// Moves the plays to v, or to the nearest v that can be reached, and sets the drive.
    #[inline]
    fn go_to(&mut self, v: Real) -> Real {
        if !(SAFE_BELOW..=SAFE_ABOVE).contains(&v) {
            return self.go_to_limit(v);
        }
        self.drive = drive_for(step_plays(&mut self.plays, v));
        v
    }

    #[cold]
    fn go_to_limit(&mut self, v: Real) -> Real {
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
