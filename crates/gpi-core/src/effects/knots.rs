//! A slow function of time: a smooth curve through evenly spaced knots.

use super::quantity::Quantity;

/// Numbers of knots after the first that are proposed.
pub(super) const COUNTS: [usize; 6] = [1, 2, 4, 8, 16, 32];

/// The value at every later knot, named by its time.
pub(super) fn quantities(name: &str, unit: &str, later: &[f64], duration: f64) -> Vec<Quantity> {
    let time = |i: usize| duration * (i + 1) as f64 / later.len() as f64;
    let name = |i: usize| format!("{name}[{:.4} s]", time(i));
    later.iter().enumerate().map(|(i, &value)| Quantity::new(name(i), unit, value)).collect()
}

/// Keeps every second of the later knots, so that the first and the last stay; `false` where their number is odd.
pub(super) fn coarsen(later: &mut Vec<f64>) -> bool {
    let is_even = later.len() >= 2 && later.len().is_multiple_of(2);
    if is_even {
        *later = later.iter().skip(1).step_by(2).copied().collect();
    }
    is_even
}

/// The value at `time` of a function that is 0 at time 0 and has these values at evenly spaced later knots,
/// the last of them at `duration`; constant beyond.
///
/// Between the knots it is the cubic of Catmull and Rom (1974). Its slope at a knot is that of the line through
/// both neighbours, so that it is linear in the values and continuously differentiable. Neighbours beyond the
/// ends are extrapolated by a parabola, or by a line where there are only two knots.
pub(super) fn at(later: &[f64], duration: f64, time: f64) -> f64 {
    let last = later.len();
    if last == 0 || duration <= 0.0 {
        return 0.0;
    }
    let value = |i: usize| if i == 0 { 0.0 } else { later[i - 1] };
    let beyond = |end: f64, next: f64, second: Option<f64>| match second {
        Some(second) => 3.0 * end - 3.0 * next + second,
        None => 2.0 * end - next,
    };
    let place = (time / duration).clamp(0.0, 1.0) * last as f64;
    let left = (place as usize).min(last - 1);
    let t = place - left as f64;
    let (b, c) = (value(left), value(left + 1));
    let a = match left {
        0 => beyond(b, c, (last > 1).then(|| value(2))),
        _ => value(left - 1),
    };
    let d = match left + 1 {
        end if end == last => beyond(c, b, (last > 1).then(|| value(last - 2))),
        next => value(next + 1),
    };
    let bend = [2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a];
    b + 0.5 * t * (c - a + t * (bend[0] + t * bend[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_second_knot_keeps_a_parabola() {
        let parabola = |t: f64| 3.0 * t * t - t;
        let mut later: Vec<f64> = (1..=8).map(|i| parabola(f64::from(i))).collect();
        while coarsen(&mut later) {
            if later.len() == 1 {
                break;
            }
            for time in [0.3, 2.0, 5.7, 8.0] {
                assert!((at(&later, 8.0, time) - parabola(time)).abs() < 1e-12);
            }
        }
        assert_eq!(later, [parabola(8.0)]);
        assert!(!coarsen(&mut later));
    }

    #[test]
    fn a_parabola_is_a_parabola_everywhere() {
        let parabola = |t: f64| 3.0 * t - 0.5 * t * t;
        let later: Vec<f64> = (1..=6).map(|i| parabola(0.5 * f64::from(i))).collect();
        for k in 0..=60 {
            let time = 3.0 * f64::from(k) / 60.0;
            assert!((at(&later, 3.0, time) - parabola(time)).abs() < 1e-12, "at {time}");
        }
        assert!((at(&later, 3.0, 9.0) - parabola(3.0)).abs() < 1e-12);
    }

    #[test]
    fn two_knots_are_a_line() {
        assert_eq!(
            [-1.0, 0.0, 0.5, 2.0, 9.0].map(|t| at(&[4.0], 2.0, t)),
            [0.0, 0.0, 1.0, 4.0, 4.0]
        );
    }
}
