//! Forces inside the mechanics as an engineer reads them: in steady state, in the units of the input and of the output.

use num_complex::Complex64;

/// The force of w = 1 on the displacement in steady state, positive where it opposes the displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyForce {
    /// Over the linear stiffness, in the unit of the output: the force of the input that moves the output by one unit is 1.
    pub over_stiffness: f64,
    /// In the unit of the input.
    pub of_input: f64,
    /// The sampling period in seconds.
    pub period: f64,
    /// Mass, damping and stiffness of a G of two poles, in the unit of the input over that of the output and its derivatives in seconds.
    pub mechanics: Option<[f64; 3]>,
    /// What is added to the displacement to make the output, in the unit of the output.
    pub offset: f64,
}

impl SteadyForce {
    /// Of a loop whose force over the stiffness is known, at a rate in Hz, around a G with these poles that changes the output by
    /// `sensitivity` per unit of the input, and to which `offset` is added.
    pub(crate) fn new(
        over_stiffness: f64,
        sensitivity: f64,
        poles: &[Complex64],
        rate: f64,
        offset: f64,
    ) -> Self {
        let mechanics = match *poles {
            [p, q] => Some(mechanics([p, q], sensitivity, rate)),
            _ => None,
        };
        let of_input = over_stiffness / sensitivity;
        Self { over_stiffness, of_input, period: rate.recip(), mechanics, offset }
    }
}

/// m, c and k of `m y'' + c y' + k y = u`: the poles are those of `s^2 + (c / m) s + k / m`, s = rate ln z, and the sensitivity is 1 / k.
fn mechanics(poles: [Complex64; 2], sensitivity: f64, rate: f64) -> [f64; 3] {
    let [p, q] = poles.map(|pole| pole.ln() * rate);
    let stiffness = sensitivity.recip();
    let mass = stiffness / (p * q).re;
    [mass, -mass * (p + q).re, stiffness]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mass_damping_and_stiffness_are_those_of_the_poles() {
        // 0.5 y'' + 0.2 y' + 8 y = u at 100 Hz
        let root = Complex64::new(0.04 - 16.0, 0.0).sqrt();
        let poles = [root, -root].map(|root| ((root - 0.2) * 0.01).exp());
        let found = SteadyForce::new(0.3, 0.125, &poles, 100.0, 0.0);
        assert!((found.of_input - 2.4).abs() < 1e-12);
        for (found, wanted) in found.mechanics.unwrap().iter().zip([0.5, 0.2, 8.0]) {
            assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
        }
        assert_eq!(SteadyForce::new(0.3, 0.125, &poles[..1], 100.0, 0.0).mechanics, None);
    }
}
