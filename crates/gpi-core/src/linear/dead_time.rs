//! The part of a state space behind the shift registers of its inputs.

use super::StateSpace;
use crate::Matrix;

impl StateSpace {
    /// The state space without the shift registers of its inputs, if it begins with them, and how many samples they take.
    pub(crate) fn behind_dead_time(&self) -> (Self, usize) {
        let inputs = self.inputs();
        let (a, b, c, d) = (self.a(), self.b(), self.c(), self.d());
        for delay in (1..=self.order() / inputs).rev() {
            let first = delay * inputs;
            let states = self.order() - first;
            let registers = Self::delayed_gain(&Matrix::identity(inputs, inputs), delay);
            let late = first - inputs;
            let begins = a.view((0, 0), (first, first)) == *registers.a()
                && a.view((0, first), (first, states)).amax() == 0.0
                && a.view((first, 0), (states, late)).amax() == 0.0
                && b.rows(0, first) == *registers.b()
                && b.rows(first, states).amax() == 0.0
                && c.columns(0, late).amax() == 0.0
                && d.amax() == 0.0;
            let own = begins.then(|| {
                Self::new(
                    a.view((first, first), (states, states)).into_owned(),
                    a.view((first, late), (states, inputs)).into_owned(),
                    c.columns(first, states).into_owned(),
                    c.columns(late, inputs).into_owned(),
                )
            });
            if let Some(Ok(own)) = own {
                return (own, delay);
            }
        }
        (self.clone(), 0)
    }
}
