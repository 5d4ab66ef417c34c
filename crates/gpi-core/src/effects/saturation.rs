//! States inside the dynamics that have limits.
//!
//! A tank overflows, a mass meets an end stop, a current reaches what its amplifier can deliver, (E19) in the documentation's theory:
//! `x+ = A x + B v + E w` with the excess `w = max(z - limit, 0)` of a signal z, or `min(z - limit, 0)` of a lower limit. E takes away
//! what exceeds the limit, or leads it elsewhere: what flows over the rim of one tank may enter another.
//!
//! z is the displacement, or what a real pole p of G will hold at the next sample,
//!
//! ```text
//! s(k) = q' x(k),      z(k) = s(k + 1) = p q' x(k) + q' B v(k)
//! ```
//!
//! with the left eigenvector q of A, `q' A = p q'`. For a section in observer form, q is (p, 1), or 1 where it has one state. With
//! `E = -q / q'q`, s would stay at the limit exactly.
//!
//! The output of a sensor that clips shows the same loops as a displacement with limits, but it shows them at its limits only. A
//! saturation is therefore judged by the samples at which the output is within its limits.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{ClosedLoops, Drives, InnerLoop, Law, Proposal, Sees, Situation, Stage};

/// Loops around G through the excess over a limit: `x+ = A x + B v + E w`, w of [`Law::Excess`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Saturation {
    /// The loops, at least one.
    pub loops: Vec<InnerLoop>,
}

impl Saturation {
    pub(super) const NAME: &'static str = "saturation";
    pub(super) const WHAT: &'static str =
        "saturation: a state inside the dynamics does not exceed a limit";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["overflow", "end stop", "end-stop", "limit", "windup"];
    pub(super) const STAGE: Stage = Stage::Dynamics;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = true;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["amplitude", "level-to-level"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = false;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        /// Where limits are tried, as parts of the span from its end: the fit moves them from there.
        const PARTS: [f64; 3] = [0.1, 0.25, 0.4];
        let order = situation.dynamics.order();
        // a mass on a spring that meets a stop bounces, which is no saturation
        let is_slow = !situation.dynamics.has_resonance();
        if order == 0 || !is_slow || situation.outputs().len() > 1 || situation.inputs().len() > 1 {
            return Vec::new();
        }
        let displacement = (Sees::Output(0), Situation::range(situation.displacements, 0));
        let seen = std::iter::once(displacement).chain(held(situation));
        let around = |(sees, (low, high)): (Sees, (f64, f64))| {
            let limit = move |part: f64| {
                let inside = part * (high - low);
                [(high - inside, false), (low + inside, true)]
            };
            PARTS.into_iter().flat_map(limit).map(move |(limit, is_lower)| {
                let law = Law::Excess { limit, is_lower };
                let drives = Drives::States(vec![0.0; order]);
                let inner = InnerLoop { sees: sees.clone(), law, drives };
                Proposal::linear(Saturation { loops: vec![inner] }, 0..order)
            })
        };
        seen.flat_map(around).collect()
    }
}

/// What each real pole of G will hold at the next sample, and the range of it.
fn held(situation: &Situation) -> Vec<(Sees, (f64, f64))> {
    let dynamics = situation.dynamics;
    let mut found = Vec::new();
    let mut first = 0;
    for section in &dynamics.sections {
        for pole in section.poles().iter().filter(|pole| pole.im == 0.0).map(|pole| pole.re) {
            let eigenvector = if section.order() == 2 { vec![pole, 1.0] } else { vec![1.0] };
            let entry = section.b.column(0).iter().zip(&eigenvector).map(|(b, q)| q * b).sum();
            let mut states = vec![0.0; dynamics.order()];
            for (state, q) in states[first..].iter_mut().zip(&eigenvector) {
                *state = pole * q;
            }
            let range = range(situation.intermediates, pole, entry);
            found.push((Sees::Mixture { states, inputs: vec![entry] }, range));
        }
        first += section.order();
    }
    found
}

/// The range of `s(k + 1) = pole s(k) + entry v(k)` from the steady state of the first v.
fn range(intermediates: &[crate::Matrix], pole: f64, entry: f64) -> (f64, f64) {
    let mut range = (f64::INFINITY, f64::NEG_INFINITY);
    for v in intermediates {
        let mut held = entry * v[(0, 0)] / (1.0 - pole);
        for v in v.column(0).iter() {
            held = pole * held + entry * v;
            range = (range.0.min(held), range.1.max(held));
        }
    }
    range
}

impl ClosedLoops for Saturation {
    fn loops(&self) -> &[InnerLoop] {
        &self.loops
    }

    fn loops_mut(&mut self) -> &mut Vec<InnerLoop> {
        &mut self.loops
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::OutputKind;
    use crate::linear::{Section, Sections};
    use crate::{Channel, Experiment, Matrix, Record};

    #[test]
    fn what_a_pole_holds_is_seen_one_sample_ahead() {
        // x1+ = 0.9 x1 + v, x2+ = 0.6 x2 + x1: the poles are 0.9 and 0.6, and only the second state is seen
        let v = |k: usize| (0.05 * k as f64).sin() + 0.3 * (0.4 * k as f64).cos();
        let input = Matrix::from_fn(400, 1, |k, _| v(k));
        let (b, c) = (
            Matrix::from_column_slice(2, 1, &[0.0, 1.0]),
            Matrix::from_row_slice(1, 2, &[1.0, 0.0]),
        );
        let section = Section { a: vec![-1.5, 0.54], b, c, reference: 0, growth: 1.0 };
        let dynamics = Sections { sections: vec![section], ..Sections::default() };
        let run = Experiment::new(input.clone(), input.clone());
        let channel = |name| vec![Channel::new(name, "")];
        let record = Record::new(vec![run], 1.0, channel("u"), channel("y"), vec![]).unwrap();
        let signals = [input.clone()];
        let found = held(&Situation {
            record: &record,
            drives: &signals,
            intermediates: &signals,
            displacements: &signals,
            residuals: &signals,
            dynamics: &dynamics,
            loops: Vec::new(),
            kind: OutputKind::Displacement,
            widest: vec![0.0],
            places: vec![(-1.0, 1.0)],
        });
        let upper = found.iter().find(|(sees, _)| {
            let Sees::Mixture { states, .. } = sees else { return false };
            (states[1] - 0.9).abs() < 1e-9
        });
        let Some((Sees::Mixture { states, inputs }, (low, high))) = upper else {
            panic!("{found:?}")
        };
        // in observer form, z is the first tank at the next sample, times what both poles share
        let (mut first, mut x) = (v(0) / 0.1, [v(0) / (0.1 * 0.4), 0.0]);
        x[1] = x[0] - 1.5 * x[0];
        let mut ends = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..400 {
            let z = states[0] * x[0] + states[1] * x[1] + inputs[0] * v(k);
            first = 0.9 * first + v(k);
            assert!((z - first).abs() < 1e-9, "{k}: {z} {first}");
            ends = (ends.0.min(z), ends.1.max(z));
            x = [x[1] + 1.5 * x[0], v(k) - 0.54 * x[0]];
        }
        assert!((ends.0 - low).abs() < 1e-9 && (ends.1 - high).abs() < 1e-9);
    }
}
