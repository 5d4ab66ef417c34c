//! A piecewise linear function, evaluated at a cost that does not grow with the number of its pieces.

use super::knots::Knots;

/// `a_c x + b_c`, where c is the number of knots at or below x.
pub(super) struct Curve {
    knots: Knots,
    lines: Vec<(f64, f64)>,
    /// One for each bucket of the knots.
    cells: Vec<Cell>,
}

/// The lines below and above the knot of a bucket.
#[derive(Clone, Copy)]
struct Cell {
    /// NaN if the bucket has several knots.
    knot: f64,
    lines: [(f64, f64); 2],
}

impl Curve {
    /// The function with these finite knots, in ascending order, and one line more than knots.
    pub(super) fn new(knots: Vec<f64>, lines: Vec<(f64, f64)>) -> Self {
        let knots = Knots::new(knots);
        let cell = |(knot, before, count): (f64, usize, usize)| Cell {
            knot: if count > 1 { f64::NAN } else { knot },
            lines: [lines[before], lines[before + count]],
        };
        let cells = knots.buckets().map(cell).collect();
        Self { knots, lines, cells }
    }

    /// The number of knots at or below x.
    #[inline(always)]
    pub(super) fn at_most(&self, x: f64) -> usize {
        self.knots.at_most(x)
    }

    /// The value at a finite x.
    #[inline(always)]
    pub(super) fn at(&self, x: f64) -> f64 {
        let Cell { knot, lines } = &self.cells[self.knots.bucket(x)];
        let (slope, constant) = if knot.is_nan() {
            self.lines[self.knots.at_most(x)]
        } else {
            // an index instead of a branch, which the processor would have to predict
            lines[usize::from(*knot <= x)]
        };
        slope * x + constant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_gets_its_line() {
        let knots = vec![-2.0, 0.0, 1e-9, 2e-9, 2e-9, 3.0];
        let lines: Vec<(f64, f64)> = (0..=knots.len()).map(|c| (0.0, c as f64)).collect();
        let curve = Curve::new(knots.clone(), lines);
        for x in knots.iter().flat_map(|&x| [x - 1e-10, x, x + 1e-10, x + 7.0, x - 7.0]) {
            let below = knots.iter().filter(|knot| **knot <= x).count();
            assert_eq!(curve.at(x), below as f64, "{x}");
            assert_eq!(curve.at_most(x), below, "{x}");
        }
        assert_eq!(Curve::new(vec![], vec![(2.0, 1.0)]).at(3.0), 7.0);
    }
}
