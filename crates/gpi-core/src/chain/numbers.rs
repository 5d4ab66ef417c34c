//! The numbers of a model that determine its response to an input, as one vector.
//!
//! For each input the thresholds and weights of the deadzones, then the half-widths and weights of the plays; the matrices
//! A, B, C and D of the linear dynamics, each column by column; the offsets of the outputs; and the values of each effect
//! that the input drives, in the order of the chain.

use crate::effects::Effect;
use crate::linear::StateSpace;
use crate::operators::{Deadzones, Gpi, PlayBank};
use crate::{Error, Hysteresis, Matrix, Model};

/// Takes the next numbers in the order in which they were written.
struct Reader<'a>(std::slice::Iter<'a, f64>);

impl Reader<'_> {
    fn take(&mut self, count: usize) -> Vec<f64> {
        self.0.by_ref().take(count).copied().collect()
    }

    /// Of the same shape as another matrix.
    fn like(&mut self, other: &Matrix) -> Matrix {
        Matrix::from_vec(other.nrows(), other.ncols(), self.take(other.len()))
    }

    /// Of the same structure as another hysteresis.
    fn hysteresis(&mut self, other: &Hysteresis) -> Result<Hysteresis, Error> {
        let (zones, plays) = (other.envelope(), other.plays());
        let count = zones.weights().len();
        let envelope = Deadzones::new(self.take(count), self.take(count), zones.reading())?;
        let count = plays.weights().len();
        Ok(Gpi::new(envelope, PlayBank::new(self.take(count), self.take(count))?))
    }
}

fn is_driven(effect: &Effect) -> bool {
    effect.entry().driven && !effect.is_added()
}

impl Model {
    /// The numbers of the model.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        for hysteresis in self.hysteresis() {
            let (zones, plays) = (hysteresis.envelope(), hysteresis.plays());
            for values in
                [zones.thresholds(), zones.weights(), plays.half_widths(), plays.weights()]
            {
                numbers.extend(values);
            }
        }
        let linear = self.linear();
        for matrix in [linear.a(), linear.b(), linear.c(), linear.d()] {
            numbers.extend(matrix.as_slice());
        }
        numbers.extend(self.offsets());
        for effect in self.effects().iter().filter(|effect| is_driven(effect)) {
            numbers.extend(effect.values());
        }
        numbers
    }

    /// The model of the same structure with other numbers, as many as [`Model::numbers`] returns.
    ///
    /// # Errors
    /// Numbers that make no model, such as a negative half-width.
    pub(crate) fn with_numbers(&self, numbers: &[f64]) -> Result<Self, Error> {
        let mut reader = Reader(numbers.iter());
        let hysteresis: Result<Vec<_>, _> =
            self.hysteresis().iter().map(|own| reader.hysteresis(own)).collect();
        let own = self.linear();
        let (a, b) = (reader.like(own.a()), reader.like(own.b()));
        let linear = StateSpace::new(a, b, reader.like(own.c()), reader.like(own.d()))?;
        let (inputs, outputs) = (self.inputs().to_vec(), self.outputs().to_vec());
        let offsets = reader.take(outputs.len());
        let mut effects = self.effects().to_vec();
        for effect in effects.iter_mut().filter(|effect| is_driven(effect)) {
            let count = effect.values().len();
            effect.set(&reader.take(count));
        }
        Self::new(self.rate(), inputs, outputs, hysteresis?, linear, offsets)?.with_effects(effects)
    }
}

#[cfg(test)]
mod tests {
    use crate::chain::looped::model;

    #[test]
    fn a_model_is_its_numbers() {
        let model = model();
        let numbers = model.numbers();
        for factor in [1.0, 1.001] {
            let moved: Vec<f64> = numbers.iter().map(|value| factor * value).collect();
            let again = model.with_numbers(&moved).unwrap().numbers();
            assert_eq!(again.len(), moved.len());
            // half-widths of stops are kept as logarithms, which rounds
            let is_equal = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-14 * (1.0 + b.abs());
            assert!(again.iter().zip(&moved).all(is_equal), "{again:?} {moved:?}");
        }
    }
}
