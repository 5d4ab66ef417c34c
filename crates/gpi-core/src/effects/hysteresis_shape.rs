//! Minor loops that are not congruent.
//!
//! The plays are read through curves, (E4) in the documentation's theory:
//!
//! ```text
//! v = sum_i p_i (F_i + s q(f_i, r_i)),      f_i = (F_i - m) / s,
//! dq/df = sum_a sum_b c_ab P_a(f) P_b(2 r / R - 1),      a = 1 .. A,  b = 0 .. B - 1,
//! ```
//!
//! with the Legendre polynomials P. `P_a` of a >= 1 integrates to zero over [-1, 1], so that q = 0 at both
//! ends of the plays' range and beyond. Half-widths above R count as R. The play of half-width 0 is read as
//! it is, because its curve is that of the envelope.
//!
//! Sums of curves of plays are the Preisach operators: `1 + dq/df` is the density over the half-plane of
//! thresholds. Their minor loops change with the place; with q = 0 the hysteresis is the declared one. The
//! integral of `P_a` from -1 is `(P_{a+1} - P_{a-1}) / (2 a + 1)`.

use super::flaws::positive;
use super::properties::{FreeOrder, SeparatedBy, Signature};
use super::{Block, PlayCurves, PlayRead, Proposal, Quantity, Situation, Stage, Units};

/// Plays F are read through curves: `v = sum_i p_i (F_i + s q((F_i - m) / s, r_i))`, where dq/df is a sum of
/// products of Legendre polynomials. Its minor loops are not congruent, as those of Preisach operators.
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

/// The factors of `P_(n+1) = (2 n + 1) / (n + 1) x P_n - n / (n + 1) P_(n-1)`. They are constants because the
/// polynomials are computed at every sample of every play.
const RECURSION: [[f64; 2]; MOST + 1] = {
    let mut factors = [[0.0; 2]; MOST + 1];
    let mut n = 0;
    while n <= MOST {
        let m = n as f64;
        factors[n] = [(2.0 * m + 1.0) / (m + 1.0), m / (m + 1.0)];
        n += 1;
    }
    factors
};

impl HysteresisShape {
    pub(super) const NAME: &'static str = "hysteresis-shape";
    pub(super) const WHAT: &'static str =
        "minor loops are not congruent: outside the Prandtl-Ishlinskii class";
    pub(super) const SYNONYMS: &'static [&'static str] =
        &["asymmetry", "asymmetric hysteresis", "minor loops", "non-congruent", "congruency"];
    pub(super) const STAGE: Stage = Stage::Plays;
    pub(super) const DRIVEN: bool = true;
    pub(super) const REPEATS: bool = false;
    pub(super) const SIGNATURE: Signature = Signature::ShapeOfCycle;
    pub(super) const FREE_ORDER: FreeOrder = FreeOrder::Independent;
    pub(super) const SEPARATED_BY: SeparatedBy = SeparatedBy::Levels;
    pub(super) const SHOWN_BY: &'static [&'static str] = &["direction"];
    pub(super) const EXPLAINS_AUTOCORRELATION: bool = false;
    pub(super) const IS_EXPANSION: bool = true;

    pub(super) fn proposals(situation: &Situation) -> Vec<Proposal<Self>> {
        /// A and B.
        const SIZES: [(usize, usize); 2] = [(2, 3), (7, 5)];
        let mut proposals = Vec::new();
        for input in situation.inputs() {
            let ((low, high), widest) = (situation.places[input], situation.widest[input]);
            let (middle, scale) = (0.5 * (low + high), 0.5 * (high - low));
            if scale <= 0.0 || widest <= 0.0 {
                continue;
            }
            for (degrees, widths) in SIZES {
                let coefficients = vec![0.0; degrees * widths];
                let block = Self { input, coefficients, widths, middle, scale, widest };
                proposals.push(Proposal::linear_in_all(block));
            }
        }
        proposals
    }

    /// A, the number of polynomials of the place.
    fn degrees(&self) -> usize {
        self.coefficients.len() / self.widths
    }

    /// The Legendre polynomials P_0, P_1, .. P_degree; those above it stay 1.
    fn legendre(x: f64, degree: usize) -> [f64; MOST + 2] {
        let mut values = [1.0; MOST + 2];
        values[1] = x;
        for n in 1..degree {
            let [own, before] = RECURSION[n];
            values[n + 1] = own * x * values[n] - before * values[n - 1];
        }
        values
    }

    fn by_width(&self, half_width: f64) -> [f64; MOST + 2] {
        Self::legendre((2.0 * half_width / self.widest - 1.0).clamp(-1.0, 1.0), self.widths - 1)
    }

    /// Derivatives by the half-width of the polynomials `by_width`: `P_(n+1)' = P_(n-1)' + (2 n + 1) P_n`.
    fn growths(&self, half_width: f64, by_width: &[f64; MOST + 2]) -> [f64; MOST + 2] {
        let mut slopes = [0.0; MOST + 2];
        if half_width < self.widest {
            slopes[1] = 2.0 / self.widest;
            for n in 1..self.widths {
                let own = (2 * n + 1) as f64 * by_width[n];
                slopes[n + 1] = slopes[n - 1] + own * 2.0 / self.widest;
            }
        }
        slopes
    }

    /// The integral of P_a from -1, and P_a itself, at the value `place` of a play.
    fn by_place(&self, place: f64) -> impl Iterator<Item = (f64, f64)> {
        let f = (place - self.middle) / self.scale;
        let degrees = self.degrees();
        let values = Self::legendre(f.clamp(-1.0, 1.0), degrees + 1);
        let inside = if f.abs() < 1.0 { 1.0 } else { 0.0 };
        (1..=degrees).map(move |a| {
            let integral = (values[a + 1] - values[a - 1]) / (2 * a + 1) as f64;
            (integral, inside * values[a])
        })
    }
}

impl Block for HysteresisShape {
    fn values(&self) -> Vec<f64> {
        self.coefficients.clone()
    }

    fn set(&mut self, values: &[f64]) {
        self.coefficients.copy_from_slice(values);
    }

    /// A density of more than ten times the plays' own is a failed fit.
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
        values.map(|(place, &value)| Quantity::strength(name(place), "", value)).collect()
    }

    fn flaw(&self) -> Option<String> {
        let (count, widths) = (self.coefficients.len(), self.widths);
        let fits = (1..=MOST).contains(&widths) && count % widths == 0 && count / widths <= MOST;
        if !fits {
            let most = format!("at most {MOST} rows of {MOST}");
            return Some(format!("{count} coefficients in rows of {widths}; {most}"));
        }
        positive(&[("scale", self.scale), ("widest", self.widest)])
    }
}

impl PlayCurves for HysteresisShape {
    fn input(&self) -> usize {
        self.input
    }

    fn read(&self, half_width: f64, place: f64) -> PlayRead {
        let mut read = PlayRead::plain(place);
        if half_width == 0.0 {
            return read;
        }
        let by_width = self.by_width(half_width);
        let growths = self.growths(half_width, &by_width);
        for (row, (integral, own)) in
            self.coefficients.chunks_exact(self.widths).zip(self.by_place(place))
        {
            let sum = |factors: &[f64]| row.iter().zip(factors).map(|(c, p)| c * p).sum::<f64>();
            let weight = sum(&by_width);
            read.value += self.scale * weight * integral;
            read.by_place += weight * own;
            read.by_half_width += self.scale * sum(&growths) * integral;
        }
        read
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
