//! Which changes two successive windows of the residual agree upon.

use super::moments::{Moments, Regression, square_root};
use crate::operators::{Sample, Storage};

/// The part of what changes explain that a further change must explain. A large change is not linear, and what the first
/// order leaves of it must not be taken for another one: at this part, the second order is a third of the first.
const REMAINDER: f64 = 0.1;

/// The square of the standard deviations by which draws of the error may be exceeded in the sum of its squares.
pub(crate) const POSSIBLE: f64 = 4.0;

/// When a change counts.
///
/// A change is noticed if it deviates from zero by more than `deviations` standard errors in each of two successive windows,
/// in the same direction. One wrong sample, however large, lies in one of them only. For Gaussian noise, both exceed z with
/// the probability `2 (1 - Phi(z))^2` for one change; [`Limits::deviations`] follows from the rate of false alarms by
/// summation over all windows and changes.
///
/// An error m that is known to be possible, such as the misfit of the training record and the unknown start, may take
/// any shape. By the inequality of Cauchy and Schwarz it moves an estimate by at most `sqrt(sum m^2)` standard errors for
/// noise of deviation 1. An error h that changes as slowly as the state of the machine moves only estimates of changes that are
/// slow themselves. Errors of which draws are known move an estimate as the draws do. The last two are independent of
/// the noise. A deviation d from zero counts if
///
/// ```text
/// (|d| - sqrt(sum m^2))^2 > (z s)^2 + N h^2 [slow] + t^2 sum_j d_j^2
/// ```
///
/// with the deviation d_j of each draw and the quantile t of as many degrees of freedom as there are draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<T> {
    /// Standard deviation s of the noise when the model was made.
    pub noise: T,
    /// Standard errors z by which a change must exceed what is possible without it.
    pub deviations: T,
    /// The smallest part by which the noise must have changed, such as 0.1.
    pub least_noise: T,
    /// The slow error h that the training record may hide although it is there.
    pub hidden: T,
    /// Bit i is set if regressor i changes its sign while the machine stays in one state, as that of a resonance.
    pub fast: u32,
    /// The quantile t of the draws of the error, zero without draws.
    pub of_draws: T,
}

/// What two windows agree upon.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreed {
    /// Bit i is set if regressor i is needed to explain the residual.
    pub changes: u32,
    /// 1 if the noise has risen, -1 if it has fallen, else 0.
    pub noise: i8,
    /// The sum of squares that the changes explain in both windows, in units of the noise's variance; for the noise, its own
    /// change of this sum.
    pub evidence: f64,
}

impl Agreed {
    /// Whether nothing has changed.
    pub fn is_nothing(&self) -> bool {
        self.changes == 0 && self.noise == 0
    }

    /// Whether a regressor is needed.
    pub fn has(&self, regressor: usize) -> bool {
        self.changes >> regressor & 1 == 1
    }
}

/// One of the two windows, and the noise in it.
struct Side<S: Storage> {
    regression: Regression<S>,
    noise: f64,
    known: f64,
    hidden: f64,
    drawn: f64,
    of_draws: f64,
    fast: u32,
    samples: f64,
}

impl<S: Storage> Side<S> {
    fn new(moments: &Moments<S>, count: usize, limits: &Limits<S::Item>) -> Self {
        let samples: f64 = moments.samples.into();
        let mut all = moments.regression(count);
        (0..count).for_each(|i| {
            all.enter(i);
        });
        // more noise than before: what it does to the estimates must not be taken for a change of something else
        let present = square_root(all.left().into() / samples);
        let noise: f64 = limits.noise.into();
        Self {
            regression: moments.regression(count),
            noise: if present > noise { present } else { noise },
            known: moments.known.into(),
            hidden: square(limits.hidden) * samples,
            drawn: moments.drawn.into(),
            of_draws: square(limits.of_draws),
            fast: limits.fast,
            samples,
        }
    }

    /// The sum of squares that a change outside the regression would explain.
    fn explained(&self, regressor: usize) -> f64 {
        let deviation = self.regression.deviation(regressor, false);
        deviation * deviation
    }

    fn regression_left(&self) -> f64 {
        self.regression.left().into()
    }

    /// The standard errors by which a change exceeds what is possible without it, with the sign of the change.
    fn excess(&self, regressor: usize, is_in: bool) -> f64 {
        let deviation = self.regression.deviation(regressor, is_in);
        let size = if deviation < 0.0 { -deviation } else { deviation };
        let beyond = size - square_root(self.known);
        if beyond <= 0.0 {
            return 0.0;
        }
        let is_fast = self.fast >> regressor & 1 == 1;
        let hidden = if is_fast { 0.0 } else { self.hidden };
        let drawn = self.of_draws * self.regression.drawn(regressor, is_in);
        let more = square_root(beyond * beyond - hidden - drawn) / self.noise;
        if deviation < 0.0 { -more } else { more }
    }
}

impl<T: Sample> Limits<T> {
    /// The changes upon which two successive windows agree, of `count` regressors.
    ///
    /// Of the changes that deviate in both windows, the one that explains most enters, then the one that explains most of
    /// what is left, and so on; at the end, changes without which the others explain the residual leave again.
    pub fn agreed<S: Storage<Item = T>>(
        &self,
        earlier: &Moments<S>,
        later: &Moments<S>,
        count: usize,
    ) -> Agreed {
        let mut sides = [earlier, later].map(|moments| Side::new(moments, count, self));
        let before: f64 = sides.iter().map(Side::regression_left).sum();
        let least: f64 = self.deviations.into();
        let mut found = Agreed::default();
        loop {
            let explained = before - sides.iter().map(Side::regression_left).sum::<f64>();
            let explains = |i: usize| sides.iter().map(|side| side.explained(i)).sum::<f64>();
            let remainder = if found.changes == 0 { 0.0 } else { REMAINDER * explained };
            let counts = |i: &usize| !found.has(*i) && common(&sides, *i, false) > least;
            let outside = (0..count).filter(counts).map(|i| (i, explains(i)));
            let best = outside.fold((count, 0.0), larger);
            if best.1 <= remainder || !sides.iter_mut().all(|side| side.regression.enter(best.0)) {
                break;
            }
            found.changes |= 1 << best.0;
        }
        for i in 0..count {
            if found.has(i) && common(&sides, i, true) <= least {
                sides.iter_mut().for_each(|side| side.regression.leave(i));
                found.changes &= !(1 << i);
            }
        }
        let variance = sides[0].noise * sides[1].noise;
        let after: f64 = sides.iter().map(Side::regression_left).sum();
        found.evidence = (before - after) / variance;
        // what a large change leaves because it is not linear is no noise
        found.noise = self.of_noise(&sides, if found.changes == 0 { 0.0 } else { before - after });
        if found.noise != 0 {
            let own = f64_of(self.noise);
            let change: f64 =
                sides.iter().map(|side| side.regression_left() / (own * own) - side.samples).sum();
            found.evidence += if change < 0.0 { -change } else { change };
        }
        found
    }

    /// Whether the noise has risen or fallen in both windows: by more than chance, by more than the error that is known to be
    /// possible, by more than the least part, and, in each of the windows, by more than changes explain.
    fn of_noise<S: Storage<Item = T>>(&self, sides: &[Side<S>; 2], explained: f64) -> i8 {
        let (noise, part): (f64, f64) = (self.noise.into(), self.least_noise.into());
        let deviations: f64 = self.deviations.into();
        let way = |side: &Side<S>| {
            let variance = noise * noise * side.samples;
            let chance = deviations * square_root(2.0 / side.samples);
            let left = side.regression_left();
            let possible = side.known + side.hidden + POSSIBLE * side.drawn;
            let risen = (left - possible - explained) / variance - 1.0;
            let fallen = left / variance - 1.0;
            if risen > (2.0 + part) * part + chance {
                1
            } else if fallen < -(2.0 - part) * part - chance {
                -1
            } else {
                0
            }
        };
        let (one, two) = (way(&sides[0]), way(&sides[1]));
        if one == two { one } else { 0 }
    }
}

fn square<T: Sample>(value: T) -> f64 {
    value.into() * value.into()
}

fn f64_of<T: Sample>(value: T) -> f64 {
    value.into()
}

/// By how much a change exceeds what is possible in both windows; zero if they differ in its direction.
fn common<S: Storage>(sides: &[Side<S>; 2], regressor: usize, is_in: bool) -> f64 {
    let (one, two) = (sides[0].excess(regressor, is_in), sides[1].excess(regressor, is_in));
    match one * two {
        product if product <= 0.0 => 0.0,
        _ if one < 0.0 => (-one).min(-two),
        _ => one.min(two),
    }
}

fn larger(best: (usize, f64), next: (usize, f64)) -> (usize, f64) {
    if next.1 > best.1 { next } else { best }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits<f64> = Limits {
        noise: 0.1,
        deviations: 4.0,
        least_noise: 0.1,
        hidden: 0.0,
        fast: 0,
        of_draws: 0.0,
    };

    struct Noise(u64);

    impl Noise {
        /// Approximately normal: the sum of twelve uniform numbers.
        fn next(&mut self) -> f64 {
            (0..12)
                .map(|_| {
                    self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (self.0 >> 11) as f64 / (1u64 << 53) as f64
                })
                .sum::<f64>()
                - 6.0
        }
    }

    /// Two windows of 500 samples with a residual of `d0 + d1 sin` and noise; `spike` is one wrong sample.
    fn windows(changes: [f64; 2], noise: f64, spike: f64, known: f64) -> [Moments<[f64; 6]>; 2] {
        let mut random = Noise(1);
        [0, 1].map(|window| {
            let mut sums = Moments::like(&[0.0; 6]);
            for k in 0..500 {
                let phi = [1.0, (0.05 * f64::from(k)).sin()];
                let wrong = if window == 1 && k == 250 { spike } else { 0.0 };
                let r = changes[0] * phi[0] + changes[1] * phi[1] + noise * random.next() + wrong;
                sums.add(&phi, &[], r, known * known);
            }
            sums
        })
    }

    fn agreed(changes: [f64; 2], noise: f64, spike: f64, known: f64) -> Agreed {
        let [earlier, later] = windows(changes, noise, spike, known);
        LIMITS.agreed(&earlier, &later, 2)
    }

    #[test]
    fn noise_alone_is_no_change() {
        assert!(agreed([0.0; 2], 0.1, 0.0, 0.0).is_nothing());
    }

    #[test]
    fn each_change_is_told_from_the_other() {
        assert_eq!(agreed([0.04, 0.0], 0.1, 0.0, 0.0).changes, 0b01);
        assert_eq!(agreed([0.0, -0.06], 0.1, 0.0, 0.0).changes, 0b10);
        let both = agreed([0.05, 0.05], 0.1, 0.0, 0.0);
        assert!(both.changes == 0b11 && both.evidence > 100.0 && both.noise == 0);
    }

    #[test]
    fn one_wrong_sample_is_no_change() {
        assert!(agreed([0.0; 2], 0.1, 1e6, 0.0).is_nothing());
    }

    #[test]
    fn an_error_that_is_known_to_be_possible_is_no_change() {
        assert_eq!(agreed([0.05, 0.0], 0.1, 0.0, 0.05).changes, 0);
        assert_eq!(agreed([0.1, 0.0], 0.1, 0.0, 0.05).changes, 0b01);
    }

    #[test]
    fn a_hidden_error_is_no_slow_change() {
        let [earlier, later] = windows([0.04, -0.06], 0.1, 0.0, 0.0);
        let limits = Limits { hidden: 0.06, fast: 0b10, ..LIMITS };
        assert_eq!(LIMITS.agreed(&earlier, &later, 2).changes, 0b11);
        assert_eq!(limits.agreed(&earlier, &later, 2).changes, 0b10);
    }

    #[test]
    fn noise_that_rises_or_falls_is_that_only() {
        for (noise, way) in [(0.15, 1), (0.06, -1), (0.104, 0)] {
            let found = agreed([0.0; 2], noise, 0.0, 0.0);
            assert_eq!((found.changes, found.noise), (0, way), "{noise}");
        }
    }
}
