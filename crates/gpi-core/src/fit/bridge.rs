//! Falling pieces of the envelope between neighbouring samples of u are replaced by straight rising ones.
//!
//! The envelope `D(u) = u + sum_j g_j Z_eta_j(u)` is linear between thresholds, and the model has an inverse only where
//! it rises. Between two neighbouring samples a < b of a record, only D(a) and D(b) and the slopes outside are measured.
//! Where D falls in between although `D(b) > D(a)`, the thresholds inside are replaced by a at the left and b at the
//! right with the slope `(D(b) - D(a)) / (b - a)`: no simulated sample changes, and D rises.

use crate::chain::hysteresis::Parameters;
use crate::fit::joint::Refined;
use crate::fit::preparation::Prepared;
use crate::operators::Reading;
use crate::progress::{Progress, report};
use crate::{Error, Record};

impl Refined {
    /// Makes envelopes straight between neighbouring samples of u where they would fall on the way: what is
    /// measured stays as it is, and an inverse exists.
    pub(crate) fn bridge(&mut self, prepared: &Prepared, progress: Progress) -> Result<(), Error> {
        if !self.options.freedom.derivatives.thresholds {
            return Ok(());
        }
        let mut point = self.fitted.point.clone();
        let mut any = false;
        for (input, channel) in point.channels.iter_mut().enumerate() {
            any |= channel.bridge(&samples(&prepared.record, input));
        }
        if !any {
            return Ok(());
        }
        let mut check = || report(progress, "refinement", 1.0);
        let same = self.fitted.at(point, &prepared.record, &self.options, &mut check)?;
        // effects before the hysteresis may take u where no sample of the record is
        let allowed = 1.0 + prepared.settings.simplification.rounding;
        if same.linearization.cost <= allowed * self.fitted.linearization.cost {
            self.fitted = same;
        }
        Ok(())
    }
}

/// All values of an input in order, each once, and zero between them, where an envelope is zero.
fn samples(record: &Record, input: usize) -> Vec<f64> {
    let columns = record.experiments().iter().map(|e| e.input.column(input));
    let mut values: Vec<f64> =
        columns.flat_map(|column| column.iter().copied().collect::<Vec<_>>()).collect();
    values.sort_by(f64::total_cmp);
    if values.first().is_some_and(|low| *low < 0.0) && values.last().is_some_and(|high| *high > 0.0)
    {
        values.insert(values.partition_point(|value| *value < 0.0), 0.0);
    }
    values.dedup();
    values
}

impl Parameters {
    /// Says whether anything changed; `samples` in order.
    fn bridge(&mut self, samples: &[f64]) -> bool {
        if self.reading != Reading::OneSided {
            return false;
        }
        let mut changed = false;
        for eta in self.thresholds.clone() {
            let above = samples.partition_point(|value| *value < eta);
            if above == 0 || above == samples.len() || samples[above] == eta {
                continue;
            }
            let (a, b) = (samples[above - 1], samples[above]);
            let (is_first, is_last) = (above == 1, above == samples.len() - 1);
            // the identity has one slope on both sides of zero
            let is_free = (a != 0.0 || is_first) && (b != 0.0 || is_last);
            // a fall that goes on beyond was measured
            let rises =
                (is_first || self.slopes_at(a).0 >= 0.0) && (is_last || self.slopes_at(b).1 >= 0.0);
            let line = (self.envelope(a, b) - self.envelope(b, a)) / (b - a);
            if is_free && rises && line > 0.0 && self.falls_between(a, b) {
                self.straighten(a, b, line);
                changed = true;
            }
        }
        changed
    }

    /// The slope of the envelope just below and just above a place.
    fn slopes_at(&self, place: f64) -> (f64, f64) {
        let zones = || self.thresholds.iter().copied().zip(self.slopes.iter().copied());
        let sum = |is_on: &dyn Fn(f64) -> bool| {
            zones().filter(|zone| is_on(zone.0)).map(|zone| zone.1).sum()
        };
        let below =
            sum(&|eta| eta == 0.0 || (eta > 0.0 && eta < place) || (eta < 0.0 && place <= eta));
        let above =
            sum(&|eta| eta == 0.0 || (eta > 0.0 && eta <= place) || (eta < 0.0 && place < eta));
        (below, above)
    }

    fn falls_between(&self, a: f64, b: f64) -> bool {
        let inside = self.thresholds.iter().copied().filter(|eta| a < *eta && *eta < b);
        inside.chain([a]).any(|place| self.slopes_at(place).1 < 0.0)
    }

    /// One slope from a to b, all else kept.
    fn straighten(&mut self, a: f64, b: f64, line: f64) {
        let (before, after) = (self.slopes_at(a).0, self.slopes_at(b).1);
        let mut zones: Vec<(f64, f64)> =
            self.thresholds.iter().copied().zip(self.slopes.iter().copied()).collect();
        zones.retain(|&(eta, _)| eta == 0.0 || eta < a || eta > b);
        if a == 0.0 || b == 0.0 {
            zones[0].1 = line;
        }
        // a zone is on at the side that is away from zero
        let mut bend = |eta: f64, below: f64, above: f64| {
            if eta != 0.0 {
                zones.push((eta, if eta > 0.0 { above - below } else { below - above }));
            }
        };
        bend(a, before, line);
        bend(b, line, after);
        zones[1..].sort_by(|one, other| one.0.total_cmp(&other.0));
        (self.thresholds, self.slopes) = zones.into_iter().unzip();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::hysteresis::{Elements, Prior};

    fn envelope(thresholds: &[f64], slopes: &[f64]) -> Parameters {
        Parameters {
            elements: Elements::Plays,
            reading: Reading::OneSided,
            thresholds: thresholds.to_vec(),
            slopes: slopes.to_vec(),
            half_widths: vec![0.0],
            weights: vec![1.0],
            prior: Prior::default(),
        }
    }

    /// Bridged, and the same at all samples.
    fn bridged(mut own: Parameters, samples: &[f64]) -> Parameters {
        let values =
            |own: &Parameters| samples.iter().map(|u| own.envelope(0.0, *u)).collect::<Vec<_>>();
        let before = values(&own);
        assert!(own.bridge(samples));
        for (old, new) in before.iter().zip(values(&own)) {
            assert!((old - new).abs() < 1e-14, "{old} became {new}");
        }
        own
    }

    #[test]
    fn a_fall_between_rest_and_the_first_sample_becomes_a_rise() {
        let own = bridged(envelope(&[0.0, 1.0, 7.0], &[-0.9, 1.9, -0.3]), &[0.0, 6.0, 8.0, 9.0]);
        assert_eq!(own.thresholds, [0.0, 6.0, 7.0]);
        assert!(own.slopes[0] > 0.0 && own.slopes_at(5.0).0 > 0.0);
    }

    #[test]
    fn a_dip_between_samples_goes_on_either_side_of_zero() {
        let zones = [0.0, -4.5, -4.0, 4.0, 4.5];
        let own =
            bridged(envelope(&zones, &[1.0, 1.2, -1.5, -1.5, 1.2]), &[-6.0, -3.0, 0.0, 3.0, 6.0]);
        assert_eq!(own.thresholds, [0.0, -6.0, -3.0, 3.0, 6.0]);
        for place in [-5.0, -4.2, -1.0, 1.0, 4.2, 5.0] {
            assert!(own.slopes_at(place).0 > 0.0);
        }
        assert!(
            (own.slopes_at(7.0).0 - 0.7).abs() < 1e-14
                && (own.slopes_at(-7.0).0 - 0.7).abs() < 1e-14
        );
    }

    #[test]
    fn what_is_measured_to_fall_falls() {
        let falling = envelope(&[0.0, 2.0, 4.0], &[1.0, -1.5, 1.0]);
        let mut own = falling.clone();
        assert!(!own.bridge(&[0.0, 1.0, 2.5, 3.5, 5.0]) && own == falling);
        // nor is the slope at zero changed for one side alone
        let mut own = envelope(&[0.0, 1.0], &[-0.5, 2.0]);
        assert!(!own.bridge(&[-2.0, 0.0, 3.0]));
    }
}
