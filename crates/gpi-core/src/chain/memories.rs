//! Whether a state belongs to a model: sizes and values of everything that it remembers.
//!
//! A state may have been saved with another model, or written by hand, so that it is compared with the model before it
//! is used. The memory of an effect that begins with the first sample may be empty.

use crate::effects::{Effect, Moment, Place};
use crate::{Error, Model, ModelState};

/// Samples up to which a counter is exact in a file, where it is a number of double precision.
const MOST_SAMPLES: usize = 1 << 53;

impl Model {
    /// Refuses a state of another model, or one with a value that is not finite.
    ///
    /// # Errors
    /// Names the part of the state, its size, and the size that the model needs.
    pub(crate) fn require_own(&self, state: &ModelState) -> Result<(), Error> {
        let inputs = self.hysteresis().len();
        Error::require_equal("channels", ("state", state.hysteresis.len()), ("model", inputs))?;
        for (own, hysteresis) in state.hysteresis.iter().zip(self.hysteresis()) {
            let plays = hysteresis.plays().weights().len();
            Error::require_equal("plays", ("state", own.plays.plays().len()), ("model", plays))?;
        }
        let order = self.linear().order();
        Error::require_equal("states of G", ("state", state.linear.len()), ("model", order))?;
        let effects = self.effects().len();
        Error::require_equal("effects", ("state", state.effects.len()), ("model", effects))?;
        let closed = |effect: &Effect| effect.place().closed_loops().is_some();
        let last = self.effects().iter().rposition(closed);
        for (place, (memory, effect)) in state.effects.iter().zip(self.effects()).enumerate() {
            let (mut size, may_be_empty) = remembered(effect, self.rate());
            if Some(place) == last {
                size += self.pending();
            }
            if !(may_be_empty && memory.is_empty()) {
                let name = format!("the memory of {}", effect.name());
                Error::require_equal("values", (&name, memory.len()), ("model", size))?;
            }
        }
        let plays = state
            .hysteresis
            .iter()
            .flat_map(|own| std::iter::once(&own.envelope.previous).chain(own.plays.plays()));
        let memories = state.effects.iter().flatten();
        let mut values = plays.chain(state.linear.iter()).chain(memories);
        if let Some(value) = values.find(|value| !value.is_finite()) {
            return Err(Error::parameter("state", value, "every element must be finite"));
        }
        let requirement = "the number of past samples must be below 2^53";
        Error::require(state.sample < MOST_SAMPLES, "state.sample", state.sample, requirement)
    }
}

/// How many values an effect remembers, and whether it may begin with none.
fn remembered(effect: &Effect, rate: f64) -> (usize, bool) {
    let first = Moment { time: 0.0, rate, covariates: &[] };
    match effect.place() {
        Place::Input(own) => (own.rest(0.0).len(), true),
        Place::Widths(own) => (own.rest().len(), false),
        Place::Parallel(own) => {
            let states = own.sections(rate).iter().map(|(a, _)| a.len()).sum::<usize>();
            (own.dead_time() + states, false)
        }
        Place::Loops(own) => (own.loops().iter().map(|inner| inner.law.memories()).sum(), true),
        Place::Output(own) => (own.rest(0.0, None).len(), true),
        Place::Added(own) => (own.rest(first).len(), true),
        Place::Curves(_) | Place::Finding(_) => (0, true),
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::{Creep, Delay, Effect};
    use crate::model::tests::example;
    use crate::{Error, Matrix, Model, ModelState};

    fn with_effects() -> Model {
        let creep = Creep { input: 0, time_constants: vec![0.5], gains: vec![0.1], dead_time: 2 };
        let effects: Vec<Effect> = vec![creep.into(), Delay { input: 0, samples: 1.5 }.into()];
        let mut model = example();
        model.effects = effects;
        model
    }

    #[test]
    fn a_state_of_another_size_is_refused_with_both_sizes() {
        let model = with_effects();
        let input = Matrix::from_element(5, 1, 1.0);
        let refused = |change: fn(&mut ModelState)| {
            let mut state = model.start(&[1.0]).unwrap();
            model.simulate_from(&mut state, &input).unwrap();
            change(&mut state);
            model.simulate_from(&mut state, &input).unwrap_err().to_string()
        };
        for (change, told) in [
            ((|state| state.effects[0].truncate(1)) as fn(&mut ModelState), "creep` has 1 values"),
            (|state| state.effects[1].truncate(1), "delay` has 1 values"),
            (|state| state.effects.truncate(1), "`state` has 1 effects, but `model` has 2"),
            (|state| state.effects[0][0] = f64::NAN, "every element must be finite"),
            (|state| state.linear = nalgebra::DVector::zeros(3), "`state` has 3 states of G"),
            (|state| state.hysteresis.clear(), "`state` has 0 channels"),
            (|state| state.sample = usize::MAX, "below 2^53"),
        ] {
            let error = refused(change);
            assert!(error.contains(told), "{error}");
        }
        // what begins with the first sample has no memory yet
        let mut state = model.start(&[1.0]).unwrap();
        state.effects[1].clear();
        assert!(model.simulate_from(&mut state, &input).is_ok());
    }

    #[test]
    fn a_simulation_that_diverges_says_where_and_why() {
        let mut model = example();
        model.linear = crate::linear::StateSpace::new(
            Matrix::from_element(1, 1, 10.0),
            Matrix::from_element(1, 1, 1.0),
            Matrix::from_element(1, 1, 1.0),
            Matrix::zeros(1, 1),
        )
        .unwrap();
        let input = Matrix::from_fn(400, 1, |k, _| (k as f64).sin());
        let Err(Error::Diverged { sample, modulus }) = model.simulate(&input) else {
            panic!("an unstable model is simulated without an error")
        };
        assert!(modulus == 10.0 && (250..350).contains(&sample), "{modulus} {sample}");
    }
}
