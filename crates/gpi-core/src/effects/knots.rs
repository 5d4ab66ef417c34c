//! A slow function of time: straight lines between evenly spaced knots.

/// The value at `time` of a function given at knots from 0 to `duration`; constant beyond.
pub(super) fn at(knots: &[f64], duration: f64, time: f64) -> f64 {
    let last = knots.len() - 1;
    if last == 0 || duration <= 0.0 {
        return knots[0];
    }
    let place = (time / duration).clamp(0.0, 1.0) * last as f64;
    let left = (place as usize).min(last - 1);
    let right = place - left as f64;
    (1.0 - right) * knots[left] + right * knots[left + 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_between_knots() {
        let knots = [1.0, 3.0, -1.0];
        assert_eq!(
            [-1.0, 0.0, 0.5, 1.0, 1.5, 9.0].map(|t| at(&knots, 2.0, t)),
            [1.0, 1.0, 2.0, 3.0, 1.0, -1.0]
        );
    }
}
