//! Minor loops that are not congruent.

use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, Candidate, Quantity, Situation, Stage, Units};

/// Plays read through curves: `v = sum_i p_i (F_i + s q(f_i, r_i))` with `f_i = (F_i - m) / s` and
/// `dq/df = sum_a sum_b c_ab P_a(f) P_b(2 r / R - 1)`, a = 1 .. A, b = 0 .. B - 1, P Legendre's
/// polynomials, q = 0 at both ends of the plays' range and beyond; r beyond R counts as R. The play of
/// half-width 0 is read as it is: its curve is the envelope's.
///
/// Sums of curves of plays are the Preisach operators (1 + dq/df is their density over the half-plane of
/// thresholds), whose minor loops change with their place. The declared hysteresis is q = 0.
///
/// (E4) in the documentation's theory.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HysteresisShape {
    /// The input whose hysteresis it is.
    pub input: usize,
    /// c_ab, `[a][b]` one row after the other.
    pub coefficients: Vec<f64>,
    /// B.
    pub widths: usize,
    /// m, the middle of the plays' range.
    pub middle: f64,
    /// s, half their range.
    pub scale: f64,
    /// R, half-width of the widest play.
    pub widest: f64,
}

/// The largest A and B.
const MOST: usize = 10;

impl HysteresisShape {
    pub(super) const NAME: &'static str = "hysteresis-shape";
    pub(super) const WHAT: &'static str =
        "minor loops are not congruent: outside the Prandtl-Ishlinskii class";
    pub(super) const STAGE: Stage = Stage::Plays;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["direction"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;

    pub(super) fn candidates(situation: &Situation) -> Vec<Candidate> {
        /// A and B.
        const SIZES: [(usize, usize); 2] = [(2, 3), (7, 5)];
        let mut candidates = Vec::new();
        for input in situation.inputs() {
            let ((low, high), widest) = (situation.places[input], situation.widest[input]);
            let (middle, scale) = (0.5 * (low + high), 0.5 * (high - low));
            if scale <= 0.0 || widest <= 0.0 {
                continue;
            }
            for (degrees, widths) in SIZES {
                let coefficients = vec![0.0; degrees * widths];
                let block = Self { input, coefficients, widths, middle, scale, widest };
                candidates.push(Candidate::linear(block, 0..degrees * widths));
            }
        }
        candidates
    }

    /// Legendre's polynomials P_0, P_1, ..
    fn legendre(x: f64) -> [f64; MOST + 2] {
        let mut values = [1.0; MOST + 2];
        values[1] = x;
        for n in 1..=MOST {
            let m = n as f64;
            values[n + 1] = ((2.0 * m + 1.0) * x * values[n] - m * values[n - 1]) / (m + 1.0);
        }
        values
    }

    fn by_width(&self, half_width: f64) -> [f64; MOST + 2] {
        Self::legendre((2.0 * half_width / self.widest - 1.0).clamp(-1.0, 1.0))
    }

    /// P_a integrated from -1, and P_a itself, at a place.
    fn by_place(&self, place: f64) -> impl Iterator<Item = (f64, f64)> {
        let f = (place - self.middle) / self.scale;
        let values = Self::legendre(f.clamp(-1.0, 1.0));
        let inside = if f.abs() < 1.0 { 1.0 } else { 0.0 };
        (1..=MOST).map(move |a| {
            let integral = (values[a + 1] - values[a - 1]) / (2 * a + 1) as f64;
            (integral, inside * values[a])
        })
    }
}

impl Block for HysteresisShape {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn stage(&self) -> Stage {
        Self::STAGE
    }

    fn channel(&self) -> usize {
        self.input
    }

    fn values(&self) -> Vec<f64> {
        self.coefficients.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.coefficients.copy_from_slice(values);
    }

    /// A density that differs more from the plays' own than tenfold is no shape but a misfit.
    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(-10.0, 10.0); self.coefficients.len()]
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-4; self.coefficients.len()]
    }

    fn quantities(&self, _: Units) -> Vec<Quantity> {
        let name =
            |place: usize| format!("density[{}][{}]", 1 + place / self.widths, place % self.widths);
        let values = self.coefficients.iter().enumerate();
        values.map(|(place, &value)| Quantity::new(name(place), "", value)).collect()
    }

    fn flaw(&self) -> Option<String> {
        let (count, widths) = (self.coefficients.len(), self.widths);
        let fits = (1..=MOST).contains(&widths) && count % widths == 0 && count / widths <= MOST;
        (!fits).then(|| {
            format!("{count} coefficients in rows of {widths}; at most {MOST} rows of {MOST}")
        })
    }

    fn read(&self, half_width: f64, place: f64) -> (f64, f64) {
        if half_width == 0.0 {
            return (place, 1.0);
        }
        let by_width = self.by_width(half_width);
        let (mut curve, mut density) = (0.0, 0.0);
        for (row, (integral, own)) in
            self.coefficients.chunks_exact(self.widths).zip(self.by_place(place))
        {
            let weight: f64 = row.iter().zip(&by_width).map(|(c, p)| c * p).sum();
            curve += weight * integral;
            density += weight * own;
        }
        (place + self.scale * curve, 1.0 + density)
    }

    fn reads(&self) -> bool {
        true
    }

    fn read_slopes(&self, half_width: f64, place: f64, weight: f64, slopes: &mut [f64]) {
        if half_width == 0.0 {
            return;
        }
        let by_width = self.by_width(half_width);
        for (row, (integral, _)) in slopes.chunks_exact_mut(self.widths).zip(self.by_place(place)) {
            let factor = weight * self.scale * integral;
            row.iter_mut().zip(&by_width).for_each(|(slope, p)| *slope += factor * p);
        }
    }
}
