//! A bank of plays from the turning points of its input: the cost of a sample does not depend on the number of plays.
//!
//! Call the samples between two reversals of z a branch, with the sign s = 1 if z increases and s = -1 if it decreases.
//! Along a branch the c narrowest plays move, `F_i = z - s r_i`, and the others keep the outputs of earlier branches.
//! Hence `v = P_c z - s Q_c + R_c`, where P_c and Q_c are the sums of p_i and p_i r_i over the c moving plays, and R_c is
//! the sum of `p_i F_i` over the others. The count c grows along the branch and is zero again after a reversal.

use super::ranked::Ranked;
use pulp::Simd;

/// Samples that are computed at once if they belong to one branch.
const RUN: usize = 8;

/// Consecutive samples without a reversal after which a run of [`RUN`] samples is tried.
const QUIET: usize = 3;

/// Rounding error allowed in a difference of play outputs, relative to the largest number involved: a few hundred times
/// the precision of `f64`.
const SLACK: f64 = 1e-13;

/// A branch that has ended and still determines the outputs of some plays.
struct Turn {
    /// It determines the plays from the next later branch's `end` up to this rank.
    end: usize,
    /// z at its end.
    z: f64,
    /// 1 if z increased, -1 if it decreased.
    sign: f64,
    /// Sum of `p F` over the plays from `end` on.
    rest: f64,
}

/// The state of all plays.
pub(super) struct TurningPoints<'a> {
    bank: &'a Ranked,
    /// The initial outputs of the plays by half-width, and the sums of `p F` from each rank on.
    places: Vec<f64>,
    rests: Vec<f64>,
    /// The earliest branch, which determines the widest plays, comes first.
    turns: Vec<Turn>,
    /// Of the current branch.
    sign: f64,
    last: f64,
    /// The number of moving plays.
    moving: usize,
    /// The `sign * z` from which more plays move.
    limit: f64,
    /// Sum of `p F` over the other plays.
    rest: f64,
    /// `v = slope z + constant`.
    slope: f64,
    constant: f64,
}

impl<'a> TurningPoints<'a> {
    /// The plays with outputs `places` (in the bank's order) before a signal whose first sample is `first`.
    ///
    /// `None` if the outputs of two neighbours differ by more than their half-widths: then a wider play may move before
    /// a narrower one.
    pub(super) fn new(
        bank: &'a Ranked,
        weights: &[f64],
        places: &[f64],
        first: f64,
    ) -> Option<Self> {
        let places: Vec<f64> = bank.order.iter().map(|&i| places[i]).collect();
        let widest = bank.half_widths.last().copied().unwrap_or(0.0);
        let size = places.iter().fold(widest + first.abs(), |size, place| size.max(place.abs()));
        let neighbours = places.windows(2).zip(bank.half_widths.windows(2));
        for (places, widths) in neighbours {
            if (places[1] - places[0]).abs() > widths[1] - widths[0] + SLACK * size {
                return None;
            }
        }
        let mut rests = vec![0.0; places.len() + 1];
        for (rank, &i) in bank.order.iter().enumerate().rev() {
            rests[rank] = rests[rank + 1] + weights[i] * places[rank];
        }
        // no play moves yet: any direction is valid, the one towards `first` avoids a reversal
        let sign = match places.first() {
            Some(narrowest) if first < *narrowest => -1.0,
            _ => 1.0,
        };
        let (last, turns, moving, limit) = (first, Vec::new(), 0, f64::INFINITY);
        let (rest, slope, constant) = (0.0, 0.0, 0.0);
        let mut found =
            Self { bank, places, rests, turns, sign, last, moving, limit, rest, slope, constant };
        found.look_ahead();
        found.settle();
        Some(found)
    }

    /// Writes the outputs of the plays, in the bank's order.
    pub(super) fn write_places(&self, places: &mut [f64]) {
        let mut rank = 0;
        let present = Turn { end: self.moving, z: self.last, sign: self.sign, rest: 0.0 };
        for turn in std::iter::once(&present).chain(self.turns.iter().rev()) {
            while rank < turn.end {
                places[self.bank.order[rank]] = turn.z - turn.sign * self.bank.half_widths[rank];
                rank += 1;
            }
        }
        for rank in rank..self.bank.len() {
            places[self.bank.order[rank]] = self.places[rank];
        }
    }

    /// Sets `limit` for the current branch.
    #[inline(always)]
    fn look_ahead(&mut self) {
        let (half_widths, c) = (&self.bank.half_widths, self.moving);
        self.limit = match self.turns.last() {
            Some(turn) if turn.sign == self.sign => self.sign * turn.z,
            Some(turn) => self.sign * turn.z + 2.0 * half_widths[c],
            None if c < self.places.len() => self.sign * self.places[c] + half_widths[c],
            None => f64::INFINITY,
        };
    }

    /// Sets `rest`, `slope` and `constant` for the plays that move now.
    #[inline(always)]
    fn settle(&mut self) {
        let (Ranked { weights, moments, .. }, c) = (self.bank, self.moving);
        self.rest = match self.turns.last() {
            Some(turn) => {
                (weights[turn.end] - weights[c]) * turn.z
                    - turn.sign * (moments[turn.end] - moments[c])
                    + turn.rest
            }
            None => self.rests[c],
        };
        self.slope = weights[c];
        self.constant = self.rest - self.sign * moments[c];
    }

    /// The output for one sample.
    #[inline(always)]
    fn step(&mut self, z: f64) -> f64 {
        let turned = self.sign * (z - self.last) < 0.0;
        if turned {
            if self.moving > 0 {
                let Self { moving: end, last: z, sign, rest, .. } = *self;
                self.turns.push(Turn { end, z, sign, rest });
            }
            self.sign = -self.sign;
            self.moving = 0;
            self.look_ahead();
        }
        if turned || self.sign * z >= self.limit {
            while self.sign * z >= self.limit {
                self.go_on(z);
            }
            self.settle();
        }
        self.last = z;
        self.slope * z + self.constant
    }

    /// Adds the plays that move now, at most those of the latest earlier branch.
    #[inline(always)]
    fn go_on(&mut self, z: f64) {
        let (s, next) = (self.sign, self.moving + 1);
        self.moving = match self.turns.last() {
            Some(turn) => {
                let met = if turn.sign == s {
                    turn.end
                } else {
                    self.bank.at_most(0.5 * s * (z - turn.z)).clamp(next, turn.end)
                };
                if met == turn.end {
                    self.turns.pop();
                }
                met
            }
            None => {
                let standing = self.places[next..].iter().zip(&self.bank.half_widths[next..]);
                next + standing.take_while(|(place, r)| s * z >= s * *place + *r).count()
            }
        };
        self.look_ahead();
    }

    /// The `sign * z` from which more plays move than those of the latest earlier branch.
    #[inline(always)]
    fn farthest(&self) -> f64 {
        match self.turns.last() {
            Some(turn) if turn.sign != self.sign => {
                self.sign * turn.z + 2.0 * self.bank.half_widths[turn.end - 1]
            }
            _ => self.limit,
        }
    }

    /// The outputs for samples along which more and more plays of the latest earlier branch move:
    /// `v = v_t + 2 s sum_i p_i max(|z - z_t| / 2 - r_i, 0)`, where z_t is that branch's end and v_t its output.
    #[inline(always)]
    fn curve(&mut self, now: &[f64; RUN], out: &mut [f64; RUN]) {
        let Some(turn) = self.turns.last() else { return };
        let (start, half) = (turn.z, 0.5 * self.sign);
        let (weights, moments) = (&self.bank.weights, &self.bank.moments);
        let begin = weights[turn.end] * start + self.sign * moments[turn.end] + turn.rest;
        for (z, v) in now.iter().zip(&mut *out) {
            *v = begin + 2.0 * self.sign * self.bank.beyond(half * (z - start));
        }
        self.last = now[RUN - 1];
        let met = self.bank.at_most(half * (self.last - start));
        self.moving = self.moving.max(met).min(turn.end - 1);
        self.look_ahead();
        self.settle();
    }

    /// The outputs for finite samples.
    #[inline(always)]
    pub(super) fn run<S: Simd>(&mut self, simd: S, input: &[f64], output: &mut [f64]) {
        let mut quiet = 0;
        let mut k = 0;
        while k < input.len() {
            let before = self.sign;
            output[k] = self.step(input[k]);
            quiet = if self.sign == before { quiet + 1 } else { 0 };
            k += 1;
            if quiet < QUIET {
                continue;
            }
            while let (Some(passed), Some(now), Some(out)) = (
                input[k - 1..].first_chunk::<RUN>(),
                input[k..].first_chunk::<RUN>(),
                output[k..].first_chunk_mut::<RUN>(),
            ) {
                let end = self.sign * now[RUN - 1];
                if end >= self.farthest() || !goes_on(simd, passed, now, self.sign) {
                    break;
                }
                if end < self.limit {
                    line(simd, now, self.slope, self.constant, out);
                    self.last = now[RUN - 1];
                } else {
                    self.curve(now, out);
                }
                k += RUN;
            }
        }
    }
}

/// Whether no sample reverses the direction `sign`.
#[inline(always)]
fn goes_on<S: Simd>(simd: S, passed: &[f64; RUN], now: &[f64; RUN], sign: f64) -> bool {
    let (passed, now) = (S::as_simd_f64s(passed).0, S::as_simd_f64s(now).0);
    let sign = simd.splat_f64s(sign);
    let mut least = simd.splat_f64s(0.0);
    for (passed, now) in passed.iter().zip(now) {
        least = simd.min_f64s(least, simd.mul_f64s(sign, simd.sub_f64s(*now, *passed)));
    }
    simd.reduce_min_f64s(least) >= 0.0
}

/// `slope z + constant`.
#[inline(always)]
fn line<S: Simd>(simd: S, z: &[f64; RUN], slope: f64, constant: f64, out: &mut [f64; RUN]) {
    let (slope, constant) = (simd.splat_f64s(slope), simd.splat_f64s(constant));
    let (z, out) = (S::as_simd_f64s(z).0, S::as_mut_simd_f64s(out).0);
    for (z, out) in z.iter().zip(out) {
        *out = simd.mul_add_e_f64s(slope, *z, constant);
    }
}
