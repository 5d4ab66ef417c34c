
// Hostile references for an exported compensator; the constants above come from test_hostile_references.py.
mod compensator;
use compensator::{Compensator, Faults, Real};

struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// All patterns of bits, and large round numbers.
    fn hostile(&mut self) -> Real {
        const SPECIAL: [Real; 9] = [0.0, -0.0, 1e37, -1e37, 1e10, -1e10, 1e-40, Real::MAX, -Real::MAX];
        let draw = self.next();
        let bits = self.next() as Bits;
        if draw % 4 == 0 { SPECIAL[(draw / 4 % 9) as usize] } else { Real::from_bits(bits) }
    }
}

/// A triangle between LEAST and MOST of 64 samples.
fn good(k: u32) -> Real {
    let place = k % 64;
    (LEAST + (MOST - LEAST) * f64::from(if place < 32 { place } else { 64 - place }) / 32.0) as Real
}

fn check(drive: Real) {
    let drive = f64::from(drive);
    assert!(drive >= f64::from(LOW as Real) && drive <= f64::from(HIGH as Real), "{drive} is not within the limits");
}

fn main() {
    let mut draw = Draw(88172645463325252);
    let (mut done, mut compared) = (0, 0);
    assert!(V_LOW <= 0.0 && V_HIGH >= 0.0);
    let mut worn = Compensator::standing_at(good(0));
    while done < SAMPLES {
        // most bursts hit one state, which is never reset
        for burst in 0..32 {
            for _ in 0..8 {
                check(worn.step(draw.hostile()));
                done += 1;
            }
            check(worn.step(good(burst)));
        }
        let bad = 1 + (draw.next() % 8) as u32;
        let mut clean = Compensator::standing_at(good(0));
        assert_eq!(clean.faults(), Faults::default());
        for k in 0..64 {
            clean.step(good(k));
        }
        let mut hurt = clean.clone();
        let mut held = clean.step(good(0));
        hurt.step(good(0));
        for _ in 0..bad {
            let reference = draw.hostile();
            clean.step(good(0));
            hurt.clear_faults();
            let u = hurt.step(reference);
            assert_eq!(hurt.faults().not_finite, !reference.is_finite());
            assert!(reference.is_finite() || u == held, "{reference} {u} {held}");
            held = u;
            check(u);
            let started = Compensator::standing_at(reference);
            assert_eq!(started.faults().not_finite, !reference.is_finite());
            check(started.clone().step(Real::NAN));
            done += 1;
        }
        hurt.clear_faults();
        let mut bound = f64::from(bad) * RECOVERY;
        for k in 0..400 {
            let (a, b) = (clean.step(good(k)), hurt.step(good(k)));
            bound *= DECAY;
            check(b);
            assert_eq!(hurt.faults(), Faults::default());
            if k >= 128 {
                compared += 1;
                let apart = (f64::from(a) - f64::from(b)).abs();
                assert!(apart <= SLOPE * bound + ROUNDING, "{a} {b} after {k} samples: {bound}");
            }
        }
    }
    println!("{done} {compared}");
}
