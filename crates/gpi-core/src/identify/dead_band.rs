//! A dead band about zero before the dynamics, such as that of a valve's overlap.
//!
//! ```text
//! v = g (u - w),  u > w;      v = 0,  |u| <= w;      v = g (u + w),  u < -w
//! ```
//!
//! The deadzones of a general grid have a slope at zero, which the fit moves only slowly to nothing. A fit that begins at the
//! band keeps it.

use crate::chain::bounds::range;
use crate::chain::hysteresis::Parameters;
use crate::chain::point::Point;
use crate::fit::preparation::Prepared;

/// The dynamics of a point behind dead bands of several widths, and without plays. A width w is one of `parts` of each input's
/// own reach, the lesser of its largest and its negative smallest value. None where no input has both signs.
pub(super) fn dead_bands(prepared: &Prepared, point: &Point, parts: &[f64]) -> Vec<Point> {
    let reach = |input: usize| {
        let (low, high) = range(&prepared.record, input);
        high.min(-low)
    };
    let bipolar: Vec<usize> =
        (0..point.channels.len()).filter(|&input| reach(input) > 0.0).collect();
    if bipolar.is_empty() {
        return Vec::new();
    }
    let band = |part: &f64| {
        let mut band = prepared.point(point.dynamics.clone());
        band.offsets.clone_from(&point.offsets);
        band.channels.clone_from(&point.channels);
        for &input in &bipolar {
            let (own, width) = (&mut band.channels[input], part * reach(input));
            let gain = own.weights.iter().sum();
            let (elements, zones) = (own.elements, vec![-width, width]);
            let identity = Parameters::identity(own.reading, zones, vec![0.0]);
            let (slopes, weights) = (vec![0.0, 1.0, 1.0], vec![gain]);
            *own = Parameters { elements, slopes, weights, ..identity };
        }
        prepared.settle(&mut band);
        band
    };
    parts.iter().map(band).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::IdentifyOptions;
    use crate::identify::procedure::prepare;
    use crate::linear::{Sections, StateSpace};
    use crate::{Channel, Experiment, Matrix, Record};

    /// The bands of a gain of two on the first of some inputs, each a sine between two values.
    fn bands(inputs: &[[f64; 2]], parts: &[f64]) -> Vec<Point> {
        let u = Matrix::from_fn(1000, inputs.len(), |k, i| {
            let [low, high] = inputs[i];
            low + (high - low) * 0.5 * (1.0 - (0.01 * std::f64::consts::PI * k as f64).cos())
        });
        let y = u.columns(0, 1) * 2.0;
        let channels = |name: &str, count| {
            (0..count).map(|i| Channel::new(format!("{name}{i}"), "")).collect()
        };
        let run = vec![Experiment::new(u, y)];
        let (u, y) = (channels("u", inputs.len()), channels("y", 1));
        let record = Record::new(run, 1e3, u, y, vec![]).unwrap();
        let prepared = prepare(&record, &IdentifyOptions::default()).unwrap();
        let none = |rows, columns| Matrix::zeros(rows, columns);
        let gain = Matrix::from_fn(1, inputs.len(), |_, i| if i == 0 { 2.0 } else { 0.0 });
        let system = StateSpace::new(none(0, 0), none(0, inputs.len()), none(1, 0), gain).unwrap();
        let mut point = prepared.point(Sections::from_state_space(&system, 0).unwrap());
        for own in &mut point.channels {
            *own = Parameters::identity(own.reading, vec![], vec![0.0]);
            own.weights = vec![3.0];
        }
        dead_bands(&prepared, &point, parts)
    }

    #[test]
    fn a_band_takes_the_reach_of_its_own_input() {
        let found = bands(&[[-2.0, 5.0], [-30.0, 10.0], [1.0, 4.0]], &[0.1, 0.2]);
        assert_eq!(found.len(), 2);
        for (band, part) in found.iter().zip([0.1, 0.2]) {
            for (own, reach) in band.channels.iter().zip([2.0, 10.0]) {
                let width = part * reach;
                let near = |(own, wanted): (&f64, f64)| (own - wanted).abs() < 1e-9;
                let mut places = own.thresholds.iter().zip([0.0, -width, width]);
                assert!(places.all(near), "{:?}", own.thresholds);
                assert_eq!((&own.slopes[..], &own.weights[..]), (&[0.0, 1.0, 1.0][..], &[3.0][..]));
            }
            // an input of one sign keeps its curve
            assert_eq!(band.channels[2].thresholds, [0.0]);
        }
    }

    #[test]
    fn an_input_of_one_sign_has_no_band() {
        assert!(bands(&[[0.0, 5.0]], &[0.1]).is_empty());
        assert!(bands(&[[-7.0, -1.0]], &[0.1]).is_empty());
    }
}
