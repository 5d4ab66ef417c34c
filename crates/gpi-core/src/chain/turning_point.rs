//! Where a signal turns back between two samples.
//!
//! A z that turns back has moved farther than its samples show. Its path over the last sample is the parabola through the last
//! three samples, with the time t from -1 to 0:
//!
//! ```text
//! z(t) = z_0 + s t + c t^2 / 2,     s = (3 z_0 - 4 z_1 + z_2) / 2,     c = z_0 - 2 z_1 + z_2
//! ```
//!
//! Where it turns at a t between -1 and 0, z goes from z_1 to `z(t)` and then to z_0.

use super::jet::Jet;

/// A turning point between the last two of three samples, with derivatives by the samples, which are the variables 1 to 3.
pub(super) struct TurningPoint<const N: usize> {
    pub z: Jet<N>,
    /// From -1 to 0, the last sample.
    pub time: Jet<N>,
}

/// The turning point between the last two of three samples, the newest first; `None` where there is none.
pub(super) fn turning_point<const N: usize>(samples: [f64; 3]) -> Option<TurningPoint<N>> {
    let [now, before, older] = [0, 1, 2].map(|i| Jet::variable(samples[i], 1 + i));
    let slope = (now * 3.0 - before * 4.0 + older) * 0.5;
    let curvature = now - before * 2.0 + older;
    let time = -slope.value / curvature.value;
    (-1.0 < time && time < 0.0).then(|| {
        let time = -slope * curvature.recip();
        TurningPoint { z: now + slope * time * 0.5, time }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_top_of_the_parabola() {
        let turn = |z| turning_point::<4>(z).map(|turn| (turn.z.value, turn.time.value));
        // 4 - (t + 1/2)^2 at t = 0, -1, -2
        assert_eq!(turn([3.75, 3.75, 1.75]), Some((4.0, -0.5)));
        // the motion turned before, or goes on
        assert!(turn([1.75, 3.75, 3.75]).is_none());
        assert!(turn([3.0, 2.0, 1.0]).is_none() && turn([1.0; 3]).is_none());
    }
}
