//! A point without hysteresis, for tests.

use super::hysteresis::Parameters;
use super::point::{DynamicsFreedom, Freedom, Past, Point};
use super::sensitivity::Derivatives;
use crate::effects::Effect;
use crate::linear::{Sections, TransferFunction};
use crate::operators::Reading;
use crate::{Intersample, Matrix};

/// Everything but thresholds, half-widths and initial places of plays, of which a point without hysteresis has none.
pub(crate) const FREE: Freedom = Freedom {
    weights: true,
    offsets: true,
    derivatives: Derivatives { thresholds: false, half_widths: false, starts: false },
    states: true,
    identity: true,
    dynamics: DynamicsFreedom::Everything,
};

/// A transfer function of one input and one output, at rest before one experiment sampled at 1 kHz.
pub(crate) fn plain(numerator: &[f64], denominator: &[f64], effects: Vec<Effect>) -> Point {
    let system = TransferFunction::new(numerator, denominator).unwrap().to_state_space().unwrap();
    let dynamics = Sections::from_state_space(&system, 0).unwrap();
    Point {
        pasts: vec![Past::rest(dynamics.order(), 1)],
        channels: vec![Parameters::identity(Reading::OneSided, vec![0.0], vec![0.0])],
        dynamics,
        intersample: Intersample::default(),
        effects,
        rate: 1e3,
        offsets: vec![Matrix::zeros(1, 1)],
    }
}
