//! The impulse response alone, by iterated ridge regression.
//!
//! With the Gram matrix `G = A^T A` (unknowns, unknowns) of the centred regressor and `b = A^T y`, each pass corrects the
//! estimate by what it leaves (J. D. Riley, 1955; the proximal point method on least squares):
//!
//! ```text
//! x_0 = 0,   x_{i+1} = x_i + (G + p I)^-1 (b - G x_i),   p = ridge tr(G) / unknowns
//! ```
//!
//! A direction of eigenvalue w is scaled by `1 - (p / (p + w))^3` after three passes, as [`super::estimate`] does by a
//! singular value decomposition. The condition number of `G + p I` is at most `1 + unknowns / ridge`, so that working
//! precision suffices for it, and one Cholesky decomposition serves all passes. The excitation is not looked at.

use super::{gathered, require_samples_of};
use crate::linear::decompose::Cholesky;
use crate::{Error, Matrix, Record};

/// Passes, with which a hardly excited direction is suppressed and a well excited one hardly biased.
pub(super) const PASSES: i32 = 3;

/// Estimates `taps` Markov parameters, each (outputs, inputs), with one offset per experiment, by a positive ridge.
pub(crate) fn impulse_response(
    record: &Record,
    taps: usize,
    ridge: f64,
) -> Result<Vec<Matrix>, Error> {
    require_samples_of(record, taps)?;
    let statistic = gathered(record, taps)?;
    let (gram, right) = statistic.equations();
    let penalty = ridge * gram.trace() / gram.nrows() as f64;
    let raised = &gram + Matrix::from_diagonal_element(gram.nrows(), gram.nrows(), penalty);
    let Some(factor) = Cholesky::new(&raised) else {
        // an input that never moves, or a ridge below rounding
        return Ok(statistic.solve(ridge)?.markov);
    };
    let mut x = factor.solve(&right);
    for _ in 1..PASSES {
        x += factor.solve(&(&right - &gram * &x));
    }
    let (inputs, outputs) = (record.inputs().len(), record.outputs().len());
    let tap = |lag| Matrix::from_fn(outputs, inputs, |o, i| x[(i * taps + lag, o)]);
    Ok((0..taps).map(tap).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::estimate;
    use crate::{Channel, Experiment};

    /// Two inputs, two outputs and two experiments of a hardly excited band.
    #[test]
    fn it_is_what_the_singular_values_give() {
        let run = |phase: f64| {
            let u = Matrix::from_fn(400, 2, |k, i| {
                (0..20).map(|m| ((0.03 * k as f64 + i as f64) * f64::from(m) + phase).sin()).sum()
            });
            let y = Matrix::from_fn(400, 2, |k, o| {
                phase + u[(k, o)] - 0.5 * u[(k.saturating_sub(3), 1 - o)] + 0.01 * (k as f64).sin()
            });
            Experiment::new(u, y)
        };
        let channels = |name: &str| {
            vec![Channel::new(format!("{name}1"), ""), Channel::new(format!("{name}2"), "")]
        };
        let record =
            Record::new(vec![run(0.1), run(0.7)], 1.0, channels("u"), channels("y"), vec![])
                .unwrap();
        for ridge in [1e-4, 3e-2] {
            let expected = estimate(&record, 12, ridge).unwrap().markov;
            let found = impulse_response(&record, 12, ridge).unwrap();
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).amax() < 1e-10, "{found} {expected}");
            }
        }
    }

    #[test]
    fn an_input_that_never_moves_gives_no_response() {
        let still = Experiment::new(
            Matrix::from_element(50, 1, 2.0),
            Matrix::from_fn(50, 1, |k, _| k as f64),
        );
        let channel = |name| vec![Channel::new(name, "")];
        let record = Record::new(vec![still], 1.0, channel("u"), channel("y"), vec![]).unwrap();
        let found = impulse_response(&record, 4, 0.03).unwrap();
        assert!(found.iter().all(|tap| tap.amax() == 0.0));
    }
}
